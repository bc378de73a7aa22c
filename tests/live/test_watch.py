"""The watch on machines by another integrator: sound ones stay quiet, changes are told soon, and faults of the recording are its own."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.even_clock import SampleClock
from lathesim.live.samples import SampleBlock
from lathesim.live.watching.change_test import Cusum
from lathesim.live.watching.forecast import forecast
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.live.watching.states import ReportedChange
from lathesim.live.watching.watch import Watch
from lathesim.live.watching.watch_session import WatchSession, WatchSettings
from lathesim.live.watching.watch_verdict import Verdict, WatchEvent
from lathesim.plugins import load_registry
from lathesim.record import FloatArray
from tests.cli.command import call, refused
from tests.live.campaign.machines import PERIOD, step
from tests.live.servo import LESSON, prepared
from tests.live.streams import COMPARE, DRIVE, Streamed, in_blocks, stream, written

LEARN = 14.0
"""Seconds to learn: two laps."""


@pytest.fixture(scope="module")
def ready() -> Prepared:
    """The lesson's machine."""
    return prepared()


def watched(ready: Prepared, blocks: Iterable[SampleBlock]) -> tuple[list[ReportedChange], Watch, SampleClock]:
    """Return the alarms of a stream, its watch and its clock."""
    watch = Watch(ResidualStream(ready, DRIVE, COMPARE, PERIOD), PERIOD, learn=LEARN)
    clock = SampleClock(PERIOD)
    alarms = [alarm for block in blocks for stretch in clock.take(block) for alarm in watch.take(stretch)]
    return alarms, watch, clock


def test_the_sums_run_as_long_as_computed() -> None:
    rng, lengths = np.random.default_rng(0), []
    sums = Cusum((400,), 0.5, np.full(400, 4.0))
    counts = np.zeros(400)
    for _ in range(2000):
        over = (sums.take(rng.normal(size=400) + 1.0, 0.0) > 0.0).any(axis=0)
        counts += 1.0
        lengths += counts[over].tolist()
        counts[over] = 0.0
        sums.sums[:, over] = 0.0
    assert np.mean(lengths) == pytest.approx(8.383, rel=0.02)


def test_a_sound_machine_that_warms_up_and_takes_another_load_stays_quiet(ready: Prepared) -> None:
    seconds = 60.0
    warm = 1.1 - 0.2 * (1.0 - np.exp(-np.arange(round(seconds / PERIOD)) * PERIOD / 60.0))
    values = stream(seconds, 1, mass=step(seconds, 40.0, 1.01, 0.98), viscous=warm)
    alarms, watch, _ = watched(ready, in_blocks(values, 5000))
    assert alarms == []
    assert abs(watch.values["x_axis.mass"]) < 3.0


@pytest.mark.parametrize(
    ("change", "channel"),
    [
        pytest.param({"friction": (0.0, 8.0)}, "", marks=pytest.mark.slow),
        ({"gain": (1.0, 1.07)}, "x_drive.current"),
        pytest.param({"gain": (1.0, 0.9)}, "x_drive.current", marks=pytest.mark.slow),
        ({"play": (0.0, 4e-6)}, "x_scale.position"),
    ],
    ids=["friction", "gain", "smaller gain", "play"],
)
def test_a_change_is_told_soon_with_its_time_and_place(ready: Prepared, change: dict[str, tuple[float, float]], channel: str) -> None:
    (name, (before, after)), at = next(iter(change.items())), 24.0
    alarms, _, _ = watched(ready, in_blocks(stream(31.0, 2, **{name: step(31.0, at, before, after)}), 5000))
    assert len(alarms) >= 1
    assert at <= alarms[0].time < at + 10.0
    assert alarms[0].begun == pytest.approx(at, abs=0.7)
    assert not alarms[0].drift
    assert channel in alarms[0].channel


def test_memory_and_answers_do_not_depend_on_how_the_stream_was_cut(ready: Prepared) -> None:
    values = stream(27.0, 3, friction=step(27.0, 24.0, 0.0, 8.0))
    alarms, watch, _ = watched(ready, in_blocks(values, 5000))
    ends = np.cumsum(np.random.default_rng(0).integers(1, 900, 100))
    parts = zip(np.split(np.arange(values.shape[1]) * PERIOD, ends), np.split(values, ends, axis=1), strict=True)
    again, other, _ = watched(ready, (SampleBlock(*part) for part in parts if len(part[0])))
    assert alarms
    assert [(alarm.time, alarm.channel) for alarm in again] == [(pytest.approx(alarm.time), alarm.channel) for alarm in alarms]
    assert watch.blocks == other.blocks


def test_lost_doubled_and_reordered_samples_are_the_recordings_fault(ready: Prepared) -> None:
    values = stream(45.0, 4)
    time = np.arange(values.shape[1]) * PERIOD
    rng = np.random.default_rng(0)
    keep = np.ones(len(time), dtype=bool)
    keep[36_000:36_800] = False
    keep[rng.integers(30_000, 40_000, 200)] = False
    order = np.flatnonzero(keep)
    for at in rng.integers(30_000, 40_000, 50):
        order[[at, at + 1]] = order[[at + 1, at]]
    order = np.insert(order, rng.integers(30_000, 40_000, 50), order[rng.integers(30_000, 40_000, 50)])
    parts = np.split(order, range(777, len(order), 777))
    alarms, _, clock = watched(ready, (SampleBlock(time[rows], values[:, rows]) for rows in parts))
    assert alarms == []
    assert clock.counts["missing"] >= 900
    assert clock.counts["came twice or out of order"] >= 50


@given(st.sets(st.integers(1, 60), max_size=20), st.lists(st.integers(1, 9), min_size=1, max_size=12))
def test_the_clock_bridges_short_gaps_and_begins_anew_after_long_ones(missing: set[int], cuts: list[int]) -> None:
    numbers = np.array([number for number in range(64) if number not in missing])
    clock, found, begin, turn = SampleClock(1.0), [], 0, 0
    while begin < len(numbers):
        rows = numbers[begin : begin + cuts[turn % len(cuts)]]
        found += clock.take(SampleBlock(rows.astype(np.float64), rows[None].astype(np.float64)))
        begin += len(rows)
        turn += 1
    for stretch in found:
        assert stretch.values[0] == pytest.approx(stretch.begin + np.arange(stretch.values.shape[1]))
    joined = np.concatenate([stretch.values[0] for stretch in found])
    assert np.all(np.diff(joined) > 0.0)
    assert clock.counts.get("missing", 0) == len(missing)


def test_a_forecast_holds_the_truth_as_often_as_it_says() -> None:
    rng, inside = np.random.default_rng(0), 0
    for _ in range(300):
        time = np.linspace(0.0, 100.0, 60)
        found = forecast(time, 0.01 * time + rng.normal(size=60) * 0.05, 2.0)
        assert found is not None
        inside += found.low <= 200.0 <= found.high
    assert 0.90 <= inside / 300 <= 0.985
    assert forecast(time, rng.normal(size=60), 20.0) is None


async def test_a_session_tells_what_it_learnt_what_changed_and_how_it_ended(ready: Prepared, tmp_path: Path) -> None:
    events: list[WatchEvent] = []
    values = stream(30.0, 5, friction=step(30.0, 26.0, 0.0, 8.0))
    settings = WatchSettings(learn=LEARN, diagnose=False, folder=tmp_path)
    await WatchSession(ready, load_registry([]), Streamed(values), settings, events.append).run(asyncio.Event())
    kinds = [event.kind for event in events]
    assert kinds[0] == "learnt"
    assert "change" in kinds
    assert kinds[-1] == "end"
    change = events[kinds.index("change")]
    assert change.data["since_s"] == pytest.approx(26.0, abs=0.5)
    assert "x_axis.mass" in events[0].data["values"]


FRICTION = {"effect": "CoulombFriction", "at": "x_axis"}
NAMED = {
    "verdict": "named",
    "effects": [{**FRICTION, "parameters": {"level": {"value": 8.0, "unit": "N"}}}],
    "insert": [{**FRICTION, "level": "8 N"}],
}


async def told(
    ready: Prepared, values: FloatArray, answers: list[dict[str, Any]], folder: Path, patch: pytest.MonkeyPatch
) -> list[WatchEvent]:
    """Return the events of a watch whose diagnoses answer what is given, one after another."""

    async def answer(*_: object) -> Verdict:
        return Verdict(answers.pop(0))

    patch.setattr("lathesim.live.watching.watch_session.diagnose_window", answer)
    events: list[WatchEvent] = []
    settings = WatchSettings(learn=LEARN, window=5.0, folder=folder, waits=True)
    await WatchSession(ready, load_registry([]), Streamed(values), settings, events.append).run(asyncio.Event())
    return events


async def test_what_was_named_belongs_to_the_machine_and_its_growth_is_told(
    ready: Prepared, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    friction = step(61.0, 23.0, 0.0, 8.0) + step(61.0, 57.0, 0.0, 8.0)
    events = await told(ready, stream(61.0, 5, friction=friction), [NAMED, NAMED], tmp_path, monkeypatch)
    alarms = [event for event in events if event.kind == "change"]
    assert [event.data["since_s"] for event in alarms] == [pytest.approx(23.0, abs=0.5), pytest.approx(57.0, abs=0.5)]
    growth = next(event for event in events if event.kind == "growth")
    assert "CoulombFriction at x_axis has grown: level from 0 to about 16 N" in growth.sentence
    found = events[-1].data["found"]
    assert [(item["effect"], item["sizes"]["level"]["to"]) for item in found] == [("CoulombFriction", pytest.approx(16.0))]
    assert found[0]["until_s"] == pytest.approx(57.0, abs=0.5)
    going_on = prepare(load_lesson(str(tmp_path / "watch_2_goes_on.yaml")), load_registry([]))
    plan = going_on.plan
    assert plan.values["x_axis_coulomb_friction.level"] == pytest.approx(16.0)


async def test_without_a_name_the_watch_goes_on_from_the_changed_state(
    ready: Prepared, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = stream(62.0, 5, friction=step(62.0, 23.0, 0.0, 8.0))
    events = await told(ready, values, [{"verdict": "unknown"}], tmp_path, monkeypatch)
    assert [event.kind for event in events if event.kind in ("change", "drift")] == ["change"]
    continued = next(event for event in events if event.kind == "continued")
    assert continued.sentence.endswith("watching goes on from the changed state.")
    assert [event.kind for event in events].count("learnt") == 2


def test_recordings_one_after_another_are_a_stream(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = stream(40.0, 6, friction=step(40.0, 35.0, 0.0, 8.0))
    files = [written(values[:, :30_000], tmp_path / "march.h5"), written(values[:, 30_000:], tmp_path / "april.h5")]
    said = call(capsys, "watch", LESSON, *files, "--learn", "14 s", "--no-diagnosis", "--json-lines", "--out", tmp_path)
    lines = [json.loads(line) for line in said.out.splitlines()]
    assert said.code == 0, said.err
    assert {line["schema"] for line in lines} == {"lathesim-watch/1"}
    change = next(line for line in lines if line["event"] == "change")
    assert change["since_s"] == pytest.approx(36.0, abs=1.0)
    assert "s after it begins)" in change["sentence"].partition("(april.h5, ")[2]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.h5"], "there is no such file"),
        (["http://127.0.0.1:1"], "no MTConnect agent answers at http://127.0.0.1:1/"),
        (["ftp://127.0.0.1:1"], "is no address of a machine"),
        (["nowhere.h5", "--tolerance", "x_scale.positon=5um"], "Did you mean 'x_scale.position'?"),
    ],
)
def test_what_cannot_be_watched_is_told(capsys: pytest.CaptureFixture[str], arguments: list[str], sentence: str) -> None:
    assert sentence in refused(capsys, "watch", LESSON, *arguments).err


def test_values_far_from_the_lessons_do_not_take_the_simulation_with_them(ready: Prepared) -> None:
    residuals = ResidualStream(ready, DRIVE, COMPARE, PERIOD)
    assert residuals.move(np.full(3, 1e3)) == pytest.approx([4.0, 0.5 / 0.15, 4.0])
    assert np.isfinite(residuals.take(stream(3.0, 1)).values).all()
    assert residuals.move(np.full(3, 1e4)) == pytest.approx(np.zeros(3))


@pytest.mark.slow
def test_an_inserted_play_that_grows_is_told_as_growth_over_several_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = stream(150.0, 11, play=step(150.0, 95.0, 10e-6, 20e-6))
    files = [
        written(values[:, at : at + 50_000], tmp_path / f"{name}.h5") for at, name in ((0, "may"), (50_000, "june"), (100_000, "july"))
    ]
    lesson = tmp_path / "lesson.yaml"
    play = {"effect": "Backlash", "at": "x_scale", "width": "10 um"}
    lesson.write_text(changed_lesson(load_lesson(LESSON), [play], {}, tmp_path), encoding="utf-8")
    said = call(capsys, "watch", lesson, *files, "--learn", "30 s", "--json-lines", "--out", tmp_path / "out")
    lines = [json.loads(line) for line in said.out.splitlines()]
    assert said.code == 0, said.err
    assert [line["grown"] for line in lines if line["event"] == "growth"] == [["Backlash at x_scale"]]
    (found,) = lines[-1]["found"]
    assert found["sizes"]["width"]["from"] == pytest.approx(10e-6)
    assert found["sizes"]["width"]["to"] == pytest.approx(20e-6, rel=0.02)
    assert found["since_s"] == pytest.approx(96.0, abs=1.0)
    assert "(june.h5, 45." in lines[-1]["sentence"]
