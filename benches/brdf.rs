//! Models and tables, at random pairs.

use super::{model, pairs};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, write_merl};
use gonio::brdf::{Brdf, Channels, Presence};
use std::sync::LazyLock;

/// Times one thread on 100 000 pairs.
fn batch(bencher: Bencher, brdf: &dyn Brdf) {
    let pairs = pairs(100_000);
    let mut out = vec![0.0; pairs.len() * brdf.channels().count()];
    let mut presence = vec![Presence::Present; pairs.len()];
    bencher
        .counter(ItemsCount::new(pairs.len()))
        .bench_local(|| brdf.eval_batch(black_box(&pairs), &mut out, &mut presence));
}

#[divan::bench(args = [
    "alpha = 0.3",
    "alpha = [0.1, 0.4]",
    "alpha = 0.3\nfresnel = { kind = \"none\" }",
])]
fn ggx(bencher: Bencher, text: &str) {
    batch(bencher, &*model("ggx", text));
}

/// The bytes of a full-size table, of our own writer.
static TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut bytes = Vec::new();
    let ggx = model("ggx", "alpha = 0.1");
    write_merl(&*ggx, MerlGrid::RECIPROCAL, &mut bytes).expect("a table");
    bytes
});

fn merl(bencher: Bencher, channels: Channels, interpolation: Interpolation) {
    let table = Merl::read(TABLE.as_slice(), channels).expect("the same table");
    batch(bencher, &table.with_interpolation(interpolation));
}

#[divan::bench(args = [Interpolation::Nearest, Interpolation::Trilinear])]
fn merl_luminance(bencher: Bencher, interpolation: Interpolation) {
    merl(bencher, Channels::Luminance, interpolation);
}

#[divan::bench(args = [Interpolation::Nearest, Interpolation::Trilinear])]
fn merl_rgb(bencher: Bencher, interpolation: Interpolation) {
    merl(bencher, Channels::Rgb, interpolation);
}
