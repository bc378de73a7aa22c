"""An interval never holds zero where the gain of its effect excludes that."""

import math

import pytest

from lathesim.diagnosis.explaining.chance import size_error
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.found import Gain, RankedEffect
from lathesim.diagnosis.reporting.effect_report import reported
from lathesim.effects.friction import CoulombFriction
from lathesim.identification.estimation.estimates import CONFIDENCE, Estimate, Estimates
from tests.diagnosis.pushed_table import experiments, recording


def test_a_size_is_half_as_uncertain_as_the_gain_which_grows_with_its_square() -> None:
    assert size_error(Gain(240.0, 4.8), STANDARD) == pytest.approx(0.5 * math.sqrt(24.0) * 0.02)
    assert math.isinf(size_error(Gain(240.0, 24.0), STANDARD))


@pytest.mark.parametrize(("of_size", "error", "half"), [(0.1, 30.0, 1.5), (0.1, 0.5, 0.5), (math.inf, 30.0, 30.0)])
def test_an_interval_that_holds_zero_is_as_wide_as_the_gain_allows(of_size: float, error: float, half: float) -> None:
    (experiment,) = experiments(recording(), effects=(CoulombFriction,))
    (friction,) = experiment.candidates
    values = Estimates({friction.parameters[0]: Estimate(15.0, error)}, 1.0)
    effect = reported(RankedEffect(friction, 1.0, (), 0.9, of_size), values, experiment)
    assert effect.parameters["level"].high == pytest.approx(15.0 + CONFIDENCE * half)
    assert effect.sizes.may_be_zero == math.isinf(of_size)
