"""What holds for all tests: generated cases are the same in every run, and no verdict hangs on how fast the machine is."""

import contextlib
import gc
import importlib
import os
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lathesim.plugins import Registry, load_registry

# Half of the time in which a worker begins goes into compiling the tests anew, and each process that a test starts compiles the program:
# byte code is kept even where the environment asks for none.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# As the commands have it: matrices are too small to be shared among cores, which wait for each other. It holds for a library that is loaded
# afterwards.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

if "PYTEST_XDIST_WORKER" in os.environ:
    os.cpu_count = lambda: 1  # each worker has a core of its own, and starting threads takes as long as most batches of the tests

settings.register_profile("lathesim", max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("lathesim")


@pytest.fixture(scope="session")
def registry() -> Registry:
    """The registry of what ships, which tests only read."""
    return load_registry(installed=False)


def pytest_collection(session: pytest.Session) -> None:
    """Import the tests of whole folders from behind in the second worker: what the first has compiled by then is not compiled again."""
    if os.environ.get("PYTEST_XDIST_WORKER") == "gw1":
        files = [path for folder in session.config.args for path in (session.config.rootpath / folder).rglob("test_*.py")]
        for path in sorted(files, reverse=True):
            with contextlib.suppress(pytest.skip.Exception):
                importlib.import_module(".".join(path.relative_to(session.config.rootpath).with_suffix("").parts))


def pytest_collection_finish() -> None:
    """Take what was collected out of the garbage collector's sight: thousands of tests and modules stay until the end."""
    gc.collect()
    gc.freeze()
    first_case()
    gc.set_threshold(2_000_000, 100, 1000)  # looking for garbage among what is alive took a quarter of the time of an app


@given(st.none())
def first_case(nothing: None) -> None:
    """Begin with generated cases while little is alive: the first of them collects garbage, which takes seconds after hundreds of tests."""
