"""Deviations of a control whose clock wanders are taken apart from noise."""

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.waypoints import likely_wandering, whitened

TIME = np.sort(np.random.default_rng(2).uniform(0.0, 60.0, 600))
WEIGHTS = np.ones(2)
NOISE = 10e-6


def late(spread: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return deviations (channels, times) [m] of two axes that stand or go at 50 mm/s, and their speeds."""
    random = np.random.default_rng(seed)
    rates = 0.05 * random.choice([-1.0, 0.0, 1.0], (2, len(TIME)))
    lateness = np.cumsum(np.sqrt(spread * np.diff(TIME, prepend=0.0)) * random.standard_normal(len(TIME)))
    return rates * lateness + NOISE * random.standard_normal(rates.shape), rates


@pytest.mark.parametrize("spread", [1e-7, 1e-6])
def test_wandering_and_noise_are_found(spread: float) -> None:
    runs = [late(spread, seed) for seed in (1, 2)]
    found, floor = likely_wandering([run[0] for run in runs], [WEIGHTS] * 2, [TIME] * 2, [run[1] for run in runs])
    assert spread / 4.0 < found < 4.0 * spread
    assert floor == pytest.approx(NOISE, rel=0.3)


def test_noise_alone_is_no_wandering() -> None:
    for seed in range(20):
        deviation, rates = late(0.0, seed)
        found, floor = likely_wandering([deviation], [WEIGHTS], [TIME], [rates])
        assert found == 0.0
        assert floor == pytest.approx(NOISE, rel=0.1)


def test_what_is_new_is_white_and_linear() -> None:
    deviation, rates = late(1e-6, 7)
    new = whitened(deviation[None], WEIGHTS, TIME, rates, 1e-6, NOISE)[0]
    assert np.square(new).mean() == pytest.approx(1.0, abs=0.15)
    assert abs((new[0, 1:] * new[0, :-1]).mean()) < 0.12
    assert np.square(deviation / NOISE).mean() > 20.0
    twice = whitened(np.stack([deviation, 2.0 * deviation]), WEIGHTS, TIME, rates, 1e-6, NOISE)
    assert twice[1] == pytest.approx(2.0 * twice[0])
    # the covariance of the deviations, by which a general least-squares fit would weigh them
    rows = [rates[:, :, None] * rates[:, None, :] * 1e-6 * np.minimum.outer(TIME, TIME) + NOISE**2 * np.eye(len(TIME))][0][0]
    alone = whitened(deviation[None, :1], WEIGHTS[:1], TIME, rates[:1], 1e-6, NOISE)[0, 0]
    assert float(alone @ alone) == pytest.approx(float(deviation[0] @ np.linalg.solve(rows, deviation[0])), rel=1e-6)
