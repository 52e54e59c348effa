use gonio::brdf::{Channels, Lambert, Spectrum};
use gonio::geometry::Direction;
use gonio::moments::{Batch, Channel, Kind, Slice};
use std::f64::consts::PI;

#[test]
fn channels_are_those_of_the_brdf() {
    let rgb = Lambert::new(Spectrum::Rgb([0.1, 0.2, 0.6]), Channels::Rgb);
    let at = |channel| {
        let slice = Slice::new(&rgb, channel, 0.3).unwrap();
        slice.value(0.1, -0.4).unwrap() * PI
    };
    let expected = [
        0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.6,
        0.3,
        0.1,
        0.2,
        0.6,
    ];
    for (channel, want) in Channel::ALL.into_iter().zip(expected) {
        assert!((at(channel) - want).abs() < 1e-14);
    }
    let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
    assert!(Slice::new(&grey, Channel::Luminance, 0.3).is_ok());
    assert!(Slice::new(&grey, Channel::Average, 0.3).is_err());
    for theta_o in [-0.1, PI / 2.0 + 1e-9, f64::NAN] {
        assert!(Slice::new(&grey, Channel::Luminance, theta_o).is_err());
    }
}

#[test]
fn what_is_below_the_diffuse_part_is_clamped() {
    let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
    let slice = Slice::new(&grey, Channel::Luminance, 0.3).unwrap();
    for (diffuse, kind) in [(0.5, Kind::Clamped), (0.1, Kind::Value)] {
        let mut batch = Batch::default();
        let slice = slice.without(diffuse);
        batch.push(&slice, Direction::NORMAL);
        slice.evaluate(&mut batch);
        assert_eq!(batch.kinds(), [kind]);
        assert_eq!(batch.values()[0], (0.5 / PI - diffuse).max(0.0));
    }
}
