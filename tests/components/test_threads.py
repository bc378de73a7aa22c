"""Threads in the interpolators: where they begin, that they go on from row to row, and the way out of a tapped hole."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from lathesim.components.accelerating_interpolators import ConstantAccelerationInterpolator
from lathesim.components.interpolator import ConstantVelocityInterpolator
from lathesim.path_columns import TAP_OUT, THREAD, THREAD_ON
from tests.components.paths import RPM, SAMPLE_PERIOD, Walk, line

TURN = 2.0 * math.pi
BOTH = pytest.mark.parametrize("component", [ConstantVelocityInterpolator, ConstantAccelerationInterpolator])


def threads(*rows: tuple[float, float, float], direction: float = 1.0, **more: float) -> list[list[float]]:
    """Return a path along Z from 0 through rows of (z [mm], lead [mm], feed mode)."""
    path, here = [], 0.0
    for z, lead, mode in rows:
        turning = {"spindle_mode": 1.0, "spindle_speed": direction * 300.0 * RPM, "direction": direction}
        path.append(line((0.01, here), (0.01, z / 1000.0), feed=lead / 1000.0, feed_mode=mode, **turning, **more))
        here = z / 1000.0
    return path


def cut(component: type, path: list[list[float]], turned: Callable[[float], float], samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return turns of the spindle and z [mm] of each sample."""
    bench = Walk(component, {"path": path})
    bench.sample(spindle_angle=TURN * turned(0.0))
    turns = np.array([turned((count + 1) * SAMPLE_PERIOD) for count in range(samples)])
    return turns, np.array([1000.0 * bench.sample(spindle_angle=TURN * here)["z_reference"] for here in turns])


@BOTH
def test_threads_of_other_leads_and_far_shorter_than_a_sample_stay_on_their_leads_through_the_joints(component: type) -> None:
    rows = [(4.0, 2.0, THREAD), *((4.0 + 0.003 * count, 2.0 + 0.01 * count, THREAD_ON) for count in range(1, 101)), (0.3, 1.0, THREAD_ON)]
    turns, z = cut(component, threads(*rows), lambda time: 0.37 + 5.0 * time, 400)
    ends = [0.0, *(end for end, _, _ in rows)]
    lasting = np.cumsum([0.0, *(abs(end - begin) / lead for begin, (end, lead, _) in zip(ends, rows, strict=False))])
    np.testing.assert_allclose(z, np.interp(turns, 1.0 + lasting, ends), atol=1e-9)


@BOTH
def test_a_thread_behind_a_spindle_that_reverses_waits_for_its_index_in_the_other_sense(component: type) -> None:
    path = threads((4.0, 2.0, THREAD), direction=-1.0)
    turns, z = cut(component, path, lambda time: 3.3 + 4.0 * time - 10.0 * time * time, 400)
    assert turns.max() == pytest.approx(3.7, abs=1e-4)  # turns on to 3.7, then back: the first index is at 3 turns
    back = np.arange(len(turns)) > np.argmax(turns)
    np.testing.assert_allclose(z[back], np.clip(2.0 * (3.0 - turns[back]), 0.0, 4.0), atol=1e-9)
    assert not z[~back].any()


@BOTH
def test_a_thread_begins_at_its_start_angle_behind_the_index(component: type) -> None:
    turns, z = cut(component, threads((4.0, 2.0, THREAD), start_angle=0.75 * TURN), lambda time: 0.9 + 5.0 * time, 600)
    np.testing.assert_allclose(z, np.clip(2.0 * (turns - 1.75), 0.0, 4.0), atol=1e-9)


@BOTH
def test_without_an_angle_a_chain_goes_on_at_the_speed_of_the_spindle(component: type) -> None:
    bench = Walk(component, {"path": threads((4.0, 2.0, THREAD), (7.0, 3.0, THREAD_ON), (4.0, 3.0, TAP_OUT))})
    bench.sample()
    samples = bench.to_the_end(spindle_speed=TURN * 5.0)
    way = np.abs(np.diff([1000.0 * sample["z_reference"] for sample in samples]))
    assert way[:70] == pytest.approx(np.full(70, 2.0 * 5.0 * SAMPLE_PERIOD))
    assert way[90:110] == pytest.approx(np.full(20, 3.0 * 5.0 * SAMPLE_PERIOD))
    assert len(samples) * SAMPLE_PERIOD == pytest.approx(4.0 / 5.0, abs=2.0 * SAMPLE_PERIOD)
    assert samples[-1]["z_reference"] == pytest.approx(0.004)
