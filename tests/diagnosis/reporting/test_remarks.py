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


def test_ties_and_open_values_say_what_the_lines_to_paste_hold_and_each_experiment_stands_once() -> None:
    effects = (
        FoundEffect("LostCounts", "x_scale", "encoder", 0.5, {}, ("LostCounts at x_encoder",), "Return to the index mark."),
        FoundEffect("StribeckFriction", "x_axis", "reversal", 1.0, {}, (), "Creep.", undetermined=("stribeck_velocity", "excess")),
    )
    name, values, experiment = not_determined(effects)
    assert name == "The lines to paste hold LostCounts at x_scale, and not LostCounts at x_encoder."
    assert values.startswith(
        "stribeck velocity and excess of StribeckFriction are not determined by this recording; the lines to paste hold a set"
    )
    assert experiment == "What would tell more of StribeckFriction: Creep."


def test_a_value_that_no_channel_shows_is_said_to_be_one() -> None:
    slopes = np.array([[[0.0, 1e-5]], [[0.0, 1e-2]], [[0.0, 0.0]]])
    fitted: Any = SimpleNamespace(names=["tachometer.gain", "spindle.inertia", "spindle.speed"], sensitivity=slopes)
    (sentence,) = not_shown(fitted, {"tachometer.gain": 1.0, "spindle.inertia": 1.0}, np.array([0.1]))
    assert sentence.startswith("tachometer.gain moves nothing that is compared")
