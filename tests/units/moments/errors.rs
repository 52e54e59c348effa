use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::moments::{Channel, MomentErrors, MomentsSpec, PeakResolving, Profile};
use gonio::registry::read_text;

fn profile(brdf: &dyn Brdf) -> Profile {
    let spec = MomentsSpec {
        views: 3,
        max_view_deg: 60.0,
        ..MomentsSpec::default()
    };
    let estimator = PeakResolving::default();
    Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap()
}

fn lambert(albedo: f64) -> Lambert {
    Lambert::new(Spectrum::Grey(albedo), Channels::Luminance)
}

#[test]
fn a_darker_copy_errs_in_energy_alone() {
    let errors = MomentErrors::between(&profile(&lambert(0.8)), &profile(&lambert(0.6)));
    assert!((errors.energy.unwrap() - 0.25).abs() < 1e-12);
    for e in [
        errors.mean,
        errors.covariance,
        errors.skewness,
        errors.kurtosis,
    ] {
        assert!(e.unwrap() < 1e-12);
    }
}

#[test]
fn a_wider_lobe_errs_as_its_moments_do() {
    let of = |alpha: f64| {
        let entry = gonio::brdf::all().into_iter().find(|e| e.kind == "ggx");
        let spec = read_text(&entry.unwrap(), &format!("alpha = {alpha}")).unwrap();
        profile(&*spec.build(Channels::Luminance).unwrap())
    };
    let (f, g) = (of(0.2), of(0.25));
    let errors = MomentErrors::between(&f, &g);
    // By hand, from the profiles: one loop a quantity.
    let (mut mean, mut covariance) = (0.0, 0.0);
    for (f, g) in f.slices.iter().zip(&g.slices) {
        let ([ft, fp], [gt, gp]) = (f.moments.mean().unwrap(), g.moments.mean().unwrap());
        mean += (gt - ft).abs().max((gp - fp).abs()) / 3.0;
        let (f, g) = (
            f.moments.covariance().unwrap(),
            g.moments.covariance().unwrap(),
        );
        let relative = [
            (g[0] - f[0]).abs() / f[0],
            (g[1] - f[1]).abs() / (f[0] * f[2]).sqrt(),
            (g[2] - f[2]).abs() / f[2],
        ];
        covariance += relative.into_iter().fold(0.0, f64::max) / 3.0;
    }
    assert!((errors.mean.unwrap() - mean).abs() < 1e-15);
    assert!((errors.covariance.unwrap() - covariance).abs() < 1e-13);
    assert!(errors.covariance.unwrap() > 0.1);
}
