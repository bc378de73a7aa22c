"""Counts that are coarser than the lesson's are read off the recorded values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.wrong_readings import coarse_counts
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.sensor_errors import Quantisation
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.identification.signal import grid_spacing
from lathesim.record import Record
from tests.diagnosis.pushed_table import FORCE, POSITION, RESOLUTION, as_record, experiments, recording
from tests.diagnosis.test_mistakes import diagnosed
from tests.shipped_machine import shipped_machine


def wander(samples: int = 5000) -> np.ndarray:
    """Return a smooth path of some millimetres with noise of a micrometre."""
    time = np.linspace(0.0, 10.0, samples)
    return np.asarray(3e-3 * np.sin(time) + 1e-6 * np.random.default_rng(1).standard_normal(samples))


@pytest.mark.parametrize("offset", [0.0, 1.3e-6])
def test_the_spacing_of_readings_in_whole_counts_is_found_whatever_the_zero(offset: float) -> None:
    readings = np.round(wander() / 4e-6) * 4e-6 + offset
    assert grid_spacing(readings) == pytest.approx(4e-6, rel=1e-9)


def test_the_last_digit_of_a_text_file_does_not_hide_it() -> None:
    readings = np.round(wander() / 0.7e-6) * 0.7e-6
    as_text = np.array([float(f"{reading:.8f}") for reading in readings])
    assert grid_spacing(as_text) == pytest.approx(0.7e-6, rel=1e-3)


def test_readings_that_lie_on_no_grid_have_no_spacing() -> None:
    assert grid_spacing(wander()[:400] * 1e-9) == 0.0


def test_a_few_levels_tell_nothing() -> None:
    assert grid_spacing(np.tile([0.0, 1.0, 2.0], 100)) == 0.0


def rounded(count: float, seed: int = 1) -> Record:
    """Return the recording of a table whose encoder reads in whole ``count`` [m], where the lesson has 1 um."""
    pushed, place = (recording(noise=0.0, seed=seed)[name] for name in (FORCE, POSITION))
    return as_record({FORCE: ("N", pushed), POSITION: ("m", np.round(place / count) * count)})


def read_in_counts(count: float) -> Experiment:
    """Return the rig of such a table."""
    (experiment,) = experiments(rounded(count), effects=(Quantisation,))
    assert experiment.candidates[0].low[0] > RESOLUTION  # the grid of the lesson's own sensor is no effect
    return experiment


def test_coarse_counts_are_named_with_their_height() -> None:
    ((candidate, count),) = coarse_counts([read_in_counts(8e-6), read_in_counts(8e-6)])
    assert candidate.name == "Quantisation"
    assert candidate.at == "x_encoder"
    assert count.value == pytest.approx(8e-6, rel=1e-6)
    assert 0.0 < count.error < 1e-7


def test_coarse_counts_that_leave_no_error_to_take_away_are_all_there_is() -> None:
    """Rounding is noise to a replay: that nothing is taken away there speaks not against the counts."""
    found = diagnosed(rounded(8e-6), rounded(8e-6, seed=2), (Quantisation, ForceOffset))
    assert (found.verdict, [effect.effect for effect in found.effects]) == ("named", ["Quantisation"])
    assert found.rest.adequate


def test_the_counts_of_the_lesson_are_nothing_to_tell() -> None:
    assert coarse_counts([read_in_counts(1e-6)]) == []


def test_recordings_that_disagree_tell_nothing() -> None:
    assert coarse_counts([read_in_counts(8e-6), read_in_counts(4e-6)]) == []


def test_what_is_known_is_not_told_again() -> None:
    experiment = read_in_counts(8e-6)
    assert coarse_counts([experiment], experiment.candidates) == []


@pytest.mark.parametrize(("counts", "named"), [(1, False), (4, True)])
def test_the_rate_of_an_encoder_goes_in_counts_a_sample(counts: int, named: bool) -> None:
    """A speed in whole counts a sample was held against the counts of the angle, a five-hundredth of it."""
    resolution, period = 1.5e-6, 2e-3
    angle = np.round(np.cumsum(0.5 * np.sin(np.linspace(0.0, 20.0, 4000))) * period / (counts * resolution)) * counts * resolution
    rate = np.diff(angle, prepend=0.0) / period
    laboratory = shipped_machine("torque_spindle")
    parts = tuple(
        replace(part, parameters={**part.parameters, "resolution": resolution}) if part.name == "spindle_encoder" else part
        for part in laboratory.parts
    )
    machine = RecordedMachine(
        replace(laboratory, parts=parts, sample_period=period, step=period), ("spindle.torque",), ("spindle_encoder.rate",), {}, {}
    )
    record = as_record({"spindle.torque": ("N*m", np.zeros(4000)), "spindle_encoder.rate": ("rad/s", rate)})
    (experiment,) = build_experiments(machine, [("fit", record)], [Quantisation])
    assert [count.value for _, count in coarse_counts([experiment, experiment])] == (
        [pytest.approx(4.0 * resolution, rel=1e-3)] if named else []
    )
