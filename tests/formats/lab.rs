//! Tables of laboratories that are not quite what they should be.

use super::common::table;
use super::{chain, told, try_read};
use gonio::formats::Readings;
use gonio::schedule::Conventions;

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";

fn read(text: &str) -> Readings {
    try_read(text, Conventions::default()).unwrap_or_else(|e| panic!("{}\n{text}", chain(&e)))
}

fn refused(text: &str) -> String {
    let e = try_read(text, Conventions::default());
    chain(&e.err().unwrap_or_else(|| panic!("{text}")))
}

#[test]
fn values_below_0_are_told() {
    let good = "10,0,20,180,1\n10,0,30,180,0\n10,0,35,180,-0.0\n";
    assert!(read(&format!("{HEAD}{good}")).warnings.is_empty());
    let one = read(&format!("{HEAD}{good}10,0,40,180,-1\n"));
    assert_eq!(
        one.warnings,
        ["the value of line 5 is below 0 and counts as 0"]
    );
    let text = format!("{HEAD}{good}10,0,40,180,-1\n10,0,50,180,-1\n10,0,60,180,-1e-9\n");
    assert_eq!(
        read(&text).warnings,
        [
            "3 rows have values below 0, which count as 0, the first in line 5; -1 in 2 of them may \
             stand for no data, whose cells should be empty"
        ]
    );
    let alta =
        "#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 -1\n0.2 0.2 -1\n";
    assert!(read(alta).warnings[0].contains("the first in line 4; -1 in 2 of them"));
}

#[test]
fn what_is_not_a_number_is_no_data() {
    let of = |cell: &str| {
        let readings = read(&format!("{HEAD}10,0,20,180,1\n10,0,30,180,{cell}\n"));
        (
            readings.measurement.readings(),
            readings.measurement.no_data(),
        )
    };
    for cell in ["", "NaN", "nan"] {
        assert_eq!(of(cell), (1, 1), "{cell}");
    }
    let sentence = refused(&format!("{HEAD}10,0,20,180,1\n10,0,30,180,inf\n"));
    assert!(
        sentence.contains("m.csv:3: value = inf: allowed is a finite number"),
        "{sentence}"
    );
}

#[test]
fn rows_at_the_horizon_are_passed_over() {
    let rows = "10,0,20,180,1\n10,0,90,180,0\n90,0,20,180,7\n10,0,89.99999999,180,3\n";
    let readings = read(&format!("{HEAD}{rows}"));
    assert_eq!((readings.rows, readings.measurement.readings()), (4, 1));
    let note = "3 rows with light or sensor at the horizon: passed over";
    assert_eq!(readings.notes, [note]);
    let radians =
        "theta_i_rad,phi_i_rad,theta_o_rad,phi_o_rad,value\n0,0,0.1,0,1\n0,0,1.5708,0,1\n";
    assert_eq!(read(radians).measurement.readings(), 1);
    let up = told("elevation");
    let raised = try_read(&format!("{HEAD}80,0,0,180,1\n80,0,70,180,1\n"), up).unwrap();
    assert_eq!(raised.measurement.readings(), 1);
    // One line of JSON a row.
    let json = "{\"theta_i_deg\":1,\"theta_o_deg\":90,\"phi_o_deg\":0,\"value\":1}\n";
    assert_eq!(read(&(json.to_owned() + &json.replace("90", "9"))).rows, 2);
    assert!(refused(json).contains("there is no row above the horizon"));
    // Nothing of a file that counts tries is passed over, and nothing that is further down.
    let ours = HEAD.replace("value", "value,attempt") + "10,0,20,180,1,1\n10,0,90,180,1,1\n";
    for text in [ours, format!("{HEAD}10,0,20,180,1\n10,0,91,180,0\n")] {
        let sentence = refused(&text);
        assert!(sentence.contains("m.csv:3: theta_o_deg = 9"), "{sentence}");
    }
}

#[test]
fn an_unknown_column_gets_a_short_answer() {
    let text = HEAD.replace("\n", ",lamp\n") + "10,0,20,180,1,0\n";
    let sentence = refused(&text);
    assert!(sentence.len() < 400, "{sentence}");
    for part in [
        "column \"lamp\" is not known; allowed: index, theta_i_deg, phi_i_deg",
        " others; with --columns, which says their names in the file, others are passed over, e.g. \
         --columns theta_i_deg=theta_i_deg",
    ] {
        assert!(sentence.contains(part), "{sentence}");
    }
    // As it says.
    let name = "theta_i_deg".to_owned();
    let conventions = Conventions {
        columns: vec![(name.clone(), name)],
        ..Conventions::default()
    };
    let notes = try_read(&text, conventions).unwrap().notes;
    assert_eq!(notes, ["columns that were passed over: lamp"]);
    let sentence = refused(&text.replace("theta_o_deg", "tetha_o_deg"));
    assert!(
        sentence.ends_with("; did you mean theta_o_deg?"),
        "{sentence}"
    );
}

#[test]
fn a_wavelength_has_one_column() {
    let head = HEAD.replace("value", "value_450nm,value_550nm,value_450.0nm");
    let sentence = refused(&(head + "10,0,20,180,1,2,3\n"));
    let part =
        "columns value_450nm and value_450.0nm are of one wavelength; allowed: one column for each";
    assert!(sentence.contains(part), "{sentence}");
}

#[test]
fn lines_that_are_left_out_of_a_part_are_told() {
    let partial = |text: &str| {
        let conventions = told("partial");
        try_read(text, conventions).unwrap().notes
    };
    for [rows, note] in table(
        r"
        10,0,20,180,1\n | not cut: 1 row was read
        10,0,20,180,1\n10,0,30,180,1 | cut: 1 row was read, line 3 is left out: it has no end, and digits may be missing from it
        10,0,20,180,1\n10,0,30\n | cut: 1 row was read, line 3 is left out
        10,0,20,180,1\n10,0,30\n10,0 | cut: 1 row was read, line 3 is left out, and the next one, which has no end",
    ) {
        assert_eq!(partial(&format!("{HEAD}{rows}")), [note]);
    }
}

#[test]
fn tables_of_spreadsheets_are_read() {
    let text = HEAD.replace(',', "\t") + "10,5\t0\t20\t180\t0,25\n";
    let readings = read(&text).measurement;
    let theta = readings.schedule.poses[0].pair.omega_i.theta().to_degrees();
    assert!((theta - 10.5).abs() < 1e-12);
    assert_eq!(readings.values, [0.25]);
    // A separator at the end of every line.
    let notes = read(&(HEAD.replace('\n', ",\n") + "10,0,20,180,1,\n")).notes;
    assert_eq!(notes, ["columns that were passed over: one without a name"]);
}

#[test]
fn radians_in_columns_of_degrees_are_doubted() {
    let rows = "0.1,0,1.2,3.14,1\n0.1,0,1.5,3.14,1\n";
    let warnings = read(&format!("{HEAD}{rows}")).warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("no polar angle is above 1.50°, as if radians"));
    let radians = HEAD.replace("_deg", "_rad");
    assert!(read(&format!("{radians}{rows}")).warnings.is_empty());
    assert!(
        read(&format!("{HEAD}{rows}10,0,20,180,1\n"))
            .warnings
            .is_empty()
    );
}

#[test]
fn an_arm_may_scan_through_the_normal() {
    // The plane of incidence, once with signs and once as a polar angle and an azimuth.
    let signed = format!("{HEAD}-30,0,-50,0,1\n-30,0,0,0,2\n-30,10,50,10,3\n-30,0,50,40,4\n");
    let plain = format!("{HEAD}30,180,50,180,1\n30,180,0,0,2\n30,190,50,10,3\n30,180,50,40,4\n");
    let [a, b] = [&signed, &plain].map(|text| read(text));
    let note = "4 rows with a polar angle below 0: the same angle in the opposite azimuth";
    assert_eq!(a.notes[0], note);
    assert!(b.notes.iter().all(|n| !n.contains("below 0")));
    let values = |r: &Readings| r.measurement.values.clone();
    assert_eq!(values(&a), values(&b));
    for (a, b) in a
        .measurement
        .schedule
        .poses
        .iter()
        .zip(&b.measurement.schedule.poses)
    {
        assert!((a.pair.omega_i.vector() - b.pair.omega_i.vector()).length() < 1e-15);
        assert!((a.pair.omega_o.vector() - b.pair.omega_o.vector()).length() < 1e-15);
    }
    // Elevations beyond the zenith are the same.
    let up = told("elevation");
    let raised = format!("{HEAD}120,0,140,0,1\n120,0,90,0,2\n120,10,40,10,3\n120,0,40,40,4\n");
    let raised = try_read(&raised, up).unwrap();
    assert_eq!(values(&raised), values(&b));
    assert_eq!(raised.notes[0], note);
}

#[test]
fn symmetries_that_readings_do_not_have_are_doubted() {
    let table = |of: &dyn Fn(f64) -> f64, columns: &str, uncertainty: &str| {
        let all = "{\"isotropic\": true, \"reciprocal\": true, \"bilateral\": true}";
        let head = HEAD.replace("value", &format!("value{columns}"));
        let mut text = format!("# symmetry = {all}\n{head}");
        for (theta_o, turn) in (1..=12).flat_map(|o| [0, 45, 90].map(|turn| (5 * o, turn))) {
            let (i, o) = (turn, turn + 180);
            let value = of(f64::from(turn)) + 0.001 * f64::from(theta_o);
            text += &format!("30,{i},{theta_o},{o},{value}{uncertainty}\n");
        }
        text
    };
    let brushed = |turn: f64| 1.0 + 0.5 * turn.to_radians().cos();
    let warnings = read(&table(&brushed, "", "")).warnings;
    assert!(
        warnings[0].contains("scatter by 20 % (median of 12 configurations)"),
        "{warnings:?}"
    );
    assert!(warnings[0].contains("--symmetry"), "{warnings:?}");
    // What they claim to be uncertain by explains it; a sample that looks alike has nothing to explain.
    assert!(
        read(&table(&brushed, ",type_a", ",0.3"))
            .warnings
            .is_empty()
    );
    assert!(read(&table(&|_| 1.0, "", "")).warnings.is_empty());
}

#[test]
fn a_scan_needs_no_azimuth() {
    let plain = read(&format!("{HEAD}30,0,50,180,1\n30,0,20,0,2\n"));
    let scan = read("theta_i_deg,theta_o_deg,value\n30,-50,1\n30,20,2\n");
    let poses = |r: &Readings| -> Vec<_> {
        let poses = r.measurement.schedule.poses.iter();
        poses.map(|p| p.pair.omega_o.vector()).collect()
    };
    for (a, b) in poses(&plain).into_iter().zip(poses(&scan)) {
        assert!((a - b).length() < 1e-15);
    }
    // Without a sign nothing says that it is one.
    let sentence = refused("theta_i_deg,theta_o_deg,value\n30,50,1\n30,20,2\n");
    assert!(
        sentence.contains("column phi_o_deg is missing"),
        "{sentence}"
    );
}

/// In-plane readings of a lobe about the light, whose azimuths these are.
fn lobe(lights: &[u32]) -> String {
    let mut text = HEAD.to_owned();
    for light in lights {
        for theta in [30_u32, 45] {
            for o in (0..=80).step_by(4) {
                for side in [0, 180] {
                    let off = if side == 0 {
                        theta.abs_diff(o)
                    } else {
                        theta + o
                    };
                    let value = 0.1 + (-f64::from(off * off) / 50.0).exp();
                    text += &format!("{theta},{light},{o},{},{value}\n", light + side);
                }
            }
        }
    }
    text
}

#[test]
fn a_peak_at_the_light_is_doubted_by_what_can_cause_it() {
    let warning = |text: &str| read(text).warnings.join("; ");
    assert!(warning(&lobe(&[0])).contains("--azimuth mirror"));
    // Counted from the mirror direction, the peak would not follow the light.
    let turned = warning(&lobe(&[0, 30, 60]));
    assert!(turned.contains("--azimuth propagation"), "{turned}");
    // Nothing can be read at the light: the gap is opposite the peak.
    let gap = |text: &str| -> String {
        let rows = text.lines().filter(|row| {
            let cells: Vec<f64> = row.split(',').filter_map(|c| c.parse().ok()).collect();
            cells.len() < 5 || cells[3] == 0.0 || (cells[0] - cells[2]).abs() > 11.0
        });
        rows.map(|row| row.to_owned() + "\n").collect()
    };
    let hidden = warning(&gap(&lobe(&[0])));
    assert!(
        hidden.contains("those within 20° of its mirror direction"),
        "{hidden}"
    );
}

#[test]
fn uncertainties_are_split_and_empty_ones_are_told() {
    let rows = |text: &str| {
        read(&format!(
            "{}{text}",
            HEAD.replace("value", "value,type_a,uncertainty")
        ))
    };
    let readings = rows("10,0,20,180,1,0.3,0.5\n10,0,30,180,1,0.3,0.1\n10,0,40,180,1,0.3,\n");
    let details = readings.measurement.details.as_ref().unwrap();
    assert_eq!(details.type_a, [0.3; 3]);
    assert!((details.type_b[0] - 0.4).abs() < 1e-15);
    assert_eq!(details.type_b[1..], [0.0, 0.0]);
    let exact = "1 reading without an uncertainty in a column that has some: it is not known";
    assert_eq!(readings.warnings, [exact]);
    // Equal readings that were rounded differently show no scatter.
    let twice = read(&format!(
        "{HEAD}10,0,20,180,0.3\n10,0,20,180,0.30000000000000004\n"
    ));
    assert_eq!(twice.measurement.details.unwrap().type_a, [0.0]);
}

#[test]
fn angles_of_alta_in_degrees_are_doubted() {
    let head = "#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n";
    let good = read(&format!("{head}0.5 0 0.3 3.1 1\n0.5 0 0.4 3.1 1\n"));
    assert!(good.warnings.is_empty());
    let degrees = read(&format!("{head}30 0 20 180 1\n1 0 1 180 1\n"));
    assert!(degrees.warnings[0].contains("as if degrees were read as radians"));
}
