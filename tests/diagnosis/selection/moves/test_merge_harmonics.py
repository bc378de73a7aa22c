"""A ripple and its second harmonic are one cogging, which has both lines."""

import math

import numpy as np
import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.moves.merge_harmonics import merge_harmonics
from lathesim.effects.motor_ripple import Cogging, TorqueRipple
from lathesim.identification.estimation.least_squares import fit
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording

PERIOD, FIRST, SECOND = 0.012, 8.0, 3.0


def teeth(v: float, q: float, t: float) -> float:
    angle = 2.0 * math.pi * q / PERIOD
    return FIRST * math.sin(angle + 0.5) + SECOND * math.sin(2.0 * angle - 0.6)


@pytest.mark.parametrize(("part", "taken"), [(2.0, True), (3.0, False)], ids=["the second harmonic", "another line"])
def test_two_lines_of_one_wave_take_the_place_of_the_first(part: float, taken: bool) -> None:
    first, second = experiments(*(recording(Hidden(law=teeth), seed=seed) for seed in (1, 2)), effects=(TorqueRipple, Cogging))
    said: list[str] = []
    laboratory = Laboratory(first, second, said.append)
    fitted = fit(first.sensed, baseline(first), rounds=3)
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    ripple, cogging = first.candidates
    wave = {"amplitude": FIRST, "share": 0.0, "period": PERIOD, "phase": 0.5 + math.pi}
    one = laboratory.trial(before, ripple, (), before.free, [np.array([wave[name.partition(".")[2]] for name in ripple.parameters])])
    line = {"amplitude": SECOND, "second": 0.0, "period": PERIOD / part, "phase": -0.6, "second_phase": 0.0}
    start = np.array([line[name.partition(".")[2]] for name in cogging.parameters])
    two = laboratory.trial(one.model, cogging, (ripple,), one.model.free, [start])
    found = SearchResult(before, one.model, {ripple.part: [one]})
    found = merge_harmonics(laboratory, found, Method(), [two])
    assert [candidate.name for candidate in found.model.candidates] == (["Cogging"] if taken else ["TorqueRipple"])
    if taken:
        values = {name.partition(".")[2]: found.model.fitted.by_name[name] for name in cogging.parameters}
        assert [abs(values[name]) for name in ("amplitude", "second", "period")] == pytest.approx([FIRST, SECOND, PERIOD], rel=0.02)
        assert said[-1] == "Cogging takes the place of TorqueRipple"
