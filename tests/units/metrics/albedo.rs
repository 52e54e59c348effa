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
