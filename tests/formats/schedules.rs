//! Schedules.

use super::common::{form, planned, product, says, table};
use super::schema::check_lines;
use super::{ANGLES, FORMATS, backwards, chord, cuts, refused, schedules, text};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::schedule::{Assume, FileError, Schedule, ScheduleFile, ScheduleFormat, Sequence};
use gonio::schedule::{read_schedule, schedule_hash, schedule_schema};
use std::sync::Arc;

fn try_read(text: &str) -> Result<ScheduleFile, FileError> {
    read_schedule(text, "f.csv", &Assume::default())
}

fn read(text: &str) -> ScheduleFile {
    try_read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn grid(budget: usize) -> Arc<Schedule> {
    planned(&form("half-difference", Symmetry::FULL), "grid", budget, 1)
}

/// A text without the lines that begin so.
fn without(text: &str, start: &str) -> String {
    let kept = text.lines().filter(|line| !line.starts_with(start));
    kept.flat_map(|line| [line, "\n"]).collect()
}

#[test]
fn a_schedule_comes_back_from_both_formats() {
    for schedule in schedules() {
        let form = &schedule.parametrization;
        let hash = schedule_hash(&schedule, Sequence::Generated);
        for format in FORMATS {
            let text = text(&schedule, None, format);
            if format == ScheduleFormat::JsonLines {
                check_lines(&schedule_schema(), &text);
            }
            let back = read(&text);
            assert_eq!(back.hash, hash, "both formats say the same");
            let numbers: Vec<u32> = (0..schedule.poses.len() as u32).collect();
            assert_eq!(back.order, numbers);
            let back = back.schedule;
            assert_eq!(back.sample_set, schedule.sample_set);
            assert_eq!(back.unphysical_share, schedule.unphysical_share);
            assert_eq!(back.parametrization.name(), form.name());
            assert_eq!(back.parametrization.symmetry(), form.symmetry());
            assert_eq!(back.parametrization.warp_name(), form.warp_name());
            // The nodes of a grid follow from its axes: exactly.
            assert!(back.lattice == schedule.lattice, "{}", form.name());
            assert_eq!(back.poses.len(), schedule.poses.len());
            for (a, b) in back.poses.iter().zip(&schedule.poses) {
                if schedule.lattice.is_some() {
                    assert_eq!(a, b);
                    continue;
                }
                // Degrees and back round every angle twice.
                assert!(chord(&a.pair, &b.pair) < 2e-15);
                for (d, axis) in form.axes().iter().enumerate() {
                    let (x, y) = (a.coords[d], b.coords[d]);
                    let column = axis.column();
                    if ANGLES.split(',').any(|angle| angle == column) {
                        // From the angles of the arms; an azimuth has the fewer digits the nearer
                        // the normal.
                        let sin = b.pair.omega_i.sin_theta().min(b.pair.omega_o.sin_theta());
                        assert!((x - y).abs() * sin < 5e-15, "{column} {x} {y}");
                    } else if column.ends_with("_deg") {
                        // Two neighbouring angles may share their degrees.
                        let near = [y, y.next_up(), y.next_down()];
                        assert!(near.contains(&x), "{column} {x} {y}");
                    } else {
                        assert_eq!(x, y, "{column}");
                    }
                }
            }
        }
    }
}

#[test]
fn an_itinerary_is_in_the_file_and_what_it_leaves_out_too() {
    for schedule in schedules() {
        let itinerary = backwards(&schedule);
        let labels = itinerary.unreachable.iter();
        let labels = labels.map(|(pose, why)| (pose, why.label()));
        let unreachable = serde_json::to_string(&labels.collect::<Vec<_>>()).unwrap();
        let hash = schedule_hash(&schedule, Sequence::Visits(&itinerary));
        assert_ne!(hash, schedule_hash(&schedule, Sequence::Generated));
        for format in FORMATS {
            let text = text(&schedule, Some(&itinerary), format);
            if format == ScheduleFormat::JsonLines {
                check_lines(&schedule_schema(), &text);
            }
            // Every pose that has no row is named with its reason.
            assert!(text.contains(&unreachable), "{unreachable}");
            let back = read(&text);
            assert_eq!(back.hash, hash);
            assert_eq!(back.instrument.as_ref(), Some(&itinerary.instrument));
            assert_eq!(back.axes, itinerary.axes);
            assert_eq!(back.order.len(), itinerary.visits.len());
            // Rows keep the order of time.
            for (k, visit) in itinerary.visits.iter().enumerate() {
                let pair = &back.schedule.poses[back.order[k] as usize].pair;
                assert!(chord(pair, &schedule.poses[visit.pose as usize].pair) < 2e-15);
                for (a, b) in back.positions[k].iter().zip(visit.positions) {
                    assert!((a - b).abs() <= 2.0 * f64::EPSILON * b.abs());
                }
            }
            match &schedule.lattice {
                // All of the lattice is there, and every row under its own number.
                Some(_) => {
                    assert_eq!(back.unreachable, itinerary.unreachable);
                    assert_eq!(back.schedule.lattice, schedule.lattice);
                    assert_eq!(back.schedule.poses, schedule.poses);
                    let visited = itinerary.visits.iter().map(|v| v.pose);
                    assert!(visited.eq(back.order));
                }
                None => assert_eq!(back.schedule.poses.len(), itinerary.visits.len()),
            }
        }
    }
}

#[test]
fn a_cut_file_is_refused() {
    let form = form("half-difference", Symmetry::FULL);
    for (kind, format) in product(["grid", "sobol"], FORMATS) {
        let schedule = planned(&form, kind, 16, 1);
        for itinerary in [None, Some(&backwards(&schedule))] {
            let whole = text(&schedule, itinerary, format);
            let mut tried = 0;
            for cut in cuts(&whole) {
                tried += 1;
                assert!(try_read(cut).is_err(), "{}", &cut[cut.len() - 60..]);
            }
            assert!(tried > 100);
            // Only the last line end is missing: nothing is lost.
            read(whole.strip_suffix('\n').unwrap());
            // A digit that changed.
            let last = whole.rfind(|c: char| c.is_ascii_digit()).unwrap();
            let digit = if &whole[last..=last] == "1" { "2" } else { "1" };
            let mut edited = whole.clone();
            edited.replace_range(last..=last, digit);
            says(&try_read(&edited).err().unwrap().message, "schedule_hash");
        }
    }
}

#[test]
fn tables_from_a_spreadsheet_are_taken_as_they_are() {
    let expected = [
        DirectionPair::from_spherical(0.0, 0.0, 0.5, 0.0),
        DirectionPair::from_spherical(0.25, 0.0, 0.75, -1.5),
    ];
    let d = f64::to_degrees;
    let rows = [[0.0, 0.0, d(0.5), 0.0], [d(0.25), 0.0, d(0.75), d(-1.5)]];
    let table = |separator: &str, end: &str, number: &dyn Fn(f64) -> String| {
        let mut text = ANGLES.replace(',', separator) + end;
        for row in rows {
            text += &(row.map(number).join(separator) + end);
        }
        text
    };
    let plain = |v: f64| v.to_string();
    let comma = |v: f64| v.to_string().replace('.', ",");
    let mut texts = vec![
        table(",", "\n", &plain),
        table(";", "\r\n", &plain),
        table("\t", "\n", &plain),
        table(" , ", "\n\n", &plain),
        table(";", "\n", &comma),
        table(",", "\n", &|v| format!("\"{v}\"")),
        table(";", "\r\n", &|v| format!("\"{}\"", comma(v))),
        "\u{feff}".to_owned() + &table(",", "\r\n", &plain) + ",,,\r\n",
        "# a note\n".to_owned() + &table(",", "\n", &plain),
    ];
    // Another order of columns, an index that counts down, and a column of another instrument.
    let mut text = "block,phi_o_deg,theta_o_deg,index,phi_i_deg,theta_i_deg\n".to_owned();
    for (i, [ti, pi, to, po]) in rows.into_iter().enumerate() {
        text += &format!("7,{po},{to},{},{pi},{ti}\n", 9 - i);
    }
    texts.push(text);
    let json = |row: [f64; 4]| {
        let cells: Vec<_> = ANGLES.split(',').zip(row).collect();
        let cells = cells
            .iter()
            .map(|(name, angle)| format!("\"{name}\":{angle}"));
        format!("{{{}}}\n", cells.collect::<Vec<_>>().join(","))
    };
    texts.push(rows.map(json).concat());
    for text in texts {
        let back = read(&text);
        assert!(back.schedule.lattice.is_none() && back.positions.is_empty());
        assert_eq!(back.schedule.parametrization.name(), "half-difference");
        assert_eq!(back.schedule.parametrization.symmetry(), Symmetry::NONE);
        for (pair, &number) in expected.iter().zip(&back.order) {
            let pose = back.schedule.poses[number as usize];
            assert!(chord(&pose.pair, pair) < 2e-15, "{text}");
            let coords = back.schedule.parametrization.forward(&pose.pair);
            assert_eq!(pose.coords, coords);
        }
    }
}

#[test]
fn a_header_survives_a_spreadsheet() {
    let schedule = grid(60);
    // What has a comma in it is quoted, every line is padded to the width of the table.
    let pad = |line: &str| match line.starts_with('#') {
        false => format!("{line}\r\n"),
        true if line.contains([',', '"']) => {
            format!("\"{}\",,,,,,,\r\n", line.replace('"', "\"\""))
        }
        true => format!("{line},,,,,,,\r\n"),
    };
    let plain = text(&schedule, None, ScheduleFormat::Csv);
    let text: String = plain.lines().map(pad).collect();
    assert!(text.contains("\"# lattice = [{\"\"n\"\":"), "{text}");
    let back = read(&text);
    assert!(back.schedule.lattice == schedule.lattice);
    assert_eq!(back.schedule.poses, schedule.poses);
}

#[test]
fn the_reader_may_choose_the_coordinates() {
    let schedule = grid(60);
    let text = text(&schedule, None, ScheduleFormat::Csv);
    let read_in = |name: &str, symmetry| {
        let assume = Assume {
            parametrization: Some(name.into()),
            symmetry: Some(symmetry),
            ..Assume::default()
        };
        let back = read_schedule(&text, "s", &assume).unwrap().schedule;
        assert_eq!(back.parametrization.name(), name);
        assert_eq!(back.parametrization.symmetry(), symmetry);
        back
    };
    for (name, symmetry) in [
        ("spherical", Symmetry::FULL),
        ("half-difference", Symmetry::NONE),
    ] {
        let back = read_in(name, symmetry);
        // The lattice is in other coordinates.
        assert!(back.lattice.is_none());
        for (a, b) in back.poses.iter().zip(&schedule.poses) {
            assert!(chord(&a.pair, &b.pair) < 2e-15);
            assert_eq!(a.coords, back.parametrization.forward(&a.pair));
        }
    }
    let own = read_in("half-difference", Symmetry::FULL);
    assert!(own.lattice == schedule.lattice);
}

#[test]
fn what_is_no_schedule_is_refused_with_its_line() {
    for [text, line, part] in table(
        r#"
        | - | names the columns
        H | - | there is no row
        # sample_set = "grid"\n# unphysical_share = 1e12\nH1,2,3,4\n | 2 | unphysical_share = 1000000000000: allowed is a number in [0, 1]
        theta_i_deg,phi_i_deg,theta_o_deg\n1,2,3\n | 1 | column phi_o_deg is missing
        H,light\n1,2,3,4,5\n | 1 | column "light" is not known; allowed: index, theta_i_deg
        H1,2,3,4\n\n1,"2,3,4\n1,2,3,4\n | 4 | a quote is not closed
        H1,2,3,"4 | 2 | a quote is not closed
        H1,2,3,4ZERO\n | 2 | allowed is a finite number
        H\n1,2,3\n | 3 | 3 cells where there are 4 columns
        H\n1,2,3,4,5\n | 3 | 5 cells where there are 4 columns
        H1,2,3,4\n1,2,NaN,4\n | 3 | theta_o_deg is empty or NaN
        H1,2,3,4\n1,inf,3,4\n | 3 | phi_i_deg = inf
        H1,2,3,4\n1,two,3,4\n | 3 | phi_i_deg = two
        H1,2,3,4\n1,,3,4\n | 3 | phi_i_deg is empty
        H90,2,3,4\n | 2 | theta_i_deg = 90: allowed is a number in (-90, 90)
        H1,2,89.9999999,4\n | 2 | theta_o_deg = 89.9999999
        H-91,2,3,4\n | 2 | theta_i_deg = -91
        H1,2,3,361\n | 2 | phi_o_deg = 361: allowed is a number in [-360, 360]
        H1,2,3,4\n5,6,7,8\n\n1,2,3,4.00000000001\n | 5 | this pose is that of line 2
        H1,2,3,4\n1,362,3,4\n | 3 | phi_i_deg = 362
        H1,-358,3,4\n1,2,3,4\n | 3 | this pose is that of line 2
        index,H0,1,2,3,4\n0,5,6,7,8\n | 3 | this index is that of line 2
        index,H0.5,1,2,3,4\n | 2 | index = 0.5: allowed is a whole number
        # rows = 3\n# sample_set = "grid"\nH1,2,3,4\n | - | 1 rows where the header promises 3
        # parametrization = "cube"\nH1,2,3,4\n | 1 | allowed are spherical, half-difference
        # symmetry = 7\nH1,2,3,4\n | 1 | symmetry = 7
        {"theta_i_deg":1,"phi_i_deg":2,"theta_o_deg":3,"phi_o_deg":4}\n{"theta_i_deg":1, | 2 | no JSON object
        {"theta_i_deg":1,"phi_i_deg":2,"theta_o_deg":3,"phi_o_deg":"4"}\n | 1 | phi_o_deg = "4""#,
    ) {
        let text = text.replace("ZERO", "\0");
        let text = text.replace("H,", &format!("{ANGLES},"));
        let text = text.replace('H', &format!("{ANGLES}\n"));
        refused(try_read(&text), line, part);
    }
}

#[test]
fn a_lattice_without_the_rows_to_bear_it_out_is_refused() {
    let axis = |n: f64, d: f64| {
        let (step, origin) = (d / n, d / n / 2.0);
        format!("{{\"n\":{n},\"origin\":{origin},\"step\":{step},\"periodic\":false}}")
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    for (n, poses) in product([1e3, 1e6, 1e12], ["200000", "18446744073709551615"]) {
        let axes = [quarter; 3].map(|d| axis(n, d)).join(",");
        let text = format!(
            "# symmetry = {{\"isotropic\":true,\"reciprocal\":true,\"bilateral\":true}}\n\
             # sample_set = \"grid\"\n# poses = {poses}\n# lattice = [{axes}]\n\
             index,{ANGLES}\n0,10,0,20,0\n"
        );
        refused(try_read(&text), "4", "f.csv:4: lattice: ");
    }
}

#[test]
fn a_lattice_most_rows_of_which_were_taken_out_is_laid_out() {
    let schedule = grid(20_000);
    let whole = text(&schedule, None, ScheduleFormat::Csv);
    let unsigned = without(&without(&whole, "# schedule_hash"), "# rows");
    let few: Vec<&str> = unsigned.lines().take(30).collect();
    let back = read(&few.join("\n"));
    assert!(back.order.len() < 30);
    assert!(back.schedule.lattice == schedule.lattice);
}

#[test]
fn a_lattice_that_does_not_fit_its_rows_is_refused() {
    let schedule = grid(60);
    let whole = text(&schedule, None, ScheduleFormat::Csv);
    // Without the hash the rows are taken as they are, but they must still be nodes.
    let unsigned = without(&whole, "# schedule_hash");
    read(&unsigned);
    let lines: Vec<&str> = unsigned.lines().collect();
    let last = lines.len();
    let mut cells: Vec<&str> = lines[last - 1].split(',').collect();
    cells[4] = "1.25";
    let moved = lines[..last - 1].join("\n") + "\n" + &cells.join(",") + "\n";
    let refusal = "of the lattice in the header";
    refused(try_read(&moved), &last.to_string(), refusal);
    // A lattice of other nodes.
    let other = unsigned.replacen("\"n\":", "\"n\":1", 1);
    let line = lines.iter().position(|l| l.starts_with("# lattice"));
    let line = (line.unwrap() + 1).to_string();
    refused(try_read(&other), &line, &format!("f.csv:{line}: lattice: "));
    // Without the lattice the moved pose is one like any other.
    let free = read(&without(&moved, "# lattice")).schedule;
    assert!(free.lattice.is_none());
}
