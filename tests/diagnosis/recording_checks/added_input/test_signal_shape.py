"""The shape of a signal in words: pulses, steps, a sine, or none of them."""

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.added_input import shape_of
from lathesim.engine.assembly import FloatArray

PERIOD = 1e-3
TIME = np.arange(4000) * PERIOD


def pulses() -> FloatArray:
    return np.where((TIME % 1.0 > 0.3) & (TIME % 1.0 < 0.35), 1.5, 0.0)


@pytest.mark.parametrize(
    ("values", "told", "first", "last"),
    [
        (pulses(), "4 pulses of 1.5 V, 50 ms long", 0.3, 3.35),
        (np.where((TIME > 1.0) & (TIME < 2.0), -2.0, 0.0), "a pulse of -2 V, 999 ms long", 1.0, 2.0),
        (np.where(TIME > 1.0, 0.5, 0.0), "a step of 500 mV", 1.0, 4.0),
        (np.where(TIME > 1.0, 0.5, 0.0) + np.where(TIME > 3.0, 0.5, 0.0), "2 steps of 500 mV to 1 V", 1.0, 4.0),
        (np.where(TIME > 0.5, np.sin(2.0 * np.pi * 3.3 * TIME), 0.0), "a sine of 1 V at 3.3 Hz", 0.5, 4.0),
    ],
    ids=["pulses", "one pulse", "step", "steps", "sine"],
)
def test_a_simple_shape_is_told_with_its_sizes(values: FloatArray, told: str, first: float, last: float) -> None:
    noisy = values + 1e-3 * np.random.default_rng(1).standard_normal(len(values))
    shape = shape_of(noisy, PERIOD, "V")
    assert shape.words == told
    assert shape.share > 0.99
    assert (shape.windows[0][0], shape.windows[-1][1]) == pytest.approx((first, last), abs=0.02)


@pytest.mark.parametrize("kind", ["noise", "noise of two levels", "two sines", "nothing"])
def test_other_signals_have_no_simple_shape(kind: str) -> None:
    rng = np.random.default_rng(2)
    values = {
        "noise": rng.standard_normal(len(TIME)),
        "noise of two levels": rng.choice([0.0, 1.0], len(TIME)),
        "two sines": np.sin(2.0 * np.pi * 3.0 * TIME) + np.sin(2.0 * np.pi * 7.1 * TIME),
        "nothing": np.zeros(len(TIME)),
    }[kind]
    shape = shape_of(values, PERIOD, "V")
    assert (shape.words, shape.share) == ("", 0.0)
    assert bool(shape.windows) == (kind != "nothing")


def test_a_bump_that_ends_at_once_has_no_levels() -> None:
    bump = np.concatenate([np.zeros(100), np.linspace(0.0, 1.0, 11), np.linspace(1.0, 0.4, 6), np.zeros(100)])
    shape = shape_of(bump, PERIOD, "V")
    assert shape.words == ""
