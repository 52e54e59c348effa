//! Checks of the keys of an acquisition: ranges, and keys that exclude each other.

use super::checks::{below, distinct, refuse_empty, refused};
use super::choices::MAX_BUDGET;
use super::config::Config;
use super::keypath::KeyPath;
use super::kind::QuantityGroup;
use crate::brdf::Channels;
use crate::error::{Error, ParameterError, in_left_open};
use crate::metrics::{self, MetricsSpec};

/// Lists of whole numbers, each in range and each once.
pub(super) struct Numbers {
    pub seeds: Vec<u64>,
    pub budgets: Vec<usize>,
    pub readings: Vec<usize>,
}

impl Numbers {
    /// Checks them and `minutes`, and that there is at least one seed and one allowance.
    pub(super) fn of(config: &Config<'_>) -> Result<Self, Error> {
        let (source, scalars) = (config.source, &config.scalars);
        let convert = |key: &str, i: usize, value: i64, max: i64, min: i64| {
            if (min..=max).contains(&value) {
                return Ok(value);
            }
            let path = KeyPath::of(key).index(i);
            let allowed = format!("a whole number from {min} to {max}");
            Err(refused(source, &path, value, allowed))
        };
        let mut seeds = Vec::new();
        for (i, &seed) in scalars.seeds.iter().enumerate() {
            seeds.push(convert("seeds", i, seed, i64::MAX, 0)?.unsigned_abs());
        }
        distinct(source, "seeds", &seeds, u64::to_string)?;
        let counts = |key: &str, list: &[i64]| {
            let mut counts = Vec::new();
            for (i, &count) in list.iter().enumerate() {
                // In range of usize by its limit.
                counts.push(convert(key, i, count, MAX_BUDGET as i64, 1)? as usize);
            }
            if !counts.is_empty() {
                distinct(source, key, &counts, usize::to_string)?;
            }
            Ok::<_, Error>(counts)
        };
        let budgets = counts("budgets", &scalars.budgets)?;
        let readings = counts("readings", &scalars.readings)?;
        let minutes = &scalars.minutes;
        if readings.is_empty() && minutes.is_empty() {
            refuse_empty(source, "budgets", &budgets)?;
        }
        if !minutes.is_empty() {
            distinct(source, "minutes", minutes, f64::to_string)?;
        }
        for (i, &m) in minutes.iter().enumerate() {
            let path = KeyPath::of("minutes").index(i);
            in_left_open(&path.to_string(), m, 0.0, MAX_MINUTES)
                .map_err(|e| source.error_at(&path, e))?;
        }
        for (key, used) in [
            ("readings", !readings.is_empty()),
            ("minutes", !minutes.is_empty()),
        ] {
            if used && config.instruments.is_empty() {
                let message = format!(
                    "{key} are those of an instrument, and there is none; allowed: with an \
                     [[instrument]] only"
                );
                return Err(source.error_at(&KeyPath::of(key), message));
            }
        }
        Ok(Self {
            seeds,
            budgets,
            readings,
        })
    }
}

/// The longest time a schedule may be asked to take: a year.
pub(crate) const MAX_MINUTES: f64 = 525_600.0;

pub(super) fn check_metrics(config: &Config<'_>) -> Result<(), Error> {
    let base = KeyPath::of("metrics");
    let refuse = |e: ParameterError| {
        // Keys that only fail together are listed with commas; the first one is a place.
        let first = e.key.split(',').next().unwrap_or(&e.key).to_owned();
        config
            .source
            .error_at(&below(&base, &first), format!("metrics.{e}"))
    };
    config.metrics.check().map_err(refuse)?;
    // A window that keeps next to nothing shows in the first few pairs.
    let few = MetricsSpec {
        pairs: config.metrics.pairs.min(16),
        ..config.metrics.clone()
    };
    for &measure in &config.scalars.measures {
        metrics::test_pairs(measure, &few).map_err(refuse)?;
    }
    Ok(())
}

/// True if moments are to be compared.
pub(super) fn check_quantities(config: &Config<'_>) -> Result<bool, Error> {
    let source = config.source;
    let wanted = config.scalars.quantities.as_deref().unwrap_or_default();
    if !wanted.is_empty() {
        distinct(source, "quantities", wanted, |q| q.name())?;
    }
    let wanted = wanted.contains(&QuantityGroup::Moments);
    let Some(moments) = &config.moments else {
        return Ok(wanted);
    };
    if !wanted {
        let message = "moments has keys for a quantity that is not asked for; allowed: with \
                       quantities = [\"moments\"] only";
        return Err(source.error_at(&KeyPath::of("moments"), message));
    }
    moments.check(source)?;
    let path = KeyPath::of("moments").key("channels");
    match moments.spec.channels.as_slice() {
        [channel]
            if config.scalars.channels == Channels::Rgb
                || channel.needs() == Channels::Luminance =>
        {
            Ok(true)
        }
        [channel] => {
            let message = format!(
                "{path} = [{:?}] needs channels = \"rgb\"; allowed: luminance, or that",
                channel.name()
            );
            Err(source.error_at(&path, message))
        }
        several => {
            let message = format!(
                "{path} has {} channels; allowed: one, which the columns of results are about",
                several.len()
            );
            Err(source.error_at(&path, message))
        }
    }
}

pub(super) fn check_output(config: &Config<'_>) -> Result<(), Error> {
    let needed = [
        (
            "slices",
            config.output.slices,
            ["draw pictures", "pictures"],
            cfg!(feature = "pictures"),
        ),
        (
            "parquet",
            config.output.parquet,
            ["write Parquet", "parquet"],
            cfg!(feature = "parquet"),
        ),
    ];
    for (key, is_asked, [work, feature], is_there) in needed {
        if is_asked && !is_there {
            let path = KeyPath::of("output").key(key);
            let message = format!(
                "{path} = true: this build of gonio cannot {work}: it lacks the feature {feature} (cargo install --path . --features {feature})"
            );
            return Err(config.source.error_at(&path, message));
        }
    }
    Ok(())
}
