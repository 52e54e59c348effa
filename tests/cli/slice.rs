//! Pictures of slices.

use super::Bench;
use super::common::says;
use std::fs;

#[test]
fn a_kind_of_material_is_pictured_from_each_view() {
    let bench = Bench::new();
    let args = "slice ggx --set alpha=0.1 --view-deg 0 --view-deg 30 --resolution 20 -o out";
    let said = bench.ends(args, 0);
    let files = bench.files("out");
    assert_eq!(files.len(), 6);
    for file in &files {
        says(&said, file);
        let bytes = fs::read(bench.path("out").join(file)).unwrap();
        match file.rsplit('.').next().unwrap() {
            "png" => assert!(bytes.starts_with(b"\x89PNG")),
            "svg" => assert!(bytes.starts_with(b"<svg")),
            _ => {
                let text = String::from_utf8(bytes).unwrap();
                let mut lines = text.lines();
                assert_eq!(lines.next(), Some("theta_deg,phi_deg,value"));
                assert_eq!(lines.next().map(|l| l.starts_with("-85.5")), Some(true));
                assert_eq!(lines.count() + 1, 400);
            }
        }
    }
    // The peak lies at the mirror direction.
    let csv = files.iter().find(|f| f.ends_with("_30.csv")).unwrap();
    let text = bench.read(&format!("out/{csv}"));
    let rows = text.lines().skip(1).map(|l| {
        let cells: Vec<f64> = l.split(',').map(|c| c.parse().unwrap()).collect();
        [cells[0], cells[1], cells[2]]
    });
    let peak = rows.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    assert!(
        (peak[0] + 30.0).abs() < 9.1 && peak[1].abs() < 9.1,
        "{peak:?}"
    );

    bench.refuses(args, 2, "--force");
    bench.good(format!("{args} --force"));
}

#[test]
fn a_material_of_a_config_is_chosen_by_its_name() {
    let bench = Bench::new();
    bench.good("slice small.toml --material lambert --view-deg 12.5 --resolution 3 -o out");
    let files = bench.files("out");
    assert_eq!(
        files,
        ["lambert_12.5.csv", "lambert_12.5.png", "lambert_12.5.svg"]
    );
}
