"""What a trial is judged by."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.selection import laboratory as trial
from lathesim.diagnosis.selection.laboratory import Laboratory, _share_left, judged_score
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Score
from lathesim.identification.replay.experiment import Experiment
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording


@pytest.mark.parametrize(
    ("before", "after", "share"),
    [
        ([4000.0], [400.0], 0.1),
        ([4000.0, 90000.0], [400.0, 90000.0], 0.1),
        ([4000.0, 90000.0], [400.0, 120000.0], 120400.0 / 94000.0),
        ([4000.0, 41.0], [400.0, 50.0], 0.1),
        ([4000.0, 1.0], [400.0, 900.0], 1300.0 / 4001.0),
    ],
    ids=["one channel", "a screw that has nothing to do with it", "another is worse", "hardly anything in one", "and much there after"],
)
def test_what_is_left_is_told_where_it_is_least(before: list[float], after: list[float], share: float) -> None:
    assert _share_left(np.array(before), np.array(after)) == pytest.approx(share)


def test_a_trial_that_takes_nearly_all_away_and_gains_nothing_is_fitted_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spindle on speed with a constant torque missing: the mean of its tachometer was left 100 standard deviations off."""
    experiment, validation = experiments(recording(Hidden(dry=12.0)), recording(Hidden(dry=12.0), seed=2))
    laboratory = Laboratory(experiment, validation, lambda text: None)
    before = fit(experiment.sensed, baseline(experiment))
    laboratory.weigh(before)
    (candidate,) = [candidate for candidate in experiment.candidates if candidate.name == "CoulombFriction"]
    settled: list[float] = []

    def far_off_at_first(experiment: Experiment, fitted: Fitted) -> Score:
        score = judged_score(experiment, fitted)
        return score if settled else dataclasses.replace(score, motion=-1e6, full_band=-1e6)

    def fitted_on(*given: Any, settle: float = 0.0, **kinds: Any) -> Fitted:
        settled.extend([settle] * (settle > 0.0))
        return fit(*given, settle=settle, **kinds)

    model = laboratory.model((), before)
    monkeypatch.setattr(trial, "judged_score", far_off_at_first)
    monkeypatch.setattr(trial, "fit", fitted_on)
    tried = laboratory.trial(model, candidate, (), baseline(experiment), [np.array([10.0])])
    assert len(settled) == 1
    assert tried.gain > 100.0
    assert tried.share_of_rest > 0.9


def test_two_recordings_may_differ_in_length_and_in_how_their_noise_is_weighed() -> None:
    experiment, validation = experiments(recording(Hidden(dry=12.0), count=1200), recording(Hidden(dry=12.0), count=1000, seed=2))
    laboratory = Laboratory(experiment, validation, lambda text: None)
    started = baseline(experiment)
    without, found = (fit(experiment.sensed, started, {"try_x_axis_coulomb_friction.level": level}) for level in (0.0, 12.0))
    laboratory.weights = tuple(dataclasses.replace(noise, differences=noise.differences + 1) for noise in without.noise)
    assert laboratory._holds_there_too(without, without, {"try_x_axis_coulomb_friction.level": 12.0})
    assert not laboratory._holds_there_too(found, found, {"try_x_axis_coulomb_friction.level": 0.0})
