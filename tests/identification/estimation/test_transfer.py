"""What belongs to a recording is fitted anew on another one: how it begins, and what the machine had done before."""

import math

import numpy as np
import pytest

from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.effects.friction import ViscousWarmUp
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import begun_anew, transferred
from tests.diagnosis.pushed_table import PERIOD, Hidden, Law, baseline, experiments, recording, study

CHANGE, WARMING = -120.0, 2.0


def after(warmed: float) -> Law:
    """Return grease that thins [N], of a table that has been running for some time [s]."""
    return lambda speed, place, time: CHANGE * (1.0 - math.exp(-(time + warmed) / WARMING)) * speed


def test_a_table_that_was_warm_already_is_judged_as_such() -> None:
    cold, warm = experiments(recording(Hidden(law=after(0.0))), recording(Hidden(law=after(3.0)), seed=2), effects=[ViscousWarmUp])
    (candidate,) = cold.candidates
    start = np.array([CHANGE if name.endswith("change") else WARMING for name in candidate.parameters])
    fitted = fit(cold.sensed, [*baseline(cold), *candidate_free(study(cold, warm), candidate, start)])
    judged = transferred(warm, fitted, [candidate])
    assert candidate.remembered == (f"{candidate.part}.warmed_before",)
    assert judged.by_name[candidate.remembered[0]] == pytest.approx(3.0, rel=0.25)
    as_if_cold = fit(warm.sensed, warm.start_states(warm.sensed.plan), {**fitted.by_name, candidate.remembered[0]: 0.0})
    assert np.std(judged.residual) < 0.3 * np.std(as_if_cold.residual)


def test_the_time_before_a_recording_goes_back_a_hundred_times_as_long_as_it_lasts() -> None:
    experiment, _ = experiments(recording(), recording(seed=2), effects=[ViscousWarmUp])
    before = begun_anew(experiment, experiment.candidates)[-1]
    assert (before.start, before.low) == (0.0, 0.0)
    assert before.high == pytest.approx(100.0 * len(experiment.record) * PERIOD)
