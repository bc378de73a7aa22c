"""Mistakes that a diagnosis makes easily, each with the smallest recording that invites it."""

from collections.abc import Sequence

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.effects.drive_errors import TorqueRipple
from lathesim.effects.effect import Effect
from lathesim.effects.friction import CoulombFriction, StribeckFriction
from lathesim.effects.offset_and_gain import DriveGainError, ForceOffset
from lathesim.effects.time_shift import TransportDelay
from lathesim.identification.replay.loading import Recorded
from lathesim.record import Record
from tests.diagnosis.pushed_table import (
    EFFECTS,
    FORCE,
    MASS,
    PERIOD,
    POSITION,
    RESOLUTION,
    Hidden,
    Law,
    as_record,
    force,
    machine,
    recording,
    travel,
)


def diagnosed(first: Record, second: Record, effects: Sequence[type[Effect]] = EFFECTS) -> Diagnosis:
    return diagnose(ask("A table", machine(), (Recorded("fit.csv", first, ()), Recorded("check.csv", second, ())), effects))


def names(found: Diagnosis) -> list[str]:
    return sorted(effect.effect for effect in found.effects)


def late(record: Record, samples: int) -> Record:
    """The force as it was commanded some samples before it acted."""
    ahead = np.concatenate([record[FORCE][samples:], np.repeat(record[FORCE][-1:], samples)])
    return record.with_channel(FORCE, "N", ahead)


def test_a_shift_of_the_integrator_is_called_no_delay() -> None:
    found = diagnosed(recording(seed=1), recording(seed=2), (CoulombFriction, TransportDelay))
    assert (found.verdict, names(found)) == ("no_mismatch", [])


def test_a_delay_that_is_there_is_named_to_a_tenth_of_a_sample() -> None:
    found = diagnosed(late(recording(seed=1), 2), late(recording(seed=2), 2), (CoulombFriction, TransportDelay))
    (effect,) = found.effects
    assert effect.effect == "TransportDelay"
    assert effect.parameters["delay"].value == pytest.approx(2.0 * PERIOD, abs=0.1 * PERIOD)


def test_the_corner_of_a_friction_is_called_no_stribeck_peak() -> None:
    hidden = Hidden(dry=8.0)
    found = diagnosed(recording(hidden, seed=1), recording(hidden, seed=2), (CoulombFriction, StribeckFriction))
    assert names(found) == ["CoulombFriction"]


def test_friction_and_a_push_are_tied_where_the_table_never_turns() -> None:
    """In one direction both are a constant force; the answer says so, and what to run to tell them apart."""
    found = diagnosed(one_way(1), one_way(2), (CoulombFriction, ForceOffset))
    assert found.verdict == "tied"
    (effect,) = found.effects
    assert {effect.effect, *effect.tied_with} == {"CoulombFriction", "ForceOffset"}
    assert effect.probability < 0.6
    assert effect.separating_experiment
    assert any(sentence.startswith("The lines to paste hold") for sentence in found.not_told)


def one_way(seed: int) -> Record:
    pushed = np.abs(force(2000, seed)) + 30.0
    place = np.round(travel(pushed, Hidden(dry=8.0)) / RESOLUTION) * RESOLUTION
    return as_record({FORCE: ("N", pushed), POSITION: ("m", place)})


def wave(phase: float) -> Law:
    return lambda v, q, t: float(6.0 * np.sin(2.0 * np.pi * q / 0.012 + phase))


def test_a_ripple_keeps_its_name_where_the_zero_of_the_encoder_has_moved() -> None:
    """The phase belongs to the recording: another one in the held-out recording is no contradiction."""
    found = diagnosed(recording(Hidden(law=wave(0.0)), seed=1), recording(Hidden(law=wave(2.0)), seed=2), (CoulombFriction, TorqueRipple))
    (effect,) = found.effects
    assert effect.effect == "TorqueRipple"
    assert effect.parameters["amplitude"].value == pytest.approx(6.0, rel=0.05)
    assert effect.parameters["period"].value == pytest.approx(0.012, rel=0.01)
    assert "phase" not in effect.parameters


def test_a_coarse_encoder_is_no_physics() -> None:
    first, second = (coarse(recording(seed=seed), 100e-6) for seed in (1, 2))
    found = diagnosed(first, second)
    assert (found.verdict, names(found)) == ("no_mismatch", [])


def coarse(record: Record, step: float) -> Record:
    return record.with_channel(POSITION, "m", np.round(record[POSITION] / step) * step)


def test_a_table_that_sticks_most_of_the_time_gets_no_other_name() -> None:
    """Stick-slip is chaotic in the noise; whatever else is said, nothing but the friction is named."""
    hidden = Hidden(dry=50.0)
    found = diagnosed(recording(hidden, seed=1), recording(hidden, seed=2))
    assert set(names(found)) <= {"CoulombFriction"}


def test_a_value_further_off_than_the_lesson_holds_possible_is_told_with_its_size_and_no_effect_is_made_up_for_it() -> None:
    """Half as heavy again with a mass known to 5 percent: a load on the table."""
    hidden = Hidden(mass=1.5 * MASS)
    found = diagnosed(recording(hidden, seed=1), recording(hidden, seed=2))
    assert (found.verdict, names(found)) == ("parameters_only", [])
    assert "x_axis.mass is further off than the lesson declares possible" in found.sentence
    assert found.baseline["x_axis.mass"].refit_with == pytest.approx(1.5 * MASS, rel=0.01)
    assert any("(+50%) explains by itself" in sentence for sentence in found.left)


@pytest.mark.slow
def test_a_friction_is_never_below_zero() -> None:
    """A table that is pushed on in the direction in which it moves is no table with a negative friction."""
    hidden = Hidden(law=lambda v, q, t: float(-8.0 * np.tanh(v / 1e-3)))
    found = diagnosed(recording(hidden, seed=1), recording(hidden, seed=2))
    assert "CoulombFriction" not in names(found)
    assert found.baseline["x_axis.viscous"].refit_with >= 0.0


def test_a_gain_and_the_scale_of_mass_and_friction_are_one_thing() -> None:
    """A drive 4 percent weaker moves as a table 4 percent heavier and stiffer does: other values explain it, and no effect is named."""
    records = [recording(seed=seed) for seed in (1, 2)]
    weaker = [record.with_channel(FORCE, "N", record[FORCE] / 0.96) for record in records]
    found = diagnosed(weaker[0], weaker[1], (CoulombFriction, DriveGainError))
    assert (found.verdict, names(found)) == ("parameters_only", [])
    assert found.baseline["x_axis.mass"].refit_with == pytest.approx(MASS / 0.96, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [2.0, 25.4])
def test_a_channel_in_another_unit_names_no_physics(factor: float) -> None:
    records = [recording(seed=seed) for seed in (1, 2)]
    wrong = [record.with_channel(POSITION, "m", factor * record[POSITION]) for record in records]
    found = diagnosed(wrong[0], wrong[1])
    assert found.verdict in ("unknown", "recording_fault")
    assert names(found) == []
