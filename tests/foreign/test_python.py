"""The Python package: equal bits with the command and the library, laws, sentences, and what Python users do to arrays."""

import ast
import copy
import csv
import inspect
import json
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
import xml.dom.minidom

import pytest
from conftest import lack, needs, optional

np, g = optional("numpy"), optional("gonio")
# Of the package, a wheel that `.ci/foreign` builds and installs.
pytestmark = needs("numpy", "gonio")

PACKAGE = pathlib.Path(__file__).parents[2] / "src/python"


def cosine(n, seed=0):
    """n directions, cosine-distributed."""
    rng = np.random.default_rng(seed)
    sin2, phi = rng.random(n), 2 * np.pi * rng.random(n)
    sin = np.sqrt(sin2)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), np.sqrt(1 - sin2)], 1)


def rows(path):
    """The rows of a CSV file that gonio wrote."""
    with open(path) as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def column(rows, name):
    return np.array([float(row[name] or "nan") for row in rows])


GGX = dict(alpha=0.1, fresnel={"kind": "conductor", "eta": 0.2, "kappa": 3.0})


def config(folder, text):
    path = folder / "config.toml"
    path.write_text(text)
    return path


SCENE = '[[material]]\nkind = "ggx"\nalpha = 0.1\nfresnel = { kind = "conductor", eta = 0.2, kappa = 3.0 }\n'


# What there is, and its docs


def public():
    for name in g.__all__:
        if not name.startswith("_"):
            yield name, getattr(g, name)


def members(cls):
    own = (item for item in vars(cls).items() if not item[0].startswith("_"))
    return dict(own)


def test_every_public_name_has_a_docstring():
    for name, thing in public():
        assert thing.__doc__, name
        for member, of in members(thing).items() if inspect.isclass(thing) else ():
            assert of.__doc__, f"{name}.{member}"
    assert g.__doc__


def parameters(node, skip):
    """Names, kinds and defaults as the stub writes them."""
    a = node.args
    found = []
    plain = a.posonlyargs + a.args
    defaults = [None] * (len(plain) - len(a.defaults)) + a.defaults
    for arg, default in list(zip(plain, defaults))[skip:]:
        kind = "POSITIONAL_ONLY" if arg in a.posonlyargs else "POSITIONAL_OR_KEYWORD"
        found.append((arg.arg, kind, default and ast.literal_eval(default)))
    for arg, default in zip(a.kwonlyargs, a.kw_defaults):
        found.append((arg.arg, "KEYWORD_ONLY", default and ast.literal_eval(default)))
    if a.kwarg:
        found.append((a.kwarg.arg, "VAR_KEYWORD", None))
    return found


def signature(thing):
    empty = inspect.Parameter.empty
    all = inspect.signature(thing).parameters.values()
    return [(p.name, p.kind.name, None if p.default is empty else p.default) for p in all if p.name not in ("self", "cls")]


def test_stubs_are_the_module():
    tree = ast.parse((PACKAGE / "gonio/__init__.pyi").read_text())
    stubs = {n.name: n for n in tree.body if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
    assert set(stubs) == {name for name, _ in public()}
    for name, thing in public():
        stub = stubs[name]
        if isinstance(stub, ast.FunctionDef):
            assert parameters(stub, 0) == signature(thing), name
            continue
        of = {n.name: n for n in stub.body}
        assert {m for m in of if not m.startswith("_")} == set(members(thing)), name
        for member, node in of.items():
            if member == "__new__":
                # The stub's own first argument is the class.
                assert parameters(node, 1) == signature(thing), name
            elif not any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list):
                assert parameters(node, 1) == signature(getattr(thing, member)), f"{name}.{member}"


def test_the_page_names_everything():
    page = (PACKAGE.parent / "docs/python.md").read_text()
    for name, _ in public():
        assert f"`{name}" in page or f".{name}(" in page, name


def test_the_page_prints_what_it_says():
    page = (PACKAGE.parent / "docs/python.md").read_text()
    example, printed = (page.split(f"```{tag}\n")[1].split("```")[0] for tag in ("python", "text"))
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True, check=True)
    assert done.stdout == printed


def test_lists_are_those_of_the_command(gonio):
    assert g.__version__ == gonio("--version").split()[-1]
    for kind, of in (("materials", g.materials()), ("parametrizations", g.parametrizations()), ("reconstructions", g.reconstructions())):
        text = gonio("list", kind)
        assert of and all(name in text for name in of), kind
    assert "adaptive" in g.planners() and "sobol" in g.sample_sets()
    assert "cornell" in g.instruments() and "square-root" in g.warps()
    assert g.measures()[:2] == ["cosine", "lobe"]
    lines = gonio("list", "formats").splitlines()
    assert list(g.formats()) == [line.split()[0] for line in lines if line.startswith("  ") and line[2] != " "]


# Equal bits


def test_values_are_those_of_the_library(capsys):
    """GGX at a million pairs against the library alone, with as many threads: equal bits, at most twice the time."""
    native = os.environ.get("GONIO_NATIVE")
    if not native:
        lack("GONIO_NATIVE does not name the example `native`")
    light, sensor = cosine(1_000_000, 1), cosine(1_000_000, 2)
    ggx = g.Material("ggx", alpha=0.3)
    bytes_in = np.concatenate([light, sensor], 1).astype("<f8").tobytes()
    best = [np.inf, np.inf]
    # In turns, so that a busy machine is busy for both.
    for _ in range(4):
        done = subprocess.run([native, "5"], input=bytes_in, capture_output=True, check=True)
        best[0] = min(best[0], float(done.stderr))
        for _ in range(5):
            start = time.perf_counter()
            values = ggx.eval(light, sensor)
            best[1] = min(best[1], time.perf_counter() - start)
    assert values.tobytes() == done.stdout
    with capsys.disabled():
        print(f"\nGGX at 1e6 pairs: {best[1]:.4f} s in Python, {best[0]:.4f} s native, ratio {best[1] / best[0]:.2f}")
    assert best[1] <= 2 * best[0]


def test_wheels_are_small():
    wheel = os.environ.get("GONIO_WHEEL")
    if not wheel:
        lack("GONIO_WHEEL does not name the wheel")
    assert os.path.getsize(wheel) <= 5e6


@pytest.mark.parametrize("machine", [None, "cornell"])
def test_readings_are_those_of_the_command(gonio, tmp_path, machine):
    path = config(tmp_path, SCENE)
    planned = g.plan("sobol", 120, "hybrid", seed=3)
    planned.write(tmp_path / "poses.csv")
    extra = ["--instrument", machine, "--seed", 5, "--skip-unreachable"] if machine else []
    gonio("measure", tmp_path / "poses.csv", "--config", path, "-o", tmp_path / "readings.csv", *extra)
    schedule = g.Schedule.open(tmp_path / "poses.csv")
    m = g.measure(g.Material("ggx", **GGX), schedule, g.Instrument(machine) if machine else None, seed=5)
    found = {int(row["index"]): row for row in rows(tmp_path / "readings.csv")}
    theirs = [found[i] for i in range(len(m))]
    assert np.array_equal(column(theirs, "value"), m.values[:, 0], equal_nan=True)
    read = np.array([o == "reading" for o in m.outcomes])
    assert np.array_equal(np.isfinite(m.values[:, 0]), read) and read.sum() > 50
    if machine:
        assert not read.all() and m.seconds > 0
        for name in ("type_a", "type_b"):
            ours = getattr(m, name)[:, 0]
            assert np.array_equal(column(theirs, name), ours, equal_nan=True) and (ours[read] > 0).any()
        for flag, of in m.flags.items():
            assert [flag in row["flags"].split(";") for row in theirs] == of.tolist()
    # And back from the file, and from arrays.
    again = g.Measurement.open(tmp_path / "readings.csv")
    assert np.array_equal(again.values, m.values, equal_nan=True)
    s = m.schedule
    assert np.array_equal(g.Material("ggx", **GGX).eval(s.omega_i, s.omega_o)[read], m.values[read]) == (machine is None)


def test_visits_are_those_of_the_command(gonio, tmp_path):
    path = config(tmp_path, SCENE + '[[sample_set]]\nkind = "sobol"\n[[parametrization]]\nkind = "hybrid"\n[[reconstruction]]\nkind = "thin-plate"\n')
    options = ("--budget", 60, "--instrument", "cornell", "--skip-unreachable")
    gonio("schedule", path, *options, "-o", tmp_path / "poses.csv")
    theirs, ours = rows(tmp_path / "poses.csv"), g.Instrument("cornell").visits(g.plan("sobol", 60, "hybrid"))
    assert set(ours) - {"pose"} <= set(theirs[0]) and 20 < len(theirs) < 60
    assert np.array_equal(ours["pose"], column(theirs, "index"))
    for name in set(ours) - {"pose"}:
        assert np.allclose(ours[name], column(theirs, name), rtol=1e-14, atol=1e-12), name


def test_a_copy_is_that_of_the_command(gonio, tmp_path):
    truth = g.Material("ggx", **GGX)
    m = g.measure(truth, g.plan("grid", 500, g.Parametrization("half-difference", warp={"theta_h": "square-root"})))
    m.write(tmp_path / "readings.csv")
    gonio("reconstruct", tmp_path / "readings.csv", "--reconstruction", "cubic", "-o", tmp_path / "theirs.binary")
    copy = g.reconstruct(m, "cubic")
    copy.write(tmp_path / "ours.binary")
    assert (tmp_path / "ours.binary").read_bytes() == (tmp_path / "theirs.binary").read_bytes()
    table = g.Material.open(tmp_path / "ours.binary")
    light, sensor = cosine(2000, 1), cosine(2000, 2)
    assert np.nanmedian(abs(table.eval(light, sensor) / copy.eval(light, sensor) - 1)) < 0.02
    # A file of readings is a material too, by the method that they choose.
    chosen = g.reconstruct(m)
    assert np.array_equal(g.Material.open(tmp_path / "readings.csv").eval(light, sensor), chosen.eval(light, sensor))


def test_suggestions_are_those_of_the_command(gonio, tmp_path):
    first = g.suggest(8, seed=4)
    gonio("next", "--batch", 8, "--seed", 4, "-o", tmp_path / "first.csv")
    theirs = g.Schedule.open(tmp_path / "first.csv")
    assert np.allclose(first.schedule.omega_i, theirs.omega_i, rtol=0, atol=1e-15)
    assert np.allclose(first.schedule.omega_o, theirs.omega_o, rtol=0, atol=1e-15)


def test_advice_is_that_of_the_command(gonio, tmp_path):
    path = config(tmp_path, SCENE)
    theirs = json.loads(gonio("advise", path, "--budget", 24, "--by", "log_relative", "--seed", 3, "--json"))
    for ours in (g.advise(path, budget=24, by="log_relative", seed=3), g.advise({"material": [{"kind": "ggx", **GGX}]}, budget=24, by="log_relative", seed=3)):
        for a, b in zip(ours, theirs, strict=True):
            assert a["seconds"] > 0 and a["commands"]
            # What is computed takes another time, and commands name another source of the materials.
            assert {**a, "seconds": 0, "commands": []} == {**b, "seconds": 0, "commands": []}


def test_light_paths_are_those_of_the_command(gonio):
    theirs = gonio("paths", "smith-multiple", "--set", "alpha=0.5", "--paths", 4096, "--bounce", "later", "--purity", 0.5, "--json")
    ours = g.Material("smith-multiple", alpha=0.5).paths(paths=4096, bounce="later", purity=0.5)
    assert {**ours, "material": ""} == {**json.loads(theirs), "material": ""}


@needs("pandas")
def test_a_run_has_the_rows_of_the_command(gonio, tmp_path):
    keys = {
        "budgets": [100, 250],
        "material": [{"kind": "ggx", **GGX}, {"kind": "lambert"}],
        "parametrization": [{"kind": "half-difference"}, {"kind": "hybrid"}],
    }
    text = "budgets = [100, 250]\n" + SCENE + '[[material]]\nkind = "lambert"\n'
    path = config(tmp_path, text + '[[parametrization]]\nkind = "half-difference"\n[[parametrization]]\nkind = "hybrid"\n')
    gonio("run", path, "-o", tmp_path / "run")
    theirs = rows(tmp_path / "run/results.csv")
    for table in (g.run(keys), g.run(path)):
        times = ["plan_seconds", "measure_seconds", "reconstruct_seconds", "evaluate_seconds", "low_seconds", "high_seconds", "moment_seconds"]
        assert list(table) == list(theirs[0]) + times
        for name, values in table.items():
            if name in times:
                continue
            given = [row[name] for row in theirs]
            if isinstance(values, list):
                assert [v or "" for v in values] == given, name
            elif values.dtype == bool:
                assert [str(v).lower() for v in values] == given, name
            else:
                assert np.array_equal(values, column(theirs, name), equal_nan=True), name
    import pandas

    frame = pandas.DataFrame(table)
    assert frame.groupby("material").nrmse.max()["lambert"] < 1e-12 and frame.readings.dtype.kind == "i"
    # By hand, the same number.
    truth = g.Material("ggx", **GGX)
    copy = g.reconstruct(g.measure(truth, g.plan("grid", 250, "hybrid")), "multilinear")
    row = frame[(frame.material != "lambert") & (frame.parametrization == "hybrid") & (frame.budget == 250)]
    row = row[row.measure == "cosine"]
    assert row.reconstruction.tolist() == ["multilinear"] and row.sample_set.tolist() == ["grid"]
    assert row.nrmse.item() == g.compare(truth, copy)["cosine"]["nrmse"]


def test_moments_are_those_of_the_command(gonio):
    theirs = json.loads(gonio("moments", "ggx", "--set", "alpha=0.3", "--set", "moments.views=5", "--json"))
    ours = g.Material("ggx", alpha=0.3).profile(views=5)
    assert list(ours) == list(theirs[0])
    for name in set(ours) - {"material", "unresolved"}:
        assert [row[name] for row in theirs] == list(ours[name]), name
    table = g.run({"experiment": "moments", "moments": {"views": 5}, "material": [{"kind": "ggx", "alpha": 0.3}]})
    assert np.array_equal(table["energy"], ours["energy"])


def test_relations_are_a_table(gonio, tmp_path):
    keys = {"experiment": "relations", "material": [{"kind": "ggx", "alpha": 0.3}], "relations": {"views_deg": [30.0]}, "lighting": [{"kind": "sky"}]}
    path = config(tmp_path, 'experiment = "relations"\n[[material]]\nkind = "ggx"\nalpha = 0.3\n[relations]\nviews_deg = [30.0]\n[[lighting]]\nkind = "sky"\n')
    gonio("run", path, "-o", tmp_path / "run")
    theirs, ours = rows(tmp_path / "run/relations.csv"), g.run(keys)
    assert list(ours) == list(theirs[0])
    assert np.array_equal(ours["slice_energy"], column(theirs, "slice_energy"))
    assert ours["resolved"].dtype == bool and ours["along"] == [row["along"] for row in theirs]


@pytest.mark.parametrize("threads", ["1", "2"])
def test_threads_change_no_bit(threads):
    program = """
import gonio, hashlib, numpy
light, sensor = gonio.direction(numpy.linspace(0, 1.5, 5000), 0.3), gonio.direction(numpy.linspace(1.5, 0, 5000), 2)
ggx = gonio.Material("ggx", alpha=0.1)
m = gonio.measure(ggx, gonio.plan("sobol", 200), gonio.Instrument("cornell"))
made = [ggx.eval(light, sensor), m.values, gonio.reconstruct(m, "thin-plate").eval(light, sensor), ggx.profile(views=3)["energy"]]
print(hashlib.sha256(b"".join(a.tobytes() for a in made)).hexdigest())
"""
    environment = {**os.environ, "RAYON_NUM_THREADS": threads}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    seen = test_threads_change_no_bit.__dict__.setdefault("seen", done.stdout)
    assert len(done.stdout) == 65 and done.stdout == seen


# Laws


@pytest.mark.parametrize("name", list(g.parametrizations()) if g else ["none"])
def test_coordinates_go_round(name):
    light, sensor = cosine(20_000, 1), cosine(20_000, 2)
    steep = (light[:, 2] > 1e-3) & (sensor[:, 2] > 1e-3)
    light, sensor = light[steep], sensor[steep]
    free = g.Parametrization(name, symmetry="none")
    coordinates = free.forward(light, sensor)
    back = free.inverse(coordinates)
    assert coordinates.shape == (len(light), 4) == (len(light), len(free.axes))
    assert abs(back[0] - light).max() < 1e-9 and abs(back[1] - sensor).max() < 1e-9
    lo, hi = free.ranges.T
    assert (coordinates >= lo).all() and (coordinates <= hi).all()
    # Folded, it is the same configuration: a material with these symmetries has the same value there.
    folded = g.Parametrization(name)
    coordinates = folded.forward(light, sensor)
    assert coordinates.shape[1] == 3 and folded.symmetry == ["isotropic", "reciprocal", "bilateral"]
    matte = g.Material("ggx", alpha=0.5)
    values = matte.eval(*folded.inverse(coordinates))
    assert np.allclose(values, matte.eval(light, sensor), rtol=1e-7, atol=0)
    assert np.allclose(folded.canonical(coordinates), coordinates, rtol=0, atol=1e-12)
    assert (folded.jacobian(coordinates) >= 0).all()


def test_the_jacobian_of_angles_is_known():
    rng = np.random.default_rng(0)
    coordinates = np.stack([rng.uniform(0, 1.5, 100), rng.uniform(-3, 3, 100), rng.uniform(0, 1.5, 100), rng.uniform(-3, 3, 100)], 1)
    spherical = g.Parametrization("spherical", symmetry="none")
    theta = [i for i, axis in enumerate(spherical.axes) if axis.startswith("theta")]
    wanted = np.prod(np.sin(coordinates[:, theta]), 1)
    assert np.allclose(spherical.jacobian(coordinates), wanted, rtol=1e-12, atol=0)


def test_outside_there_is_no_pair():
    hd = g.Parametrization("half-difference")
    light, sensor = hd.inverse([[2.0, 0.1, 0.1], [np.nan, 0.1, 0.1], [0.1, 0.2, 0.3]])
    assert np.isnan(light[:2]).all() and np.isnan(sensor[:2]).all() and np.isfinite(light[2]).all()
    assert np.isnan(hd.jacobian([[2.0, 0.1, 0.1]])).all() and np.isnan(hd.canonical([[2.0, 0.1, 0.1]])).all()


def test_samples_are_as_dense_as_they_say():
    """The share of draws that are kept is the integral of the density; 1/pdf of them averages to the hemisphere."""
    ggx = g.Material("ggx", alpha=0.5)
    sensor = g.direction(0.6, 0.2)
    u = np.random.default_rng(1).random((400_000, 2))
    light = ggx.sample(sensor, u)
    kept = np.isfinite(light[:, 0])
    theta, phi = np.meshgrid(np.linspace(0, np.pi / 2, 801)[:-1] + np.pi / 3200, np.linspace(0, 2 * np.pi, 801)[:-1])
    grid = g.direction(theta.ravel(), phi.ravel())
    solid = np.sin(theta.ravel()) * (np.pi / 1600) * (2 * np.pi / 800)
    assert abs((ggx.pdf(grid, sensor) * solid).sum() - kept.mean()) < 3e-3
    # E[cos / pdf] is the integral of the cosine, π.
    weights = light[kept][:, 2] / ggx.pdf(light[kept], sensor)
    assert abs(weights.sum() / len(u) - np.pi) < 0.1
    assert ggx.can_sample and not g.Material("test-f").can_sample


@pytest.mark.parametrize("kind, keys", [("test-f", {}), ("ggx", {"alpha": [0.1, 0.4]}), ("low-abc", {})])
def test_weights_of_draws_average_to_the_albedo(kind, keys):
    material = g.Material(kind, channels="rgb", **keys)
    sensor = g.direction(0.9, 0.3)
    light, weights = material.sample(sensor, np.random.default_rng(2).random((100_000, 2)), weights=True)
    theta, phi = np.meshgrid((np.arange(400) + 0.5) * np.pi / 800, np.arange(800) * np.pi / 400)
    grid = g.direction(theta.ravel(), phi.ravel())
    cosine = (np.sin(theta) * np.cos(theta)).ravel() * np.pi / 800 * np.pi / 400
    albedo = (material.eval(grid, sensor) * cosine[:, None]).sum(0)
    error = weights.std(0) / len(weights) ** 0.5
    assert weights.shape == (100_000, 3) and (np.abs(weights.mean(0) - albedo) < 5 * error + 2e-3 * albedo).all()
    kept = np.isfinite(light[:, 0])
    again = material.eval(light[kept], sensor) * light[kept][:, 2:] / material.pdf(light[kept], sensor)[:, None]
    assert np.allclose(again, weights[kept], rtol=1e-6) and (weights[~kept] == 0).all()


def test_moments_of_a_matte_are_known():
    matte = g.Material("lambert", albedo=0.5)
    found = matte.moments([0.0, 1.0])
    names = list(found)
    assert np.allclose(found["energy"], 0.5 * np.pi, rtol=1e-12, atol=0), names
    # Degrees are told with ten decimals.
    assert found["theta_o_deg"].tolist() == [0, round(57.29577951308232, 10)]
    errors = g.moment_errors(matte, g.Material("lambert", albedo=0.4), views=3)
    assert abs(errors["moment_energy"] - 0.2) < 1e-12


def test_shared_errors_come_through():
    """Readings that are all 2 % too large make a copy that is, and it says so."""
    truth = g.Material("ggx", alpha=0.4)
    s = g.plan("sobol", 200)
    values = truth.eval(s.omega_i, s.omega_o)
    m = g.Measurement(s.omega_i, s.omega_o, values, np.zeros(len(s)), 0.02 * values)
    copy = g.reconstruct(m, "inverse-distance")
    light, sensor = cosine(50, 1), cosine(50, 2)
    type_a, type_b = copy.uncertainty(light, sensor)
    assert np.allclose(type_b / copy.eval(light, sensor)[:, 0], 0.02, rtol=0.05, atol=0) and not type_a.any()
    assert isinstance(copy, g.Material) and "200 readings" in repr(copy)
    of_channels = copy.uncertainty(light, sensor, channels=True)[1]
    assert of_channels.shape == (50, 1) and np.array_equal(of_channels[:, 0], type_b)
    # Without uncertainties there are those between readings, of a method that has them.
    bare = g.reconstruct(g.Measurement(s.omega_i, s.omega_o, values), "kriging")
    open_between = bare.uncertainty(light, sensor)[0]
    assert (open_between > 0).all() and np.isnan(m.type_a).all()
    assert copy.coverage(s.omega_i[:3], s.omega_o[:3]) == ["interpolated"] * 3


def test_a_darker_copy_errs_as_it_is_darker():
    errors = g.compare(g.Material("lambert", albedo=0.8), g.Material("lambert", albedo=0.6), ["cosine", "lobe"])
    for of in errors.values():
        assert abs(of["nrmse"] - 0.25) < 1e-12 and abs(of["energy"] + 0.25) < 1e-12 and of["converged"]
    assert np.isnan(g.compare(g.Material("lambert", albedo=0.0), g.Material("lambert"))["cosine"]["nrmse"])


def test_a_laboratory_goes_round_until_it_knows():
    truth, machine = g.Material("ggx", alpha=0.3), g.Instrument("cornell")
    arrays, so_far = None, None
    for _ in range(6):
        answer = g.suggest(len(so_far) if so_far else 16, so_far, instrument=machine, target={"nrmse": 0.05})
        if answer.enough:
            break
        m = g.measure(truth, answer.schedule, machine)
        assert set(m.outcomes) == {"reading"}
        new = (m.schedule.omega_i, m.schedule.omega_o, m.values, m.type_a, m.type_b)
        arrays = new if arrays is None else tuple(np.concatenate(both) for both in zip(arrays, new))
        so_far = g.Measurement(*arrays)
    assert answer.enough and len(answer.schedule) == 0 and answer.now["expected_nrmse"] <= 0.05
    found = g.compare(truth, g.reconstruct(so_far, "kriging"))["cosine"]["nrmse"]
    assert found < answer.now["expected_nrmse_bound"]


# What Python users do


def test_what_is_missing_is_nan(gonio, tmp_path):
    s = g.Schedule(g.direction(np.linspace(0, 0.3, 8), 0.0), g.direction(np.linspace(0.3, 0.1, 8), np.pi))
    m = g.measure(g.Material("lambert"), s)
    m.write(tmp_path / "readings.csv")
    table = tmp_path / "holes.binary"
    gonio("reconstruct", tmp_path / "readings.csv", "--reconstruction", "nearest", "--fill", "none", "-o", table)
    holed = g.Material.open(table)
    values = holed.eval(cosine(5000, 1), cosine(5000, 2))[:, 0]
    assert 0 < np.isfinite(values).sum() < 5000 and (values[np.isfinite(values)] > 0).all()
    measured = g.measure(holed, g.plan("sobol", 300))
    missing = np.array([o == "no-data" for o in measured.outcomes])
    assert missing.any() and np.array_equal(np.isnan(measured.values[:, 0]), missing)


# Materials of a program's own

FULL = "isotropic, reciprocal, bilateral"


def half(omega_i, omega_o):
    """0.1 + 0.3 h_z^8: isotropic, reciprocal, bilateral."""
    h = omega_i + omega_o
    return 0.1 + 0.3 * (h[:, 2] / np.linalg.norm(h, axis=1)) ** 8


def test_a_function_is_a_material_like_any_other(tmp_path):
    blocks = []

    def counted(omega_i, omega_o):
        blocks.append(len(omega_i))
        return half(omega_i, omega_o)

    made = g.Material.from_function(counted, symmetry=FULL, name="mine")
    light, sensor = cosine(3000, 1), cosine(3000, 2)
    assert np.array_equal(made.eval(light, sensor)[:, 0], half(light, sensor))
    with pytest.warns(UserWarning, match="below the horizon"):
        assert made.eval([[0.0, 0.6, -0.8]], UP)[0, 0] == 0
    assert made.symmetry == ["isotropic", "reciprocal", "bilateral"]
    ggx = g.Material("ggx", alpha=0.3)
    same = g.Material.from_function(ggx.eval, symmetry=FULL)
    assert g.compare(ggx, same)["cosine"]["nrmse"] < 1e-15
    matte = g.Material.from_function(lambda i, o: np.full(len(i), 0.25), symmetry=FULL)
    grey = g.Material("lambert", albedo=0.25 * np.pi)
    for name, values in grey.moments([0.3, 1.0]).items():
        if np.asarray(values).dtype == float and not name.endswith("uncertainty"):
            assert np.allclose(values, matte.moments([0.3, 1.0])[name], rtol=1e-6, atol=1e-9, equal_nan=True), name
    # In a config, alone and inside another material, and written as a table.
    plan = {"budgets": [60], "measures": ["cosine"], "metrics": {"pairs": 2000}}
    first, *others = [g.run(plan | {"material": [m]}) for m in ({"kind": "ggx", "alpha": 0.3}, ggx, same)]
    assert all(np.array_equal(first["nrmse"], other["nrmse"]) for other in others)
    assert first["material_key"] == others[0]["material_key"]
    blocks.clear()
    both = {"kind": "sum", "component": [{"weight": 0.5, "brdf": made}, {"weight": 0.5, "brdf": {"kind": "lambert"}}]}
    of_sum = g.run(plan | {"material": [made, both, {"kind": "tabulated", "format": "merl", "of": made}]})
    assert len(of_sum["nrmse"]) == 3 and np.all(of_sum["nrmse"] < 0.2)
    # The lock is taken once a block.
    assert sum(blocks) > 20 * len(blocks)
    made.write(tmp_path / "mine.binary")
    assert g.compare(made, g.Material.open(tmp_path / "mine.binary"))["cosine"]["nrmse"] < 0.01
    coloured = g.Material.from_function(lambda i, o: half(i, o)[:, None] * [1, 0.5, 0], channels="rgb")
    assert coloured.eval(light, sensor).shape == (3000, 3) and coloured.symmetry == []


def test_a_function_that_fails_is_said_in_one_sentence(tmp_path):
    def second(omega_i, omega_o):
        """Fails once it has been called for a while."""
        second.calls += 1
        return half(omega_i, omega_o) if second.calls < 3 else np.full(len(omega_i), np.inf)

    second.calls = 0
    wrong = {
        lambda i, o: half(i, o) * np.nan: "mine: what the function returns is NaN for omega_i = ",
        lambda i, o: -half(i, o): "mine: what the function returns is -0.*at least 0",
        lambda i, o: half(i, o)[:-1]: r"mine: .* has the shape \(.*,\) for .* pairs; allowed: \(",
        lambda i, o: 1 / 0: "mine: the function raised ZeroDivisionError: division by zero",
        lambda i: 1: "mine: the function raised TypeError",
        lambda i, o: "bright": "mine: what the function returns has texts",
    }
    for function, sentence in wrong.items():
        made = g.Material.from_function(function, symmetry=FULL, name="mine")
        plan = {"budgets": [60], "material": [made], "metrics": {"pairs": 2000}}
        for call in (
            lambda made=made: made.eval(cosine(9), cosine(9, 1)),
            lambda made=made: g.compare(made, g.Material("lambert")),
            lambda made=made: made.moments([0.5]),
            lambda made=made: g.measure(made, g.plan("sobol", 20)),
            lambda plan=plan: g.run(plan),
            lambda made=made: made.write(tmp_path / "x.binary"),
        ):
            with pytest.raises(ValueError, match=sentence) as told:
                call()
            assert "\n" not in str(told.value) and not list(tmp_path.iterdir())
        # It is raised once.
        assert g.Material("lambert").eval(UP, UP) > 0
    # Where it happened, also inside another material, and in no other thread's call.
    bad = g.Material.from_function(lambda i, o: 1 / 0, symmetry=FULL, name="mine")
    with pytest.raises(ValueError, match="mine: the function raised"):
        g.Material("tabulated", format="merl", of=bad)
    with pytest.raises(ValueError, match="mine: the function raised"):
        g.advise({"material": [bad]}, budget=12)
    good, failed, stop = g.Material.from_function(lambda i, o: np.full(len(i), 0.5)), [], threading.Event()

    def fails():
        while not stop.is_set():
            with pytest.raises(ValueError, match="mine"):
                bad.eval(cosine(99), cosine(99, 1))
            failed.append(1)

    other = threading.Thread(target=fails)
    other.start()
    assert all(np.all(good.eval(cosine(99), cosine(99, 1)) == 0.5) for _ in range(50))
    stop.set()
    other.join()
    assert failed
    # A shell may have started this with the signal ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(KeyboardInterrupt):
        g.Material.from_function(lambda i, o: signal.raise_signal(signal.SIGINT) or time.sleep(1)).eval(UP, UP)
    made = g.Material.from_function(second, symmetry=FULL)
    (tmp_path / "x.binary").write_bytes(b"before")
    with pytest.raises(ValueError, match="inf"):
        made.write(tmp_path / "x.binary", force=True)
    assert (tmp_path / "x.binary").read_bytes() == b"before" and len(list(tmp_path.iterdir())) == 1


def test_an_array_is_linear_between_its_nodes():
    for name, symmetry in [("half-difference", FULL), ("spherical", "isotropic"), ("spherical", "none")]:
        form = g.Parametrization(name, symmetry=symmetry)
        # Nodes as uneven as they come; of a turn not the end, which is its beginning.
        axes = [a + (b - a) * np.linspace(0, 1, 7 + k) ** (1 + 0.3 * k) for k, (a, b) in enumerate(form.ranges)]
        grid = np.meshgrid(*axes, indexing="ij")
        made = g.Material.from_array(20 + sum((k + 1) * x for k, x in enumerate(grid)), axes, parametrization=form)
        light, sensor = cosine(2000, 5), cosine(2000, 6)
        coords = form.forward(light, sensor)
        want = 20 + coords @ np.arange(1, coords.shape[1] + 1)
        assert np.allclose(made.eval(light, sensor)[:, 0], want, rtol=1e-12), name
        assert g.compare(made, made)["cosine"]["nrmse"] == 0
    # Round a turn the last node is followed by the first one.
    turn, values = [-np.pi, -np.pi / 2, 0, np.pi / 2], [[[0.0, 1.0, 0.0, 3.0]]]
    made = g.Material.from_array(values, [[0.5], [0.5], turn], parametrization="spherical", symmetry="isotropic")
    at = [made.eval(g.direction(0.5, 0.0), g.direction(0.5, phi))[0, 0] for phi in np.pi * np.array([0.75, 0.5, 1.25])]
    assert np.allclose(at, [1.5, 3.0, 0.5]) or np.allclose(at, [0.5, 1.0, 1.5])


def test_any_array_is_taken():
    ggx = g.Material("ggx", alpha=0.3)
    light, sensor = cosine(1000, 1), cosine(1000, 2)
    wanted = ggx.eval(light, sensor)
    wide = np.zeros((1000, 6))
    wide[:, ::2] = light
    assert np.array_equal(ggx.eval(wide[:, ::2], sensor), wanted)
    assert np.array_equal(ggx.eval(np.asfortranarray(light), sensor[::-1][::-1]), wanted)
    assert np.array_equal(ggx.eval(light.tolist(), sensor), wanted)
    assert np.array_equal(ggx.eval(light.astype(">f8"), sensor), wanted)
    single = light.astype("f4"), sensor.astype("f4")
    assert np.array_equal(ggx.eval(*single), ggx.eval(*(a.astype("f8") for a in single)))
    assert np.allclose(ggx.eval(*single), wanted, rtol=1e-4, atol=0)
    assert np.allclose(ggx.eval(7 * light, sensor), wanted, rtol=1e-12, atol=0)
    assert np.allclose(ggx.eval(g.angles(light), g.angles(sensor)), wanted, rtol=1e-9, atol=0)
    assert np.array_equal(ggx.eval([0, 0, 1], sensor), ggx.eval(np.tile([0, 0, 1], (1000, 1)), sensor))
    packed = np.zeros(1000, dtype=[("flag", "u1"), ("light", "f8", 3)])
    packed["light"] = light
    apart = np.frombuffer(b"\0" + light.tobytes(), dtype="u1")[1:].view("f8").reshape(-1, 3)
    assert not apart.flags.aligned and apart.flags.c_contiguous
    assert np.array_equal(ggx.eval(packed["light"], sensor), wanted) and np.array_equal(ggx.eval(apart, sensor), wanted)
    read_only = light.copy()
    read_only.flags.writeable = False
    assert np.array_equal(ggx.eval(read_only, sensor), wanted)
    assert np.array_equal(g.Material("ggx", alpha=np.float32(0.5)).eval(light, sensor), g.Material("ggx", alpha=0.5).eval(light, sensor))
    with pytest.warns(UserWarning, match="below the horizon"):
        assert np.array_equal(ggx.eval(-light, sensor), np.zeros((1000, 1)))


def test_what_is_masked_is_missing():
    s = g.plan("sobol", 20)
    mask = np.arange(len(s)) % 3 == 0
    for values in (np.linspace(1, 2, len(s)), np.arange(len(s))):
        m = g.Measurement(s.omega_i, s.omega_o, np.ma.array(values, mask=mask))
        assert np.array_equal(np.isnan(m.values[:, 0]), mask) and np.array_equal(m.values[~mask, 0], values[~mask])
    bare = np.ma.array(np.linspace(1, 2, len(s)))
    assert np.array_equal(g.Measurement(s.omega_i, s.omega_o, bare).values[:, 0], bare.data)
    with pytest.raises(ValueError, match=r"omega_i\[0\] is \(NaN, NaN, NaN\), which is no direction"):
        g.Material("lambert").eval(np.ma.array(s.omega_i, mask=mask[:, None] & np.ones(3, bool)), s.omega_o)


@pytest.mark.parametrize("kind", [KeyboardInterrupt, MemoryError])
def test_what_is_not_the_arrays_fault_is_passed_on(kind):
    class Array:
        def __array__(self, *_, **__):
            raise kind

    with pytest.raises(kind):
        g.Material("lambert").eval(Array(), UP)


def test_directions_broadcast():
    ggx, hybrid = g.Material("ggx", alpha=0.3, channels="rgb"), g.Parametrization("hybrid")
    light, sensor = cosine(4, 1)[:, None], cosine(5, 2)
    both = np.broadcast_to(light, (4, 5, 3)).reshape(-1, 3), np.broadcast_to(sensor, (4, 5, 3)).reshape(-1, 3)
    copy = g.reconstruct(g.measure(ggx, g.plan("sobol", 64)), "kriging")
    for function, tail in [(ggx.eval, (3,)), (ggx.pdf, ()), (hybrid.forward, (3,)), (lambda i, o: copy.uncertainty(i, o)[0], ()), (copy.coverage, ())]:
        wide = np.array(function(light, sensor[None]))
        assert wide.shape == (4, 5, *tail) and np.array_equal(wide.reshape(20, *tail), function(*both))
        assert np.array_equal(function(g.angles(light), sensor[2]), function(g.angles(light), sensor[2:3]))
    u = np.random.default_rng(0).random((5, 2))
    assert np.array_equal(ggx.sample(light, u)[3, :, :], ggx.sample(light[3], u), equal_nan=True)
    assert g.direction([[0.1], [0.2]], [0.0, 1.0, 2.0]).shape == (2, 3, 3) and g.angles(light).shape == (4, 1, 2)
    coordinates = hybrid.forward(light, sensor)
    assert np.allclose(hybrid.forward(*hybrid.inverse(coordinates)), coordinates)
    assert hybrid.jacobian(coordinates).shape == (4, 5) and hybrid.canonical(coordinates).shape == (4, 5, 3)
    m = g.Measurement(light, sensor, ggx.eval(light, sensor), symmetry="none", parametrization="spherical")
    assert np.array_equal(m.values, ggx.eval(*both)) and np.allclose(m.schedule.omega_o, both[1])
    with pytest.raises(ValueError, match=r"omega_o\[4\] is \(0, 0, 0\)"):
        ggx.eval(light, np.array([*sensor[:4], [0, 0, 0]]))
    with pytest.raises(MemoryError, match="more pairs than memory holds"):
        ggx.eval(np.ones((2**22, 1, 3)), np.ones((2**22, 3)))


@pytest.mark.parametrize("wrong", [[[0, 0, 1 + 0j]], np.array([[0, 0, 1.0]], object), [["0", "0", "1"]], [[None, 0, 1]], np.array([[1, 2]], "m8[s]")])
def test_what_is_no_real_number_is_refused(wrong):
    lambert, s = g.Material("lambert"), g.Schedule(UP, UP)
    calls = {
        "omega_i": lambda: lambert.eval(wrong, UP),
        "omega": lambda: g.angles(wrong),
        "values": lambda: g.Measurement(s.omega_i, s.omega_o, wrong),
        "coordinates": lambda: g.Parametrization("stark").inverse(wrong),
        "theta_o": lambda: lambert.moments(wrong[0]),
        "u": lambda: lambert.sample(UP, wrong),
    }
    for name, call in calls.items():
        with pytest.raises(ValueError, match=f"^{name} has .*; allowed: an array of real numbers$"):
            call()


def test_what_may_be_degrees_or_below_the_horizon_is_doubted():
    ggx, hd, low = g.Material("ggx", alpha=0.3), g.Parametrization("half-difference"), np.array([[0, 0.6, -0.8], [0, 0, 1], [0, 0.6, -0.8]])
    copy = g.reconstruct(g.measure(ggx, g.plan("sobol", 64)), "kriging")
    doubts = {
        "theta has the angle -60, beyond 2π: angles are in radians, and np.radians converts degrees": lambda: g.direction([-60, 7], 0.1),
        "phi has the angle 90,": lambda: g.direction(0.1, [[90]]),
        "omega_o has the angle 45,": lambda: ggx.eval(UP, [45.0, 0.0]),
        "coordinates, phi_d has the angle 30,": lambda: hd.inverse([[0.1, 0.1, 30]]),
        r"below the horizon \(z < 0\) is omega_i in 2 of 3: ": lambda: ggx.eval(low, UP),
        "is omega_i in 4 of 6, omega_o in 3 of 6: ": lambda: ggx.pdf(low[:, None], low[:2]),
        "is omega_o in 2 of 3: ": lambda: ggx.sample(low, [[0.5, 0.5]]),
        "is omega_i in 2 of 3: .*": lambda: hd.forward(low, UP),
        "is omega_i in 2 of 3: .*f_r is 0 below it": lambda: copy.coverage(low, UP),
        "is omega_o in 1 of 1: ": lambda: copy.uncertainty(UP, low[:1]),
    }
    for sentence, call in doubts.items():
        with pytest.warns(UserWarning, match=sentence) as told:
            call()
        assert len(told) == 1
    with pytest.warns(UserWarning, match="theta_o has the angle 30"), pytest.raises(ValueError, match="theta_o = 30"):
        ggx.moments([30])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ggx.eval([[1.0, np.pi]], g.direction(np.pi / 2, np.float32(2 * np.pi)))


def test_objects_are_pickled_to_the_bit(gonio, tmp_path):
    light, sensor = cosine(50, 1), cosine(50, 2)
    path = config(tmp_path, SCENE + '[[sample_set]]\nkind = "grid"\n[[parametrization]]\nkind = "hybrid"\n[[reconstruction]]\nkind = "cubic"\n')
    gonio("schedule", path, "--budget", 60, "--instrument", "cornell", "--skip-unreachable", "-o", tmp_path / "poses.csv")
    form = g.Parametrization("half-difference", symmetry="isotropic", warp={"theta_h": {"kind": "power", "exponent": 0.3}})
    made = g.Material.from_array(np.arange(8.0).reshape(2, 2, 2), [[0.1, 1.0], [0.2, 1.0], [0, 1]], parametrization="half-difference", name="mine")
    m = g.measure(g.Material("ggx", **GGX), g.plan("grid", 120, form), g.Instrument("cornell", realisation=7))
    g.Material("ggx", alpha=0.2, channels="rgb").write(tmp_path / "table.binary")
    materials = [g.Material("ggx", **GGX, channels=[400, 500.5]), g.Material.open(tmp_path / "table.binary"), made, g.Material.from_function(half, symmetry=FULL, channels="luminance"), g.reconstruct(m, "thin-plate", noise=True)]
    for material in materials:
        again = pickle.loads(pickle.dumps(material))
        assert type(again) is type(material) and np.array_equal(again.eval(light, sensor), material.eval(light, sensor), equal_nan=True)
        assert (repr(again), again.symmetry, again.channels) == (repr(material), material.symmetry, material.channels)
        assert copy.copy(material) is material and copy.deepcopy([material])[0] is material
    for measurement, name in ((m, "whole"), (m[5:40], "part"), (g.Measurement(light, sensor, np.ones((50, 3)), symmetry="none"), "own")):
        again = pickle.loads(pickle.dumps(measurement))
        measurement.write(tmp_path / f"{name}.csv")
        again.write(tmp_path / f"{name}-again.csv")
        assert (tmp_path / f"{name}.csv").read_bytes() == (tmp_path / f"{name}-again.csv").read_bytes()
        assert again.values.tobytes() == measurement.values.tobytes() and again.seconds == measurement.seconds
    # A grid stays one, and a file's order.
    assert np.array_equal(g.reconstruct(pickle.loads(pickle.dumps(g.measure(made, g.plan("grid", 60)))), "cubic").eval(light, sensor), g.reconstruct(g.measure(made, g.plan("grid", 60)), "cubic").eval(light, sensor))
    file = g.Schedule.open(tmp_path / "poses.csv")
    again = pickle.loads(pickle.dumps(file))
    assert np.array_equal(again.order, file.order) and again.omega_i.tobytes() == file.omega_i.tobytes()
    assert pickle.loads(pickle.dumps(form)).forward(light, sensor).tobytes() == form.forward(light, sensor).tobytes()
    machine = g.Instrument("cornell", limits=False)
    seen = [g.measure(made, g.plan("sobol", 20), i).values for i in (machine, pickle.loads(pickle.dumps(machine)))]
    assert seen[0].tobytes() == seen[1].tobytes() and pickle.loads(pickle.dumps(g.Instrument())).name == "ideal"
    answer = g.suggest(4, m, instrument=g.Instrument("cornell"))
    again = pickle.loads(pickle.dumps(answer))
    assert (again.now, again.then, len(again.schedule)) == (answer.now, answer.then, 4) and answer.now
    both = g.Material("sum", component=[{"weight": 0.5, "brdf": made}, {"weight": 0.5, "brdf": {"kind": "lambert"}}])
    with pytest.raises(TypeError, match="a function or an array cannot be pickled"):
        pickle.dumps(both)
    assert copy.deepcopy(both) is both
    with pytest.raises(ValueError, match="this pickle is not of this version"):
        g.Schedule._restored("{}")


def test_parts_of_measurements():
    m = g.measure(g.Material("ggx", **GGX), g.plan("grid", 120), g.Instrument("cornell"))
    numbers = np.arange(len(m))
    for key in (slice(3, 10), slice(None, None, -2), np.isfinite(m.values[:, 0]), [4, 2], np.array([-1]), 7):
        part, kept = m[key], np.atleast_1d(numbers[key])
        assert len(part) == len(kept) and part.outcomes == [m.outcomes[i] for i in kept]
        for name in ("values", "type_a", "type_b"):
            assert np.array_equal(getattr(part, name), getattr(m, name)[kept], equal_nan=True)
        assert all(np.array_equal(part.flags[flag], of[kept]) for flag, of in m.flags.items())
        for schedule in (part.schedule, m.schedule[key]):
            assert np.array_equal(schedule.omega_i, m.schedule.omega_i[kept]) and np.array_equal(schedule.coordinates, m.schedule.coordinates[kept])
        assert part.seconds is None
    assert m[:].seconds == m.seconds and len(m[0:0]) == 0 and len([*m]) == len(m)
    with pytest.raises(ValueError, match="key takes pose 2 twice; allowed: each pose once"):
        m[[2, 2]]
    for key in (len(m), numbers[:3] > 0, "values"):
        with pytest.raises(IndexError):
            m[key]


def test_a_table_in_colour_is_opened_in_colour(tmp_path):
    colour = g.Material("lambert", albedo=[0.8, 0.4, 0.2], channels="rgb")
    colour.write(tmp_path / "colour.binary")
    opened = g.Material.open(tmp_path / "colour.binary")
    assert opened.channels == ["r", "g", "b"] and np.allclose(opened.eval(UP, UP), np.array([[0.8, 0.4, 0.2]]) / np.pi)
    assert g.Material.open(tmp_path / "colour.binary", channels="luminance").channels == ["luminance"]
    for channels in ("luminance", "rgb", [450.0, 550.0]):
        material = g.Material("lambert", albedo=0.5, channels=channels)
        g.measure(material, g.plan("sobol", 40)).write(tmp_path / "readings.csv", force=True)
        assert g.Material.open(tmp_path / "readings.csv").channels == material.channels


def test_refusals_of_files_name_keywords(tmp_path):
    file, rows = tmp_path / "theirs.csv", "10,20,180,0.5\n20,30,0,0.4\n"
    texts = {
        "theta_i,theta_o,phi_o,value\n1,1,1,1\n" + rows: ', "value": "4"}, angles="deg"; did you mean theta_i_deg?',
        "tilt,turn,out,what\n" + rows: "with columns, which says their names in the file, others are passed over",
        rows: 'a guess: columns={"theta_i": "1", "theta_o": "2", "phi_o": "3", "value": "4"}',
        "theta_i,theta_o,phi_o,value\n.1,.2,3.1,.5\n.2,.3,0,.4\n": "or angles with one of deg, rad",
        "theta_i_deg,theta_o_deg,phi_o_deg,value\n" + rows + "10": "partial=True reads up to the cut",
    }
    for text, advice in texts.items():
        file.write_text(text)
        for call in (g.Measurement.open, g.Material.open):
            with pytest.raises(ValueError) as told:
                call(file)
            assert str(told.value).endswith(advice) and not any(mark in str(told.value) for mark in ("--", "`"))
    with pytest.raises(ValueError, match="no format of schedules is known by this name; allowed: .*, or format$"):
        g.plan("sobol", 4).write(tmp_path / "poses.what")


def test_notebooks_show_tables():
    m = g.measure(g.Material("ggx", **GGX), g.plan("sobol", 30))
    for thing, cell in ((m, "<td>reading</td>"), (m.schedule, "<th>theta_o_deg</th>"), (g.Material("ggx", **GGX), "<td>alpha</td><td>0.1</td>"), (g.reconstruct(m, "nearest"), "<td>luminance</td>")):
        html = thing._repr_html_()
        xml.dom.minidom.parseString(html)
        assert cell in html and repr(thing).strip("<>") in html
    assert m._repr_html_().count("<tr>") == 10 and "22 more" in m._repr_html_() and "more" not in m[:8]._repr_html_()


def test_empty_arrays_stay_empty():
    nothing = np.zeros((0, 3))
    colour = g.Material("lambert", albedo=[1.0, 0.5, 0.2], channels="rgb")
    assert colour.eval(nothing, nothing).shape == (0, 3) and colour.eval(nothing, [0, 0, 1]).shape == (0, 3)
    assert g.Parametrization("hybrid").forward(nothing, nothing).shape == (0, 3)
    assert [a.shape for a in g.Parametrization("hybrid").inverse(nothing)] == [(0, 3), (0, 3)]
    assert len(g.Schedule(nothing, nothing)) == 0 and g.angles(nothing).shape == (0, 2)
    assert g.direction([], []).shape == (0, 3)


def test_channels():
    light, sensor = cosine(10, 1), cosine(10, 2)
    spectral = g.Material("lambert", albedo=0.5, channels=[400, 500, 600.5])
    assert spectral.channels == ["400nm", "500nm", "600.5nm"] and spectral.wavelengths_nm.tolist() == [400, 500, 600.5]
    assert spectral.eval(light, sensor).shape == (10, 3)
    m = g.measure(spectral, g.Schedule(light, sensor))
    again = g.Measurement(light, sensor, m.values, wavelengths_nm=spectral.wavelengths_nm)
    assert again.channels == m.channels and g.reconstruct(again, "nearest").wavelengths_nm is not None


def test_the_global_lock_is_free():
    ggx, light, sensor = g.Material("ggx", alpha=0.3), cosine(2_000_000, 1), cosine(2_000_000, 2)
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    start = time.perf_counter()
    ggx.eval(light, sensor)
    seconds, during = time.perf_counter() - start, counted[0] - before
    stop.set()
    thread.join()
    # Held, the other thread would stand still but for a switch before and after.
    assert seconds > 0.01 and during > 1e5 * seconds


def test_an_interrupt_ends_a_run():
    def interrupt(*_):
        raise KeyboardInterrupt

    old = signal.signal(signal.SIGALRM, interrupt)
    try:
        # Seconds of work: at its end the signal is raised in any case.
        materials = [{"kind": "ggx", "alpha": 0.01 + 0.0001 * i, "name": f"m{i}"} for i in range(2000)]
        alarm = time.perf_counter() + 0.1
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(KeyboardInterrupt):
            g.run({"material": materials})
        assert time.perf_counter() - alarm < 1
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)


UP = [[0.0, 0.0, 1.0]]

WRONG = [
    (lambda: g.Material("ggxx"), 'kind = "ggxx" is not a material; allowed: .*did you mean ggx'),
    (lambda: g.Material("ggx", alpha=-1), "alpha = -1.*allowed"),
    (lambda: g.Material("ggx", kind="lambert"), 'kind = "lambert" beside "ggx"'),
    (lambda: g.plan("grid", 10, kind="sobol"), 'kind = "sobol" beside "grid"'),
    (lambda: g.Material("ggx", alhpa=0.1), "alhpa.*alpha"),
    (lambda: g.Material("ggx", alpha="wide"), "alpha.*wide"),
    (lambda: g.Material("ggx", fresnel={"kind": "conductr"}), '^fresnel: kind = "conductr"'),
    (lambda: g.Instrument("name = 'mine'\nabout = 'two lines'"), "^spec is a text of several lines"),
    (lambda: g.Material("ggx", alpha=object()), "alpha is a object; allowed: a number"),
    (lambda: g.Material("ggx", alpha=10**30), "64 bits"),
    (lambda: g.Material("lambert", channels="rbg"), "channels.*rbg"),
    (lambda: g.Material("lambert", channels=[500, 400]), "^channels.*400"),
    (lambda: g.Material.open("nowhere.binary"), "nowhere.binary: "),
    (lambda: g.Material.open("picture.gif"), "picture.gif: no format.*allowed: .binary"),
    (lambda: g.Material("lambert").eval(np.zeros((4, 5)), UP), r"omega_i has the shape \(4, 5\); allowed: \(…, 3\) vectors"),
    (lambda: g.Material("lambert").eval(np.zeros((2, 3, 3)), UP), r"omega_i\[0, 0\] is \(0, 0, 0\)"),
    (lambda: g.Material("lambert").eval(5.0, UP), r"shape \(1,\)"),
    (lambda: g.Material("lambert").eval(cosine(3), cosine(4)), r"omega_i has the shape \(3, 3\) and omega_o has \(4, 3\); allowed: shapes that broadcast"),
    (lambda: g.Material("lambert").eval([[0, 0, 1], [0, 0, 0]], UP), r"omega_i\[1\] is \(0, 0, 0\), which is no direction"),
    (lambda: g.Material("lambert").eval(UP, [[np.nan, 0, 0]]), r"omega_o\[0\] is \(NaN, 0, 0\)"),
    (lambda: g.Material("lambert").eval("north", UP), "omega_i has texts; allowed: an array of real numbers"),
    (lambda: g.Material("lambert").eval([[0, 0, 1], [0, 1]], UP), "omega_i is a list without numbers"),
    (lambda: g.Material("ggx", alpha=0.1).sample(UP, [[0.5, 1.0]]), r"u has 1; allowed: numbers in \[0, 1\)"),
    (lambda: g.Material("ggx", alpha=0.1).sample(UP, [0.5]), r"u has the shape \(1,\)"),
    (lambda: g.Material("lambert").moments([2.0]), "theta_o = 2"),
    (lambda: g.Material("lambert").moments([0.5], channel="mauve"), "channel = mauve: allowed is luminance"),
    (lambda: g.Material("lambert").profile(views=0), "views = 0"),
    (lambda: g.Material("lambert").profile(estimator={"sample": 1}), "^estimator: unknown key sample"),
    (lambda: g.Material("lambert").write("/nowhere/x.binary"), "/nowhere/x.binary: "),
    (lambda: g.Material("lambert").write("x.csv"), "x.csv: .*tables"),
    (lambda: g.Material("lambert").write("x.binary", size=7), "size: allowed is a whole number from 0 to 0"),
    (lambda: g.Material("lambert").write("x.binary", size=-1), "size: allowed"),
    (lambda: g.Parametrization("hybird"), '^name = "hybird".*did you mean hybrid'),
    (lambda: g.Parametrization("hybrid", symmetry="isotopic"), "symmetry = isotopic"),
    (lambda: g.Parametrization("hybrid", warp={"phi_h": "square-root"}), "phi_h"),
    (lambda: g.Parametrization("hybrid").inverse([[0.1, 0.2]]), r"coordinates have the shape \(1, 2\); allowed: \(…, 3\), h_bar"),
    (lambda: g.plan("gird", 10), '^sample_set = "gird".*did you mean grid'),
    (lambda: g.plan("grid", 10, "hybird"), '^parametrization = "hybird"'),
    (lambda: g.plan("grid", 0), "budget = 0: allowed is a whole number from 1"),
    (lambda: g.plan("grid", -1), "budget = -1"),
    (lambda: g.plan("sobol", 10, seed=-1), "seed = -1: allowed is a whole number from 0"),
    (lambda: g.Schedule(UP, [[0, 0, -1.0]]), r"omega_o\[0\] is not above the horizon"),
    (lambda: g.Instrument("cornel"), '^spec: "cornel".*did you mean cornell'),
    (lambda: g.Instrument("cornell", nose=False), "nose"),
    (lambda: g.Instrument({"name": "mine"}), "^spec: .*about"),
    (lambda: g.Instrument().visits(g.plan("sobol", 9)), "the ideal instrument has no axes"),
    (lambda: g.Instrument(noise=False), "the ideal instrument has no keys"),
    (lambda: g.Measurement(UP, UP, [1.0, 2.0]), r"values has the shape \(2,\); allowed: \(1,\)"),
    (lambda: g.Measurement(UP, UP, [np.inf]), r"values\[0\] is inf"),
    (lambda: g.Measurement(UP, UP, [[1, np.nan, 1]]), r"values\[0\] is NaN in 1 of 3 channels"),
    (lambda: g.Measurement(UP, UP, [1.0], type_a=[-1.0]), r"type_a\[0\] is -1"),
    (lambda: g.Measurement(UP, UP, [[1.0, 2.0]]), "wavelengths_nm"),
    (lambda: g.Measurement(UP, UP, [1.0], wavelengths_nm=[400, 500, 600]), r"values has the shape \(1,\), of 3 wavelengths; allowed: \(1, 3\)"),
    (lambda: g.Measurement.open("nowhere.csv"), "nowhere.csv: cannot read"),
    (lambda: g.reconstruct(g.measure(g.Material("lambert"), g.plan("sobol", 20)), "cubic"), "cubic needs a grid"),
    (lambda: g.reconstruct(g.measure(g.Material("lambert"), g.plan("sobol", 20)), "cubix"), '^reconstruction = "cubix"'),
    (lambda: g.reconstruct(g.measure(g.Material("lambert"), g.plan("sobol", 20)), "inverse-distance").uncertainty(UP, UP), "no uncertainty"),
    (lambda: g.compare(g.Material("lambert"), g.Material("lambert"), ["cosin"]), "measures = cosin"),
    (lambda: g.compare(g.Material("lambert"), g.Material("lambert"), mask_deg=100), "mask_deg = 100"),
    (
        lambda: g.moment_errors(g.Material("lambert", channels="rgb"), g.Material("lambert", channels="rgb"), channels=["red", "green"]),
        "channels = red, green: allowed is one channel",
    ),
    (lambda: g.Material.from_function(5), "function = 5: allowed is a function of omega_i and omega_o"),
    (lambda: g.Material.from_array([1.0], [[0.5]], parametrization="stark"), "axes are 1; allowed: one list of nodes for each of "),
    (lambda: g.Material.from_array([[[1.0]]], [[0.5], [0.5], [9]], parametrization="half-difference"), r"phi_d = \[9.0\]; allowed: increasing"),
    (lambda: g.Material.from_array([[[1.0]]], [[0.5, 0.4], [0.5], [0]], parametrization="half-difference"), r"theta_h = \[0.5, 0.4\]"),
    (lambda: g.Material.from_array([[1.0]], [[0.5], [0.5], [0]], parametrization="half-difference"), r"values has the shape \(1, 1\); allowed"),
    (lambda: g.Material.from_array([[[-1.0]]], [[0.5], [0.5], [0]], parametrization="half-difference"), "values has -1; allowed"),
    (lambda: g.Material("given", number=3), "given.*is not a material|number = 3"),
    (lambda: g.Material("lambert").paths(), "does not tell light by the number of facets.*smith-multiple"),
    (lambda: g.Material("smith-multiple").paths(paths=10), "paths = 10: allowed is a whole number from 1024"),
    (lambda: g.Material("smith-multiple").paths(bounce="all"), "bounce = all: allowed is first, second, later"),
    (lambda: g.Material("smith-multiple").paths(purity=0.0), r"purity = 0: allowed is a number in \(0, 1\]"),
    (lambda: g.advise(), "allowed is one of budget, minutes and, alone or beside one, moment"),
    (lambda: g.advise(budget=10, minutes=3.0), "allowed is one of budget, minutes and, alone or beside one, moment"),
    (lambda: g.advise(minutes=3.0), "minutes is of an instrument"),
    (lambda: g.advise(minutes=-3.0, instrument="cornell"), "minutes = -3"),
    (lambda: g.advise(budget=10, by="nrms"), "^by = nrms: allowed is nrmse.*did you mean nrmse"),
    (lambda: g.advise(budget=10, most=0), "most = 0"),
    (lambda: g.advise(budget=10, seed=2**63), "seed = 9223372036854775808"),
    (lambda: g.advise(budget=10, instrument="cornel"), '^instrument: "cornel"'),
    (lambda: g.suggest(0), "batch = 0"),
    (lambda: g.suggest(4, planner="adaptiv"), '^planner = "adaptiv".*did you mean adaptive'),
    (lambda: g.run({"material": [{"kind": "ggx", "alpha": -1}]}), r"^material\[0\].alpha = -1"),
    (lambda: g.run({"material": [{"kind": "lambert"}], "budgts": [1]}), "budgts"),
    (lambda: g.run({"budgets": [9]}), "at least one material, or materials_dir$"),
    (lambda: g.run({"materials_dir": "nowhere"}), 'choose another folder with set={"materials_dir": "DIR"}'),
    (lambda: g.run("nowhere.toml"), "nowhere.toml: cannot read"),
    (lambda: g.direction([1, 2], [1, 2, 3]), r"theta has the shape \(2,\) and phi has \(3,\)"),
]


@pytest.mark.parametrize("call, sentence", WRONG, ids=[w[1][:40] for w in WRONG])
def test_mistakes_are_told_in_one_sentence(call, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=sentence) as told:
        call()
    text = str(told.value)
    assert len(text) < 3000 and "\n" not in text and not list(tmp_path.iterdir())


def test_doubts_are_warnings():
    brushed = g.Material("ward", alpha=[0.1, 0.4])
    with pytest.warns(UserWarning, match="for materials that are isotropic, reciprocal, bilateral; ward.* is reciprocal, bilateral"):
        g.measure(brushed, g.plan("sobol", 20))
    s = g.Schedule(g.direction(0.5, [0.0, 1.0]), g.direction(0.2, [0.0, 1.0]), symmetry="reciprocal,bilateral")
    assert len(set(g.measure(brushed, s).values[:, 0])) == 2


def test_readings_that_symmetries_contradict_are_doubted():
    """Twenty configurations of an anisotropic sample, each at two azimuths of the sample."""
    theta, turned = np.linspace(0.1, 1.2, 20), np.repeat([0.0, np.pi / 2], 20)
    light, sensor = g.direction(np.tile(theta, 2), turned), g.direction(np.tile(theta, 2), turned + np.pi)
    values = np.repeat([1.0, 2.0], 20)
    with pytest.warns(UserWarning, match="symmetries make one scatter by 47 %"):
        m = g.Measurement(light, sensor, values)
    assert len(m) == 20 and np.allclose(m.values, 1.5, rtol=1e-15, atol=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(g.Measurement(light, sensor, values, symmetry="reciprocal")) == 40


def test_values_below_zero_are_told():
    s = g.plan("sobol", 4)
    with pytest.warns(UserWarning, match=r"^values\[2\] is -0.5, below 0, and counts as 0 in a copy$"):
        m = g.Measurement(s.omega_i, s.omega_o, [1, 2, -0.5, 3])
    assert m.values[2] == -0.5 and g.reconstruct(m, "nearest").eval(s.omega_i[2:3], s.omega_o[2:3]) == 0
    with pytest.warns(UserWarning, match=r"^2 rows have values below 0.*first is values\[1\] = -1$"):
        g.Measurement(s.omega_i, s.omega_o, [1, -1, -0.5, 3])


def test_tables_that_gain_energy_are_told(tmp_path):
    s = g.plan("grid", 200)
    bright = g.reconstruct(g.Measurement(s.omega_i, s.omega_o, np.tile(np.array([1.5, 0.5, 0.5]) / np.pi, (len(s), 1))), "nearest")
    with pytest.warns(UserWarning, match="albedo is 1.5") as told:
        bright.write(tmp_path / "bright.binary")
    assert len(told) == 2 and (tmp_path / "bright.binary").exists()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        g.Material("lambert", albedo=1.0).write(tmp_path / "white.binary")


def test_readings_that_a_format_has_no_place_for(tmp_path):
    light, sensor = g.direction([0.2, 0.5], 0.0), g.direction([0.3, 0.6], 1.0)
    plain = dict(symmetry="none", parametrization="spherical")
    several = g.Measurement(light, sensor, [1.0, 2.0], **plain)
    with pytest.raises(ValueError, match="2 directions of the light; allowed: one in a file of pab-opto"):
        several.write(tmp_path / "several.dat", format="pab-opto")
    assert not list(tmp_path.iterdir())
    known = g.Measurement(light[:1], sensor, [1.0, 2.0], [0.1, 0.1], **plain)
    with pytest.warns(UserWarning, match="pab-opto has no place for uncertainties"):
        known.write(tmp_path / "one.dat", format="pab-opto")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        several.write(tmp_path / "several.npz")
    again = g.Measurement.open(tmp_path / "several.npz", **plain)
    assert np.array_equal(again.values, several.values)


def test_a_file_lists_some_poses_in_an_order(gonio, tmp_path):
    path = config(tmp_path, SCENE + '[[sample_set]]\nkind = "grid"\n[[parametrization]]\nkind = "hybrid"\n[[reconstruction]]\nkind = "cubic"\n')
    gonio("schedule", path, "--budget", 60, "--instrument", "cornell", "--skip-unreachable", "-o", tmp_path / "poses.csv")
    listed = [int(row["index"]) for row in rows(tmp_path / "poses.csv")]
    some, all = g.Schedule.open(tmp_path / "poses.csv"), g.plan("grid", 60, "hybrid")
    assert all.order is None and some.order.tolist() == listed != sorted(listed)
    assert len(some) == len(all) > len(listed) and np.array_equal(some.coordinates, all.coordinates)
    read = [o == "reading" for o in g.measure(g.Material("lambert"), some).outcomes]
    assert np.flatnonzero(read).tolist() == sorted(listed)


def test_files_are_not_replaced_unasked(tmp_path):
    s = g.plan("sobol", 20)
    m = g.measure(g.Material("lambert"), s)
    for thing, name in ((s, "poses.csv"), (m, "readings.jsonl"), (g.Material("lambert"), "table.binary")):
        thing.write(tmp_path / name)
        with pytest.raises(ValueError, match="exists.*force=True"):
            thing.write(tmp_path / name)
        thing.write(tmp_path / name, force=True)
    again = g.Schedule.open(tmp_path / "poses.csv")
    assert np.allclose(again.coordinates, s.coordinates, rtol=1e-15, atol=0) and again.sample_set == s.sample_set == "sobol"


# Examples


@needs("mitsuba", "nbformat", "nbclient", "ipykernel")
def test_the_notebook_runs(tmp_path):
    """From readings to a rendered sphere; the picture is of three spheres that are alike."""
    import nbclient
    import nbformat

    folder = PACKAGE / "examples"
    (tmp_path / "mitsuba_bsdf.py").write_text((folder / "mitsuba_bsdf.py").read_text())
    notebook = nbformat.read(folder / "readings_to_sphere.ipynb", 4)
    # What it shows is stored, small, and says nothing of the machine it was made on.
    stored = (folder / "readings_to_sphere.ipynb").read_text()
    assert all(c.outputs for c in notebook.cells if c.cell_type == "code" and ("print(" in c.source or "Image(" in c.source) and "def " not in c.source)
    assert len(stored) < 500_000 and not any(name in stored for name in ("/home/", "/tmp/", "/Users/", "site-packages", "Traceback"))
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": tmp_path}}).execute()
    printed = "".join(o.get("text", "") for c in notebook.cells for o in c.get("outputs", []))
    away = [float(line.split("by ")[1].split()[0]) for line in printed.splitlines() if "differs from" in line]
    assert len(away) == 2 and max(away) < 0.05, printed
    assert (tmp_path / "spheres.png").stat().st_size > 10_000
