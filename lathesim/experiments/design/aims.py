"""What a design for precision is for, and what is known before it: programs that will be run, and programs that were recorded.

The variance of what a machine will read on programs that will be run, J_u their derivatives and M the information, both in noise levels, is

    v = mean diag (J_u M^-1 J_u')

A design that makes v small is V-optimal; values that no such program shows may stay unknown. A structure that is not quite right errs
where the machine has something to show: a reading which the values' own uncertainty s would move by g = |J s| counts as much as one of
variance 1 + b^2 g^2. Source: Atkinson, Donev, Tobias, Optimum Experimental Designs (2007), section 10.6.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.design.room import Room
from lathesim.json_text import parsed_json
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.program_path import path_of_program, start_of
from lathesim.path_columns import DWELL, DWELL_PAUSE, FEED, KIND, LENGTH

_AFTER = 0.3
"""Time [s] that is read after the end of a program."""


@dataclass(frozen=True, eq=False)
class Ready:
    """A part program of a file as path table, how long it is read [s], and its largest feed [m/s]."""

    table: FloatArray
    seconds: float
    fastest: float


@dataclass(frozen=True)
class Before:
    """What an emulation leaves for the next design: programs that were recorded, and b, the share by which the structure errs."""

    programs: tuple[Path, ...] = ()
    error: float = 0.0


NOTHING_BEFORE = Before()


def before_design(file: Path, lesson: Lesson) -> Before:
    """Return what an ``emulation.json`` tells. Raises :class:`LatheSimError` where the file is none, or its programs are gone."""
    try:
        told = parsed_json(file.read_text(encoding="utf-8"))
        if not str(told["schema"]).startswith("lathesim-emulation/"):
            raise KeyError("schema")
        programs = [item["program"] for item in told["recordings"] if item["program"]]
        error = float(told["model_error_share"])
    except (OSError, ValueError, KeyError, TypeError):
        raise LatheSimError("this is no emulation.", place=str(file), remedy="Give the emulation.json of 'lathesim emulate'.") from None
    found = [find_program(name, lesson.path.parent) for name in programs]
    if None in found:
        missing = programs[found.index(None)]
        raise LatheSimError(f"the part program '{missing}' is not there any more.", place=str(file), remedy="Emulate the machine again.")
    return Before(tuple(path for path in found if path is not None), error)


def programs_to_run(lesson: Lesson) -> list[Path]:
    """Return the part programs that a machine will run: that of the lesson and those of its variants."""
    settings = lesson.settings
    named = [settings.program, *(item.program for item in settings.variants.values())]
    found = [find_program(name, lesson.path.parent) for name in named if name]
    return list(dict.fromkeys(path for path in found if path is not None))


def ready(file: Path, lesson: Lesson, room: Room) -> Ready:
    """Return a part program as path table, with about how long it takes."""
    table = path_of_program(file, lesson.settings.dialect, start=start_of(lesson.machine)).table
    seconds = sum(
        float(row[DWELL]) if row[KIND] == DWELL_PAUSE else room.time(float(row[LENGTH]), float(row[FEED]) or room.feed) for row in table
    )
    feeds = table[table[:, KIND] != DWELL_PAUSE, FEED]
    return Ready(table, seconds + _AFTER, float(feeds.max(initial=0.0)) or room.feed)


def discounted(slopes: FloatArray, spread: FloatArray, error: float) -> FloatArray:
    """Return derivatives (readings, values) in the noise levels that the structure's share of error leaves."""
    return np.asarray(slopes / np.sqrt(1.0 + error**2 * np.square(slopes * spread).sum(axis=1))[:, None])


def mean_variance(aims: FloatArray, matrix: FloatArray) -> float:
    """Return v, the mean variance of readings with derivatives ``aims`` (readings, values) under information (values, values)."""
    return float(np.einsum("ij,ji->i", aims, np.linalg.solve(matrix, aims.T)).mean())
