mod lattice {
    use crate::common::product;
    use gonio::geometry::Symmetry;
    use gonio::parametrization::{self, Axis, AxisKind};
    use gonio::schedule::Centring::{Cell, Node, Start};
    use gonio::schedule::{Centring, Lattice, LatticeAxis, for_each_node};

    /// theta_h, theta_d and the azimuth of half/difference coordinates.
    fn axes(symmetry: Symmetry) -> Vec<Axis> {
        parametrization::find("half-difference")
            .unwrap()
            .axes(symmetry)
    }

    /// Positions of all nodes in units of the range.
    fn positions(axis: &Axis, centring: Centring, n: usize) -> Vec<f64> {
        let lattice = LatticeAxis::new(axis, centring, n);
        let unit = |i: usize| (lattice.value(i as f64) - axis.range[0]) / axis.length();
        (0..n).map(unit).collect()
    }

    fn assert_near(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-15, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn nodes_sit_where_the_centring_says() {
        let radial = axes(Symmetry::FULL)[0];
        assert_near(&positions(&radial, Cell, 2), &[0.25, 0.75]);
        assert_near(&positions(&radial, Node, 3), &[0.0, 0.5, 1.0]);
        assert_near(&positions(&radial, Start, 3), &[0.0, 0.4, 0.8]);
        let periodic = axes(Symmetry::NONE)[1];
        assert_eq!(periodic.kind, AxisKind::Periodic);
        assert_near(&positions(&periodic, Cell, 2), &[0.25, 0.75]);
        // Its ends are one place: no node at 1.
        assert_near(&positions(&periodic, Node, 4), &[0.0, 0.25, 0.5, 0.75]);
    }

    #[test]
    fn one_node_spans_the_axis() {
        for axis in [axes(Symmetry::FULL)[0], axes(Symmetry::NONE)[1]] {
            assert_near(&positions(&axis, Cell, 1), &[0.5]);
            assert_near(&positions(&axis, Node, 1), &[0.0]);
            assert_near(&positions(&axis, Start, 1), &[0.0]);
            for centring in [Cell, Node, Start] {
                let lattice = LatticeAxis::new(&axis, centring, 1);
                assert!(lattice.step > 0.0 && lattice.step.is_finite());
            }
            assert_eq!(LatticeAxis::new(&axis, Node, 1).step, axis.length());
        }
    }

    #[test]
    fn steps_of_a_periodic_axis_close_the_circle() {
        let axis = axes(Symmetry::NONE)[1];
        for centring in [Cell, Node] {
            let lattice = LatticeAxis::new(&axis, centring, 6);
            assert!(lattice.periodic);
            let turn = lattice.value(6.0) - lattice.value(0.0);
            assert!((turn - axis.length()).abs() < 1e-15);
        }
        assert!(!LatticeAxis::new(&axes(Symmetry::FULL)[2], Node, 6).periodic);
    }

    #[test]
    fn index_undoes_value() {
        let lattices = product([Cell, Node, Start], [1, 2, 7, 90]);
        for (axis, (centring, n)) in product(axes(Symmetry::NONE), lattices) {
            let lattice = LatticeAxis::new(&axis, centring, n);
            for (i, part) in product(-2..=n as i64 + 2, [0.0, 0.3]) {
                let index = i as f64 + part;
                let back = lattice.index(lattice.value(index));
                // An ulp of the value, divided by the step.
                assert!((back - index).abs() < 1e-13, "{index} {back}");
            }
        }
    }

    #[test]
    fn node_numbers_run_fastest_along_the_last_axis_and_wrap_on_circles() {
        let axes = axes(Symmetry::NONE);
        let shape = [2, 4, 3, 2];
        let axes = axes.iter().zip(shape);
        let axes = axes.map(|(a, n)| LatticeAxis::new(a, Cell, n)).collect();
        let pose = vec![None; 48];
        let lattice = Lattice { axes, pose };
        assert_eq!(lattice.shape(), shape);
        for_each_node(&[3, 0], |_| panic!("no node"));
        // Axes 1 and 3 are circles, 0 and 2 end.
        assert_eq!(lattice.node(&[0, -1, 0, 2]), lattice.node(&[0, 3, 0, 0]));
        assert_eq!(lattice.node(&[0, 9, 0, -5]), lattice.node(&[0, 1, 0, 1]));
        for outside in [[-1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 3, 0], [0, 0, -1, 0]] {
            assert_eq!(lattice.node(&outside), None);
        }
        // Beyond a pole the coordinates go on: the mirror image of the first cell.
        let at = |i| lattice.coords(&[i, 0, 0, 0])[0];
        assert_eq!(at(-1), -at(0));
    }
}

#[cfg(feature = "experiments")]
mod export {
    use crate::common::{form, planned};
    use gonio::geometry::Symmetry;
    use gonio::parametrization::{self, WarpSpec};
    use gonio::schedule::{SampleSet, Schedule, SobolSet};
    use gonio::schedule::{ScheduleFormat, Sequence, write_schedule};

    fn text(schedule: &Schedule, format: ScheduleFormat) -> String {
        let mut bytes = Vec::new();
        write_schedule(schedule, Sequence::Generated, format, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn degrees_and_units_are_in_the_column_names() {
        let names = |name: &str, warps: &[(&str, WarpSpec)]| {
            let warps = warps.iter().map(|&(a, w)| (a.to_owned(), w)).collect();
            let entry = parametrization::find(name).unwrap();
            let p = entry.warped(Symmetry::FULL, &warps).unwrap();
            let schedule = SobolSet::default().plan(&p, 1, 0).unwrap();
            let text = text(&schedule, ScheduleFormat::Csv);
            let names = text.lines().find(|l| !l.starts_with('#')).unwrap();
            names.strip_prefix("index,").unwrap().replace(',', " ")
        };
        let of_arms = "theta_i_deg phi_i_deg theta_o_deg phi_o_deg";
        let both = [("k", WarpSpec::Arcsine), ("h_bar", WarpSpec::SquareRoot)];
        let (half, merl) = ("half-difference", [("theta_h", WarpSpec::Merl)]);
        for (name, warps, own) in [
            (half, &[][..], "theta_h_deg theta_d_deg phi_d_deg"),
            (half, &merl, "theta_h_merl theta_d_deg phi_d_deg"),
            ("hybrid", &both, "h_bar_square_root k_arcsine_deg delta_deg"),
            ("spherical", &[], "delta_phi_deg"),
        ] {
            assert_eq!(names(name, warps), format!("{own} {of_arms}"));
        }
    }

    #[test]
    fn the_header_says_what_was_folded_and_left_out() {
        let of = |symmetry| planned(&form("orthographic", symmetry), "grid", 200, 1);
        let schedule = of(Symmetry::FULL);
        let about = text(&schedule, ScheduleFormat::Csv);
        let poses = format!("{} poses", schedule.poses.len());
        let share = format!("{:.4}", schedule.unphysical_share);
        for part in [&poses, "isotropic, reciprocal, bilateral", &share] {
            assert!(about.contains(part), "{about}");
        }
        let about = text(&of(Symmetry::NONE), ScheduleFormat::Csv);
        assert!(about.contains("under the symmetries none"));
    }
}
