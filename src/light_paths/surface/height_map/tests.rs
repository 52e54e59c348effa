use super::*;

#[test]
fn a_map_reads_and_resolves_to_itself() {
    let read = |text: &str| registry::read_text(&ENTRY, text);
    let spec = read("file = \"a.exr\"\npitch_um = 0.5").unwrap();
    assert!(!spec.resolved().contains_key("height_um"));
    let again = registry::read_keys("surface", &[ENTRY], spec.resolved()).unwrap();
    assert_eq!(again.resolved(), spec.resolved());
    assert_eq!(again.pitch_um(), Some(0.5));
    assert!(read("file = \"a.exr\"").is_err() && read("pitch_um = 1.0").is_err());
    assert!(read("file = \"a.exr\"\npitch_um = 1.0\nheigth_um = 1.0").is_err());
}
