"""Peers that need a package of their own: run in a Python that has it, this one or the one that ``LATHESIM_PEERS`` names."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[3]
VARIABLE = "LATHESIM_PEERS"


@functools.cache
def python_with(package: str) -> str | None:
    """Return the Python that has a package and what lathesim needs, none where neither has."""
    if importlib.util.find_spec(package) is not None:
        return sys.executable
    other = os.environ.get(VARIABLE)
    if other is None:
        return None
    tried = subprocess.run(
        [other, "-c", f"import {package}, lathesim.lessons.simulate"], capture_output=True, env=_environment(), check=False
    )
    return other if tried.returncode == 0 else None


def missing(package: str) -> str:
    """Return why a package cannot be measured here, empty where it can."""
    if python_with(package) is not None:
        return ""
    return f"{package} is not installed here, nor in the Python that {VARIABLE} names"


def times_and_positions(peer: str, package: str, repeats: int) -> tuple[list[float], np.ndarray]:
    """Run a peer a few times in a Python that has its package; give the CPU seconds of each run and the positions of the last."""
    python = python_with(package)
    assert python is not None
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.npz"
        command = [python, "-W", "ignore", "-m", __name__, peer, str(repeats), str(result)]
        done = subprocess.run(command, capture_output=True, text=True, env=_environment(), cwd=ROOT, check=False)
        if done.returncode:
            raise RuntimeError(f"{peer} failed: {(done.stderr.strip().splitlines() or ['no reason given'])[-1]}")
        with np.load(result, allow_pickle=False) as found:
            return found["seconds"].tolist(), found["positions"]


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def _main(peer: str, repeats: int, result: Path) -> None:
    from lathesim.cli.speed.bench_rows import lathe_work

    module: Any = importlib.import_module(f"tests.benchmarks.peers.{peer}")
    work = lathe_work()
    seconds, positions = [], np.zeros((2, 0))
    for _ in range(repeats):
        start = time.process_time()
        positions = module.simulate(work)
        seconds.append(time.process_time() - start)
    np.savez(result, seconds=np.array(seconds), positions=positions)


if __name__ == "__main__":
    _main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
