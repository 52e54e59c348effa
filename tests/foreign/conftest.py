"""What every test here uses: the command, as another program would call it."""

import os
import pathlib
import subprocess

import pytest

GONIO = pathlib.Path(os.environ.get("GONIO", "target/release/gonio")).absolute()


@pytest.fixture(scope="session")
def gonio():
    """Runs the command and returns what it prints; another exit code than `code` fails."""

    def run(*args, code=0, cwd=None):
        done = subprocess.run([GONIO, *map(str, args)], capture_output=True, text=True, cwd=cwd)
        assert done.returncode == code, done.stderr
        return done.stdout

    return run
