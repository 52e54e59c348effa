"""The campaign: every command that takes a file against every kind of file, whole and damaged, and what must hold then.

A file that is damaged may be read or refused. It may not make a command hang, crash, print what a terminal obeys, leave half a
file, or change what it was given. Nothing here is random but by a number that is the name of the case.
"""

import concurrent.futures
import csv
import io
import json
import math
import os
import pathlib
import random
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import threading
import time
import zipfile
import zlib

import pytest
from conftest import GONIO, lack, needs, optional
from kinds import DAMAGES, KINDS, OWN, SCENE, THREE, npz, poses, readings_csv

np = optional("numpy")
pytestmark = [needs("numpy"), pytest.mark.filterwarnings("ignore:Duplicate name")]

LIMIT = 10
# An internal error (1) is no answer to a file.
CODES = {0, 2, 3, 4, 5, 6}
# With these nothing is written; 5 and 6 are findings, and come with what was found.
REFUSALS = {2, 3, 4}
DUMP = re.compile(r"panicked|RUST_BACKTRACE|Os \{|Custom \{|kind: [A-Z]|\b(Some|Ok|Err|None|Error)\(|Utf8Error|ParseIntError")
WORKERS = os.cpu_count() or 2
# A core each: they run beside each other.
ENVIRONMENT = {**os.environ, "RAYON_NUM_THREADS": "1", "NO_COLOR": "1"}
COUNT = dict.fromkeys(("commands", "files", "refusals", "signals"), 0) | {"slowest": (0.0, "")}
LOCK = threading.Lock()

BRDF = {"readings", "config", "table", "binary"}
# Command: which roles of files it is for, and how it is called; {B} has files that are whole.
COMMANDS = {
    "check": ({"config", "binary", "instrument"}, "check {IN}"),
    "run": ({"config", "binary"}, "run {IN} --set budgets=[20] --set metrics.pairs=100 --set metrics.max_pairs=1 -o {OUT}/run"),
    "schedule": ({"config", "binary"}, "schedule {IN} --budget 20 -o {OUT}/s.csv"),
    "append": ({"readings"}, "schedule {B}/m.toml --budget 300 --append {IN} -o {OUT}/s.csv"),
    "tabulate": ({"config"}, "tabulate {IN} -o {OUT}/t.bin"),
    "advise": ({"config"}, "advise {IN} --budget 3 --most 1"),
    "advise-prior": ({"prior"}, "advise {B}/m.toml --budget 3 --most 1 --prior {IN}"),
    "next": ({"readings"}, "next {IN} --batch 2 -o {OUT}/n.csv"),
    "next-prior": ({"prior"}, 'next --set prior="{IN}" --batch 2 -o {OUT}/n.csv'),
    "measure": ({"schedule"}, "measure {IN} --config {B}/m.toml -o {OUT}/r.csv"),
    "measure-config": ({"config"}, "measure {B}/s.csv --config {IN} -o {OUT}/r.npz"),
    "instrument": ({"instrument"}, "measure {B}/s.csv --config {B}/m.toml --instrument {IN} --skip-unreachable -o {OUT}/r.jsonl"),
    "reconstruct": ({"readings"}, "reconstruct {IN} --reconstruction nearest -o {OUT}/t.bin"),
    "checked": ({"readings"}, "reconstruct {IN} --cross-validation none --checked {OUT}/c.csv"),
    "against": ({"table"}, "reconstruct {B}/r.csv --reconstruction nearest --against {IN}"),
    "convert-readings": ({"readings", "schedule"}, "convert {IN} {OUT}/o.npz"),
    "convert-table": ({"table", "binary"}, "convert {IN} {OUT}/o.zbsdf"),
    "moments": (BRDF, "moments {IN} --set moments.views=2 --set moments.estimator.tolerance=0.1 -o {OUT}/m"),
    "slice": (BRDF, "slice {IN} --view-deg 30 --resolution 8 -o {OUT}/s"),
    "symmetry": (BRDF, "symmetry {IN}"),
    "distortion": (BRDF, "distortion {IN} --table alignment -o {OUT}/d.csv --format csv"),
    "explore-schedule": ({"schedule"}, "explore --schedule {IN} --instrument cornell -o {OUT}/e.html"),
    "explore-readings": ({"readings"}, "explore --readings {IN} -o {OUT}/e.html"),
    "explore-plan": ({"config"}, "explore --plan {IN} --instrument cornell -o {OUT}/e.html"),
    "sphere": (BRDF, "picture sphere {IN} --resolution 16 --samples 2 -o {OUT}/p"),
    "sky": ({"sky"}, "picture sphere lambert --lighting {IN} --resolution 16 --samples 2 -o {OUT}/p"),
    "slices": ({"config", "table"}, "picture slices {IN} -o {OUT}/p"),
    "compare": ({"config"}, "picture compare {IN} --budget 20 --resolution 16 --samples 2 -o {OUT}/p"),
    "subset": ({"config"}, "subset --parametrization hybrid --box h_bar=0..0.2 --material {IN} -o {OUT}/s.svg"),
    "density": ({"schedule"}, "density {IN}"),
    "claims": ({"config"}, "claims {IN}"),
    "paths": ({"config"}, "paths {IN} --paths 1024 -o {OUT}/p.svg"),
    "surface": ({"map"}, "surface height-map --set file={IN} --set pitch_um=1 --set height_um=1 --rays 1000 --elevation 30"),
    "train": ({"config"}, "train {IN} --nodes 500 --functions 2 -o {OUT}/p.gonio"),
    "bench": ({"binary"}, "bench moments --quick --merl {IN}"),
    "merge": ({"folder"}, "merge {IN} -o {OUT}/whole"),
}
# Of these a kind of each role is enough.
DEAR = {"advise", "claims", "subset"}


@pytest.fixture(scope="module")
def whole(gonio):
    """Every kind of file, whole: name to bytes; and a folder with all. Others may enter it, as one test is run by another."""
    with tempfile.TemporaryDirectory(prefix="campaign-") as folder:
        base = pathlib.Path(folder)
        base.chmod(0o755)
        for file, _, by_hand in KINDS.values():
            if by_hand:
                (base / file).write_bytes(by_hand())
        (base / "three.toml").write_text(THREE)
        (base / "one-light.csv").write_bytes(readings_csv(poses((30.0,))))
        for end in ("csv", "npz", "jsonl"):
            gonio("schedule", "m.toml", "--budget", 40, "-o", f"s.{end}", cwd=base)
            gonio("measure", f"s.{end}", "--config", "m.toml", "-o", f"r.{end}", cwd=base)
        gonio("convert", "r.csv", "r.astm", cwd=base)
        gonio("convert", "one-light.csv", "r.pab", cwd=base)
        gonio("train", "three.toml", "--nodes", 500, "--functions", 2, "-o", "p.gonio", cwd=base)
        (base / "cornell.toml").write_text(gonio("list", "instruments", "cornell"))
        for end in ("bin", "bsdf", "binary", "mbsdf"):
            gonio("tabulate", "m.toml", "-o", f"t.{end}", cwd=base)
        gonio("picture", "sphere", "lambert", "--resolution", 16, "-o", "p", cwd=base)
        shutil.move(next((base / "p").glob("*.exr")), base / "sky.exr")
        yield base


@pytest.fixture(scope="module", autouse=True)
def counted(request):
    """Prints what was tried."""
    yield
    seconds, argv = COUNT["slowest"]
    told = ", ".join(f"{n} {what}" for what, n in COUNT.items() if what != "slowest")
    with request.config.pluginmanager.getplugin("capturemanager").global_and_fixture_disabled():
        print(f"\ncampaign: {told}; slowest {seconds:.1f} s: {argv}")


def count(what, number=1):
    with LOCK:
        COUNT[what] += number


def start(argv, **options):
    pipe = subprocess.PIPE
    options = {"stdin": subprocess.DEVNULL, "stdout": pipe, "stderr": pipe, "env": ENVIRONMENT} | options
    return subprocess.Popen([GONIO, *argv], **options)


def argv_of(command, base, file, out):
    words = {"B": base, "IN": file, "OUT": out}
    return ["-q", *(word.format(**words) for word in COMMANDS[command][1].split())]


def tried(argv, file, out, **options):
    """Runs a command that reads a file; its code, and what it did that it may not."""
    out.mkdir(parents=True)
    out.chmod(0o777)
    began, found = time.monotonic(), []
    process = start(argv, cwd=out.parent, **options)
    try:
        stdout, stderr = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        stdout, stderr = process.communicate()
        found.append(f"ran for more than {LIMIT} s")
    seconds, code = time.monotonic() - began, process.returncode
    count("commands")
    count("refusals", code in REFUSALS)
    with LOCK:
        COUNT["slowest"] = max(COUNT["slowest"], (seconds, " ".join(map(ascii, argv))[:200]))
    text, left = stderr.decode(errors="replace"), [f for f in out.rglob("*") if not f.is_dir()]
    if not found and code not in CODES:
        found.append(f"exit code {code}")
    if DUMP.search(text):
        found.append("a dump on stderr")
    if b"\x1b" in stdout + stderr:
        found.append("an escape byte is printed")
    if any(f.name.endswith(".part") for f in left):
        found.append("a .part is left")
    if code in REFUSALS:
        # Doubts of the same file may stand before the error, which is last.
        told = [line for line in text.splitlines() if not line.startswith("  because: ")]
        names = [re.sub(r"[\x00-\x1f\x7f-\x9f]|[\udc80-\udcff]+", "\ufffd", n) for n in (file.name, file.stem)]
        if not told or not all(line.startswith("gonio: ") for line in told) or len(told) > 3:
            found.append("not one sentence")
        elif not any(n in told[-1] for n in names) and not (str(out) in told[-1] or re.search(r"--[a-z]|gonio [a-z]+:|\b(grey|ggx)\b", told[-1])):
            found.append("no file or key is named")
        if left:
            found.append(f"left: {sorted(f.name for f in left)}")
    elif code == 0 and any(str(out) in word for word in argv) and not (left and all(f.stat().st_size for f in left)):
        found.append("nothing is written, or an empty file")
    shutil.rmtree(out)
    told = f"{' '.join(map(ascii, argv))}\n      code {code}, {seconds:.1f} s; stderr: {ascii(text[:300])}"
    return code, [f"{what}: {told}" for what in found]


def digest(path):
    return zlib.crc32(path.read_bytes())


def all_of(jobs):
    """The results of functions that wait for processes."""
    with concurrent.futures.ThreadPoolExecutor(WORKERS) as pool:
        return [found for of in pool.map(lambda job: job(), jobs) for found in of]


def report(found):
    assert not found, f"{len(found)} broken laws\n" + "\n".join(f"  - {line}" for line in found)


def commands_of(role, number):
    """The commands that are for a role, of many the first and another by turns; and one that is not."""
    fit = [c for c, (roles, _) in COMMANDS.items() if role in roles]
    other = [c for c in COMMANDS if c not in fit]
    turn = [fit[3 + number % (len(fit) - 3)]] if len(fit) > 3 else []
    return [*fit[:3], *turn, other[number % len(other)]]


@pytest.mark.parametrize("kind", KINDS)
def test_whole_files(whole, kind):
    """Every command takes every kind, or refuses it."""
    file = whole / KINDS[kind][0]
    before = digest(file)
    role = KINDS[kind][1]
    first = next(k for k, (_, r, _) in KINDS.items() if r == role) == kind
    chosen = [c for c in COMMANDS if first or role not in BRDF or c not in DEAR]
    found = all_of([lambda c=c, out=whole / f"out-{kind}-{c}": tried(argv_of(c, whole, file, out), file, out)[1] for c in chosen])
    assert digest(file) == before
    count("files")
    report(found)


def sealed(kind, damage, data, bad):
    """True if the file itself tells that it was changed, by a sum or by two members of a name."""
    if damage == "twice the same":
        return True
    if not damage.startswith("flip"):
        return False
    if kind == "prior":
        return True
    if kind not in ("npz", "own npz", "schedule npz"):
        return False
    at = next(k for k in range(len(data)) if data[k] != bad[k])
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        # The head of a member has 30 bytes, its name, and a field whose length it says.
        starts = [(i, i.header_offset + 30 + sum(struct.unpack_from("<2H", data, i.header_offset + 26))) for i in archive.infolist()]
    return any(first <= at < first + i.compress_size for i, first in starts)


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files(whole, kind):
    """Each damage, by the commands that are for the kind and one that is not."""
    name, role, _ = KINDS[kind]
    data, end = (whole / name).read_bytes(), name.rsplit(".", 1)[1]
    damages = DAMAGES | OWN.get(end, {})
    jobs = []
    for number, (damage, of) in enumerate(damages.items()):

        def job(number=number, damage=damage, of=of):
            folder = whole / f"{kind}-{number}"
            folder.mkdir()
            file = folder / f"bad.{end}"
            bad = of(data, random.Random(f"{kind} {damage}"))
            file.write_bytes(bad)
            before, found = zlib.crc32(bad), []
            for command in commands_of(role, number):
                out = folder / f"out-{command}"
                code, broken = tried(argv_of(command, whole, file, out), file, out)
                found += [f"{kind}, {damage}: {line}" for line in broken]
                reads = role in COMMANDS[command][0]
                if code == 0 and reads and bad != data and sealed(kind, damage, data, bad):
                    found.append(f"{kind}, {damage}: {command} takes a file whose sum is wrong")
                if digest(file) != before:
                    found.append(f"{kind}, {damage}: {command} changed what it read")
            count("files")
            shutil.rmtree(folder)
            return found

        jobs.append(job)
    report(all_of(jobs))


# What a path may lead to.
FORMS = ("folder", "pipe", "circle", "nowhere", "a folder in a file", "no leave")
NAMES = ["=1+1", "+1", "-1", "@a", "\x1b[31mred", "line\nbreak", "\udcff\udcfe", "ü", "x" * 240, "a b", "{IN}", "*", "'\"$(a)"]


@pytest.fixture(scope="module")
def other_user(whole):
    """Options of a process that may not read everything: of this user, or, as root may, of nobody."""
    if os.geteuid():
        return {}
    program = whole / "gonio"
    shutil.copy(GONIO, program)
    nobody = {"user": 65534, "group": 65534, "extra_groups": []}
    try:
        # Of Popen, the program that is started; the first word of its arguments stays.
        subprocess.run([program, "--version"], check=True, capture_output=True, **nobody)
    except (OSError, subprocess.SubprocessError) as e:
        lack(f"no other user can run the program ({e})")
    return {"executable": program, **nobody}


@pytest.mark.parametrize("form", FORMS)
def test_what_is_no_file_is_refused(whole, other_user, form):
    jobs = []
    for command in COMMANDS:
        for end in ("csv", "toml", "npz", "binary", "xml"):

            def job(command=command, end=end):
                folder = whole / f"form-{command}-{end}"
                folder.mkdir()
                folder.chmod(0o777)
                file = folder / f"bad.{end}"
                options = {}
                if form == "folder":
                    file.mkdir()
                elif form == "pipe":
                    os.mkfifo(file)
                elif form == "circle":
                    file.symlink_to(file.name)
                elif form == "a folder in a file":
                    file = whole / "m.toml" / f"bad.{end}"
                elif form == "no leave":
                    shutil.copy(whole / {"csv": "r.csv", "toml": "m.toml", "npz": "r.npz", "binary": "t.bin", "xml": "t.xml"}[end], file)
                    file.chmod(0)
                    options = other_user
                code, broken = tried(argv_of(command, whole, file, folder / "out"), file, folder / "out", **options)
                if code == 0:
                    broken.append(f"{command} takes {form} for a .{end}")
                if form == "no leave":
                    file.chmod(0o600)
                shutil.rmtree(folder)
                count("files")
                return [f"{form}: {line}" for line in broken]

            jobs.append(job)
    report(all_of(jobs))


NAMED = "csv append, csv next, csv reconstruct, npz reconstruct, csv moments, npz symmetry, config run, config moments, zemax against"
NAMED += ", zemax symmetry, schedule measure, schedule npz density, instrument instrument, config tabulate"


@pytest.mark.parametrize("name", NAMES, ids=ascii)
def test_names_are_names(whole, name):
    """A file with a name that is something else elsewhere is read, and its name does no harm. A material has it too, and may
    refuse it if it is long, moves a cursor or is no UTF-8."""
    no_material = len(name) > 200 or any(ord(c) < 32 or "\udc80" <= c <= "\udcff" for c in name)

    def job(kind, command):
        file = KINDS[kind][0]
        folder = whole / f"name-{kind}-{command}"
        folder.mkdir()
        own = folder / (name + "." + file.rsplit(".", 1)[1])
        shutil.copy(whole / file, own)
        code, broken = tried(argv_of(command, whole, own, folder / "out"), own, folder / "out")
        if code != 0 and not (no_material and code in REFUSALS):
            broken.append(f"{command} {file}: code {code} under the name {name!a}, 0 under its own")
        shutil.rmtree(folder)
        count("files")
        return broken

    report(all_of([lambda words=words: job(*words.rsplit(" ", 1)) for words in NAMED.split(", ")]))


# What writes a file, and the file it reads, which is never what it writes.
WRITERS = {
    "schedule": ("m.toml", "schedule {IN} --budget 20 -o {OUT} --format csv"),
    "append": ("r.csv", "schedule m.toml --budget 300 --append {IN} -o {OUT}"),
    "next": ("r.csv", "next {IN} --batch 2 -o {OUT}"),
    "next npz": ("r.npz", "next r.csv {IN} --batch 2 -o {OUT}"),
    "next prior": ("p.gonio", 'next --set prior="{IN}" --batch 2 -o {OUT} --format csv'),
    "measure": ("s.csv", "measure {IN} --config m.toml -o {OUT}"),
    "measure config": ("m.toml", "measure s.csv --config {IN} -o {OUT} --format csv"),
    "measure instrument": ("cornell.toml", "measure s.csv --config m.toml --instrument {IN} --skip-unreachable -o {OUT} --format csv"),
    "reconstruct": ("r.csv", "reconstruct {IN} --reconstruction nearest -o {OUT} --format zemax"),
    "checked": ("r.csv", "reconstruct {IN} --checked {OUT}"),
    "uncertainty": ("r.csv", "reconstruct {IN} --uncertainty {OUT}"),
    "against": ("t.zbsdf", "reconstruct r.csv --against {IN} --reconstruction nearest -o {OUT}"),
    "explore": ("r.csv", "explore --readings {IN} -o {OUT}"),
    "explore plan": ("m.toml", "explore --plan {IN} -o {OUT}"),
    "picture of": ("r.csv", "reconstruct {IN} --picture {OUT}"),
    "convert": ("r.csv", "convert {IN} {OUT}"),
    "convert second": ("one-light.csv", "convert own.csv {IN} {OUT}"),
    "convert table": ("t.zbsdf", "convert {IN} {OUT}"),
    "tabulate": ("m.toml", "tabulate {IN} -o {OUT} --format zemax"),
    "tabulate table": ("t.binary", "tabulate {IN} -o {OUT}"),
    "train": ("three.toml", "train {IN} --nodes 500 --functions 2 -o {OUT}"),
    "distortion": ("m.toml", "distortion {IN} --table alignment -o {OUT}"),
    "alignment": ("m.toml", "distortion {IN} --table alignment --picture {OUT}"),
    "claims": ("m.toml", "claims {IN} -o {OUT}"),
    "subset": ("m.toml", "subset --parametrization hybrid --box h_bar=0..0.2 --material {IN} -o {OUT}"),
    "paths": ("paths.toml", "paths {IN} --paths 1024 -o {OUT}"),
}
WAYS = {
    "itself": lambda file: file,
    "a link": lambda file: (file.parent / ("link" + file.suffix)),
    "a hard link": lambda file: (file.parent / ("hard" + file.suffix)),
    "another spelling": lambda file: file.parent / ".." / file.parent.name / file.name,
}


@pytest.mark.parametrize("writer", WRITERS)
def test_output_is_never_input(whole, writer):
    (whole / "paths.toml").write_text('[[material]]\nkind = "smith-multiple"\nalpha = 0.5\n')
    name, command = WRITERS[writer]
    # Listed once: other jobs make and remove folders.
    files = [f for f in whole.iterdir() if f.is_file() and (f.name != "t.binary" or name == f.name)]

    def job(way):
        folder = whole / f"{writer} {way}".replace(" ", "-")
        folder.mkdir()
        for file in files:
            shutil.copy2(file, folder)
        file = folder / name
        (folder / ("link" + file.suffix)).symlink_to(file.name)
        (folder / ("hard" + file.suffix)).hardlink_to(file)
        before, out = digest(file), WAYS[way](file)
        found = []
        for argv in ([], ["--force"]):
            process = start([*(w.format(IN=file, OUT=out) for w in command.split()), *argv], cwd=folder)
            text = process.communicate(timeout=LIMIT)[1].decode()
            count("commands")
            changed = " and it is changed" if digest(file) != before else ""
            # Of a hard link one name gets another file, and the other keeps the one that was read.
            if changed or process.returncode not in ({0, 2} if way == "a hard link" else {2}):
                told = f"{command} {' '.join(argv)} with OUT = {way} of {name}"
                found.append(f"{told}: code {process.returncode}{changed}; {ascii(text[:200])}")
        shutil.rmtree(folder)
        return found

    report(all_of([lambda way=way: job(way) for way in WAYS]))


# What takes long, and may be asked to stop.
LONG = {
    "reconstruct": "reconstruct many.csv",
    "reconstruct a table": "reconstruct many.csv --reconstruction thin-plate -o {OUT}/t.binary",
    "against": "reconstruct r.csv --against facets.toml --material a",
    "explore": "explore lambert --readings many.csv -o {OUT}/e.html",
    "next": "next some.csv --batch 900 -o {OUT}/n.csv",
    "tabulate": "tabulate m.toml --tolerance 1e-9 -o {OUT}/t.xml",
    "tabulate paths": "tabulate facets.toml --material a -o {OUT}/t.binary",
    "run": "run quickstart.toml -o {OUT}/run",
    "run a truth": "run facets.toml -o {OUT}/run",
    "run moments": "run moments.toml -o {OUT}/run",
    "alignment": "distortion facets.toml --table alignment",
    "stability": "stability -o {OUT}/s.txt",
    "claims": "claims m.toml",
    "advise": "advise --budget 32",
    "train": "train facets.toml -o {OUT}/p.gonio",
    "moments": "moments facets.toml --material a",
    "symmetry": "symmetry facets.toml --material a",
    "slice": "slice facets.toml --material a --view-deg 30 -o {OUT}/s",
    "picture": "picture compare facets.toml --material a -o {OUT}/p",
    "paths": "paths facets.toml --material a --paths 16777216",
    "surface": "surface gaussian --rays 100000000",
    "bench": "bench",
    "convert": "convert many.csv {OUT}/o.jsonl",
    "measure": "measure poses.csv --config facets.toml --material a -o {OUT}/r.csv",
    "schedule": "schedule m.toml --budget 1e6 -o {OUT}/s.csv",
}


@pytest.fixture(scope="module")
def long_work(whole):
    rng = random.Random("long")
    angles = [tuple(round(rng.uniform(0, most), 3) for most in (85, 85, 360)) for _ in range(60_000)]
    rows = [(i, 0.0, o, p, round(0.1 + 2 * math.exp(-(((o - i) / 20) ** 2)), 6)) for i, o, p in angles]
    (whole / "many.csv").write_bytes(readings_csv(rows))
    (whole / "some.csv").write_bytes(readings_csv(rows[:3000]))
    (whole / "poses.csv").write_bytes(readings_csv([row[:4] for row in rows], "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg"))
    facets = '[[material]]\nkind = "smith-multiple"\nalpha = {}\nname = "{}"\n'
    (whole / "facets.toml").write_text(facets.format(0.5, "a") + facets.format(0.8, "b"))
    moments = 'quantities = ["moments", "albedo"]\nbudgets = [16000]\n[[sample_set]]\nkind = "sobol"\n'
    (whole / "moments.toml").write_text(moments + '[[reconstruction]]\nkind = "thin-plate"\n' + SCENE)
    shutil.copy(pathlib.Path(__file__).parents[2] / "configs/quickstart.toml", whole)
    return whole


@pytest.mark.parametrize("name", LONG)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_are_answered(long_work, name, number, tmp_path):
    """A command ends at once, with the code that says by what, and leaves nothing that is half written."""
    argv = LONG[name]
    process = start(["-q", *argv.format(OUT=tmp_path).split()], cwd=long_work)
    # Of moments the short part comes first.
    time.sleep(1.5 if name == "run moments" else 0.3)
    assert process.poll() is None, f"{argv} has ended before: {process.communicate()}"
    began = time.monotonic()
    process.send_signal(number)
    count("signals")
    try:
        text = process.communicate(timeout=LIMIT)[1].decode()
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        pytest.fail(f"gonio {argv}: no answer to {number.name} in {LIMIT} s", pytrace=False)
    seconds = time.monotonic() - began
    assert process.returncode == 128 + number and text.splitlines()[-1].startswith("gonio: interrupted"), (argv, process.returncode, text)
    # A loaded machine; on an idle one it is a second.
    assert seconds < 2, f"gonio {argv}: {seconds:.1f} s from {number.name} to the end"
    # Values of random paths are kept, and named.
    left = [f for f in tmp_path.rglob("*") if f.name.endswith(".part") and str(f) not in text]
    assert not left, f"gonio {argv}: {number.name} leaves {[f.name for f in left]}"
    if name == "stability" and (table := tmp_path / "s.txt").exists():
        assert re.search("interrupted|cut", table.read_text()), "a table that was cut does not say so"


def test_a_run_outlives_its_terminal(long_work, tmp_path):
    """SIGHUP, which `nohup` turns off."""
    process = start(
        ["-q", "run", "quickstart.toml", "-o", tmp_path / "run"],
        cwd=long_work,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
    )
    time.sleep(0.3)
    process.send_signal(signal.SIGHUP)
    count("signals")
    time.sleep(0.5)
    alive = process.poll() is None
    process.kill()
    assert alive, process.communicate()


H = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value"
# The same readings in other forms, by hand.
SAME = {
    "crlf.csv": lambda text, rows: text.replace(b"\n", b"\r\n"),
    "bom.csv": lambda text, rows: b"\xef\xbb\xbf" + text,
    "comma.csv": lambda text, rows: text.replace(b",", b";").replace(b".", b","),
    "tab.csv": lambda text, rows: text.replace(b",", b"\t"),
    "turned.csv": lambda text, rows: readings_csv(rows[::-1]),
    "columns.csv": lambda text, rows: readings_csv([row[::-1] for row in rows], ",".join(H.split(",")[::-1])),
    "radians.csv": lambda text, rows: readings_csv([(*map(math.radians, r[:4]), r[4]) for r in rows], H.replace("_deg", "_rad")),
    "hand.jsonl": lambda text, rows: "".join(json.dumps(dict(zip(H.split(","), row))) + "\n" for row in rows).encode(),
    "hand.npz": lambda text, rows: npz(**dict(zip(H.split(","), np.array(rows).T))),
}


@pytest.mark.parametrize("form", [*SAME, "made.csv", "made.jsonl", "made.npz", "made.astm", "made.pab"])
def test_forms_of_the_same_readings(gonio, tmp_path, form):
    """They have one reconstruction, and go through any format and back as they were."""
    rows = poses((30.0,) if form == "made.pab" else (15.0, 50.0, 70.0))
    (tmp_path / "plain.csv").write_bytes(readings_csv(rows))
    if form in SAME:
        (tmp_path / form).write_bytes(SAME[form](readings_csv(rows), rows))
    else:
        gonio("convert", "plain.csv", form, cwd=tmp_path)
    gonio("convert", form, "back.csv", cwd=tmp_path)
    lines = [line for line in (tmp_path / "back.csv").read_text().splitlines() if not line.startswith("#")]
    back = [[float(row[name]) for name in H.split(",")] for row in csv.DictReader(lines)]
    # Of angles that moved by a rounding the order is what it was, and 360° is 0°.
    tidy = sorted([round(cell, 9) % 360 for cell in row] for row in back)
    assert tidy == sorted([round(cell, 9) for cell in row] for row in rows)
    plain, other = (gonio("reconstruct", file, cwd=tmp_path) for file in ("plain.csv", form))
    count("commands", 4)
    count("files")
    assert other == plain


def digit(data, rng):
    """Another digit in a number of a row that is finished."""
    at = rng.choice([m.start(1) for m in re.finditer(rb'"(?:nrmse|energy|cbrt)":-?\d\.(\d)', data)])
    return data[:at] + b"%d" % ((data[at] - 48 + 1 + rng.randrange(8)) % 10) + data[at + 1 :]


def numbers_of(folder):
    with open(folder / "results.csv") as file:
        return [{k: v for k, v in row.items() if not k.endswith("_seconds")} for row in csv.DictReader(file)]


@pytest.mark.parametrize("name", ["results.jsonl", "manifest.json", "config.toml", "results.csv"])
def test_damaged_runs(gonio, whole, name):
    """A run of which a file is damaged goes on to what it would have been, or is refused; and so do parts that are merged."""
    base = whole / "runs"
    if not base.exists():
        gonio("run", whole / "run.toml", "-q", "-o", base / "all")
        for k in (1, 2):
            gonio("run", whole / "run.toml", "-q", "--shard", f"{k}/2", "-o", base / f"{k}")
    expected = sorted(map(str, numbers_of(base / "all")))
    more = OWN["toml"] if name == "config.toml" else OWN["jsonl"] | {f"digit {k}": digit for k in range(4)} if name == "results.jsonl" else {}
    jobs = []
    for number, (damage, of) in enumerate((DAMAGES | more).items()):
        for command in ("run", "merge"):

            def job(number=number, damage=damage, of=of, command=command):
                folder = whole / f"run-{name}-{command}-{number}"
                shutil.copytree(base, folder)
                file = folder / ("all" if command == "run" else "1") / name
                bad = of(file.read_bytes(), random.Random(f"{name} {damage} {command}"))
                file.write_bytes(bad)
                made = folder / "all" if command == "run" else folder / "whole"
                # A run that is refused keeps what it has: only what it says is looked at.
                argv = ["run", whole / "run.toml", "-o", made] if command == "run" else ["merge", folder / "1", folder / "2", "-o", made]
                code, broken = tried(["-q", *map(str, argv)], file, folder / "out")
                if code == 0 and damage.startswith("digit"):
                    broken.append("a row is taken of which a digit was changed")
                elif code == 0 and sorted(map(str, numbers_of(made))) != expected:
                    broken.append("code 0, and other numbers than those of the whole run")
                elif code in REFUSALS and command == "merge" and made.exists():
                    broken.append("refused, and a folder is left")
                if command == "merge" and digest(file) != zlib.crc32(bad):
                    broken.append("a part is changed")
                shutil.rmtree(folder)
                count("files")
                return [f"{command}, {name}, {damage}: {line}" for line in broken]

            jobs.append(job)
    report(all_of(jobs))


@pytest.mark.parametrize("threads", ["0", "-1", "x", "100000", "9" * 30, "\x1b[31m"])
def test_threads_that_cannot_be_are_a_sentence(whole, threads):
    file = whole / "RAYON_NUM_THREADS"
    argv = ["-q", "reconstruct", str(whole / "own.csv")]
    _, broken = tried(argv, file, whole / f"out-threads-{len(threads)}", env=ENVIRONMENT | {"RAYON_NUM_THREADS": threads})
    report(broken)
