"""``python -m tests.house.margins [ROOM ...]``: how far each limit of a room may move before fewer cases of the room are answered rightly.

A limit is moved down and up by factors (a share of at least one half by its distance from one), one at a time, in a process of its own.
Printed are the values between which no case is lost, and the nearest ones at which some are. A limit at which a side fails is calibrated;
a number that may be half and twice as large decides none of these cases, and is a plain constant.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence

import pytest

from lathesim.errors import LatheSimError
from lathesim.limit import Limit
from lathesim.stability.diagnose_cut import diagnose_cut
from tests.stability.campaign.chatter import as_recorded
from tests.stability.campaign.rig_cuts import KINDS, recording

CUTS = 49
"""Cuts of the tuning half of the rigs, as many of each kind."""
FACTORS = (1.25, 2.0)
NARROW = 1.1
"""Factor that is tried where the first one loses a case."""

Judge = Callable[[], int]
"""How many cases are answered rightly with the limits as they are."""


def by_tests(*tests: str) -> Judge:
    """Return the judge that counts one case, which is right where all tests of some files pass."""

    def judge() -> int:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return int(pytest.main(["-x", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]) == 0)

    return judge


@functools.cache
def cuts() -> list[tuple[str, object, tuple[float, ...]]]:
    """Return the cuts: what vibrates there, the recording, and the natural frequencies of the rig."""
    made = [recording(KINDS[number % len(KINDS)], number, "tuning") for number in range(CUTS)]
    return [(one.kind, one, tuple(mode[0] for mode in one.rig.modes)) for one in made]


def by_cuts() -> int:
    """Return how many cuts get the name of their vibration, with the modes of the rig given and not."""
    right = 0
    for kind, made, modes in cuts():
        for given in (modes, ()):
            with contextlib.suppress(LatheSimError):
                right += diagnose_cut(as_recorded(made), given).judged.kind == kind  # type: ignore[arg-type]
    return right


READ = "faults", "channel_offsets", "text", "mapping", "reader", "labview"
ROOMS: dict[str, tuple[str, dict[str, Judge]]] = {
    "recordings": (
        "lathesim.recordings.recording_thresholds",
        {"": by_tests(*(f"tests/recordings/test_{name}.py" for name in READ))},
    ),
    "stability": (
        "lathesim.stability.stability_thresholds",
        {
            "TAP": by_tests("tests/stability/test_tap.py", "tests/stability/test_tap_to_cut.py"),
            "MAP": by_tests("tests/stability/test_learning.py", "tests/stability/test_limits.py", "tests/stability/test_band.py"),
            "": by_cuts,
        },
    ),
}
"""Room -> its limits, and what judges those of a group; an empty name stands for all other groups."""


def moved(value: float, factor: float) -> float:
    """Return a limit moved by a factor: a share of at least one half by its distance from one."""
    return 1.0 - (1.0 - value) / factor if 0.5 <= value < 1.0 else value * factor


def right(judge: Judge, group: object, name: str, value: float) -> int:
    """Return how many cases are right with one limit at another value, asked in a process of its own."""
    child = os.fork()
    if not child:
        limit = getattr(group, name)
        other = Limit(value, limit.unit, limit.meaning, limit.basis, limit.evidence) if isinstance(limit, Limit) else value
        object.__setattr__(group, name, other)
        os._exit(judge())
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def side(judge: Judge, most: int, group: object, name: str, *, up: bool) -> tuple[float, str]:
    """Return the furthest value on one side at which as many cases are right, and the nearest at which fewer are, with their number."""
    value = furthest = float(getattr(group, name))
    for factor in FACTORS:
        there = moved(value, factor if up else 1.0 / factor)
        if (left := right(judge, group, name, there)) < most:
            nearer = moved(value, NARROW if up else 1.0 / NARROW)
            if furthest == value and right(judge, group, name, nearer) >= most:
                furthest = nearer
            return furthest, f"{there:.3g} ({left})"
        furthest = there
    return furthest, "-"


def limits(module: str) -> Iterator[tuple[str, object, str]]:
    """Yield the numbers of a module that are no counts: the name of their group, the group, their own name."""
    for label, group in vars(importlib.import_module(module)).items():
        if label.isupper() and hasattr(group, "__dataclass_fields__"):
            yield from ((label, group, name) for name in group.__dataclass_fields__ if isinstance(getattr(group, name), float))


def main(rooms: Sequence[str]) -> int:
    """Print the range of each limit of some rooms."""
    for room in rooms:
        module, judges = ROOMS[room]
        if by_cuts in judges.values():
            cuts()  # made once, before a process for each value
        known: dict[Judge, int] = {}
        for label, group, name in limits(module):
            judge, value = judges.get(label, judges[""]), float(getattr(group, name))
            if judge not in known:
                known[judge] = right(judge, group, name, value)
            (low, below), (high, above) = (side(judge, known[judge], group, name, up=up) for up in (False, True))
            sides = f"{low:.3g} to {high:.3g}, fewer at {below} and {above}"
            print(f"{room} {label}.{name} = {value:.4g}, {known[judge]} right: {sides}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:] or list(ROOMS)))
