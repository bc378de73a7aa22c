"""The noise test: what other values of the machine do to the noise is no change, and blocks that depend on one another tell less."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.live.watching.noise_test import NoiseTest
from lathesim.record import FloatArray

BLOCK = 0.2


def noises(rng: np.random.Generator, count: int, level: float = 0.0, dependence: float = 0.0) -> FloatArray:
    """Return the noise of a slow and a quick channel in blocks, its logarithm around a level, (count, 2)."""
    drawn = rng.normal(size=(count, 2))
    for number in range(1, count):
        drawn[number] = dependence * drawn[number - 1] + np.sqrt(1.0 - dependence**2) * drawn[number]
    return np.exp(level + 0.3 * drawn)


def first_told(test: NoiseTest, blocks: FloatArray) -> int | None:
    """Return after how many blocks a change was told."""
    return next((number for number, left in enumerate(blocks) if test.take(left, BLOCK * (number + 1)) is not None), None)


@pytest.mark.parametrize(("level", "is_told"), [(-0.2, False), (0.2, False), (0.6, True), (-0.6, True)])
def test_noise_that_other_values_would_leave_too_is_no_change(level: float, is_told: bool) -> None:
    rng = np.random.default_rng(1)
    learnt = noises(rng, 300)
    others = np.array([learnt * np.exp(0.15), learnt * np.exp(-0.15)] * 2)
    assert (first_told(NoiseTest(learnt, others, BLOCK), noises(rng, 3000, level)) is not None) is is_told


def test_a_small_lasting_change_is_told_where_no_value_explains_it() -> None:
    rng = np.random.default_rng(2)
    learnt = noises(rng, 300)
    assert first_told(NoiseTest(learnt, np.zeros((0, *learnt.shape)), BLOCK), noises(rng, 3000, 0.35)) is not None


def test_blocks_that_depend_on_one_another_bring_no_alarm() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        blocks = noises(rng, 5000, dependence=0.7)
        learnt = blocks[:300]
        assert first_told(NoiseTest(learnt, np.zeros((0, *learnt.shape)), BLOCK), blocks[300:]) is None
