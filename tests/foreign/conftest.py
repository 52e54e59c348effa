"""What every test here uses: the command, as another program would call it, and what a test needs besides."""

import importlib
import os
import pathlib
import subprocess

import pytest

GONIO = pathlib.Path(os.environ.get("GONIO", "target/release/gonio")).absolute()


def optional(module):
    """A module, or None: files are read for their names also where their tests are not chosen. Marks say who needs it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        return None


def lack(what):
    """Fails a test that cannot check what it is there for; GONIO_NO_FOREIGN=1 makes it a skip, which pytest lists."""
    if os.environ.get("GONIO_NO_FOREIGN") == "1":
        pytest.skip(f"{what} (GONIO_NO_FOREIGN=1)")
    pytest.fail(f"{what}; allowed: GONIO_NO_FOREIGN=1 to go on without it", pytrace=False)


def needs(*modules, besides=lambda: None):
    """Marks what needs modules, and besides that of which a function says what is lacking."""
    return pytest.mark.needs(modules, besides)


def pytest_configure(config):
    config.addinivalue_line("markers", "needs(modules, besides): fails without them")


# Before any fixture, each of which may need them too.
@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    for mark in item.iter_markers("needs"):
        modules, besides = mark.args
        for module in modules:
            if optional(module) is None:
                lack(f"no module {module}")
        if what := besides():
            lack(what)


@pytest.fixture(scope="session")
def gonio():
    """Runs the command and returns what it prints; another exit code than `code` fails."""

    def run(*args, code=0, cwd=None):
        done = subprocess.run([GONIO, *map(str, args)], capture_output=True, text=True, cwd=cwd)
        assert done.returncode == code, done.stderr
        return done.stdout

    return run
