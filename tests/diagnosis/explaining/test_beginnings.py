"""Where fits begin: at the values that the model has, and at those of the lesson where these are not out of the question."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.explaining.starts import starts
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.records.found import Screened
from lathesim.effects.friction import CoulombFriction
from tests.diagnosis.pushed_table import VISCOUS, Hidden, experiments, machine, recording, study


def far_off(*, by_output_error: bool) -> Study:
    """Return recordings of a table with more viscous friction than its vague lesson says, and a little dry friction."""
    recordings = [recording(Hidden(viscous=3.0 * VISCOUS, dry=0.5), seed=seed) for seed in (1, 2)]
    halves = experiments(*recordings, effects=(CoulombFriction,), of=machine(sure=0.5))
    return study(*(half.by_output_error() if by_output_error else half for half in halves))


def test_values_of_the_lesson_that_simulate_far_off_are_no_beginning() -> None:
    begun = {}
    for by_output_error in (False, True):
        asked = far_off(by_output_error=by_output_error)
        model = explain(asked).baseline
        item = Screened(asked.estimation.candidates[0], 0.0, (np.array([2.0]),))
        given = {one.name: one.given for one in model.free if one.given}
        beginnings = starts(asked, model, item, None)
        begun[by_output_error] = {all(one.start == given[one.name] for one in free if one.name in given) for free in beginnings}
    assert begun == {False: {False, True}, True: {False}}
