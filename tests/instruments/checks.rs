//! Files that describe no instrument are refused, with the key and its line.

use super::common::table;
use gonio::instrument;

/// The preset of a robot with an edit: the first occurrence of a text after a mark replaced.
fn edited(mark: &str, from: &str, to: &str) -> String {
    let presets = instrument::presets();
    let text = presets.iter().find(|p| p.name == "rosi").unwrap().text;
    let start = text.find(mark).unwrap_or_else(|| panic!("{mark}"));
    let (before, after) = text.split_at(start);
    assert!(after.contains(from), "{from} after {mark}");
    format!("{before}{}", after.replacen(from, to, 1))
}

/// Start of an axis, a part to edit, its replacement, the key in the message, and what it says.
const WRONG: &str = r#"
| name = "rosi" | name = "a/b" | name | letters, digits
| about = "ROSI: fixed light, receiver on a ring, sample held by a robot" | about = " " | about | not empty
| robot-sample | robot | class | fixed-detector-3-axis, fixed-source-4-axis, dual-arm-turntable, robot-sample
| name = "ring" | name = "" | axis[0].name | letters, digits
| name = "ring" | name = "base" | axis[0].name | another name
| name = "ring" | name = "robot_yaw" | axis[1].name | nothing else has
"ring" | "base" | "wall" | axis[0].parent | base or the name of an axis: ring, robot_yaw
"ring" | "base" | "ring" | axis[0].parent | ring would hang from itself
name = "robot_yaw" | "base" | "robot_roll" | axis[1].parent | robot_yaw would hang from itself
"ring" | "base" | "robot_yaw" | axis[0].parent | "base" for this axis of robot-sample, its ring
name = "robot_roll" | "robot_pitch" | "robot_yaw" | axis[3].parent | "robot_pitch" for this axis
"ring" | [0, 1, 0] | [0, 0, 0] | axis[0].vector | length 1
"ring" | [0, 1, 0] | [0, nan, 0] | axis[0].vector | length 1
"ring" | [0, 1, 0] | [0, -1, 0] | axis[0].vector | [0.0, 1.0, 0.0] for this axis
| robot-sample | fixed-detector-3-axis | axis | the 3 axes of fixed-detector-3-axis: source_arm on base about [0.0, 1.0, 0.0]; sample_yaw on base
"ring" | min_deg = -180 | min_deg = 180 | axis[0].min_deg | below max_deg = 180
"ring" | min_deg = -180 | min_deg = nan | axis[0].min_deg | finite
"ring" | max_deg = 180 | max_deg = inf | axis[0].max_deg | finite
"ring" | speed_deg_per_s = 30 | speed_deg_per_s = 0 | axis[0].speed_deg_per_s | above 0
"ring" | speed_deg_per_s = 30 | speed_deg_per_s = inf | axis[0].speed_deg_per_s | finite
"ring" | deg_per_s2 = 60 | deg_per_s2 = 0 | axis[0].acceleration_deg_per_s2 | above 0
"ring" | deg_per_s2 = 60 | deg_per_s2 = nan | axis[0].acceleration_deg_per_s2 | finite
"ring" | resolution_deg = 0.001 | resolution_deg = -0.001 | axis[0].resolution_deg | [0, 10]
name = "robot_yaw" | repeatability_deg = 0.02 | repeatability_deg = -0.02 | axis[1].repeatability_deg | [0, 10]
name = "robot_yaw" | bias_deg = 0.05 | bias_deg = nan | axis[1].bias_deg | [0, 10]
name = "robot_pitch" | bias_deg = 0.05 | bias_deg = 0.05\nwraps = true | axis[2].wraps | at least 360
[[body]] | "link" | "light" | body[0].name | nothing else has
[[body]] | "link" | "" | body[0].name | letters, digits
[[body]] | "robot_pitch" | "robot" | body[0].axis | base or the name of an axis
[[body]] | [0, -1, 0] | [0, -1, 1] | body[0].direction | length 1
[limits] | theta_i_max_deg = 85 | theta_i_max_deg = 0 | limits.theta_i_max_deg | (0, 90]
[limits] | theta_i_max_deg = 85 | theta_i_max_deg = 91 | limits.theta_i_max_deg | (0, 90]
[limits] | theta_o_max_deg = 85 | theta_o_max_deg = nan | limits.theta_o_max_deg | (0, 90]
[limits] | separation_min_deg = 8 | separation_min_deg = -1 | limits.separation_min_deg | [0, 180)
[limits] | separation_min_deg = 8 | separation_min_deg = 180 | limits.separation_min_deg | [0, 180)
[limits] | ["link", "light"] | ["link", "lamp"] | limits.collision[0].between | two of light, sensor, link
[limits] | ["link", "sensor"] | ["sensor", "sensor"] | limits.collision[1].between | different
[limits] | angle_min_deg = 15 | angle_min_deg = 0 | limits.collision[0].angle_min_deg | above 0
[limits] | angle_min_deg = 15 | angle_min_deg = 180 | limits.collision[0].angle_min_deg | [0, 180)
[source] | half_angle_deg = 0.25 | half_angle_deg = -0.25 | source.half_angle_deg | [0, 10]
[source] | half_angle_deg = 0.25 | half_angle_deg = 11 | source.half_angle_deg | [0, 10]
[source] | beam_mm = 20 | beam_mm = 0 | source.beam_mm | above 0
[source] | drift_per_hour = 0.001 | drift_per_hour = -0.1 | source.drift_per_hour | at least 0
[detector] | half_angle_deg = 0.5 | half_angle_deg = nan | detector.half_angle_deg | [0, 10]
[detector] | view_mm = 40 | view_mm = 0 | detector.view_mm | above 0
[detector] | reference_rate = 1e5 | reference_rate = 0 | detector.reference_rate | above 0
[detector] | full_scale = 1e6 | full_scale = 0 | detector.full_scale | above 0
[detector] | bits = 18 | bits = 0 | detector.bits | [1, 32]
[detector] | bits = 18 | bits = 33 | detector.bits | [1, 32]
[detector] | read_noise = 100 | read_noise = -1 | detector.read_noise | at least 0
[detector] | read_noise = 100 | read_noise = inf | detector.read_noise | finite
[detector] | dark_rate = 20 | dark_rate = -20 | detector.dark_rate | at least 0
[detector] | exposures = 3 | exposures = 0 | detector.exposures | [1, 32]
[detector] | exposure_min_s = 0.002 | exposure_min_s = 0 | detector.exposure_min_s | above 0
[detector] | exposure_min_s = 0.002 | exposure_min_s = 3 | detector.exposure_min_s | at most exposure_max_s = 2
[detector] | exposure_max_s = 2 | exposure_max_s = inf | detector.exposure_max_s | finite
[timing] | settle_s = 0.2 | settle_s = -0.2 | timing.settle_s | at least 0
[timing] | overhead_s = 0.1 | overhead_s = nan | timing.overhead_s | finite
[timing] | scan = "stop" | scan = "stop"\nsample_rate_hz = 0 | timing.sample_rate_hz | above 0
[calibration] | reflectance = 0.99 | reflectance = 0 | calibration.reflectance | (0, 1]
[calibration] | reflectance = 0.99 | reflectance = 1.01 | calibration.reflectance | (0, 1]
[calibration] | uncertainty = 0.0025 | uncertainty = -0.1 | calibration.uncertainty | [0, 1)
[calibration] | every_minutes = 60 | every_minutes = -1 | calibration.every_minutes | at least 0
[calibration] | seconds = 60 | seconds = -1 | calibration.seconds | at least 0
[[provenance]] | fields = ["axis.*.vector"] | fields = [] | provenance[0].fields | at least one key
"calibration.uncertainty" | source = "NIST, five-axis goniospectrometer: expanded uncertainty (k = 2) of about 0.5 %" | source = "" | provenance[1].source | not empty"#;

#[test]
fn wrong_values_are_refused_by_key_and_line() {
    for [mark, from, to, key, parts] in table(WRONG) {
        let text = edited(mark, from, to);
        let e = instrument::read(&text).expect_err(&format!("{key}: {to}"));
        let start = format!("{key} = ");
        assert!(e.message.starts_with(&start), "{key}: {}", e.message);
        super::common::says(&e.message, parts);
        // The place is the value that was put there, but where a later one is at fault.
        let span = e.span.unwrap_or_else(|| panic!("{key} has no place"));
        let later = ["axis", "axis[1].name"].contains(&key);
        let written = to.lines().last().unwrap();
        let value = written.split_once(" = ").map_or(written, |pair| pair.1);
        if !later {
            let found = &text[span];
            assert!(found.contains(value), "{key}: points at {found}");
        }
    }
}

#[test]
fn what_is_missing_is_refused_at_its_table() {
    for [mark, from, to, part, place] in table(
        r#"
        [timing]      | "stop"             | "fly"              | timing.sample_rate_hz = nothing | timing
        [calibration] | reflectance = 0.99 |                    | reflectance                     |
        [detector]    | bits = 18          | bits = 18\nbit = 1 | bit                             | bit"#,
    ) {
        let text = edited(mark, from, to);
        let e = instrument::read(&text).unwrap_err();
        super::common::says(&e.message, part);
        let found = e.span.map(|span| &text[span]);
        assert!(place.is_empty() || found == Some(place), "{found:?}");
    }
}

#[test]
fn every_preset_without_an_axis_is_refused() {
    for preset in instrument::presets() {
        let mut spec = instrument::read(preset.text).unwrap();
        // The last axis carries no other.
        spec.axis.pop();
        spec.body.clear();
        spec.limits.collision.clear();
        let e = spec.check().unwrap_err();
        assert_eq!(e.key, "axis");
        assert!(e.allowed.contains(&spec.class), "{e}");
        assert!(gonio::instrument::Machine::new(&spec).is_err());
    }
}
