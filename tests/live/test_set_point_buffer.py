"""The buffer between planner and servo: published-style underrun counts, elastic playback without a hard stop, nothing below empty."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.live.samples import LiveError
from lathesim.live.set_point_buffer import BufferCount, ClockStatistics, SetPointBuffer
from lathesim.live.streaming import Planner, stream_virtually
from tests.live.servo import Kept


def busy_planner(fill: int, rng: np.random.Generator, rho: float | None = None, periods: int = 20_000) -> BufferCount:
    """Return what a buffer saw of a planner that fills it up to ``fill`` and is then away for 5 + Exp(15) periods."""
    buffer, turn = SetPointBuffer(1, 400, rho), 0.0
    for period in range(periods):
        if period >= turn:
            count = max(0, int(fill - buffer.fill))
            buffer.put(buffer.arrived + np.arange(float(count))[:, None])
            turn = period + 5.0 + rng.exponential(15.0)
        buffer.play(1)
        assert buffer.fill >= 0.0
    return buffer.count()


def test_a_holding_buffer_underruns_as_often_as_computed() -> None:
    rng = np.random.default_rng(0)
    assert [busy_planner(fill, rng).underruns for fill in (20, 50, 100, 200)] == [5628, 1034, 7, 0]


@pytest.mark.parametrize(
    ("rho", "longer"),
    [(0.02, {50: 0.12, 100: 0.007, 150: 0.0001, 200: 0.0}), (0.005, {100: 0.14, 150: 0.007, 200: 0.0004})],
)
def test_an_elastic_buffer_never_stops_dead_and_takes_little_longer(rho: float, longer: dict[int, float]) -> None:
    for fill, expected in longer.items():
        count = busy_planner(fill, np.random.default_rng(0), rho)
        assert count.hard_stops == 0
        assert 20_000 / count.consumed == pytest.approx(1.0 + expected, abs=0.01)


def test_the_virtual_stream_counts_the_same_and_the_same_again() -> None:
    def count(fill: int) -> BufferCount:
        return stream_virtually(iter([np.arange(20_000.0)[:, None]]), None, SetPointBuffer(1, 400), Planner(fill, 5.0, 15.0, 3))

    assert count(100) == count(100)
    assert count(20).underruns > count(50).underruns > count(200).underruns == 0


def test_the_elastic_path_is_that_of_the_undisturbed_run_within_its_limits() -> None:
    steps = 4000
    s = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, steps))
    circle = 0.02 * np.column_stack([np.cos(2 * np.pi * s), np.sin(2 * np.pi * s)])
    rho = 0.001
    kept = Kept()
    buffer = SetPointBuffer(2, 900, rho)
    count = stream_virtually(iter([circle]), None, buffer, Planner(650, 5.0, 120.0, 1), kept)
    played = kept.values.T
    assert count.hard_stops == 0
    assert len(played) > steps + 20
    assert np.abs(np.hypot(*played.T) - 0.02).max() < 1e-6
    speed, acceleration = np.diff(circle, axis=0), np.diff(circle, 2, axis=0)
    assert np.abs(np.diff(played, axis=0)).max() <= np.abs(speed).max() * 1.001
    assert np.abs(np.diff(played, 2, axis=0)).max() <= np.abs(acceleration).max() * 1.001 + np.abs(speed).max() * rho


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=40), st.sampled_from([None, 0.01, 0.2, 1.0]))
def test_the_fill_is_never_negative_and_no_set_point_is_lost(turns: list[tuple[int, int]], rho: float | None) -> None:
    buffer, played, sent = SetPointBuffer(1, 50, rho), [np.zeros((0, 1))], 0
    for arriving, periods in turns:
        sent += buffer.put(sent + np.arange(float(arriving))[:, None])
        played.append(buffer.play(periods))
        assert 0.0 <= buffer.fill <= 50.0
    buffer.end()
    played.append(buffer.play(20_000))
    values = np.concatenate(played)[:, 0]
    assert buffer.finished or sent == 0
    if sent:
        assert values[-1] == pytest.approx(sent - 1)
        assert np.all(np.diff(values) >= -1e-9)
        assert np.all(np.diff(values) <= 1.0 + 1e-9)
    if rho is None:
        assert np.array_equal(np.unique(values), np.arange(float(sent)))


def test_sizes_that_cannot_be_are_told() -> None:
    with pytest.raises(LiveError, match="the buffer has room for 1 set-points"):
        SetPointBuffer(1, 1)
    with pytest.raises(LiveError, match="the playback rate may change by 2 in a period"):
        SetPointBuffer(1, 10, 2.0)


def test_the_clock_statistics_are_those_of_all_wakes() -> None:
    late, fill = np.random.default_rng(4).exponential(1e-4, 50), np.arange(50.0) + 3.0
    clock = ClockStatistics()
    for one in zip(late, fill, strict=True):
        clock.add(*one)
    spread = (late.mean(), late.std(), late.max(), 3.0, fill.mean())
    assert list(clock.as_json().values()) == pytest.approx([50, *spread], rel=1e-12)
