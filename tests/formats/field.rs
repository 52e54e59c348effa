//! The same readings as people and programs write them.

use super::common::{near, says, table};
use super::{chain, chord, conventions, try_read};
use gonio::formats::{Readings, load_readings, of_name};
use gonio::schedule::{Assume, Conventions, Sequence};
use serde_json::{Value, json};
use std::io::Write;

/// Poses, degrees.
const POSES: [[f64; 4]; 7] = [
    [10.0, 0.0, 0.0, 0.0],
    [10.0, 0.0, 20.0, 180.0],
    [10.0, 0.0, 20.0, 90.0],
    [10.0, 0.0, 45.0, 180.0],
    [50.0, 0.0, 20.0, 180.0],
    [50.0, 0.0, 20.0, 90.0],
    [50.0, 0.0, 45.0, 180.0],
];

/// f_r of the pose of a number, 1/sr.
fn value(k: usize) -> f64 {
    0.125 + 0.25 * k as f64
}

/// Lines of the cells of all poses, with a separator, and with a decimal comma in place of the point.
fn rows(separator: &str, comma: bool, cells: impl Fn(usize, [f64; 4]) -> Vec<f64>) -> String {
    let line = |(k, pose): (usize, &[f64; 4])| {
        let cells: Vec<String> = cells(k, *pose).iter().map(f64::to_string).collect();
        let line = cells.join(separator) + "\n";
        if comma { line.replace('.', ",") } else { line }
    };
    POSES.iter().enumerate().map(line).collect()
}

/// Angles and value.
fn five(k: usize, pose: [f64; 4]) -> Vec<f64> {
    [&pose[..], &[value(k)]].concat()
}

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n";

const VECTORS: &str = "omega_i_x,omega_i_y,omega_i_z,omega_o_x,omega_o_y,omega_o_z";

/// The readings in sheets, of which six cells are empty, and in the text of FRED.
const SHEETS: &str = "theta_i;10\nphi_i;0\n;0;180;90\n0;0,125;0,125;0,125\n20;;0,375;0,625\n45;;0,875;\n\
    theta_i;50\n;0;180;90\n20;;1,125;1,375\n45;;1,625;\n";
const FRED: &str = "type bsdf_data\nformat angles=deg bsdf=value scale=0.5\n\
    10 0\n0 180 .25\n20 0 .75\n20 270 1.25\n45 0 1.75\n50 0\n20 0 2.25\n20 270 2.75\n45 0 3.25\n";

/// The readings of a file of these bytes.
fn load(bytes: &[u8], name: &str, words: &str) -> Result<Readings, gonio::Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let conventions = conventions(words);
    let assume = Assume {
        conventions,
        ..Assume::default()
    };
    load_readings(&path, &assume)
}

/// Asserts that a text is refused without conventions, with these parts of the sentence.
#[track_caller]
fn not_read(text: &str, parts: &str) {
    let e = try_read(text, Conventions::default()).err().expect(parts);
    says(&chain(&e), parts);
}

/// Asserts that each of these values in place of that of [`bird`] is refused.
fn not_birds<const N: usize>(cases: [(&str, Value, &str); N]) {
    for (pointer, value, part) in cases {
        let mut file = bird();
        *file.pointer_mut(pointer).unwrap() = value;
        not_read(&file.to_string(), part);
    }
}

/// Asserts that readings are those of [`value`] at the poses, whatever their order.
#[track_caller]
fn assert_same(readings: &Readings, holes: usize, slack: f64, form: &str) {
    let m = &readings.measurement;
    let counts = [m.readings(), m.outcomes.len()];
    assert_eq!(counts, [POSES.len(), POSES.len() + holes], "{form}");
    for (k, pose) in POSES.iter().enumerate() {
        let [a, b, c, d] = pose.map(f64::to_radians);
        let pair = gonio::geometry::DirectionPair::from_spherical(a, b, c, d);
        let poses = m.schedule.poses.iter();
        let at = poses.map(|pose| chord(&pose.pair, &pair)).enumerate();
        let (at, off) = at.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!(off < 1e-7, "{form}: {off}");
        near(m.value(at).unwrap()[0], value(k), slack, (form, k));
    }
}

#[test]
fn files_are_read_as_programs_save_them() {
    let plain = HEAD.to_owned() + &rows(",", false, five);
    let utf_16 =
        |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(plain.as_bytes()).unwrap();
    let semicolons = HEAD.replace(',', ";") + &rows(";", true, five);
    let radians = |k: usize, pose: [f64; 4]| [&pose.map(f64::to_radians)[..], &[value(k)]].concat();
    let vectors = |k: usize, pose: [f64; 4]| {
        let unit = |theta: f64, phi: f64| {
            let ((s, c), (sp, cp)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
            [s * cp, s * sp, c]
        };
        let [light, sensor] = [unit(pose[0], pose[1]), unit(pose[2], pose[3])];
        [&light[..], &sensor, &[value(k)]].concat()
    };
    let counts = |k: usize, pose: [f64; 4]| {
        let signal = value(k) * pose[2].to_radians().cos() * 2000.0;
        [&pose[..], &[signal + 7.0, 7.0, 2000.0]].concat()
    };
    let states = |k: usize| [1.5 * value(k), 0.5 * value(k)];
    let polarised = |k: usize, pose: [f64; 4]| [&pose[..], &states(k)].concat();
    let check = |form: &str, bytes: &[u8], words: &str| {
        // Text is told by what is in it, also under the names of tables.
        for name in ["m.csv", "m.txt", "m.bsdf"] {
            let readings = load(bytes, name, words);
            let readings = readings.unwrap_or_else(|e| panic!("{form}: {}", chain(&e)));
            let is_scaled = ["FRED", "counts"].contains(&form);
            let holes = if form == "sheets" { 6 } else { 0 };
            let slack = if is_scaled { 1e-12 } else { 1e-15 };
            assert_same(&readings, holes, slack, form);
        }
    };
    check("gzip", &gzip.finish().unwrap(), "");
    check("UTF-16", &utf_16(&format!("\u{feff}{semicolons}")), "");
    check("UTF-16 without a mark", &utf_16(&plain), "");
    let big_end_first = plain.encode_utf16().flat_map(u16::to_be_bytes);
    check("big end first", &big_end_first.collect::<Vec<_>>(), "");
    let code_page = [&b"# at 20 \xb0C\n"[..], plain.as_bytes()].concat();
    check("a code page", &code_page, "");
    let by_number = "columns=theta_i=1,phi_i=2,theta_o=3,phi_o=4,value=5";
    check("by number", rows(" ", false, five).as_bytes(), by_number);
    let same = |form: &str, text: String| check(form, text.as_bytes(), "");
    same("plain", plain.clone());
    same("CR", plain.replace('\n', "\r"));
    same("CRLF", plain.replace('\n', "\r\n"));
    same("sep=", format!("sep=;\n{semicolons}"));
    same("tabs", HEAD.replace(',', "\t") + &rows("\t", true, five));
    let blanks = HEAD.replace(',', "  ");
    same("blanks", blanks + &rows("   ", true, five));
    same("MATLAB", format!("% run 4\n{plain}"));
    same("savetxt", format!("# {plain}"));
    let preamble = "Goniometer 7\n\nDate: 1.2.2026, 10:00";
    same("a preamble", format!("{preamble}\n{plain}"));
    same("names again", format!("{plain}\n{HEAD}"));
    let capitals = plain.replace("theta_i_deg", " Theta_I_deg ");
    same("capitals", capitals.replace("value", "Value"));
    let units = plain.replace("_deg", " [°]");
    same("units", units.replace("value", "value (1/sr)"));
    let bare = plain.replace("_deg", "");
    let line = "\ndeg,deg,deg,deg,1/sr\n";
    same("a line of units", bare.replacen('\n', line, 1));
    same("degrees by their numbers", bare);
    let of_radians = HEAD.replace("_deg", "_rad");
    same("radians", of_radians + &rows(",", false, radians));
    same("Fortran", plain.replace("0.125", "1.25D-01"));
    let behind = "10,0,120,0,9\n170,0,20,0,9\n";
    same("beyond 90°", format!("{plain}{behind}"));
    let of_vectors = rows(",", false, vectors);
    same("unit vectors", format!("{VECTORS},value\n{of_vectors}"));
    let of_counts = HEAD.replace("value", "signal,dark,reference");
    same("counts", of_counts + &rows(",", false, counts));
    let of_states = HEAD.replace("value", "value_s,value_p");
    same("polarised", of_states + &rows(",", false, polarised));
    same("sheets", SHEETS.into());
    same("FRED", FRED.into());
    same("BiRD", bird().to_string());
    let beyond = load(format!("{plain}10,0,120,0,9\n").as_bytes(), "m.csv", "").unwrap();
    let note = "1 row with light or sensor behind the sample: passed over";
    assert_eq!(beyond.notes, [note]);
}

#[test]
fn wavelengths_are_in_any_unit() {
    const NM: [f64; 3] = [450.0, 555.5, 650.0];
    for (head, factor) in [
        ("wavelength_nm", 1.0),
        ("wavelength_um", 1e-3),
        ("wavelength [µm]", 1e-3),
        ("wavelength_m", 1e-9),
        // Told by the numbers.
        ("Wavelength", 1.0),
        ("wavelength", 1e-3),
        ("wavelength", 1e-9),
    ] {
        let mut text = HEAD.replace("value", &format!("{head},value"));
        for nm in NM {
            text += &rows(",", false, |k, pose| {
                [&pose[..], &[nm * factor, value(k) * nm]].concat()
            });
        }
        let m = super::read(&text, "").measurement;
        assert_eq!(m.channels.wavelengths().unwrap().nm(), NM, "{head}");
        let want = NM.map(|nm| nm * value(0));
        assert_eq!(m.value(0).unwrap(), want, "{head}");
    }
    for (labels, words) in [
        (["450nm", "555.5 nm", "650nm"], ""),
        (["R450", "R555.5", "R650"], "columns=value_*nm=R*"),
    ] {
        let text = HEAD.replace("value", &labels.join(","))
            + &rows(",", false, |k, pose| {
                [&pose[..], &[1.0, 2.0, 3.0].map(|x| x * value(k))].concat()
            });
        let m = super::read(&text, words).measurement;
        assert_eq!(m.channels.wavelengths().unwrap().nm(), NM);
        assert_eq!(m.value(1).unwrap(), [1.0, 2.0, 3.0].map(|x| x * value(1)));
    }
    // A pattern may name as many columns as a line has room for.
    let labels: Vec<String> = (0..20_000).map(|i| format!("R{i}")).collect();
    let row = "10,0,20,0".to_owned() + &",.5".repeat(labels.len());
    let text = HEAD.replace("value", &labels.join(",")) + &row;
    let refused = try_read(&text, conventions("columns=value_*nm=R*")).err();
    says(&chain(&refused.unwrap()), "allowed is 1 to 512 of them");
}

#[test]
fn what_others_may_mean_is_guessed_and_not_taken() {
    let row = "10,0,20,180,.5,.1\n";
    for [head, guess] in table(
        r#"
        Einfallswinkel [°],Azimut ein [°],Ausfallswinkel [°],Azimut aus [°],BRDF,lamp | --columns theta_i_deg=1,phi_i_deg=2,theta_o_deg=3,phi_o_deg=4,value=BRDF
        thetaIn,phiIn,thetaOut,phiOut,brdf,sigma | --columns theta_i=thetaIn,phi_i=phiIn,theta_o=thetaOut,phi_o=phiOut,value=brdf,uncertainty=sigma --angles deg
        AOI,azimuth_source,scatter_angle,azimuth_detector,BSDF,x | --columns theta_i=AOI,phi_i=azimuth_source,theta_o=scatter_angle,phi_o=azimuth_detector,value=BSDF --angles deg
        theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,u_percent | --columns uncertainty=u_percent --uncertainties percent"#,
    ) {
        not_read(&format!("{head}\n{row}"), &format!("a guess: {guess}"));
    }
    let guess = "a guess: --columns theta_i=1,phi_i=2,theta_o=3,phi_o=4,value=5";
    not_read(row, guess);
}

/// The readings as the BiRD format has them, each in s and p polarised light.
fn bird() -> Value {
    let n = POSES.len();
    let twice = |of: &dyn Fn(usize) -> f64| (0..2 * n).map(of).collect::<Vec<f64>>();
    let angle = |d: usize| json!({ "unit": "deg", "values": twice(&|i| POSES[i % n][d]) });
    let values = twice(&|i| value(i % n) * if i < n { 1.5 } else { 0.5 });
    let states = [vec!["s"; n], vec!["p"; n]].concat();
    json!({
        "metadata": { "sample": { "name": "tile" }, "environment": "NA", "instrumentation": { "name": "rig" } },
        "data": {
            "theta_i": angle(0), "phi_i": angle(1), "theta_r": angle(2), "phi_r": angle(3),
            "polarization_i": { "notation": "sp", "values": states },
            "BRDF": { "unit": "sr^-1", "values": values, "comments": "of a tile" },
            "uBRDF": { "unit": "%", "values": vec![2.0; 2 * n] },
        },
    })
}

#[test]
fn files_of_national_laboratories_go_through_ours_and_come_back() {
    let text = bird().to_string();
    let both = super::read(&text, "");
    assert_eq!(both.about.material.as_deref(), Some("tile"));
    let details = both.measurement.details.as_ref().unwrap();
    for (i, u) in details.type_b.iter().enumerate() {
        near(*u, 0.02 * both.measurement.values[i], 1e-12, i);
    }
    let factors = [
        ("polarisation=s", 1.5),
        ("polarisation=p", 0.5),
        ("coverage-factor=2", 1.0),
    ];
    for (words, factor) in factors {
        let one = super::read(&text, words).measurement;
        near(
            one.values[0] / both.measurement.values[0],
            factor,
            1e-12,
            words,
        );
        let u = one.details.unwrap().type_b[0] / one.values[0];
        near(u, if factor == 1.0 { 0.01 } else { 0.02 }, 1e-12, words);
    }
    let written = |readings: &Readings, name: &str| {
        let write = of_name(name.as_ref()).unwrap().write_readings.unwrap();
        let (m, about, order) = (&readings.measurement, &readings.about, Sequence::Generated);
        let mut out = Vec::new();
        write(m, about, order, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    };
    let ours = super::read(&written(&both, "m.csv"), "");
    let back: Value = serde_json::from_str(&written(&ours, "m.brdf")).unwrap();
    assert_eq!(back["metadata"], bird()["metadata"]);
    assert_eq!(back["data"]["BRDF"]["comments"], "of a tile");
    let again = super::read(&back.to_string(), "");
    for i in 0..POSES.len() {
        assert_eq!(again.measurement.values[i], both.measurement.values[i]);
        let [a, b] = [&again, &both].map(|r| r.measurement.details.as_ref().unwrap().type_b[i]);
        near(a, b, 1e-15, i);
    }
    let few = "data.theta_r has 1 values; allowed: 14, as data.BRDF";
    let no_number = "data.phi_r: invalid type: string \"x\"";
    let beyond = "reading 3: theta_i [deg] = 200";
    let state = "data.polarization_i, reading 3: [1.0, 0.0, 0.0, 1.0]; allowed: s, p, u";
    not_birds([
        ("/data/theta_r/values", json!([1.0]), few),
        ("/data/phi_r/values/3", json!("x"), no_number),
        ("/data/theta_i/values/2", json!(200.0), beyond),
        ("/data/polarization_i/values/2", json!([1, 0, 0, 1]), state),
        ("/data/BRDF", json!({}), "data.BRDF: missing field `unit`"),
    ]);
    not_read(&text[..text.len() / 2], "this is no JSON");
}

#[test]
fn unusual_files_are_read_as_they_are_meant() {
    let first = |text: &str, words: &str| {
        let readings = super::read(text, words);
        let (m, mut told) = (readings.measurement, readings.notes);
        told.extend(readings.warnings);
        let values = (0..m.outcomes.len()).filter_map(|i| Some(m.value(i)?[0]));
        (values.collect::<Vec<f64>>(), told.join("; "))
    };
    for [text, words, values, part] in table(
        r#"
        T,value,value_s,value_p\n30,0,30,180,1.5,3,1 |  | 1.5 | ignored columns: value_s, value_p
        T,value,value_s,value_p\n30,0,30,180,1.5,3,1 | polarisation=s | 3 | ignored columns: value, value_p
        T,value,signal,reference\n30,0,60,180,1.5,700,1000 |  | 1.5 | ignored columns: signal, reference
        T,signal,dark,reference\n30,0,60,180,250,-1,2000\n30,0,60,90,500,-2,2008 |  | 0.251 0.5 | (signal - dark) / reference
        T,signal,reference\n30,0,60,180,250,2000\n30,0,60,90,500,0 |  | 0.25 | (signal - dark)
        T,value_s,value_p\n30,0,30,180,0.5,0.25\n30,0,30,90,-999,0.5 |  | 0.375 | -999 in 1 cell
        T,value\n30,0,30,180,.5\n30,0,30,90,1.000000015047466219e+30 |  | 0.5 | taken for no reading
        T,value\n30,0,30,180,.5\n30,0,30,90,-nan |  | 0.5 | taken for no reading: -nan in 1 cell
        30,0,20,180,1.5,12:01:33\n30,0,5,180,.5,12:01:35 | columns=theta_i=1,phi_i=2,theta_o=3,phi_o=4,value=5 | 0.5 1.5 | ignored columns: 6
        in,out,az,R,u\ndeg,deg,deg,%,%\n30,20,180,1.5,2 | columns=theta_i=in,theta_o=out,phi_o=az,value=R | 1.5 | ignored columns: u
        theta_i,phi_i,theta_o,phi_o,signal,reference\ndeg,deg,deg,deg,counts,counts\n30,0,60,0,250,2000\ntheta_i,phi_i,theta_o,phi_o,signal,reference\ndeg,deg,deg,deg,counts,counts\n30,0,60,90,500,2000 |  | 0.25 0.5 | (signal - dark)
        Wavelength,550 nm\n12,5,2024\nT,value\n30,0,30,180,.5 |  | 0.5 |
        T,std,std,value\n30,0,30,180,1,2,.5 | columns=value=value | 0.5 | ignored columns: std, std
        T,theta_i_rad,value\n30,0,30,180,.2,.5 |  | 0.5 | ignored columns: theta_i_rad
        omega_i_x,omega_i_y,omega_i_z,omega_o_x,omega_o_y,omega_o_z,value\n0,0,1,0,.6,.8,.5\n0,0,1,0,.6,-.8,.5\n0,0,1,,.6,.8,.5 |  | 0.5 | 1 row with light or sensor behind the sample
        sep=;\ntheta_i;15\n;0;90;180\n10;.5;.25;1 |  | 0.25 0.5 1 |
        index,T,value\n1,10,0,20,180,.5\n2,10,0,30,180,.25\n1,40,0,20,180,1 |  | 0.25 0.5 1 |
        Sample 12, white tile\nmeasured;2026-05-04\ntheta_i;15\n;0;90;180\n10;.5;.25;1 |  | 0.25 0.5 1 |
        "Sample 12\nmeasured;2026-05-04\ntheta_i;15\n;0;90;180\n10;.5;.25;1 |  | 0.25 0.5 1 |
        theta_i_deg\tphi_i_deg\ttheta_o_deg\tphi_o_deg\tvalue\n10 0 20 180 .5\n10 0  20 90 .25 |  | 0.25 0.5 |
        theta_i;15\n;0;90\n10;.5;.25\nSheet 2, steep;;\ntheta_i;30\n;0;90\n10;.75;1 |  | 0.25 0.5 0.75 1 |
        type bsdf_data\nformat angles=deg bsdf=value scale=2\n30 0\n50 0 -999\n40 0 .25 |  | 0.5 | -999 in 1 cell"#,
    ) {
        let text = text.replace("T,", &format!("{},", super::ANGLES)) + "\n";
        let (mut found, told) = first(&text, words);
        found.sort_by(f64::total_cmp);
        let want: Vec<f64> = values.split(' ').map(|v| v.parse().unwrap()).collect();
        assert_eq!(found.len(), want.len(), "{text}{told}");
        let both = found.iter().zip(&want);
        both.for_each(|(a, b)| near(*a, *b, 1e-12, &text));
        says(&told, part);
        // What is no reading does not count as 0.
        let is_twice = told.contains("taken for no reading") && told.contains("below 0");
        assert!(!is_twice, "{told}");
    }
    for [text, part] in table(
        r#"
        theta_i;15\nwavelength_nm;450\n;0;90;180\n10;.1;.1;.1 | :2: this is no line of a sheet
        theta_i;15\n;0;90;180\n10;.1;.2;.3\nmean;.1;.2;.3 | :4: this is no line of a sheet
        theta_i;15\n;0;90;180\n10;.1;.2;.3\nsmoothed\n20;.1;.2;.3 | :5: this is no line of a sheet
        theta_i;15\n;0;90;180\n10;.1;.2;.3\nwavelength_nm;550\ntheta_i;15 | :4: this is no line of a sheet
        theta_i;15\n;0;90\n10;.1;.2\nred\ntheta_i;15\n;0;90\n10;.3;.4 | :6: this sheet has the light of one above the title in line 4
        theta_i;15\n;0;90\n10;.1;.2\nn.a.;n.a.;n.a. | :4: this is no line of a sheet
        theta_i;15\n;0;90;180\n10;.1;.2 | 2 values where there are 3 azimuths; --partial reads up to the cut
        theta_i;15\nphi_i [rad];1.5\n;0;90;180\n10;.1;.2;.3 | its unit is not that of the angle before"#,
    ) {
        not_read(&format!("{text}\n"), part);
    }
    let of_values = "data.BRDF.unit = %: allowed are 1/sr, sr^-1";
    let of_angles = "data.theta_i.unit = grad: allowed are units such as deg or rad";
    let of_both = "unit of uncertainties = 1: allowed are 1/sr, sr^-1 and %";
    let one_state = json!(vec!["s"; 2 * POSES.len()]);
    not_birds([
        ("/data/BRDF/unit", json!("%"), of_values),
        ("/data/theta_i/unit", json!("grad"), of_angles),
        ("/data/uBRDF/unit", json!("1"), of_both),
        (
            "/data/polarization_i/values",
            one_state,
            "no pose has a reading",
        ),
    ]);
    let mut single = bird();
    single["data"]["polarization_i"]["values"][POSES.len()] = json!("u");
    let read = super::read(&single.to_string(), "");
    assert_eq!(read.lost, 1);
    let told = "1 pose in s or in p polarised light alone: no reading";
    says(&read.warnings.join("; "), told);
}
