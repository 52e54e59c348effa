"""Radiance opens the tensor trees that gonio writes, and fits its readings; pyradiance has the programs."""

import csv
import json
import math
import os
import pathlib
import subprocess
import sys

import pytest
from conftest import needs, optional

np, pyradiance = optional("numpy"), optional("pyradiance")
pytestmark = needs("numpy", "pyradiance")

if pyradiance:
    BIN = pathlib.Path(pyradiance.__file__).parent / "bin"
    os.environ["RAYPATH"] = f".:{BIN.parent / 'lib'}"
COUNT = 1000
HIGHEST = math.radians(80)


def radiance(program, *args, cwd, stdin=None):
    """Runs a program of Radiance and returns what it prints."""
    done = subprocess.run([BIN / program, *map(str, args)], cwd=cwd, input=stdin, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def scene(folder, material, channels="luminance"):
    config = folder / "scene.toml"
    config.write_text(f'channels = "{channels}"\n\n[[material]]\n{material}\n')
    return config


def pairs():
    """COUNT pairs up to 80°, cosine-distributed, in degrees: theta_i, phi_i, theta_o, phi_o."""
    rng = np.random.default_rng(1)
    theta = lambda: np.degrees(np.arcsin(np.sqrt(rng.random(COUNT)) * np.sin(HIGHEST)))
    phi = lambda: 360 * rng.random(COUNT)
    return np.stack([theta(), phi(), theta(), phi()], 1)


def truth(gonio, folder, config, poses):
    """f_r by gonio, a column for each channel."""
    head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg"
    np.savetxt(folder / "poses.csv", poses, "%.17g", delimiter=",", header=head, comments="")
    readings = folder / "readings.csv"
    gonio("measure", folder / "poses.csv", "--config", config, "-o", readings, "--force")
    with open(readings) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = ["value"] if "value" in rows[0] else ["value_r", "value_g", "value_b"]
    return np.array([[float(row[name]) for name in names] for row in rows])


# A process of its own for each file: the library must not load one twice.
QUERY = """
import json, sys
from pyradiance import bsdf
table = bsdf.load_file(sys.argv[1])
poses = json.load(sys.stdin)
print(json.dumps([list(bsdf.query(table, *pose)) for pose in poses]))
"""


def query(table, poses):
    """X, Y, Z of f_r by Radiance."""
    done = subprocess.run(
        [sys.executable, "-c", QUERY, table], input=json.dumps(poses.tolist()), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return np.array(json.loads(done.stdout))


def nrmse(exact, found, poses):
    cos = np.cos(np.radians(poses[:, 0]))
    return np.sqrt(np.mean(((exact - found) * cos) ** 2) / np.mean((exact * cos) ** 2))


def albedo(gonio, folder, config, theta):
    """Directional albedo (hemispherical reflectance) of each channel of a matte to satin material, by midpoints."""
    sin2 = (np.arange(200) + 0.5) / 200
    phi = np.arange(100) * 3.6
    grid = [[theta, 180, t, p] for t in np.degrees(np.arcsin(np.sqrt(sin2))) for p in phi]
    return np.pi * truth(gonio, folder, config, np.array(grid)).mean(axis=0)


def test_a_tree_has_the_values(gonio, tmp_path):
    config = scene(tmp_path, 'kind = "ggx"\nalpha = 0.3')
    tree = tmp_path / "tree.xml"
    gonio("tabulate", config, "-o", tree)
    poses = pairs()
    found = nrmse(truth(gonio, tmp_path, config, poses)[:, 0], query(tree, poses)[:, 1], poses)
    print(f"nrmse {found:.4f}, {tree.stat().st_size / 1e6:.2f} MB")
    assert found <= 0.025


# Weights of R, G, B in the luminance of Radiance (`color.h`).
WEIGHTS = [0.265, 0.670, 0.065]


@pytest.mark.parametrize(
    "channels, material",
    [
        ("luminance", 'kind = "ggx"\nalpha = 0.3'),
        ("rgb", 'kind = "lambert"\nalbedo = [0.6, 0.3, 0.1]'),
        ("rgb", 'kind = "phong"\nrho_d = [0.05, 0.3, 0.4]\nrho_s = 0.2\nexponent = 20'),
        ("rgb", 'kind = "ggx"\nalpha = 0.3\nfresnel = { kind = "schlick", f0 = [0.9, 0.6, 0.2] }'),
    ],
)
def test_a_furnace_has_the_albedo(gonio, tmp_path, channels, material):
    """Below a sky of radiance 1 a surface has the radiance of its albedo, in R, G, B as in gonio."""
    config = scene(tmp_path, material, channels)
    gonio("tabulate", config, "-o", tmp_path / "tree.xml")
    (tmp_path / "scene.rad").write_text(
        "void glow white\n0\n0\n4 1 1 1 0\nwhite source sky\n0\n0\n4 0 0 1 360\n"
        "void BSDF sample\n6 0 tree.xml 0 1 0 .\n0\n0\n"
        "sample polygon plane\n0\n0\n12 -1 -1 0 1 -1 0 1 1 0 -1 1 0\n"
    )
    octree = radiance("oconv", "scene.rad", cwd=tmp_path)
    (tmp_path / "scene.oct").write_bytes(octree)
    rays = 400
    for theta in (0, 30, 60):
        sin, cos = np.sin(np.radians(theta)), np.cos(np.radians(theta))
        ray = f"{sin} 0 {cos} {-sin} 0 {-cos}\n" * rays
        options = ["-h", "-ab", "1", "-ad", "1024", "-as", "0", "-aa", "0", "-lw", "1e-5", "-ss", "16", "-st", "0"]
        out = radiance("rtrace", *options, "scene.oct", cwd=tmp_path, stdin=ray.encode())
        found = np.array(out.split(), float).reshape(-1, 3).mean(axis=0)
        exact = albedo(gonio, tmp_path, config, theta) * np.ones(3)
        print(f"{theta}°: {found.round(5)}, exact {exact.round(5)}")
        assert found @ WEIGHTS == pytest.approx(exact @ WEIGHTS, rel=5e-3)
        assert found == pytest.approx(exact, rel=2e-2)


def test_a_tree_is_reciprocal(gonio, tmp_path):
    config = scene(tmp_path, 'kind = "ggx"\nalpha = 0.3')
    gonio("tabulate", config, "-o", tmp_path / "tree.xml")
    told = radiance("checkBSDF", "tree.xml", cwd=tmp_path).decode()
    _, errors = told.split("Reciprocity Error (min avg max %)")
    least, mean, most = (float(x) for x in errors.split("Interior Refl")[1].split()[:3])
    print(f"reciprocity: mean error {mean} %")
    assert 0 <= mean <= 1.5


def lobe(theta_i):
    """Rings about the mirror direction, in degrees, where a lobe of roughness .3 is."""
    mirror = np.radians(theta_i)
    for radius in np.linspace(0.117, 1, 9):
        for azimuth in np.radians(np.arange(3, 360, 15)):
            along, across = np.sin(radius) * np.cos(azimuth), np.sin(radius) * np.sin(azimuth)
            x = -np.cos(radius) * np.sin(mirror) + along * np.cos(mirror)
            z = np.cos(radius) * np.cos(mirror) + along * np.sin(mirror)
            if z > 0.03:
                yield [np.degrees(np.arccos(z)), np.degrees(np.arctan2(across, x)) % 360]


def test_readings_become_a_scattering_function(gonio, tmp_path):
    """pabopto2bsdf fits what gonio measured; its hemispherical reflectance is that of the material."""
    config = scene(tmp_path, 'kind = "ggx"\nalpha = 0.3')
    poses = []
    for theta_i in range(0, 81, 10):
        for theta in np.arange(0, 88, 2.5):
            around = max(1, round(72 * np.sin(np.radians(theta))))
            poses += [[theta_i, 0, theta, 360 * k / around] for k in range(around)]
        poses += [[theta_i, 0, *sensor] for sensor in lobe(theta_i)]
    head = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg"
    np.savetxt(tmp_path / "poses.csv", poses, "%.10g", delimiter=",", header=head, comments="")
    folder = tmp_path / "readings"
    gonio("measure", tmp_path / "poses.csv", "--config", config, "-o", folder, "--format", "pab-opto")
    files = sorted(folder.glob("*.pab"))
    assert len(files) == 9
    (tmp_path / "fit.sir").write_bytes(radiance("pabopto2bsdf", "-n", "1", *files, cwd=tmp_path))
    (tmp_path / "fit.xml").write_bytes(radiance("bsdf2ttree", "-g", "6", "-t", "90", "fit.sir", cwd=tmp_path))
    for theta in (10, 30, 60):
        told = subprocess.run(
            [sys.executable, "-c", HEMISPHERE, tmp_path / "fit.xml", str(theta)], capture_output=True, text=True
        )
        assert told.returncode == 0, told.stderr
        exact = albedo(gonio, tmp_path, config, theta)[0]
        print(f"{theta}°: {float(told.stdout):.4f}, exact {exact:.4f}")
        assert float(told.stdout) == pytest.approx(exact, rel=0.05)


# Of everything that is scattered (SAMPLE_ALL).
HEMISPHERE = """
import sys
from pyradiance import bsdf
table = bsdf.load_file(sys.argv[1])
print(bsdf.direct_hemi(table, float(sys.argv[2]), 0.0, bsdf.SAMPLE_ALL))
"""
