"""Sentences of an answer."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from lathesim.diagnosis.records.diagnosis import BaselineValue, FoundEffect
from lathesim.diagnosis.reporting.remarks import not_determined, not_shown, value_instead

PRESSURE = "cutting.specific_force"
BASELINE = {PRESSURE: BaselineValue("N/m^2", 8.5e8, 1.05e9, 1.05e9)}


def test_a_value_that_is_impossible_is_told_with_what_it_does() -> None:
    (whole,) = value_instead((PRESSURE,), BASELINE, whole=True)
    assert whole.startswith(
        f"{PRESSURE} of 1.05e+09 N/m^2 (+24%) explains by itself what is missing, though the lesson holds it impossible."
    )
    (part,) = value_instead((PRESSURE, "cutting.width"), BASELINE, whole=False)
    assert "takes away a part of what is missing, and not the whole" in part
    assert "; so would another value of cutting.width." in part
    assert value_instead((), BASELINE, whole=True) == []


def test_a_tie_without_an_experiment_ends_with_its_sentence() -> None:
    effect = FoundEffect("StribeckFriction", "x_axis", "reversal", 1.0, {}, tied_with=("x_axis.viscous",), separating_experiment=None)
    (sentence,) = not_determined((effect,))
    assert sentence == "StribeckFriction cannot be told from x_axis.viscous here; the lines to paste hold StribeckFriction."


def test_an_effect_that_is_tied_with_itself_at_another_sensor_is_told_with_its_place() -> None:
    effect = FoundEffect(
        "LostCounts",
        "x_scale",
        "encoder",
        0.5,
        {},
        tied_with=("LostCounts at x_encoder",),
        separating_experiment="Return to the index mark.",
    )
    (sentence,) = not_determined((effect,))
    assert sentence == (
        "LostCounts at x_scale cannot be told from LostCounts at x_encoder here; the lines to paste hold LostCounts at x_scale. "
        "Return to the index mark."
    )


def test_a_value_that_no_channel_shows_is_said_to_be_one() -> None:
    slopes = np.array([[[0.0, 1e-5]], [[0.0, 1e-2]], [[0.0, 0.0]]])
    fitted: Any = SimpleNamespace(names=["tachometer.gain", "spindle.inertia", "spindle.speed"], sensitivity=slopes)
    (sentence,) = not_shown(fitted, {"tachometer.gain": 1.0, "spindle.inertia": 1.0}, np.array([0.1]))
    assert sentence.startswith("tachometer.gain moves nothing that is compared")
