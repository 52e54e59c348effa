"""The recipes of configs/cluster, as they are shipped, on a real Slurm, by GNU parallel and by Snakemake."""

import csv
import os
import pathlib
import shutil
import signal
import subprocess
import sys

import pytest
from conftest import GONIO, needs
from one_node import Slurm, missing, state, until

ROOT = pathlib.Path(__file__).parents[2]
RECIPES = ROOT / "configs/cluster"
PARTS = 4
# The quickstart, of pairs enough that a part takes a few seconds: of each of 4 materials 20 grids by 2 methods, 20 sets of Sobol
# points and 4 of directions by kriging, under 2 measures.
OPTIONS = ["--set", "budgets=[60,90,120,150]", "--set", "metrics.pairs=100000", "--set", "metrics.max_pairs=1"]
ROWS = 4 * (20 * 2 + 20 + 4) * 2

# Where a user has them: `gonio`, and what is installed beside this Python.
PATH = os.pathsep.join([str(GONIO.parent), str(pathlib.Path(sys.executable).parent), os.environ["PATH"]])

needs_slurm = needs(besides=lambda: missing() and f"no Slurm: {missing()}")


def needs_program(program):
    return needs(besides=lambda: None if shutil.which(program, path=PATH) else f"no program {program}")


def rows(folder):
    with open(folder / "results.csv") as file:
        return list(csv.DictReader(file))


def lines(part):
    """The rows that a part has so far, as they are stored; not one that is half written."""
    file = part / "results.jsonl"
    found = file.read_bytes().splitlines(True) if file.exists() else []
    return [line for line in found if line.endswith(b"\n")]


def part(folder, number):
    return folder / f"runs/quickstart.shard-{number}-of-{PARTS}"


def held(folder, number, processes):
    """Waits until a part has some of its rows, and stops its clock there, so that no machine is too fast to be
    disturbed: its process, and the rows."""
    process = until(lambda: lines(part(folder, number)) and processes(), 30, f"part {number} has rows")[0]
    os.kill(process, signal.SIGSTOP)
    until(lambda: state(process) == "T", 10, f"part {number} waits")
    kept = lines(part(folder, number))
    assert 0 < len(kept) < ROWS / PARTS
    return process, kept


@pytest.fixture(scope="module")
def whole(gonio, tmp_path_factory):
    """The rows of the run that is not divided."""
    folder = tmp_path_factory.mktemp("whole")
    gonio("run", ROOT / "configs/quickstart.toml", *OPTIONS, "-q", "-o", folder / "whole")
    found = rows(folder / "whole")
    assert len(found) == ROWS
    return found


@pytest.fixture
def folder(tmp_path):
    """A user's folder: the config, and the recipes."""
    shutil.copy(ROOT / "configs/quickstart.toml", tmp_path)
    shutil.copytree(RECIPES, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture(scope="module")
def slurm():
    slurm = Slurm()
    try:
        slurm.environment["PATH"] = PATH
        slurm.start()
        yield slurm
    finally:
        slurm.stop()


def submitted(slurm, folder):
    """Numbers of the array and of the job that merges it, by the two commands that the recipe tells."""
    for_this_cluster = ["--partition=all", f"--array=1-{PARTS}", "--mem=500M"]
    array = slurm.command("sbatch", "--parsable", *for_this_cluster, "array.sh", "quickstart.toml", *OPTIONS, cwd=folder)
    after = f"--dependency=afterok:{array}"
    merge = slurm.command("sbatch", "--parsable", after, "--mem=500M", "merge.sh", "quickstart.toml", cwd=folder)
    return array, merge


@needs_slurm
def test_an_array_makes_the_rows_of_a_whole_run(slurm, folder, whole):
    array, merge = submitted(slurm, folder)
    assert slurm.ended(merge) == {None: "COMPLETED"}, slurm.logs()
    assert slurm.ended(array) == dict.fromkeys(range(1, PARTS + 1), "COMPLETED")
    assert rows(folder / "runs/quickstart") == whole
    # Each part has its own rows as a table too, and none has all.
    own = [rows(part(folder, k)) for k in range(1, PARTS + 1)]
    assert all(0 < len(o) < ROWS for o in own) and sum(map(len, own)) == ROWS
    assert all(row in whole for o in own for row in o)


@needs_slurm
def test_a_cancelled_task_goes_on(slurm, folder, whole, gonio):
    array, merge = submitted(slurm, folder)
    _, kept = held(folder, 2, lambda: slurm.processes(SLURM_ARRAY_JOB_ID=array, SLURM_ARRAY_TASK_ID=2))
    slurm.command("scancel", f"{array}_2")
    others = dict.fromkeys((1, 3, 4), "COMPLETED")
    assert slurm.ended(array) == {**others, 2: "CANCELLED"}, slurm.logs()
    # The whole does not wait for what will not come, and three parts are no whole.
    assert slurm.ended(merge) == {None: "CANCELLED"}
    three = [part(folder, k) for k in others]
    gonio("merge", *three, "-o", folder / "three", "-q", code=5)
    assert len(rows(folder / "three")) == ROWS * 3 // PARTS
    # It was asked to stop, and wrote its table.
    left = lines(part(folder, 2))
    assert set(kept) <= set(left) and len(rows(part(folder, 2))) == len(left) < ROWS / PARTS
    before = [lines(p) for p in three]

    array, merge = submitted(slurm, folder)
    assert slurm.ended(merge) == {None: "COMPLETED"}, slurm.logs()
    assert rows(folder / "runs/quickstart") == whole
    # Nothing was made twice: seconds are those of the first time.
    assert set(left) <= set(lines(part(folder, 2)))
    assert [lines(p) for p in three] == before


@needs_slurm
def test_the_failure_of_a_node_costs_its_task_and_no_other(slurm, folder, whole):
    array, merge = submitted(slurm, folder)
    process, kept = held(folder, 3, lambda: slurm.processes(SLURM_ARRAY_JOB_ID=array, SLURM_ARRAY_TASK_ID=3))
    slurm.fail(process)
    others = {task: "COMPLETED" for task in (1, 2, 4)}
    until(lambda: others.items() <= {t: s for t, (s, _) in slurm.states(array).items()}.items(), 30, "others end")
    slurm.reboot()
    # Slurm begins the task again by itself, and the merge has waited for it.
    assert slurm.ended(merge) == {None: "COMPLETED"}, slurm.logs()
    assert slurm.ended(array) == dict.fromkeys(range(1, PARTS + 1), "COMPLETED")
    assert rows(folder / "runs/quickstart") == whole
    assert set(kept) <= set(lines(part(folder, 3)))
    log = (slurm.folder / "slurmctld.log").read_text()
    assert "due to node failure" in log


def disturbed(folder, command, environment):
    """Runs a command, ends part 2 of it as a crash does, and returns what was left; the command has to tell."""
    environment = {**os.environ, "PATH": PATH, **environment}
    log = folder / "log"
    with open(log, "w") as file:
        job = subprocess.Popen(command, cwd=folder, env=environment, stdout=file, stderr=file)
    try:
        process, kept = held(folder, 2, lambda: running(folder, 2))
        os.kill(process, signal.SIGKILL)
        assert job.wait(60) != 0, log.read_text()
    finally:
        job.kill()
        for number in range(1, PARTS + 1):
            for process in running(folder, number):
                os.kill(process, signal.SIGKILL)
    assert kept == lines(part(folder, 2)), "what was made stays"
    others = [lines(part(folder, k)) for k in (1, 3, 4)]
    assert all(len(o) == ROWS / PARTS for o in others), "no other is stopped"
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert set(kept) <= set(lines(part(folder, 2)))
    assert [lines(part(folder, k)) for k in (1, 3, 4)] == others, "and none made again"


def running(folder, number):
    """Processes of a part in a folder."""
    found = []
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            here = os.readlink(entry / "cwd") == str(folder)
        except OSError:
            continue
        if here and words[0].endswith(b"gonio") and f"{number}/{PARTS}".encode() in words:
            found.append(int(entry.name))
    return found


@needs_program("parallel")
def test_gnu_parallel_makes_the_rows_of_a_whole_run(folder, whole):
    command = ["./parallel.sh", str(PARTS), "quickstart.toml", *OPTIONS]
    disturbed(folder, command, {"JOBS": str(PARTS)})
    assert rows(folder / "runs/quickstart") == whole


@needs_program("snakemake")
def test_snakemake_makes_the_rows_of_a_whole_run(folder, whole):
    options = "options=" + " ".join(OPTIONS)
    command = ["snakemake", "--snakefile", "Snakefile", "--cores", str(PARTS), "--keep-going"]
    command += ["--config", "study=quickstart.toml", f"parts={PARTS}", options]
    disturbed(folder, command, {"XDG_CACHE_HOME": str(folder / "cache")})
    assert rows(folder / "runs/quickstart") == whole
