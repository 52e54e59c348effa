use crate::common::made;
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::parametrization::usual_form;
use gonio::reconstruct::{Components, Reconstruct, ReconstructError};
use gonio::schedule::{SampleSet, SobolSet};
use std::sync::Arc;

#[test]
fn other_materials_and_bad_keys_are_refused() {
    let other = made(Symmetry::ORTHOTROPIC, |_| Some([0.1]));
    let schedule = SobolSet {}.plan(&usual_form(Symmetry::ORTHOTROPIC), 20, 1);
    let read = Ideal.measure(&other, &Arc::new(schedule.unwrap()));
    let refused = Components::default().reconstruct(&read).err().unwrap();
    assert_eq!(
        refused,
        ReconstructError::Symmetry {
            method: "components"
        }
    );
    for ridge in [0.0, f64::NAN, f64::INFINITY] {
        let method = Components {
            ridge,
            ..Components::default()
        };
        let sentence = method.check().unwrap_err().to_string();
        assert!(sentence.starts_with("ridge = "), "{sentence}");
    }
}
