//! Samplers made of tables, on every model: draws average to the albedo, and their variance is that of the quadrature.
#![cfg(feature = "experiments")]

mod common;

use common::{Level, levels, model, on_threads, table};
use gonio::brdf::{self, Brdf, Channels, laws};
use gonio::geometry::{Direction, DirectionPair};
use gonio::importance::{self, Axes, InCells, SamplerSettings, TabulatedSampler};
use gonio::registry;
use gonio::sampling::{Random, Sobol};

levels! {
    draws_average_to_the_albedo: "thorough: every model, each in a third of the charts";
}

fn draws_average_to_the_albedo(level: Level) {
    let mut brdfs: Vec<(String, Box<dyn Brdf>)> = Vec::new();
    if level == Level::Thorough {
        for entry in brdf::all() {
            for text in entry.examples {
                let spec = registry::read_text(&entry, text);
                // Those of a file have none.
                let built = spec
                    .ok()
                    .and_then(|spec| spec.build(Channels::Luminance).ok());
                brdfs.extend(built.map(|brdf| (format!("{} {text}", entry.kind), brdf)));
            }
        }
        assert!(brdfs.len() > 20);
    } else {
        for [kind, keys] in table(
            r#"
            lambert |
            ggx | alpha = 0.001
            ggx | alpha = [0.1, 0.4]
            sheen | alpha = 0.3
            retro-reflective | of = { kind = "ggx", alpha = 0.2 }"#,
        ) {
            brdfs.push((format!("{kind} {keys}"), model(kind, keys)));
        }
    }
    let charts = match level {
        Level::Quick => vec![SamplerSettings::default().axes],
        // With fixed ends the cells across the horizon have few and large weights.
        Level::Thorough => Axes::all()
            .into_iter()
            .filter(|axes| axes.to_horizon)
            .collect(),
    };
    for (m, (name, brdf)) in brdfs.iter().enumerate() {
        // A third of the charts for each model, another third for the next.
        let some = charts
            .iter()
            .enumerate()
            .filter(|(n, _)| charts.len() < 3 || (n + m) % 3 == 0);
        for (n, axes) in some {
            let settings = SamplerSettings {
                axes: *axes,
                in_cells: InCells::ALL[n % 2],
                azimuths: 16,
                ..SamplerSettings::default()
            };
            let sampler = TabulatedSampler::new(&**brdf, settings).unwrap();
            for theta in [0.5_f64, 50.0, 85.0] {
                let omega_o = Direction::from_spherical(theta.to_radians(), 1.0);
                let what = format!("{name}, {} at {theta}", axes.name());
                let weight = |u: [f64; 2]| {
                    let (omega_i, density) = sampler.draw(omega_o, u)?;
                    let f = brdf.luminance(&DirectionPair::new(omega_i, omega_o));
                    Some(f.unwrap_or(0.0) * omega_i.cos_theta() / density)
                };
                let albedo = laws::directional_albedo(&**brdf, omega_o).value[0];
                if albedo < 1e-9 {
                    continue;
                }
                let (variance, integral) =
                    importance::relative_variance(&**brdf, &sampler, omega_o).unwrap();
                // Where cells are far wider than the lobe, the quadrature of the chart itself is rough.
                let rough = 0.02_f64.max(0.05 * variance.min(1.0));
                let off = (integral / albedo - 1.0).abs();
                assert!(off < rough, "{what}: {integral} {albedo}");
                // Few and large weights: no number of draws shows their spread.
                if variance > 0.5 {
                    continue;
                }
                // Eight scrambled sets, each of a mean.
                let mean = |seed: u64| {
                    let mut sobol = Sobol::new(seed);
                    let all = (0..2048).map(|i| weight(sobol.point(i)).unwrap_or(0.0));
                    all.sum::<f64>() / 2048.0
                };
                let means: Vec<f64> = (0..8).map(mean).collect();
                let drawn = means.iter().sum::<f64>() / 8.0;
                let spread: f64 = means.iter().map(|m| (m - drawn).powi(2)).sum();
                let error = (spread / 56.0).sqrt();
                let off = (drawn - albedo).abs();
                let most = 5.0 * error + 1e-3 * albedo;
                assert!(off < most, "{what}: {drawn} ± {error}, not {albedo}");
                // In ω_i itself a cell is wider than a lobe, and what lies beside its points is drawn once in many times.
                if axes.name().starts_with("omega_i") {
                    continue;
                }
                // By independent draws: the variance has a standard error by their fourth moment.
                let random = Random::new(5);
                let squares = (0..8192).map(|i| weight(random.point(i)).unwrap_or(0.0));
                let squares: Vec<f64> = squares.map(|w| (w / albedo - 1.0).powi(2)).collect();
                let found = squares.iter().sum::<f64>() / 8192.0;
                let fourth: f64 = squares.iter().map(|s| (s - found).powi(2)).sum();
                let error = fourth.sqrt() / 8192.0;
                // Cells at the horizon are drawn a few times in all, and their weights are off by as much as themselves.
                let most = 5.0 * error + 0.1 * variance + 1e-3;
                // Where f cos θ_i does not vanish at the horizon grazing views have weights without a largest one: few draws find
                // less than there is.
                let least = if theta < 80.0 { variance - most } else { 0.0 };
                assert!(
                    (least..variance + most).contains(&found),
                    "{what}: {found} ± {error}, not {variance}"
                );
            }
        }
    }
}

#[test]
fn threads_do_not_matter() {
    let brdf = model("ggx", "alpha = [0.1, 0.4]");
    let draws = |threads: usize| -> Vec<_> {
        let settings = SamplerSettings {
            views: 5,
            azimuths: 7,
            ..SamplerSettings::default()
        };
        let sampler = on_threads(threads, || TabulatedSampler::new(&*brdf, settings).unwrap());
        let random = Random::new(1);
        let omega_o = |i: u64| Direction::from_spherical(0.02 * i as f64, i as f64);
        let drawn = (0..64).map(|i| sampler.draw(omega_o(i), random.point(i)));
        drawn
            .map(|drawn| drawn.map(|(d, p)| (d.vector(), p)))
            .collect()
    };
    assert_eq!(draws(1), draws(2));
}

#[test]
fn what_no_table_can_be_is_refused() {
    let brdf = model("lambert", "");
    for (cells, views, says) in [
        (
            [1, 8],
            8,
            "cells = 1: allowed is a whole number from 2 to 4096",
        ),
        (
            [8, 5000],
            8,
            "cells = 5000: allowed is a whole number from 2 to 4096",
        ),
        (
            [8, 8],
            0,
            "views = 0: allowed is a whole number from 1 to 4096",
        ),
    ] {
        let settings = SamplerSettings {
            cells,
            views,
            ..SamplerSettings::default()
        };
        let refused = TabulatedSampler::new(&*brdf, settings).unwrap_err();
        assert_eq!(refused.to_string(), says);
    }
    for cosine in [-0.1, 1.0, f64::NAN] {
        let settings = SamplerSettings {
            cosine,
            ..SamplerSettings::default()
        };
        let refused = TabulatedSampler::new(&*brdf, settings).unwrap_err();
        assert!(
            refused.to_string().contains("a number in [0, 0.99]"),
            "{refused}"
        );
    }
    // Without light there is a density all the same.
    let black = model("lambert", "albedo = 0.0");
    let sampler = TabulatedSampler::new(&*black, SamplerSettings::default()).unwrap();
    let up = Direction::from_spherical(0.3, 0.0);
    assert!(sampler.draw(up, [0.5, 0.5]).unwrap().1 > 0.0);
    assert!(importance::relative_variance(&*black, &sampler, up).is_none());
    assert!(
        sampler
            .draw(Direction::from_spherical(1.6, 0.0), [0.5, 0.5])
            .is_none()
    );
}
