//! Signals that end the program: SIGINT (Ctrl-C) with exit code 130, SIGTERM with 143. Files that are being written are removed.
//! SIGHUP has its usual effect, which `nohup` turns off.

use super::say;
use crate::error::Error;
use crate::files;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Action of a command at the first signal; returns true if the command ends by itself afterwards.
type Answer = Box<dyn FnMut() -> bool + Send>;

/// That of the command that runs.
static ANSWER: Mutex<Option<Answer>> = Mutex::new(None);

/// The last signal; 0 before any.
static SEEN: AtomicI32 = AtomicI32::new(0);

/// True when the command is at its end.
static ENDS: AtomicBool = AtomicBool::new(false);

/// Time that work has to see a signal.
const PATIENCE: Duration = Duration::from_millis(500);

/// Exit code of a process that a signal ended, less the signal.
const CODE: i32 = 128;

/// Waits for signals, in a thread of its own; an error if the system has no thread or no handler to give.
#[cfg(unix)]
pub(super) fn watch() -> Result<(), Error> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let failed = |e: std::io::Error| Error::Internal(e.to_string());
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]).map_err(failed)?;
    let wait = move || signals.forever().for_each(see);
    let thread = std::thread::Builder::new().name("signals".into());
    thread.spawn(wait).map(drop).map_err(failed)
}

/// Signals do what the system does with them.
#[cfg(not(unix))]
pub(super) fn watch() -> Result<(), Error> {
    Ok(())
}

/// Lets the command end by itself at the first signal if it can; ends the program at the second.
fn see(signal: i32) {
    let is_first = SEEN.swap(signal, Ordering::SeqCst) == 0;
    let mut answer = ANSWER.lock().unwrap_or_else(PoisonError::into_inner);
    let ends_itself = match &mut *answer {
        Some(answer) => is_first && answer(),
        None => {
            say("gonio: interrupted");
            false
        }
    };
    if !ends_itself {
        end(signal);
    }
}

/// Ends the program, and leaves no file half-written.
fn end(signal: i32) -> ! {
    files::remove_unfinished();
    std::process::exit(CODE + signal);
}

/// Sets what is done at the first signal; true if the command comes to its own end then.
pub(super) fn answer(with: impl FnMut() -> bool + Send + 'static) {
    let mut answer = ANSWER.lock().unwrap_or_else(PoisonError::into_inner);
    *answer = Some(Box::new(with));
}

/// A flag that the first signal sets; `kept` ends the sentence of an interruption. Work that does not see it in time is given up: the program ends then, with the files that
/// it has, unless [`ends`] was called before.
pub(super) fn stop_flag(kept: &'static str) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    answer(move || {
        flag.store(true, Ordering::SeqCst);
        let late = move || {
            std::thread::sleep(PATIENCE);
            if !ENDS.load(Ordering::SeqCst) {
                say(&format!("gonio: interrupted{kept}"));
                end(SEEN.load(Ordering::SeqCst));
            }
        };
        std::thread::Builder::new().spawn(late).is_ok()
    });
    stop
}

/// Says that the command is at its end, which it may finish after a signal: what is left is to write what it has.
pub(super) fn ends() {
    ENDS.store(true, Ordering::SeqCst);
}

/// Exit code of an error; of an interruption 128 and the number of the signal.
pub fn exit_code(error: &Error) -> u8 {
    let seen = SEEN.load(Ordering::SeqCst);
    match error {
        Error::Interrupted { .. } if seen > 0 => u8::try_from(CODE + seen).unwrap_or(1),
        error => error.exit_code(),
    }
}
