#[cfg(feature = "pictures")]
mod alignment {
    use gonio::analysis::{Scale, View, Weight};
    use gonio::brdf::{BrdfSpec, Channels, TestFunctionSpec};
    use gonio::geometry::Symmetry;
    use gonio::parametrization;
    use gonio::report::{SharesRow, alignment_svg};

    #[test]
    fn every_material_has_a_dot_in_every_parametrization_and_weight() {
        let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
        let mut rows = Vec::new();
        for material in ["one", "two"] {
            for entry in parametrization::all() {
                let form = entry.form(Symmetry::FULL);
                for weight in Weight::ALL {
                    let found = View::new(&*s, Scale::Value, &*form, weight).distortion();
                    let kind = (Scale::Value, weight);
                    rows.extend(SharesRow::of(
                        material,
                        entry.kind,
                        form.axes(),
                        kind,
                        &found,
                        None,
                    ));
                }
            }
        }
        let svg = alignment_svg(&rows).unwrap();
        let charts = parametrization::all().len();
        // Two materials and a mean.
        assert_eq!(svg.matches("<circle").count(), 3 * 2 * charts);
        assert!(svg.contains("2 materials, sorted by") && !svg.contains("NaN"));
        assert!(alignment_svg(&[]).is_ok());
    }
}
