"""Mitsuba 3 opens the tables that gonio writes: values, and the densities it draws samples from."""

import csv
import math

import pytest
from conftest import lack, needs, optional

np, mi = optional("numpy"), optional("mitsuba")
pytestmark = needs("numpy", "mitsuba")

COUNT = 1000
HIGHEST = math.radians(80)
NEEDLE = '''kind = "sum"
component = [
    { weight = 1, brdf = { kind = "lambert", albedo = 0.3 } },
    { weight = 0.02, brdf = { kind = "ggx", alpha = 0.01 } },
]'''

def directions(rng, mirrors=None, width=None):
    """COUNT directions up to 80°, cosine-distributed, or around the mirror directions of others."""
    if mirrors is None:
        sin = np.sqrt(rng.random(COUNT)) * np.sin(HIGHEST)
        theta, phi = np.arcsin(sin), 2 * np.pi * rng.random(COUNT)
        return np.stack([sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)], 1)
    found = mirrors * [-1, -1, 1]
    result = np.empty_like(found)
    for i, mirror in enumerate(found):
        while True:
            # A half vector that tilts by a GGX of that width.
            u = rng.random()
            tan = width * np.sqrt(u / (1 - u))
            azimuth = 2 * np.pi * rng.random()
            m = np.array([tan * np.cos(azimuth), tan * np.sin(azimuth), 1.0])
            m /= np.linalg.norm(m)
            light = mirror * [-1, -1, 1]
            out = 2 * light.dot(m) * m - light
            if out[2] > np.cos(HIGHEST):
                result[i] = out
                break
    return result


def pairs(width):
    """Cosine pairs and lobe pairs, (2 COUNT, 3) each."""
    rng = np.random.default_rng(1)
    lights = [directions(rng), directions(rng)]
    sensors = [directions(rng), directions(rng, lights[1], width)]
    return np.concatenate(lights), np.concatenate(sensors)


def degrees(d):
    return np.degrees(np.arccos(d[:, 2])), np.degrees(np.arctan2(d[:, 1], d[:, 0]))


def truth(gonio, folder, config, light, sensor, *options):
    """f_r by gonio, (pairs, channels)."""
    poses = np.stack([*degrees(light), *degrees(sensor)], 1)
    head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg"
    np.savetxt(folder / "poses.csv", poses, "%.17g", delimiter=",", header=head, comments="")
    readings = folder / "readings.csv"
    gonio("measure", folder / "poses.csv", "--config", config, "-o", readings, "--force", *options)
    with open(readings) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = [n for n in rows[0] if n in ("r", "g", "b", "value") or n.startswith("value_")]
    return np.array([[float(row[n]) for n in names] for row in rows])


def values(table, light, sensor, nm=None):
    """f_r by Mitsuba, (pairs, 3) or at wavelengths."""
    bsdf = mi.load_dict({"type": "measured", "filename": str(table)})
    si, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
    if nm is not None:
        si.wavelengths = nm
    found = []
    for i, o in zip(light, sensor):
        si.wi = mi.Vector3f(i)
        found.append(np.array(bsdf.eval(context, si, mi.Vector3f(o))).ravel() / o[2])
    return np.array(found)


def errors(truth, copy, light):
    """nrmse and median relative error of cosine pairs and of lobe pairs."""
    found = []
    for part in (slice(None, COUNT), slice(COUNT, None)):
        cos = light[part, 2:]
        t, c = truth[part] * cos, copy[part] * cos
        away = np.sqrt(np.mean((t - c) ** 2) / np.mean(t**2))
        found.append((away, np.median(np.abs(t - c) / np.abs(t))))
    return found


def scene(folder, material):
    config = folder / "scene.toml"
    config.write_text(f"[[material]]\n{material}\n")
    return config


def written(gonio, folder, config, *options):
    table = folder / "table.bsdf"
    gonio("tabulate", config, "-o", table, *options)
    return table


@pytest.fixture(autouse=True)
def variant():
    mi.set_variant("scalar_rgb")


@pytest.mark.parametrize("alpha", [1.0, 0.3, 0.1])
def test_a_written_table_has_the_values(gonio, tmp_path, alpha):
    config = scene(tmp_path, f'kind = "ggx"\nalpha = {alpha}')
    table = written(gonio, tmp_path, config)
    light, sensor = pairs(alpha)
    exact = truth(gonio, tmp_path, config, light, sensor, "--set", "channels=rgb")
    found = errors(exact, values(table, light, sensor), light)
    for nrmse, median in found:
        assert nrmse < 2e-3 and median < 1e-3


@pytest.mark.parametrize(
    "material, width",
    [
        ('kind = "ggx"\nalpha = [0.2, 0.5]', 0.3),
        (NEEDLE, 0.02),
    ],
)
def test_both_read_the_same(gonio, tmp_path, material, width):
    """Brushed metal, and a needle on a matte base: gonio and Mitsuba see one table."""
    table = written(gonio, tmp_path, scene(tmp_path, material))
    config = scene(tmp_path, f'kind = "rgl"\npath = "{table}"')
    light, sensor = pairs(width)
    ours = truth(gonio, tmp_path, config, light, sensor, "--set", "channels=rgb")
    theirs = values(table, light, sensor)
    assert np.all(np.abs(ours - theirs) <= 1e-4 * np.abs(ours) + 1e-7 * ours.max())


def test_wavelengths_are_read_in_spectral_variants(gonio, tmp_path):
    nm = [400, 450, 500, 550, 600, 650, 700]
    material = '''kind = "sum"
component = [
    { weight = 1, brdf = { kind = "lambert", albedo = { nm = [400, 700], values = [0.1, 0.5] } } },
    { weight = 0.4, brdf = { kind = "ggx", alpha = 0.3 } },
]'''
    channels = ("--set", f"channels={{ wavelengths_nm = {nm} }}")
    config = scene(tmp_path, material)
    table = written(gonio, tmp_path, config, *channels)
    light, sensor = pairs(0.3)
    exact = truth(gonio, tmp_path, config, light, sensor, *channels)
    mi.set_variant("scalar_spectral")
    # Four wavelengths are asked at once.
    found = values(table, light, sensor, nm[1:5])
    for nrmse, median in errors(exact[:, 1:5], found, light):
        assert nrmse < 2e-3 and median < 1e-3


@pytest.mark.parametrize("degrees", [5, 30, 60, 80])
def test_samples_have_the_density_that_is_said(gonio, tmp_path, degrees):
    """Pearson's chi-square test of Mitsuba, 64 x 64 densities in a cell of its histogram."""
    try:
        mi.set_variant("llvm_ad_rgb")
    except ImportError as e:
        lack(f"no LLVM for Mitsuba: {e}"[:120])
    import drjit as dr
    from mitsuba.chi2 import ChiSquareTest, SphericalDomain

    table = written(gonio, tmp_path, scene(tmp_path, 'kind = "ggx"\nalpha = 0.3'))
    bsdf, context = mi.load_dict({"type": "measured", "filename": str(table)}), mi.BSDFContext()
    theta = np.radians(degrees)
    light = [float(np.sin(theta)), 0.0, float(np.cos(theta))]

    def interaction(count):
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f(light)
        return si

    def sample(u):
        drawn, weight = bsdf.sample(context, interaction(dr.width(u)), u[0], mi.Point2f(u[1], u[2]))
        # Those below the horizon have no weight.
        return drawn.wo, dr.select(dr.max(weight) > 0, 1.0, 0.0)

    def pdf(sensor):
        return bsdf.pdf(context, interaction(dr.width(sensor)), sensor)

    test = ChiSquareTest(SphericalDomain(), sample, pdf, sample_dim=3, res=51, ires=64)
    assert test.run(0.01), test.messages
