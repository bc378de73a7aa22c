"""What an input shaper that a lesson inserts leaves of a swing that it is off by: |cos(pi r/2)| for ZV, its square for ZVD."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.lessons.simulate import simulate
from lathesim.plugins import load_registry

PERIOD, TUNED = 5e-3, 20.0
"""Sample period [s], and the frequency that the shaper is set to [Hz]: half a vibration is five samples."""
PROGRAM = "N10 G90 G94 G71\nN20 M03 G01 X17.0 Z12.0 F180 S1000\nN30 Z16.0\nN40 M00\n"
"""X moves by 2 mm and then rests."""


def references(kind: int, tmp_path: Path) -> tuple[FloatArray, FloatArray]:
    """Return the reference of an axis [m] before and after the shaper, from rest to rest."""
    source = load_lesson("09_learning")
    (tmp_path / "part.nc").write_text(PROGRAM, encoding="utf-8")
    entry = f"{{remedy: InputShaper, at: x_controller.reference, name: shaper, frequency: {TUNED} Hz, kind: {kind}}}"
    text = source.text.partition("variants:")[0].replace("../part_programs/liu_landers_2004_feed_path.nc", "part.nc")
    text += f"insert:\n  - {entry}\n"
    record = simulate(lesson_from_text(text, tmp_path / "lesson.yaml"), load_registry())
    return record["interpolator.x_reference"], record["shaper.outgoing"]


def swing(reference: FloatArray, frequency: float) -> float:
    """Return the amplitude that an undamped structure of this frequency [Hz] keeps after the steps of a reference [m]."""
    steps = np.diff(reference)
    return float(abs(steps @ np.exp(-2j * np.pi * frequency * PERIOD * np.arange(len(steps)))))


@pytest.mark.parametrize("kind", [1, 2])
def test_the_part_leaves_what_the_formula_says(kind: int, tmp_path: Path) -> None:
    asked, shaped = references(kind, tmp_path)
    assert np.ptp(asked[-50:]) == np.ptp(shaped[-40:]) == 0.0
    for ratio in (0.8, 0.9, 1.0, 1.1, 1.3):
        left = swing(shaped, ratio * TUNED) / swing(asked, ratio * TUNED)
        zv = abs(np.cos(0.5 * np.pi * ratio))  # what ZV leaves of an undamped swing; ZVD leaves its square
        assert left == pytest.approx(zv**kind, abs=1e-6)


@pytest.mark.parametrize(("kind", "vibrations"), [(1, 0.5), (2, 1.0)])
def test_it_is_late_by_half_a_vibration_or_a_whole_one(kind: int, vibrations: float, tmp_path: Path) -> None:
    asked, shaped = references(kind, tmp_path)
    arrived = [int(np.flatnonzero(np.diff(path))[-1]) for path in (asked, shaped)]
    assert (arrived[1] - arrived[0]) * PERIOD == pytest.approx(vibrations / TUNED, abs=1.01 * PERIOD)
