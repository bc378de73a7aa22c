"""What the fitted model makes by itself is no doubt: a limit cycle is in its replicates too, a squeal is not."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.location.narrow_band import in_octave
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.verdict.replicate_check import BAND, DEPENDENCE, CalibratedDoubts, adjusted, calibrated_doubts, first_order_noise
from lathesim.effects.friction import CoulombFriction
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import Experiment, baseline_free
from lathesim.identification.replay.replicates import Load, replicates
from tests.diagnosis.pushed_table import FORCE, POSITION, Hidden, experiments, machine, recording

FEWER = replace(STANDARD, verdict=replace(STANDARD.verdict, false_alarms=STANDARD.verdict.false_alarms.times(2.5)))
"""Twenty replicates, of which the smallest probability is 1/21."""
SQUEAL = Hidden(law=lambda v, q, t: 4.0 * float(np.sin(2.0 * np.pi * 70.0 * t)))


def fitted(hidden: Hidden) -> tuple[Experiment, Experiment, Model]:
    """Return two recordings and the model without effects, fitted to the first."""
    first, second = experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=(CoulombFriction,), of=machine())
    laboratory = Laboratory(first, second, lambda text: None)
    values = fit(first.sensed, [*baseline_free(first.machine), *first.start_states(first.sensed.plan)], rounds=3)
    laboratory.weigh(values)
    return first, second, laboratory.model((), values)


@functools.cache
def doubts_of(hidden: Hidden) -> CalibratedDoubts | None:
    """Return what speaks against the model of two recordings, beyond what replicates show."""
    return calibrated_doubts(*fitted(hidden), method=FEWER)


def test_replicates_are_the_machine_run_again_with_other_noise() -> None:
    first, _, model = fitted(Hidden())
    made = replicates(first, (), model.fitted.by_name, [Load("x_axis.disturbance", 2.0, 5.0)], 3)
    places = [one.record[POSITION] for one in made.drawn]
    assert len(places) == 3
    assert len({one.sensed.plan.channels for one in made.drawn}) == 1
    assert np.array_equal(made.drawn[0].record[FORCE], first.record[FORCE])
    apart = [float(np.std(place - first.record[POSITION])) for place in places]
    assert all(1e-6 < size < 0.2 * float(np.std(first.record[POSITION])) for size in apart)
    again = replicates(first, (), model.fitted.by_name, [Load("x_axis.disturbance", 2.0, 5.0)], 1)
    assert np.array_equal(again.drawn[0].record[POSITION], places[0])


@pytest.mark.parametrize(("hidden", "stands"), [(Hidden(), False), (SQUEAL, True)], ids=["sound", "squeal"])
def test_a_squeal_is_a_doubt_and_noise_is_none(hidden: Hidden, stands: bool) -> None:
    doubts = doubts_of(hidden)
    assert doubts is not None and doubts.replicates == 20
    assert (doubts.probability[BAND, in_octave(POSITION, 70.0)] <= FEWER.verdict.false_alarms) is stands


def test_many_tests_raise_no_more_false_alarms_than_one() -> None:
    """Of statistics that are all noise the smallest adjusted probability is below a twentieth in one case of twenty."""
    rng = np.random.default_rng(3)
    alarms = 0
    for _ in range(400):
        table = rng.standard_normal((51, 12))
        drawn = [{("test", str(place)): float(value) for place, value in enumerate(row)} for row in table[1:]]
        recorded = {("test", str(place)): float(value) for place, value in enumerate(table[0])}
        alarms += min(adjusted(recorded, drawn).values()) <= 0.05
    assert 400 * 0.015 < alarms < 400 * 0.07


@pytest.mark.parametrize("corner", [2.0, 8.0])
def test_a_load_is_known_from_the_band_in_which_a_motion_shows_it(corner: float) -> None:
    """First-order noise of 3 N, of which only the first 10 Hz are seen: what lies above belongs to it."""
    rng, period, samples = np.random.default_rng(5), 1e-3, 20_000
    kept = float(np.exp(-2.0 * np.pi * corner * period))
    values = np.zeros(samples)
    for place in range(1, samples):
        values[place] = kept * values[place - 1] + 3.0 * np.sqrt(1.0 - kept * kept) * rng.standard_normal()
    spectrum = np.fft.rfft(values)
    band = int(10.0 * samples * period)
    spectrum[band:] = 0.0
    deviation, found = first_order_noise(np.fft.irfft(spectrum, n=samples), period, band)
    assert deviation == pytest.approx(3.0, rel=0.25)
    assert found == pytest.approx(corner, rel=0.5)


DRAG = Hidden(law=lambda v, q, t: 1500.0 * v * abs(v))


@pytest.mark.parametrize(("hidden", "stands"), [(Hidden(), False), (DRAG, True)], ids=["sound", "drag"])
def test_what_goes_with_the_motion_beyond_chance_is_a_doubt(hidden: Hidden, stands: bool) -> None:
    doubts = doubts_of(hidden)
    assert doubts is not None
    assert (doubts.probability[DEPENDENCE, POSITION] <= 1.0 / 20.0) is stands
