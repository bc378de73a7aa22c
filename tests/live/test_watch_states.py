"""The states of a watch, block by block and without a stream, and its noise test.

What other values of the machine do to the noise is no change, and blocks that depend on one another tell less.
"""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.live.watching.change_test import NoiseTest
from lathesim.live.watching.residual_stream import Residual
from lathesim.live.watching.states import (
    GoOn,
    JudgingState,
    LearningState,
    Moved,
    PausedState,
    ReportedChange,
    Steps,
    WatchedBlock,
    WatchedChannels,
    WatchMemory,
    WatchState,
)
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


WATCHED = WatchedChannels(("axis.mass",), np.array([False]), ("scale.position",), ("axis.reference",), BLOCK, 20, 30)
NOTHING = WatchMemory(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros((1, 1)))


def block(number: int, mass: float = 0.0, offset: float = 0.0, times: float = 1.0) -> WatchedBlock:
    """Return a block: a machine whose mass is off by so many deviations, with an offset and noise that is so much louder."""
    rng = np.random.default_rng(number)
    shape = np.sin(np.arange(20) + 0.3 * number)
    values = mass * shape + offset + times * 0.1 * rng.normal(size=20)
    speed = np.cos(np.arange(20) + 0.3 * number)[None]
    simulated = np.sin(2.3 * np.arange(20) + number)[None]
    residual = Residual(values[None], shape[None, None], speed, simulated, np.zeros((0, 1, 20)))
    return WatchedBlock(BLOCK * (number + 1), residual, np.full(1, 1e-4 * times**2), [], np.zeros(1))


def run(state: WatchState, blocks: list[WatchedBlock]) -> tuple[WatchState, list[object]]:
    """Return the state after blocks, with all their events."""
    events: list[object] = []
    for item in blocks:
        state, more = state.after(item)
        events += more
    return state, events


@pytest.fixture(scope="module")
def judging() -> JudgingState:
    state, _ = run(LearningState(WATCHED, NOTHING, centred=True), [block(number) for number in range(30)])
    assert isinstance(state, JudgingState)
    return state


def test_it_learns_until_there_are_enough_blocks_and_judges_then(judging: JudgingState) -> None:
    state, events = run(LearningState(WATCHED, NOTHING, centred=True), [block(number) for number in range(29)])
    assert isinstance(state, LearningState)
    assert (len(state.rows), events) == (29, [])
    assert judging.memory.base is not None
    assert judging.memory.first is not None
    assert judging.memory.first[0] is judging.usual
    assert abs(judging.memory.theta[0]) < 0.3


def test_values_far_from_the_lessons_are_simulated_before_it_learns_again() -> None:
    state, events = run(LearningState.anew(WATCHED, NOTHING), [block(number, mass=3.0) for number in range(10)])
    assert isinstance(state, LearningState)
    assert (state.centred, state.rows) == (True, ())
    assert [type(event) for event in events] == [GoOn]
    assert state.memory.theta[0] == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize(("offset", "times", "where"), [(1.0, 1.0, "at all times"), (0.0, 8.0, "in its noise")])
def test_an_alarm_ends_the_course_and_it_learns_anew(offset: float, times: float, where: str) -> None:
    state, _ = run(LearningState(WATCHED, NOTHING, centred=True), [block(number) for number in range(30)])
    state, events = run(state, [block(number, 0.0, offset, times) for number in range(30, 45)])
    (change,) = (event for event in events if isinstance(event, ReportedChange))
    assert isinstance(state, LearningState)
    assert (change.channel, change.state, change.drift) == ("scale.position", where, False)
    assert change.begun == pytest.approx(6.0, abs=0.5)
    assert state.memory.course is None
    assert state.memory.held is not None


def test_a_step_of_an_uncertain_value_is_believed_after_a_while_and_is_no_alarm() -> None:
    state, _ = run(LearningState(WATCHED, NOTHING, centred=True), [block(number) for number in range(30)])
    state, events = run(state, [block(number, mass=2.0) for number in range(30, 60)])
    assert isinstance(state, JudgingState)
    assert [type(event) for event in events][:2] == [Moved, GoOn]
    step = events[0]
    assert isinstance(step, Moved)
    assert (step.parameter, step.begun) == ("axis.mass", pytest.approx(6.0, abs=0.3))
    assert step.time >= step.begun + 10 * BLOCK


def test_while_it_is_paused_nothing_comes_of_a_block(judging: JudgingState) -> None:
    paused = PausedState(judging, judging.memory)
    state, events = run(paused, [block(number, offset=5.0) for number in range(100, 140)])
    assert state is paused
    assert events == []


def test_steps_that_follow_one_another_have_one_beginning() -> None:
    steps = Steps().with_one(100.0).with_one(110.0)
    assert (steps.begun(112.0), steps.begun(140.0)) == (100.0, 140.0)
    assert steps.with_one(150.0).begun(155.0) == 150.0
