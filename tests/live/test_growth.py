"""Known effects that grow or shrink: told once, with the time since when, and forecast without what a warm-up does."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.watching.forecast import Following, Growth, GrowthCourse, bend, line_through
from lathesim.live.watching.known_effects import KnownEffects
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.live.watching.usual import CoursePoint
from lathesim.live.watching.watch import Watch
from lathesim.live.watching.watch_session import WatchSession, WatchSettings
from lathesim.live.watching.watch_verdict import Verdict, WatchEvent
from lathesim.plugins import load_registry
from lathesim.record import FloatArray
from tests.live.campaign.machines import PERIOD
from tests.live.servo import LESSON
from tests.live.servo import prepared as lesson_machine
from tests.live.streams import COMPARE, DRIVE, Streamed, stream

EVERY = 20.0


def told(sizes: FloatArray, *, stepped: float | None = None) -> list[tuple[float, Growth]]:
    """Return what a course of sizes around 1 tells, and when."""
    course, found = GrowthCourse(1.0, 1.0), []
    for number, size in enumerate(sizes):
        if stepped is not None and stepped <= number * EVERY < stepped + EVERY:
            course.stepped(stepped)
        growth = course.take((number + 0.5) * EVERY, float(size), 0.01)
        if growth is not None:
            found.append(((number + 1.0) * EVERY, growth))
    return found


@pytest.mark.parametrize("rate", [0.02, -0.02], ids=["grows", "shrinks"])
def test_a_size_that_moves_steadily_is_told_once_with_its_rate_and_its_begin(rate: float) -> None:
    noise = np.random.default_rng(1).normal(size=60) * 0.01
    ((_, growth),) = told(1.0 + rate * np.maximum(0.0, np.arange(60) - 20.0) + noise)
    assert growth.since == pytest.approx(20.0 * EVERY, abs=3.0 * EVERY)
    assert np.sign(growth.now - growth.before) == np.sign(rate)
    assert np.sign(growth.rate) == np.sign(rate)


def test_a_size_that_stays_is_told_in_no_hour_of_twenty() -> None:
    rng = np.random.default_rng(2)
    assert sum(len(told(1.0 + rng.normal(size=180) * 0.05)) for _ in range(20)) == 0


def test_a_step_is_told_by_the_next_whole_segment_and_none_where_nothing_stepped() -> None:
    noise = np.random.default_rng(3).normal(size=30) * 0.01
    ((when, growth),) = told(np.where(np.arange(30) < 15, 1.0, 1.4) + noise, stepped=15.0 * EVERY)
    assert growth.since == 15.0 * EVERY
    assert when <= 17.0 * EVERY
    assert (growth.before, growth.now) == (pytest.approx(1.0, abs=0.03), pytest.approx(1.4, abs=0.03))
    assert told(1.0 + noise, stepped=15.0 * EVERY) == []


def test_a_bend_is_found_where_the_slope_begins() -> None:
    time = np.arange(30.0)
    assert bend(time, np.maximum(0.0, time - 12.0)) == pytest.approx(12.0)


def test_a_line_through_noise_rises_as_rarely_as_asked() -> None:
    rng, times = np.random.default_rng(4), np.arange(20.0)
    lines = [line_through(times, rng.normal(size=20)) for _ in range(500)]
    assert sum(line is not None and line.rises(0.05) != 0.0 for line in lines) <= 40
    assert line_through(times[:4], times[:4]) is None


def watched(prepared: Prepared, values: FloatArray, folder: Path, tolerance: dict[str, float]) -> list[WatchEvent]:
    """Return what a watch tells of a stream."""
    events: list[WatchEvent] = []
    settings = WatchSettings(learn=30.0, folder=folder, waits=True, diagnose=False, tolerance=tolerance)
    asyncio.run(WatchSession(prepared, load_registry([]), Streamed(values), settings, events.append).run(asyncio.Event()))
    return events


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("first", "last"), [(20.0, 28.0), (20.0, 8.0)], ids=["grows", "shrinks"])
def test_an_inserted_friction_that_moves_is_told_without_an_alarm(tmp_path: Path, first: float, last: float) -> None:
    seconds, begin = 300.0, 60.0
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    friction = first + (last - first) * np.clip((time - begin) / (seconds - begin), 0.0, 1.0)
    warm = 1.0 + 0.08 * np.exp(-time / 100.0)
    lesson = tmp_path / "lesson.yaml"
    entry = {"effect": "CoulombFriction", "at": "x_axis", "level": f"{first:g} N"}
    lesson.write_text(changed_lesson(load_lesson(LESSON), [entry], {}, tmp_path), encoding="utf-8")
    prepared = prepare(load_lesson(str(lesson)), load_registry([]))
    events = watched(prepared, stream(seconds, 12, friction=friction, viscous=warm), tmp_path, {})
    assert [event.kind for event in events if event.kind in ("change", "drift")] == []
    (growth,) = (event for event in events if event.kind == "growth")
    assert ("shrinks" if last < first else "grows") in growth.sentence
    assert growth.data["since_s"] == pytest.approx(begin, abs=45.0)
    (found,) = events[-1].data["found"]
    truth = friction[int(found["until_s"] / PERIOD)]
    assert truth == pytest.approx(last, abs=0.25 * abs(last - first))
    assert found["sizes"]["level"]["to"] == pytest.approx(truth, abs=0.1 * abs(last - first))


async def test_what_was_named_is_followed_and_forecast_from_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A friction that a diagnosis names grows on: growth and a forecast, and no further alarm."""
    seconds, begin = 160.0, 32.0
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    friction = np.where(time < begin, 0.0, 4.0 + 4.0 * (time - begin) / (seconds - begin))
    warm = 1.0 + 0.05 * np.exp(-time / 60.0)
    at = {"effect": "CoulombFriction", "at": "x_axis"}
    answer = {
        "verdict": "named",
        "effects": [{**at, "parameters": {"level": {"value": 4.2, "unit": "N"}}}],
        "insert": [{**at, "level": "4.2 N"}],
    }

    async def diagnosed(*_: object) -> Verdict:
        return Verdict(answer)

    monkeypatch.setattr("lathesim.live.watching.watch_session.diagnose_window", diagnosed)
    events: list[WatchEvent] = []
    settings = WatchSettings(learn=16.0, window=20.0, folder=tmp_path, waits=True, tolerance={"x_encoder.position": 1.0})
    await WatchSession(
        lesson_machine(), load_registry([]), Streamed(stream(seconds, 13, friction=friction, viscous=warm)), settings, events.append
    ).run(asyncio.Event())
    assert [event.kind for event in events if event.kind in ("change", "drift")] in (["change"], ["drift"])
    (growth,) = (event for event in events if event.kind == "growth")
    assert growth.data["rate"] > 0.0
    (found,) = events[-1].data["found"]
    assert found["sizes"]["level"]["to"] == pytest.approx(friction[int(found["until_s"] / PERIOD)], rel=0.1)
    assert [event.data["channel"] for event in events if event.kind == "forecast"][:1] == ["x_encoder.position"]


def test_an_uncertain_value_beyond_what_the_lesson_allows_is_told_once() -> None:
    ready = lesson_machine()
    residuals = ResidualStream(ready, DRIVE, COMPARE, PERIOD)
    watch = Watch(residuals, PERIOD)
    following = Following(watch, {}, KnownEffects(ready, load_registry([])), {}, None)
    at = residuals.parameters.index("x_axis.viscous")
    told_of = []
    for number, value in enumerate((0.5, 3.9, 4.1, 4.6, 5.0)):
        values = np.zeros(len(residuals.parameters))
        values[at] = value
        watch.points.append(CoursePoint(20.0 * number, values, np.full(len(values), 0.1), np.zeros(len(COMPARE))))
        told_of += [(number, event.kind, event.data["parameter"]) for event in following.news(20.0 * number + 10.0)]
    assert told_of == [(3, "range", "x_axis.viscous")]
