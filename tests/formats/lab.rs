//! Tables of laboratories that are not quite what they should be.

use super::common::{near, product, says, table};
use super::{chord, try_read};
use gonio::formats::Readings;
use gonio::schedule::Conventions;

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";

fn read(text: &str) -> Readings {
    super::read(text, "")
}

fn strict(text: &str) -> Result<Readings, gonio::schedule::FileError> {
    try_read(text, Conventions::default())
}

/// Asserts that all directions of two files are alike.
fn assert_alike(a: &Readings, b: &Readings) {
    let [a, b] = [a, b].map(|r| &r.measurement.schedule.poses);
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        near(chord(&a.pair, &b.pair), 0.0, 1e-15, (a, b));
    }
}

#[test]
fn what_is_not_a_number_is_no_data() {
    for cell in ["", "NaN", "nan"] {
        let m = read(&format!("{HEAD}10,0,20,180,1\n10,0,30,180,{cell}\n")).measurement;
        assert_eq!((m.readings(), m.no_data()), (1, 1), "{cell}");
    }
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
    let raised = super::read(&format!("{HEAD}80,0,0,180,1\n80,0,70,180,1\n"), "elevation");
    assert_eq!(raised.measurement.readings(), 1);
    // One line of JSON a row.
    let json = "{\"theta_i_deg\":1,\"theta_o_deg\":90,\"phi_o_deg\":0,\"value\":1}\n";
    assert_eq!(read(&(json.to_owned() + &json.replace("90", "9"))).rows, 2);
}

#[test]
fn an_unknown_column_gets_a_short_answer() {
    let text = HEAD.replace("\n", ",lamp\n") + "10,0,20,180,1,0\n";
    let sentence = super::chain(&strict(&text).err().unwrap());
    assert!(sentence.len() < 400, "{sentence}");
    says(
        &sentence,
        "column \"lamp\" is not known; allowed: index, theta_i_deg, phi_i_deg … others; with --columns, which says their \
         names in the file, others are passed over, e.g. --columns theta_i_deg=theta_i_deg",
    );
    // As it says.
    let notes = super::read(&text, "columns=theta_i_deg=theta_i_deg").notes;
    assert_eq!(notes, ["ignored columns: lamp"]);
    let misspelt = strict(&text.replace("theta_o_deg", "tetha_o_deg"));
    let sentence = super::chain(&misspelt.err().unwrap());
    let end = "; did you mean theta_o_deg?";
    assert!(sentence.ends_with(end), "{sentence}");
}

#[test]
fn lines_that_are_left_out_of_a_part_are_told() {
    for [rows, note] in table(
        r"
        10,0,20,180,1\n | not cut: 1 row was read
        10,0,20,180,1\n10,0,30,180,1 | cut: 1 row was read, line 3 is left out: it has no end, and digits may be missing from it
        10,0,20,180,1\n10,0,30\n | cut: 1 row was read, line 3 is left out
        10,0,20,180,1\n10,0,30\n10,0 | cut: 1 row was read, line 3 is left out, and the next one, which has no end",
    ) {
        let notes = super::read(&format!("{HEAD}{rows}"), "partial").notes;
        assert_eq!(notes, [note]);
    }
}

#[test]
fn tables_of_spreadsheets_are_read() {
    let text = HEAD.replace(',', "\t") + "10,5\t0\t20\t180\t0,25\n";
    let readings = read(&text).measurement;
    let theta = readings.schedule.poses[0].pair.omega_i.theta().to_degrees();
    near(theta, 10.5, 1e-12, "theta_i");
    assert_eq!(readings.values, [0.25]);
    // A separator at the end of every line.
    let notes = read(&(HEAD.replace('\n', ",\n") + "10,0,20,180,1,\n")).notes;
    assert_eq!(notes, ["ignored columns: one without a name"]);
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
    assert_alike(&a, &b);
    // Elevations beyond the zenith are the same.
    let raised = format!("{HEAD}120,0,140,0,1\n120,0,90,0,2\n120,10,40,10,3\n120,0,40,40,4\n");
    let raised = super::read(&raised, "elevation");
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
    let told = "scatter by 20 % (median of 12 configurations) … --symmetry";
    says(&warnings[0], told);
    // What they claim to be uncertain by explains it; a sample that looks alike has nothing to explain.
    for text in [table(&brushed, ",type_a", ",0.3"), table(&|_| 1.0, "", "")] {
        assert!(read(&text).warnings.is_empty());
    }
}

#[test]
fn a_scan_needs_no_azimuth() {
    let plain = read(&format!("{HEAD}30,0,50,180,1\n30,0,20,0,2\n"));
    let scan = read("theta_i_deg,theta_o_deg,value\n30,-50,1\n30,20,2\n");
    assert_alike(&plain, &scan);
}

/// In-plane readings of a lobe about the light, whose azimuths these are.
fn lobe(lights: &[u32]) -> String {
    let mut text = HEAD.to_owned();
    for ((light, theta), o) in product(product(lights, [30_u32, 45]), (0..=80).step_by(4)) {
        for (side, off) in [(0, theta.abs_diff(o)), (180, theta + o)] {
            let value = 0.1 + (-f64::from(off * off) / 50.0).exp();
            text += &format!("{theta},{light},{o},{},{value}\n", light + side);
        }
    }
    text
}

#[test]
fn a_peak_at_the_light_is_doubted_by_what_can_cause_it() {
    let one = lobe(&[0]);
    // Nothing can be read at the light: the gap is opposite the peak.
    let gap = one.lines().filter(|row| {
        let cells: Vec<f64> = row.split(',').filter_map(|c| c.parse().ok()).collect();
        cells.len() < 5 || cells[3] == 0.0 || (cells[0] - cells[2]).abs() > 11.0
    });
    let gap: String = gap.flat_map(|row| [row, "\n"]).collect();
    for (text, part) in [
        (&one, "--azimuth mirror"),
        // Counted from the mirror direction, the peak would not follow the light.
        (&lobe(&[0, 30, 60]), "--azimuth propagation"),
        (&gap, "those within 20° of its mirror direction"),
    ] {
        says(&read(text).warnings.join("; "), part);
    }
}

#[test]
fn uncertainties_are_split_and_empty_ones_are_told() {
    let head = HEAD.replace("value", "value,type_a,uncertainty");
    let rows = "10,0,20,180,1,0.3,0.5\n10,0,30,180,1,0.3,0.1\n10,0,40,180,1,0.3,\n";
    let readings = read(&(head + rows));
    let details = readings.measurement.details.as_ref().unwrap();
    assert_eq!(details.type_a, [0.3; 3]);
    near(details.type_b[0], 0.4, 1e-15, "type B");
    assert_eq!(details.type_b[1..], [0.0, 0.0]);
    let exact = "1 reading without an uncertainty in a column that has some: it is not known";
    assert_eq!(readings.warnings, [exact]);
    // Equal readings that were rounded differently show no scatter.
    let rows = "10,0,20,180,0.3\n10,0,20,180,0.30000000000000004\n";
    let twice = read(&format!("{HEAD}{rows}"));
    assert_eq!(twice.measurement.details.unwrap().type_a, [0.0]);
}
