use crate::common::test_pairs;
use gonio::analysis::{anisotropy, stretches};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::Measure;
use gonio::parametrization::all;
use std::f64::consts::FRAC_PI_2;

#[test]
fn the_product_is_the_jacobian() {
    let pairs = test_pairs(Measure::Cosine, 2000);
    for entry in all() {
        let found = anisotropy(&entry, &pairs).unwrap();
        assert_eq!(found.pairs + found.skipped, 2000);
        assert!(found.skipped < 5, "{}: {found:?}", entry.kind);
        // Central differences of step 1e-6: 1e-10 for a coordinate of size 1, more by the
        // condition number near poles.
        assert!(
            found.jacobian_error.median < 1e-8,
            "{}: {found:?}",
            entry.kind
        );
        assert!(found.jacobian_error.p95 < 1e-6, "{}: {found:?}", entry.kind);
        assert!(found.condition.median >= 1.0);
    }
}

#[test]
fn spherical_stretches_have_a_closed_form() {
    // Elevations move each direction by their own angle. The difference of azimuths, with the
    // turn taken out, moves the pair by sin θ_i sin θ_o/√(sin² θ_i + sin² θ_o).
    let open = crate::common::form(
        "spherical",
        Symmetry {
            isotropic: true,
            ..Symmetry::NONE
        },
    );
    let lengths = [FRAC_PI_2, FRAC_PI_2, 1.0];
    for (ti, to, phi) in [(0.3_f64, 0.9_f64, 1.0), (1.2, 1.1, -2.0), (0.05, 1.4, 3.0)] {
        let pair = DirectionPair::from_spherical(ti, phi, to, 0.0);
        let [si, so] = [ti.sin(), to.sin()];
        let want = si * so / si.hypot(so);
        let got = stretches(&*open, lengths, &pair).unwrap();
        for (got, want) in got.into_iter().zip([FRAC_PI_2, FRAC_PI_2, want]) {
            assert!((got - want).abs() < 1e-7, "{got} {want}");
        }
    }
}
