"""Machines drawn at random, and what the program answers: pushed tables and the rigs of both sets."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Container, Iterator, Sequence
from pathlib import Path

import numpy as np

from tests.diagnosis import pushed_table
from tests.diagnosis.asking import ask_here, truth_of, words_of
from tests.diagnosis.calibration.draws import Draw, shortened
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden
from tests.diagnosis.rigs.cases import schedule, write_case

RIPPLE = ("TorqueRipple", "Cogging")
TURN = 5e-3
"""Travel of the table after which a hidden ripple repeats [m]."""
KINDS = ("sound", "CoulombFriction", "ForceOffset", "TorqueRipple")
DOUBTS = 0.05, 0.1
"""Relative doubts that the lesson of the pushed table declares of mass and viscous friction."""


def tables(seed: int, number: int, at_most: float, kept: Container[str] = ()) -> Iterator[Draw]:
    """Yield pushed tables whose mass and friction are drawn from what the lesson declares, and whose effect is of any size that shows."""
    for index in range(number):
        if (name := f"table {seed}/{index}") in kept:
            continue
        rng = np.random.default_rng([seed, index, 71])
        kind = KINDS[index % len(KINDS)]
        mass, viscous = (value * (1.0 + doubt * rng.standard_normal()) for value, doubt in zip((MASS, VISCOUS), DOUBTS, strict=True))
        size, phase = float(np.exp(rng.uniform(math.log(0.5), math.log(10.0)))), float(rng.uniform(-math.pi, math.pi))
        hidden = _table(kind, size, phase, mass, viscous)
        sizes = {"x_axis.mass": mass, "x_axis.viscous": viscous}
        sizes |= {"CoulombFriction": {"CoulombFriction.level": size}, "ForceOffset": {"ForceOffset.offset": size}}.get(kind, {})
        sizes |= (
            {f"{name}.{key}": value for name in RIPPLE for key, value in (("amplitude", size), ("period", TURN))} if kind in RIPPLE else {}
        )
        right = () if kind == "sound" else (RIPPLE if kind in RIPPLE else (kind,),)
        with tempfile.TemporaryDirectory() as folder:
            first = int(rng.integers(2**31))
            lesson, fitted, held_out = pushed_table.write_case(Path(folder), hidden, seeds=(first, first + 1))
            told, seconds = _ask([lesson, fitted, "--validate", held_out], at_most)
        yield Draw("table", name, kind, right, sizes, told, seconds)


def _table(kind: str, size: float, phase: float, mass: float, viscous: float) -> Hidden:
    laws: dict[str, pushed_table.Law] = {
        "ForceOffset": lambda v, q, t: size,
        "TorqueRipple": lambda v, q, t: size * math.sin(2.0 * math.pi * q / TURN + phase),
    }
    return Hidden(size if kind == "CoulombFriction" else 0.0, laws.get(kind), mass, viscous)


def rigs(seed: int, sound: int, single: int, at_most: float, kept: Container[str] = ()) -> Iterator[Draw]:
    """Yield sound machines and single effects of all rigs of both sets, each in one description, another one from case to case."""
    for case in schedule(seed, {"sound": sound, "single": single}):
        if (name := f"{case.name} {seed}") in kept:
            continue
        with tempfile.TemporaryDirectory() as place:
            folders = write_case(case, Path(place))
            folder = folders[case.number % len(folders)]
            truth = truth_of(folder)
            if not truth.get("answerable", True):
                continue
            told, seconds = _ask(words_of(folder), at_most)
        hidden = tuple(tuple(names) for names in truth["right"].values())
        yield Draw("rigs", name, case.kind, hidden, {}, told, seconds, tuple(truth["beside"]))


def _ask(words: Sequence[str | Path], at_most: float) -> tuple[dict[str, object], float]:
    """Return what the program answers to a lesson and its recordings, and the seconds of processor time."""
    began = time.process_time()
    return shortened(ask_here(*words, "--at-most", f"{at_most:g}s")), time.process_time() - began
