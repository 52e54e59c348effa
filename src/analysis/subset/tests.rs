//! Sets whose measure is known, and pairs that must be in them.
use super::*;
use crate::brdf::{Channels, Lambert, Spectrum};
use crate::geometry::Symmetry;
use crate::parametrization::find;

fn read(name: &str, symmetry: Symmetry, text: &str) -> Subset {
    Subset::read(find(name).unwrap().form(symmetry), text).unwrap()
}

#[test]
fn the_energy_of_a_sharp_lobe_is_found() {
    let ggx = |alpha: f64| {
        let all = crate::brdf::all();
        let entry = all.iter().find(|e| e.kind == "ggx").unwrap();
        let spec = crate::registry::read_text(entry, &format!("alpha = {alpha}")).unwrap();
        spec.build(Channels::Luminance).unwrap()
    };
    // All of it, and not 8 % more.
    let share = |text: &str| read("spherical", Symmetry::FULL, text).energy_share(&*ggx(0.003));
    let all = share("").unwrap();
    assert!((all.value - 1.0).abs() < 1e-12, "{all:?}");
    // What is reflected stays within a degree of the mirror direction.
    let mirrored = share("delta_phi=150..180, theta_i=20..70").unwrap();
    let around = share("theta_i=20..70").unwrap();
    assert!(mirrored.resolved() && (mirrored.value / around.value - 1.0).abs() < 0.02);
    let beside = share("delta_phi=0..150, theta_i=20..70").unwrap();
    assert!(beside.value < 0.02, "{beside:?}");
    // A wide lobe is resolved by a box's own points as well: they are others.
    let wide = ggx(0.4);
    let subset = read("hybrid", Symmetry::FULL, "h_bar=0.1..0.5, k=0.2..0.7");
    let whole = read("half-difference", Symmetry::FULL, "").energy(&*wide);
    let own = subset.energy(&*wide).share_of(&whole);
    let found = subset.energy_share(&*wide).unwrap();
    let error = own.error.hypot(found.error);
    assert!(
        (own.value - found.value).abs() < 4.0 * error,
        "{own:?} {found:?}"
    );
    assert!(found.error < 0.02 * found.value);
    // So is a box that few of the others fall into.
    let small = read(
        "hybrid",
        Symmetry::FULL,
        "h_bar=0.3..0.31, k=0.3..0.31, delta=40..45",
    );
    assert!(small.energy_share(&*wide).unwrap().resolved());
    let black = Lambert::new(Spectrum::Grey(0.0), Channels::Luminance);
    assert_eq!(subset.energy_share(&black), None);
}
