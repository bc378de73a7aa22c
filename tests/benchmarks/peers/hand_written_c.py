"""Hand-written C of the same loop, gcc -O2, strict floating point."""

from __future__ import annotations

import ctypes
import functools
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

NAME = "hand-written C, gcc -O2 -ffp-contract=off"
IN_TURNS = True
"""It takes as long as the engine does, and is measured in turns with it."""
SOURCE = Path(__file__).with_name("lathe.c")
FLAGS = ("-O2", "-ffp-contract=off", "-shared", "-fPIC")


def absent() -> str:
    return "" if shutil.which("gcc") else "gcc is not installed"


@functools.cache
def _library() -> Any:
    folder = Path(tempfile.mkdtemp(prefix="lathesim-bench-"))
    subprocess.run(["gcc", *FLAGS, str(SOURCE), "-o", str(folder / "lathe.so"), "-lm"], check=True)
    library = ctypes.CDLL(str(folder / "lathe.so"))
    shutil.rmtree(folder)
    return library


@functools.cache
def parameter_names() -> tuple[str, ...]:
    """Return the fields of the C file's Parameters, as part.name."""
    fields = re.search(r"typedef struct \{(.*?)\} Parameters;", SOURCE.read_text(), re.DOTALL)
    assert fields is not None
    return tuple(name.replace("__", ".", 1) for name in re.findall(r"\w+__\w+", fields[1]))


def record(work: Any) -> np.ndarray:
    """Return all channels of the work, shape (samples, channels)."""
    parameters = np.array([work.parameters[name] for name in parameter_names()])
    values = np.empty((work.samples, len(work.channels)))
    pointer = ctypes.POINTER(ctypes.c_double)

    def address(array: np.ndarray) -> Any:
        return array.ctypes.data_as(pointer)

    done = _library().lathe(
        address(parameters), address(work.path), len(work.path), address(work.noise["tachometer.chance"]),
        address(work.noise["dynamometer.chance"]), work.samples, ctypes.c_double(work.period), ctypes.c_double(work.step), work.steps,
        address(values),
    )  # fmt: skip
    return values[:done]


def simulate(work: Any) -> np.ndarray:
    values = record(work)
    return np.stack([values[:, work.channels.index("x_axis.position")], values[:, work.channels.index("z_axis.position")]])
