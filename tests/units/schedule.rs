mod lattice {
    use gonio::geometry::Symmetry;
    use gonio::parametrization;
    use gonio::parametrization::{Axis, AxisKind};
    use gonio::schedule::Centring::{Cell, Node, Start};
    use gonio::schedule::{Centring, Lattice, LatticeAxis, for_each_node};

    /// theta_h, theta_d and the azimuth of half/difference coordinates.
    fn axes(symmetry: Symmetry) -> Vec<Axis> {
        let entry = parametrization::find("half-difference").unwrap();
        entry.axes(symmetry)
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
        for axis in axes(Symmetry::NONE) {
            for centring in [Cell, Node, Start] {
                for n in [1, 2, 7, 90] {
                    let lattice = LatticeAxis::new(&axis, centring, n);
                    for i in -2..=n as i64 + 2 {
                        for part in [0.0, 0.3] {
                            let index = i as f64 + part;
                            let back = lattice.index(lattice.value(index));
                            // An ulp of the value, divided by the step.
                            assert!((back - index).abs() < 1e-13, "{index} {back}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn node_numbers_run_fastest_along_the_last_axis_and_wrap_on_circles() {
        let axes = axes(Symmetry::NONE);
        let shape = [2, 4, 3, 2];
        let lattice = Lattice {
            axes: axes
                .iter()
                .zip(shape)
                .map(|(a, n)| LatticeAxis::new(a, Cell, n))
                .collect(),
            pose: vec![None; 48],
        };
        assert_eq!(lattice.shape(), shape);
        let mut number = 0;
        for_each_node(&shape, |index| {
            assert_eq!(lattice.node(index), Some(number));
            let coords = lattice.coords(index);
            for d in 0..4 {
                assert_eq!(coords[d], lattice.axes[d].value(index[d] as f64));
            }
            number += 1;
        });
        assert_eq!(number, 48);
        for_each_node(&[3, 0], |_| panic!("no node"));
        // Axes 1 and 3 are circles, 0 and 2 end.
        assert_eq!(lattice.node(&[0, -1, 0, 2]), lattice.node(&[0, 3, 0, 0]));
        assert_eq!(lattice.node(&[0, 9, 0, -5]), lattice.node(&[0, 1, 0, 1]));
        for outside in [[-1, 0, 0, 0], [2, 0, 0, 0], [0, 0, 3, 0], [0, 0, -1, 0]] {
            assert_eq!(lattice.node(&outside), None);
        }
        // Beyond a pole the coordinates go on: the mirror image of the first cell.
        assert_eq!(
            lattice.coords(&[-1, 0, 0, 0])[0],
            -lattice.coords(&[0, 0, 0, 0])[0]
        );
    }
}

#[cfg(feature = "experiments")]
mod export {
    use gonio::geometry::{DirectionPair, Symmetry};
    use gonio::parametrization;
    use gonio::parametrization::WarpSpec;
    use gonio::schedule::{
        Grid, SampleSet, Schedule, ScheduleFormat, Sequence, SobolSet, write_schedule,
    };
    use serde_json::Value;
    use std::collections::BTreeMap;

    const ARMS: [&str; 4] = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];

    /// Schedules with plain, warped, 3-D and 4-D columns.
    fn schedules() -> Vec<Schedule> {
        let mut schedules = Vec::new();
        for symmetry in [Symmetry::FULL, Symmetry::NONE] {
            for entry in parametrization::all() {
                let p = entry.form(symmetry);
                schedules.push(Grid::default().plan(&p, 40, 1).unwrap());
                schedules.push(SobolSet::default().plan(&p, 9, 1).unwrap());
            }
        }
        let entry = parametrization::find("half-difference").unwrap();
        let warps = BTreeMap::from([("theta_h".to_owned(), WarpSpec::Merl)]);
        let p = entry.warped(Symmetry::FULL, &warps).unwrap();
        schedules.push(Grid::default().plan(&p, 40, 1).unwrap());
        schedules
    }

    fn text(schedule: &Schedule, format: ScheduleFormat) -> String {
        let mut bytes = Vec::new();
        write_schedule(schedule, Sequence::Generated, format, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// Angle columns in degrees against the pose they were written from.
    /// `ulps` is what the reader may lose.
    fn check_row(schedule: &Schedule, index: usize, ulps: f64, value: impl Fn(&str) -> f64) {
        let pose = &schedule.poses[index];
        assert_eq!(value("index"), index as f64);
        let [ti, pi, to, po] = ARMS.map(|name| value(name).to_radians());
        let back = DirectionPair::from_spherical(ti, pi, to, po);
        for (a, b) in [
            (back.omega_i, pose.pair.omega_i),
            (back.omega_o, pose.pair.omega_o),
        ] {
            // Degrees and back round the angles once each.
            assert!((a.vector() - b.vector()).length() < 2e-15);
        }
        for (axis, c) in schedule.parametrization.axes().iter().zip(pose.coords) {
            let written = value(&axis.column());
            let expected = if axis.column().ends_with("_deg") {
                c.to_degrees()
            } else {
                c
            };
            // The coordinates exactly, unless an arm's column stands for them.
            let slack = if ARMS.contains(&axis.column().as_str()) {
                1e-13
            } else {
                ulps * f64::EPSILON * expected.abs()
            };
            assert!((written - expected).abs() <= slack, "{}", axis.column());
        }
    }

    #[test]
    fn csv_reads_back_with_comments_skipped() {
        for schedule in schedules() {
            let text = text(&schedule, ScheduleFormat::Csv);
            let comments: Vec<_> = text.lines().take_while(|l| l.starts_with("# ")).collect();
            assert!(
                text.lines()
                    .skip(comments.len())
                    .all(|l| !l.starts_with('#'))
            );
            let mut reader = csv::ReaderBuilder::new()
                .comment(Some(b'#'))
                .from_reader(text.as_bytes());
            let header = reader.headers().unwrap().clone();
            for name in &header {
                // Every column is explained.
                let start = format!("# {name}: ");
                assert_eq!(
                    comments.iter().filter(|c| c.starts_with(&start)).count(),
                    1,
                    "{name}"
                );
            }
            for arm in ARMS {
                assert!(header.iter().any(|h| h == arm), "{arm}");
            }
            assert_eq!(
                header
                    .iter()
                    .collect::<std::collections::HashSet<_>>()
                    .len(),
                header.len()
            );
            let mut rows = 0;
            for record in reader.records() {
                let record = record.unwrap();
                check_row(&schedule, rows, 0.0, |name| {
                    let column = header.iter().position(|h| h == name).expect(name);
                    record[column].parse().unwrap()
                });
                rows += 1;
            }
            assert_eq!(rows, schedule.poses.len());
        }
    }

    #[test]
    fn every_json_line_parses_and_the_first_is_the_header() {
        for schedule in schedules() {
            let text = text(&schedule, ScheduleFormat::JsonLines);
            let mut lines = text
                .lines()
                .map(|l| serde_json::from_str::<Value>(l).unwrap());
            let header = lines.next().unwrap()["header"].clone();
            assert_eq!(header["poses"], schedule.poses.len());
            assert_eq!(header["parametrization"], schedule.parametrization.name());
            assert_eq!(header["warp"], schedule.parametrization.warp_name());
            let symmetry: Symmetry = serde_json::from_value(header["symmetry"].clone()).unwrap();
            assert_eq!(symmetry, schedule.parametrization.symmetry());
            let columns: Vec<_> = header["columns"].as_object().unwrap().keys().collect();
            let mut rows = 0;
            for line in lines {
                let object = line.as_object().unwrap();
                assert_eq!(object.keys().collect::<Vec<_>>(), columns);
                // The text is exact; serde_json, without `float_roundtrip`, reads it to an ulp.
                check_row(&schedule, rows, 1.0, |name| object[name].as_f64().unwrap());
                rows += 1;
            }
            assert_eq!(rows, schedule.poses.len());
        }
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
        assert_eq!(
            names("half-difference", &[]),
            "theta_h_deg theta_d_deg phi_d_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names("half-difference", &[("theta_h", WarpSpec::Merl)]),
            "theta_h_merl theta_d_deg phi_d_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names(
                "hybrid",
                &[("k", WarpSpec::Arcsine), ("h_bar", WarpSpec::SquareRoot)]
            ),
            "h_bar_square_root k_arcsine_deg delta_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
        assert_eq!(
            names("spherical", &[]),
            "delta_phi_deg theta_i_deg phi_i_deg theta_o_deg phi_o_deg"
        );
    }

    #[test]
    fn the_header_says_what_was_folded_and_left_out() {
        let entry = parametrization::find("orthographic").unwrap();
        let schedule = Grid::default()
            .plan(&entry.form(Symmetry::FULL), 200, 1)
            .unwrap();
        let about = text(&schedule, ScheduleFormat::Csv);
        let poses = schedule.poses.len();
        let share = format!("{:.4}", schedule.unphysical_share);
        for part in [
            &format!("{poses} poses"),
            "isotropic, reciprocal, bilateral",
            &share,
        ] {
            assert!(about.contains(part), "{about}");
        }
        let schedule = Grid::default()
            .plan(&entry.form(Symmetry::NONE), 200, 1)
            .unwrap();
        assert!(text(&schedule, ScheduleFormat::Csv).contains("under the symmetries none"));
    }
}
