"""What the measurements share: a figure that is held against a bar, a clock, and a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from lathesim.cli.speed.bench_rows import measured_on
from lathesim.cli.writing import CommandResult
from lathesim.engine.assembly import FloatArray


class Held:
    """A figure with a bar, which it is to reach or to stay below."""

    value: float
    bar: float
    is_at_least: bool = False

    @property
    def is_within(self) -> bool:
        """Whether the bar is kept."""
        return self.value >= self.bar if self.is_at_least else self.value <= self.bar

    @property
    def sign(self) -> str:
        """Whether the bar is kept, in a word."""
        return "kept" if self.is_within else "MISSED"


def held_result(schema: str, figures: Sequence[Held], lines: Iterator[str], **further: Any) -> tuple[CommandResult, list[str]]:
    """Return what a command tells of figures; it fails where a bar is missed."""
    rows = [{**vars(figure), "is_within": figure.is_within} for figure in figures]
    data = {"rows": rows, **further, "machine": measured_on()}
    return CommandResult(schema, data, lines, code=int(any(not figure.is_within for figure in figures))), []


def clock(call: Callable[[], object]) -> float:
    """Return how long a call takes [s]."""
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def in_child(module: str, what: str) -> str:
    """Return what a module prints in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-m", module, what]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def last(record: FloatArray) -> float:
    """Return the last value of the first channel."""
    return float(record[0, -1])
