//! Pictures of parametrizations, materials and reconstructions.

use super::Bench;
use super::common::{near, says};

/// Every file of `out` begins as its ending says.
fn well_formed(bench: &Bench, files: &[String]) {
    for file in files {
        let start: &[u8] = match file.rsplit('.').next().unwrap() {
            "png" => b"\x89PNG",
            "svg" => b"<svg",
            "csv" => b"theta_deg",
            _ => &[0x76, 0x2f, 0x31, 0x01],
        };
        let bytes = bench.read_bytes(&format!("out/{file}"));
        assert!(bytes.starts_with(start), "{file}");
    }
}

#[test]
fn each_picture_is_one_command() {
    let bench = Bench::new();
    let commands = [
        "hemispheres --view-deg 30 --parametrization hybrid",
        "functions --phi-deg 0 --parametrization stark",
        "stops --angle-deg 20 --parametrization stark",
        "slices ggx --resolution 24",
        "sphere ggx --resolution 16 --samples 4",
        "compare ggx --budget 200 --reconstruction thin-plate --resolution 16 --samples 4 --lighting constant",
    ];
    let small = "--budget 200 --resolution 16 --samples 4 -o warped";
    bench.does(&format!(
        "0 | picture compare ggx {small} --warp theta_h=square-root | theta_h:square-root
         0 | picture compare ggx {small} --warp theta_h:power-0.4 | theta_h:power-0.4"
    ));
    let mut told = Vec::new();
    for command in commands {
        let args = format!("picture {command} -o out");
        let said = bench.ends(&args, 0);
        let paths = said.lines().filter_map(|l| l.strip_prefix("out/"));
        told.extend(paths.map(str::to_owned));
        bench.refuses(&args, 2, "--force");
        if command.starts_with("functions") {
            bench.good(format!("{args} --force"));
        }
    }
    let files = bench.files("out");
    told.sort();
    assert_eq!(told, files);
    let compared = "thin-plate_half-difference_200";
    let expected = format!(
        "functions.svg ggx-0.3_slices.exr ggx-0.3_slices.svg ggx-0.3_sphere.exr ggx-0.3_sphere.png \
         ggx-0.3_{compared}.exr ggx-0.3_{compared}.png ggx-0.3_{compared}.svg hemispheres.svg stops.svg"
    );
    assert_eq!(files.join(" "), expected);
    well_formed(&bench, &files);
    // The paper's three, in its order.
    let slices = bench.read("out/ggx-0.3_slices.svg");
    let places = ["half-difference", "orthographic", "hybrid"].map(|name| slices.find(name));
    assert!(places.iter().all(Option::is_some) && places.is_sorted());
}

#[test]
fn what_cannot_be_pictured_is_refused() {
    let bench = Bench::new();
    bench.does(
        "2 | picture hemispheres -o out --parametrization polar | --parametrization … polar … hybrid
         2 | picture hemispheres -o out --view-deg 90 | --view-deg … [0, 90)
         2 | picture stops -o out --angle-deg 86 | --angle-deg … 86 … [0, 85]
         2 | picture functions -o out --phi-deg 200 | --phi-deg … 200
         2 | picture sphere shiny -o out | shiny … ggx
         2 | picture sphere ggx -o out --lighting moon | --lighting … moon … sky
         2 | picture compare ggx -o out --reconstruction magic | --reconstruction … magic … cubic
         2 | picture slices small.toml -o out | --material … lambert
         2 | picture compare ggx -o out --warp theta_h=sqare-root | did you mean square-root?
         2 | picture compare ggx -o out --warp theta_h | AXIS=WARP
         2 | slice ggx -o out --view-deg 90 | --view-deg … 90 … [0, 90)",
    );
    assert!(!bench.path("out").exists());
}

#[test]
fn errors_are_mapped_in_any_coordinates() {
    let bench = Bench::new();
    bench.good("schedule ggx --parametrization hybrid --budget 60 -o poses.csv");
    bench.good("measure poses.csv --config ggx -o readings.csv");
    let of = "reconstruct readings.csv --reconstruction nearest --error-map";
    let against = "--against ggx --cross-validation none";
    let others = "--error-map-in stark --error-map-in spherical";
    bench.good(format!("{of} own.svg {against}"));
    bench.good(format!("{of} two.svg {against} {others}"));
    let both = ["own.svg", "two.svg"].map(|file| bench.read(file));
    let title = "relative error (%) of the reconstruction by nearest of";
    says(&both[0], title);
    for (name, own_too) in [("hybrid", true), ("stark", false), ("spherical", false)] {
        let row = format!("\n{name}\n");
        let found = both.each_ref().map(|svg| svg.contains(&row));
        assert_eq!(found, [own_too, !own_too], "{name}");
    }
    bench.does(&format!(
        "2 | {of} no.png {against} | no.png … svg
         2 | {of} no.svg | --error-map: there is no truth to err from; allowed: with --against
         2 | {of} no.svg --against readings.csv | --error-map … readings … CONFIG|BRDF
         2 | {of} no.svg {against} --error-map-in polar | --error-map-in … polar … hybrid
         2 | {of} own.svg {against} | --force"
    ));
    assert!(!bench.path("no.svg").exists());
}

#[test]
fn slices_are_pictured_from_each_view() {
    let bench = Bench::new();
    let args = "slice ggx --set alpha=0.1 --view-deg 0 --view-deg 30 --resolution 20 -o out";
    let said = bench.ends(args, 0);
    let files = bench.files("out");
    assert_eq!(files.len(), 6);
    well_formed(&bench, &files);
    for file in &files {
        says(&said, file);
    }
    // The peak lies at the mirror direction.
    let csv = files.iter().find(|f| f.ends_with("_30.csv")).unwrap();
    let text = bench.read(&format!("out/{csv}"));
    assert!(text.starts_with("theta_deg,phi_deg,value\n-85.5"));
    let cells = |l: &str| l.split(',').map(|c| c.parse().unwrap()).collect();
    let rows: Vec<Vec<f64>> = text.lines().skip(1).map(cells).collect();
    assert_eq!(rows.len(), 400);
    let peak = rows.iter().max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    near(peak[0], -30.0, 9.1, peak);
    near(peak[1], 0.0, 9.1, peak);
    // A material of a config is chosen by its name.
    bench.does(&format!(
        "2 | {args} | --force
         0 | {args} --force
         0 | slice small.toml --material lambert --view-deg 12.5 --resolution 3 -o one"
    ));
    let names = ["csv", "png", "svg"].map(|ending| format!("lambert_12.5.{ending}"));
    assert_eq!(bench.files("one"), names);
}
