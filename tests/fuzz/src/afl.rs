//! A target as AFL++ drives it: `afl NAME`.

fn main() {
    let name = std::env::args().nth(1).unwrap_or_default();
    let target = gonio_fuzz::find(&name).expect("the name of a target");
    // What is made once is made before the fork.
    target.seeds();
    // A panic ends the process: nothing is seen half changed.
    let target = std::panic::AssertUnwindSafe(target);
    afl::fuzz!(|data: &[u8]| {
        let target = &target;
        target.run(data);
    });
}
