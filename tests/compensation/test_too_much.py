"""A remedy set too strong: more than the true play is an error of the other sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.compensation.diagnosed_machine import Diagnosed, InsertedRemedy
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry

PLAY = 10e-6


def along_the_play(times: float, folder: Path) -> tuple[float, float]:
    """Return the shares of the error that a shift of ``times`` the true play leaves: with its sign, and of its rms."""
    shift = {"width": times * PLAY, "lag": 5.393e-3, "inner": 10.64e-3, "spread": 5.2e-3}
    line = InsertedRemedy("BacklashShift", "x_controller", "x_controller_backlash_shift", shift)
    effect = {"effect": "Backlash", "at": "x_scale", "name": "x_scale_backlash", "width": f"{PLAY} m"}
    bench = Diagnosed(load_lesson("22_what_is_wrong_with_this_machine"), load_registry(), (effect,), {}, folder).bench([line])
    sound, bare, mended = (bench.table(record)[0] for record in bench.runs([bench.sound, bench.bare, {}], exact=True))
    before, after = bare - sound, mended - sound
    return float(after @ before / (before @ before)), float(np.sqrt(np.mean(after**2) / np.mean(before**2)))


@pytest.mark.parametrize(("times", "left"), [(0.5, 0.5), (1.0, 0.0), (1.5, -0.5), (2.0, -1.0)])
def test_more_than_the_true_play_is_an_error_of_the_other_sign(times: float, left: float, tmp_path: Path) -> None:
    along, rms = along_the_play(times, tmp_path)
    # at a reversal the drive takes its time to cross the play, the longer the more it is asked to cross
    assert along == pytest.approx(left, abs=0.02 * times)
    assert rms == pytest.approx(abs(left), abs=0.04)
