"""Two simple effects and one that does what they do: the two are named, and that they are tied with the one is said."""

import functools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.effects.motor_ripple import Cogging, TorqueRipple
from lathesim.effects.offset_and_gain import ForceOffset
from tests.diagnosis.pushed_table import Hidden, recording
from tests.diagnosis.test_mistakes import diagnosed

LEVEL, SHARE = 12.0, 0.3


def uneven(v: float, q: float, t: float) -> float:
    """A friction that differs between the directions, smooth where it turns round."""
    turn = float(np.tanh(v / 1e-4))
    return LEVEL * turn + SHARE * LEVEL * turn * turn


@functools.cache
def answer() -> Diagnosis:
    pair = recording(Hidden(law=uneven), seed=1), recording(Hidden(law=uneven), seed=2)
    return diagnosed(*pair, (CoulombFriction, ForceOffset, AsymmetricFriction))


def test_the_simple_ones_are_named() -> None:
    found = {effect.effect: effect.parameters for effect in answer().effects}
    assert set(found) == {"CoulombFriction", "ForceOffset"}
    assert abs(found["CoulombFriction"]["level"].value - LEVEL) < 0.05 * LEVEL
    assert abs(found["ForceOffset"]["offset"].value - SHARE * LEVEL) < 0.1 * SHARE * LEVEL


def test_the_one_that_does_the_same_is_said_to_be_tied_with_them() -> None:
    assert answer().verdict == "named"
    assert all(effect.tied_with == ("AsymmetricFriction",) for effect in answer().effects)
    assert [bool(effect.separating_experiment) for effect in answer().effects] == [
        effect.effect == "ForceOffset" for effect in answer().effects
    ], "none tells two forms of one law"


def three_harmonics(v: float, q: float, t: float) -> float:
    """A cogging whose third harmonic no effect has."""
    angle = 2.0 * np.pi * q / 0.024
    return float(8.0 * np.sin(angle + 0.4) + 2.0 * np.sin(2.0 * angle) + 4.0 * np.sin(3.0 * angle + 1.0))


def wave(part: str, at: str, of_motion: str = "") -> Any:
    return SimpleNamespace(part=part, at=at, of_motion=of_motion, parameters=(), points=np.zeros((1, 0)))


@pytest.mark.parametrize(("size", "longer", "is_part"), [(0.1, 1.02, True), (1.0, 1.02, False), (0.1, 1.5, False), (1.0, 2.0, True)])
def test_a_small_line_beside_a_wave_is_a_part_of_it(size: float, longer: float, is_part: bool) -> None:
    """So is a harmonic of any size; a line of some size beside it, or a small one elsewhere, is not."""
    cogging, ripple = wave("cogging", "x_axis"), wave("ripple", "x_axis")
    sizes = {"cogging.amplitude": 4.0, "ripple.amplitude": size, "cogging.period": 0.01 * longer, "ripple.period": 0.01}
    trial: Any = SimpleNamespace(candidate=ripple, model=SimpleNamespace(fitted=SimpleNamespace(by_name=sizes)))
    model: Any = SimpleNamespace(candidates=(cogging,))
    assert is_part_of_a_wave(trial, model) == is_part


def test_a_harmonic_is_a_part_of_a_wave_by_whatever_name_its_effect_calls_the_period() -> None:
    pitch, disc = wave("pitch", "x_scale"), wave("disc", "x_scale")
    sizes = {"pitch.amplitude": 1.6e-6, "disc.amplitude": 0.35e-6, "pitch.lead": 8e-3, "disc.turn": 4e-3}
    trial: Any = SimpleNamespace(candidate=disc, model=SimpleNamespace(fitted=SimpleNamespace(by_name=sizes)))
    model: Any = SimpleNamespace(candidates=(pitch,))
    assert is_part_of_a_wave(trial, model)
    sizes["disc.turn"] = 5.3e-3
    assert not is_part_of_a_wave(trial, model)


def test_a_further_harmonic_is_no_further_effect() -> None:
    pair = recording(Hidden(law=three_harmonics), seed=1), recording(Hidden(law=three_harmonics), seed=2)
    found = diagnosed(*pair, (Cogging, TorqueRipple))
    assert [effect.effect for effect in found.effects] == ["Cogging"]
    assert found.effects[0].parameters["amplitude"].value == pytest.approx(8.0, rel=0.1)
    assert found.left


@pytest.mark.parametrize(("axis", "is_part"), [("x_axis", True), ("y_axis", False)])
def test_a_harmonic_at_another_sensor_of_the_same_motion_is_a_part_of_the_wave(axis: str, is_part: bool) -> None:
    """Scale and motor encoder are held against each other: which of them has the harmonic their difference does not tell."""
    pitch, disc = wave("pitch", "x_scale", "x_axis"), wave("disc", "encoder", axis)
    sizes = {"pitch.amplitude": 4e-6, "disc.amplitude": 0.6e-6, "pitch.lead": 10e-3, "disc.lead": 5e-3}
    trial: Any = SimpleNamespace(candidate=disc, model=SimpleNamespace(fitted=SimpleNamespace(by_name=sizes)))
    assert is_part_of_a_wave(trial, SimpleNamespace(candidates=(pitch,))) == is_part  # type: ignore[arg-type]
