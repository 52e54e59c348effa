use gonio::brdf::{Channels, Lambert, Spectrum};
use gonio::metrics::AlbedoProbe;

#[test]
fn lambert_is_exact_to_rounding() {
    let probe = AlbedoProbe::new();
    let values = probe.evaluate(&Lambert::new(Spectrum::Grey(0.7), Channels::Luminance));
    for albedo in probe.albedos(&values, &values) {
        assert!((albedo / 0.7 - 1.0).abs() < 1e-13, "{albedo}");
    }
}

#[test]
fn missing_pairs_are_left_out_of_both() {
    let probe = AlbedoProbe::new();
    let grey = |albedo| probe.evaluate(&Lambert::new(Spectrum::Grey(albedo), Channels::Luminance));
    let (mut truth, mut reconstruction) = (grey(0.5), grey(0.6));
    let whole = probe.error(&truth, &reconstruction).unwrap();
    assert!((whole - 0.2).abs() < 1e-12, "{whole}");
    truth.missing = (0..probe.pairs().len()).map(|i| i % 3 == 0).collect();
    reconstruction.missing = (0..probe.pairs().len()).map(|i| i % 5 == 0).collect();
    assert!(probe.albedos(&truth, &reconstruction)[0] < 0.45);
    let part = probe.error(&truth, &reconstruction).unwrap();
    assert!((part - 0.2).abs() < 1e-12, "{part}");
}
