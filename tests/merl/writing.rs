//! BRDFs out: what a cell holds, what is refused, and that the bytes are always the same.

use super::common::made;
use super::{cells, first, ulps};
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, Nodes, write_merl};
use gonio::brdf::measured::{TableError, TabulatedSpec};
use gonio::brdf::{self, Brdf, BrdfSpec, Channels, Lambert, LambertSpec, Presence, Spectrum};
use gonio::formats::{self, Tabulation};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::registry;
use std::path::Path;

/// A smooth function with the symmetries asked for and no other; missing where `hole` says.
struct Smooth {
    channels: Channels,
    symmetry: Symmetry,
    hole: fn(&DirectionPair) -> bool,
}

impl Smooth {
    fn new(channels: Channels, reciprocal: bool) -> Self {
        let symmetry = Symmetry {
            isotropic: true,
            reciprocal,
            bilateral: false,
        };
        let hole = |_: &_| false;
        Self {
            channels,
            symmetry,
            hole,
        }
    }

    fn values(&self, pair: &DirectionPair) -> [f64; 3] {
        let (h, k) = (pair.half(), pair.back());
        let turn = h.cross(k).z;
        // Even in k, changed by a mirror; the second line is odd in k.
        let even = 0.4 + 0.2 * h.z + 0.1 * turn * k.z;
        let odd = 0.05 * turn + 0.1 * k.z;
        let f = if self.symmetry.reciprocal {
            even
        } else {
            even + odd
        };
        [f, f * f, 1.0 - f]
    }
}

impl Brdf for Smooth {
    fn channels(&self) -> &Channels {
        &self.channels
    }
    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }
    fn conserves_energy(&self) -> bool {
        false
    }
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        if (self.hole)(pair) {
            return Presence::Missing;
        }
        if pair.is_above_horizon() {
            out.copy_from_slice(&self.values(pair)[..self.channels.count()]);
        }
        Presence::Present
    }
}

fn written(brdf: &dyn Brdf, grid: MerlGrid) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_merl(brdf, grid, &mut bytes).unwrap();
    assert_eq!(bytes.len() as u64, grid.file_len());
    bytes
}

/// Writes, reads and compares every node; returns the worst distance in ulp.
fn round_trip(brdf: &dyn Brdf, grid: MerlGrid) -> f64 {
    let channels = brdf.channels();
    let table = Merl::read(written(brdf, grid).as_slice(), channels.clone()).unwrap();
    let (mut worst, mut held) = (0.0f64, 0);
    for cell in cells(grid) {
        let (got, pair) = (table.value(cell), grid.pair(cell));
        assert_eq!(got.is_some(), pair.is_some(), "{cell:?}");
        let (Some(got), Some(pair)) = (got, pair) else {
            continue;
        };
        held += 1;
        let mut want = [0.0; 3];
        let n = channels.count();
        assert_eq!(brdf.eval(&pair, &mut want[..n]), Presence::Present);
        for (&got, &want) in got.iter().zip(&want[..n]) {
            worst = worst.max(ulps(got, want));
        }
    }
    assert!(held as f64 > 0.75 * grid.cells() as f64, "{held}");
    worst
}

#[test]
fn what_is_written_is_read_back() {
    let lambert = |channels| Lambert::new(Spectrum::Rgb([0.9, 0.5, 0.2]), channels);
    // Luminance adds the roundings of three weights and two sums.
    for (channels, ulp) in [(Channels::Rgb, 2.0), (Channels::Luminance, 3.0)] {
        let worst = [
            round_trip(&lambert(channels.clone()), MerlGrid::RECIPROCAL),
            round_trip(&Smooth::new(channels.clone(), true), MerlGrid::RECIPROCAL),
            round_trip(&Smooth::new(channels.clone(), false), MerlGrid::FULL),
        ];
        assert!(worst.iter().all(|&w| w <= ulp), "{channels:?}: {worst:?}");
    }
}

/// Whatever its cells hold: at the horizon, below it, beside cells without data.
#[test]
fn a_copy_of_a_table_has_its_cells() {
    for grid in [MerlGrid::RECIPROCAL, MerlGrid::FULL] {
        let mut bytes = written(
            &Smooth::new(Channels::Rgb, grid == MerlGrid::RECIPROCAL),
            grid,
        );
        for (i, cell) in bytes[12..].as_chunks_mut::<8>().0.iter_mut().enumerate() {
            let i = i % grid.cells();
            let value = if i % 7 == 3 {
                -1.0
            } else {
                1.0 + (i % 1000) as f64
            };
            *cell = value.to_le_bytes();
        }
        let table = Merl::read(bytes.as_slice(), Channels::Rgb).unwrap();
        let copy = written(&table, grid);
        assert_eq!(copy.len(), bytes.len());
        let numbers = |bytes: &[u8]| -> Vec<f64> {
            let cells = bytes[12..].as_chunks().0.iter();
            cells.map(|b| f64::from_le_bytes(*b)).collect()
        };
        for (copy, cell) in numbers(&copy).into_iter().zip(numbers(&bytes)) {
            assert!((copy - cell).abs() <= 1e-15 * cell.abs(), "{copy} {cell}");
        }
    }
}

#[test]
fn missing_data_stay_missing() {
    let mut smooth = Smooth::new(Channels::Rgb, true);
    smooth.hole = |pair| pair.separation() < 0.2;
    let table = Merl::read(
        written(&smooth, MerlGrid::RECIPROCAL).as_slice(),
        Channels::Rgb,
    )
    .unwrap()
    .with_interpolation(Interpolation::Nearest);
    for plane in table.planes() {
        assert_eq!(plane[0], -1.0);
        assert!(plane.iter().all(|&v| v >= 0.0 || v == -1.0));
    }
    assert_eq!(table.value([10, 5, 7]), None);
    assert!(table.value([10, 6, 7]).is_some());
}

#[test]
fn broken_promises_are_written_as_missing() {
    // The last is finite, but not once it is divided by the scale of the file.
    for broken in [-0.5, f64::NAN, f64::INFINITY, 1e306] {
        let brdf = made(Symmetry::FULL, |_| Some([1.0, broken, 1.0]));
        let bytes = written(&brdf, MerlGrid::RECIPROCAL);
        let (header, body) = bytes.split_at(12);
        assert_eq!(header.len(), 12);
        assert!(body.chunks(8).all(|b| b == (-1.0f64).to_le_bytes()));
    }
}

#[test]
fn a_table_refuses_what_it_cannot_hold() {
    let mut brdf = Smooth::new(Channels::Luminance, false);
    let refusal = |brdf: &Smooth, grid| write_merl(brdf, grid, &mut Vec::new()).unwrap_err();
    let error = refusal(&brdf, MerlGrid::RECIPROCAL);
    assert!(matches!(error, TableError::Unsuited(why) if why.contains("90×90×360 can hold it")));
    brdf.symmetry = Symmetry::ORTHOTROPIC;
    for grid in [MerlGrid::RECIPROCAL, MerlGrid::FULL] {
        let error = refusal(&brdf, grid);
        assert!(matches!(error, TableError::Unsuited(why) if why.contains("not isotropic")));
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let brdf = Smooth::new(Channels::Rgb, true);
    let on = |threads| crate::common::on_threads(threads, || written(&brdf, MerlGrid::RECIPROCAL));
    assert!(on(1) == on(2));
}

#[test]
fn a_file_is_whole_or_not_there() {
    let dir = tempfile::tempdir().unwrap();
    let names = || {
        let mut names: Vec<_> = std::fs::read_dir(dir.path())
            .unwrap()
            .map(|e| e.unwrap().file_name())
            .collect();
        names.sort();
        names
    };
    let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
    let path = dir.path().join("grey.binary");
    let write = |brdf: &dyn Brdf, path: &Path| {
        formats::MERL.write_table.unwrap()(brdf, Tabulation::default(), path)
    };
    write(&grey, &path).unwrap();
    assert!(std::fs::read(&path).unwrap() == written(&grey, MerlGrid::RECIPROCAL));
    assert_eq!(names(), ["grey.binary"]);

    let folder = dir.path().join("folder");
    std::fs::create_dir_all(folder.join("full")).unwrap();
    for target in [folder, dir.path().join("nowhere/a.binary"), "/".into()] {
        let error = write(&grey, &target).unwrap_err();
        assert!(matches!(error, formats::TableError::Io(_)), "{error}");
    }
    let mut brushed = Smooth::new(Channels::Luminance, false);
    brushed.symmetry = Symmetry::ORTHOTROPIC;
    write(&brushed, &dir.path().join("b")).unwrap_err();
    assert_eq!(names(), ["folder", "grey.binary"]);

    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("disk full"))
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let error = write_merl(&grey, MerlGrid::RECIPROCAL, &mut Full).unwrap_err();
    assert_eq!(error.to_string(), "no access to this MERL table: disk full");
}

#[test]
fn a_config_tabulates_another_material() {
    let entry = brdf::all()
        .into_iter()
        .find(|e| e.kind == "tabulated")
        .unwrap();
    let text = "format = 'merl'\ninterpolation = 'nearest'\nof = { kind = 'lambert', albedo = [0.9, 0.5, 0.2] }";
    let spec = registry::read_text(&entry, text).unwrap();
    assert_eq!(spec.label(), "merl-of-lambert");
    assert!(spec.tables().files.is_empty());
    // What holds the material holds its table.
    let of = "{ kind = 'tabulated', of = { kind = 'lambert' } }";
    for holder in [
        format!("kind = 'retro-reflective'\nof = {of}"),
        format!("kind = 'sum'\ncomponent = [{{ weight = 0.5, brdf = {of} }}]"),
    ] {
        let holder = brdf::read(toml::de::DeTable::parse(&holder).unwrap()).unwrap();
        assert_eq!(holder.tables(), spec.tables());
        assert!(holder.tables().channel_bytes >= 8 * MerlGrid::RECIPROCAL.cells());
    }
    spec.check(&Channels::Rgb).unwrap();
    let resolved = spec.resolved();
    let text = resolved.to_string();
    let again = brdf::read(toml::de::DeTable::parse(&text).unwrap()).unwrap();
    assert_eq!(again.resolved(), resolved);
    for channels in [Channels::Rgb, Channels::Luminance] {
        let table = spec.build(channels.clone()).unwrap();
        assert_eq!(*table.channels(), channels);
        assert_eq!(table.symmetry(), Symmetry::FULL);
        let lambert = Lambert::new(Spectrum::Rgb([0.9, 0.5, 0.2]), channels);
        let pair = DirectionPair::from_spherical(0.4, 0.1, 0.9, 2.0);
        let (got, want) = (first(table.as_ref(), &pair), first(&lambert, &pair));
        assert!(ulps(got.unwrap(), want.unwrap()) <= 3.0);
    }

    let message = |text: &str| registry::read_text(&entry, text).unwrap_err().message;
    assert!(message("").contains("of is missing"));
    assert!(message("of = { kind = 'lambert', albdeo = 1 }").contains("albdeo"));
    assert!(message("of = { kind = 'velvet-underground' }").contains("velvet-underground"));
    assert!(message("of = { kind = 'lambert' }\nsize = 3").contains("size"));
    let too_bright =
        registry::read_text(&entry, "of = { kind = 'lambert', albedo = 2.0 }").unwrap();
    assert!(too_bright.check(&Channels::Rgb).is_err() && too_bright.build(Channels::Rgb).is_err());
}

#[test]
fn a_material_that_does_not_fit_is_the_config_s_fault() {
    #[derive(Debug)]
    struct Brushed(LambertSpec);
    impl BrdfSpec for Brushed {
        fn resolved(&self) -> toml::Table {
            self.0.resolved()
        }
        fn label(&self) -> String {
            "brushed".into()
        }
        fn check(&self, _channels: &Channels) -> Result<(), brdf::BuildError> {
            Ok(())
        }
        fn tables(&self) -> brdf::Tables {
            brdf::Tables::NONE
        }
        fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, brdf::BuildError> {
            let mut brdf = Smooth::new(channels, true);
            brdf.symmetry = Symmetry::ORTHOTROPIC;
            Ok(Box::new(brdf))
        }
    }
    let of = Box::new(Brushed(LambertSpec::default()));
    let spec = TabulatedSpec::merl(of, Interpolation::Trilinear, Nodes::Centre);
    let error = spec.build(Channels::Luminance).err().unwrap();
    assert!(matches!(error, brdf::BuildError::Parameter(_)));
    assert!(error.to_string().contains("not isotropic"), "{error}");
}
