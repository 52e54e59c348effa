"""Arrow opens `results.parquet`: the cells of `results.csv`, with their types."""

import csv
import subprocess

import pytest
from conftest import GONIO, lack, needs, optional

pa, parquet = optional("pyarrow"), optional("pyarrow.parquet")
pytestmark = needs("pyarrow", "pyarrow.parquet")

SCENE = """
quantities = ["albedo"]
budgets = [20, 50]
seeds = [18446744073709551]
metrics = { pairs = 500 }
output = { parquet = true }
[[material]]
kind = "ggx"
name = "Grüße, \\"a\\""
alpha = 0.3
[[instrument]]
preset = "cornell"
"""


@pytest.fixture(autouse=True)
def build_with_parquet(tmp_path):
    """A build that cannot write it says so, and checks nothing."""
    config = tmp_path / "asked.toml"
    config.write_text(SCENE)
    done = subprocess.run([GONIO, "check", config], capture_output=True, text=True)
    if "lacks the feature parquet" in done.stderr:
        assert done.returncode == 2
        lack(done.stderr.strip())


def test_arrow_reads_the_rows_of_a_run(gonio, tmp_path):
    config = tmp_path / "scene.toml"
    config.write_text(SCENE)
    gonio("run", config, "-o", tmp_path / "run", "-q")
    table = parquet.read_table(tmp_path / "run/results.parquet")
    with open(tmp_path / "run/results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert table.num_rows == len(rows) >= 4
    assert table.column_names == list(rows[0])
    seen = set()
    for name in table.column_names:
        cells = [row[name] for row in rows]
        kind, column = table.schema.field(name).type, table.column(name).to_pylist()
        read = {
            pa.string(): str,
            pa.bool_(): lambda cell: {"true": True, "false": False}[cell],
            pa.uint64(): int,
            pa.float64(): float,
        }[kind]
        seen.add(kind)
        # An empty text is one; other empty cells have no value.
        expected = [cell if kind == pa.string() else read(cell) if cell else None for cell in cells]
        assert column == expected, name
    assert len(seen) == 4
    assert any(None in table.column(name).to_pylist() for name in table.column_names)


def test_parquet_is_not_written_unasked_and_goes_with_its_rows(gonio, tmp_path):
    config = tmp_path / "scene.toml"
    config.write_text(SCENE)
    folder = tmp_path / "run"
    gonio("run", config, "-o", folder, "-q")
    assert (folder / "results.parquet").exists()
    # Rows are added that it lacks.
    gonio("run", config, "--set", "output.parquet=false", "--set", "budgets=[20, 50, 90]", "-o", folder, "-q")
    assert not (folder / "results.parquet").exists()
