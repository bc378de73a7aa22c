"""Mistakes that a diagnosis makes easily, each with the smallest recording that invites it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.location import one_way
from lathesim.diagnosis.preparation import Question
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.verdict import is_told_by_direction
from lathesim.effects.drive_errors import Cogging, TorqueRipple
from lathesim.effects.effect import Effect
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction, PositionDependentFriction, StribeckFriction
from lathesim.effects.offset_and_gain import ConverterOffset, DriveGainError, ForceOffset
from lathesim.effects.time_shift import TransportDelay
from lathesim.identification.replay.loading import Recorded, load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
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
    experiments,
    force,
    machine,
    recording,
    travel,
)
from tests.diagnosis.rigs.cases import case_of, write_case


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
    found = diagnosed(pushed_ahead(1), pushed_ahead(2), (CoulombFriction, ForceOffset))
    assert found.verdict == "tied"
    (effect,) = found.effects
    assert {effect.effect, *effect.tied_with} == {"CoulombFriction", "ForceOffset"}
    assert effect.probability < 0.6
    assert effect.separating_experiment
    assert any(sentence.startswith("The lines to paste use") for sentence in found.rest.not_told)


def pushed_ahead(seed: int) -> Record:
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
    found = diagnosed(recording(hidden, count=1200, seed=1), recording(hidden, count=1200, seed=2))
    assert set(names(found)) <= {"CoulombFriction"}


def test_a_value_further_off_than_the_lesson_holds_possible_is_told_with_its_size_and_no_effect_is_made_up_for_it() -> None:
    """Half as heavy again with a mass known to 5 percent: a load on the table."""
    hidden = Hidden(mass=1.5 * MASS)
    found = diagnosed(recording(hidden, seed=1), recording(hidden, seed=2))
    assert (found.verdict, names(found)) == ("parameters_only", [])
    assert "x_axis.mass is further off than the lesson declares possible" in found.sentence
    assert found.baseline["x_axis.mass"].refit_with == pytest.approx(1.5 * MASS, rel=0.01)
    assert any("(+50%) explains the error by itself" in sentence for sentence in found.rest.left)


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
    assert names(found) == []
    if factor == 2.0:
        # no unit has this factor: half of the mass and of the friction under the same force is the same recording
        assert (found.verdict, set(found.rest.far_off)) == ("parameters_only", {"x_axis.mass", "x_axis.viscous"})
    else:
        assert found.verdict in ("unknown", "recording_fault")


UNEVEN = (CoulombFriction, AsymmetricFriction, ForceOffset)


def forward(dry: float, seed: int, pull: float = 80.0) -> Record:
    """Return a recording of a table that is pulled forward all the time, with more force and with less."""
    pushed = pull + 0.5 * force(2000, seed)
    place = travel(pushed, Hidden(dry=dry)) + 0.3e-6 * np.random.default_rng(seed).standard_normal(2000)
    return as_record({FORCE: ("N", pushed), POSITION: ("m", np.round(place / RESOLUTION) * RESOLUTION)})


def test_it_is_no_candidate_where_no_recording_moves_its_host_both_ways() -> None:
    ahead = experiments(forward(8.0, 1), forward(8.0, 2), effects=UNEVEN)
    assert all(one_way(experiment, "x_axis") for experiment in ahead)
    (experiment, _) = without_one_sided(ahead)
    assert {candidate.name for candidate in experiment.candidates} == {"CoulombFriction", "ForceOffset"}
    assert [candidate.name for candidate in experiment.one_sided] == ["AsymmetricFriction"]


def test_a_ripple_is_tied_with_a_friction_that_varies_along_the_way() -> None:
    """In one direction the one is the other; a wave of friction that no friction is under would be the stranger of the two."""
    ahead = experiments(forward(8.0, 1), forward(8.0, 2), effects=(CoulombFriction, PositionDependentFriction, Cogging, ForceOffset))
    (experiment, _) = without_one_sided(ahead)
    (varying,) = experiment.one_sided
    told = {candidate.name: is_told_by_direction(candidate, varying) for candidate in experiment.candidates}
    assert (varying.name, told) == ("PositionDependentFriction", {"CoulombFriction": False, "Cogging": True, "ForceOffset": False})


def test_one_recording_both_ways_is_enough_to_look_for_it() -> None:
    pair = experiments(forward(8.0, 1), recording(Hidden(dry=8.0), seed=2), effects=UNEVEN)
    assert [one_way(experiment, "x_axis") for experiment in pair] == [True, False]
    assert [experiment.one_sided for experiment in without_one_sided(pair)] == [(), ()]


def test_the_plain_friction_is_tied_with_it_and_the_experiment_is_named() -> None:
    first, second = (Recorded(f"{seed}.csv", forward(8.0, seed), ()) for seed in (1, 2))
    found = diagnose(Question("A table", machine(sure=0.02), first, second, UNEVEN))
    (friction,) = [effect for effect in found.effects if effect.effect == "CoulombFriction"]
    assert found.verdict == "tied"
    assert "AsymmetricFriction" in friction.tied_with
    assert friction.parameters["level"].value == pytest.approx(8.0, rel=0.2)
    assert "both directions" in (friction.separating_experiment or "")


@pytest.mark.slow
def test_a_current_tells_an_offset_of_a_force_from_one_of_a_converter(tmp_path: Path) -> None:
    """From command and place alone they are the same; the current shows which it is. A zero of its reading does as a force does."""
    case = case_of("screw_tacho_1k", "single", keys=("gravity",), number=24)
    folder = write_case(replace(case, rig=replace(case.rig, seconds=3.0)), tmp_path)[0]
    lesson = folder / "lesson.yaml"
    without = folder / "without.yaml"
    without.write_text("".join(line for line in lesson.read_text().splitlines(keepends=True) if "current" not in line))
    told = {}
    for file in (lesson, without):
        loaded = load_case(load_lesson(file), [folder / "fit.csv", folder / "validate.csv"], load_registry())
        told[file] = diagnose(ask("a rig", loaded.machine, loaded.recordings, (ForceOffset, ConverterOffset)))
    (at_drive,) = [one for one in told[lesson].search.explanations if (one.name, one.place) == ("ConverterOffset", "x_drive")]
    assert not at_drive.kept and at_drive.reason == "fits the first recording hardly better"
    assert told[without].verdict == "tied"
    (effect,) = told[without].effects
    assert (effect.separating_experiment or "").startswith("Record x_drive.current too, where ")
    assert told[lesson].effects[0].effect == "ForceOffset"
