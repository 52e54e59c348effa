"""Mitsuba 3 opens the tables that gonio writes: values, and the densities it draws samples from."""

import csv

import numpy as np
import pytest

mi = pytest.importorskip("mitsuba")

COUNT = 1000
HIGHEST = np.radians(80)

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


def values(table, light, sensor):
    """f_r by Mitsuba, (pairs, 3)."""
    bsdf = mi.load_dict({"type": "measured", "filename": str(table)})
    si, context = mi.SurfaceInteraction3f(), mi.BSDFContext()
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


@pytest.fixture(scope="module", autouse=True)
def variant():
    mi.set_variant("scalar_rgb")


@pytest.mark.parametrize("alpha", [1.0, 0.3, 0.1])
def test_a_written_table_has_the_values(gonio, tmp_path, alpha):
    config = scene(tmp_path, f'kind = "ggx"\nalpha = {alpha}')
    table = tmp_path / "table.bsdf"
    gonio("tabulate", config, "-o", table)
    light, sensor = pairs(alpha)
    exact = truth(gonio, tmp_path, config, light, sensor, "--set", "channels=rgb")
    found = errors(exact, values(table, light, sensor), light)
    for nrmse, median in found:
        assert nrmse < 2e-3 and median < 1e-3
