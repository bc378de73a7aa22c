"""Sixteen runs side by side have the bits of sixteen runs one by one, and a batch goes over to them only where it pays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.component import Component, DiscreteState, Input, Memory, Noise, Output, Parameter, Table
from lathesim.engine import batch, lane_text, lanes
from lathesim.engine.assembly import Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.fuse import fuse, idle_values
from lathesim.engine.lane_flat import refusal
from lathesim.engine.lane_text import LaneModule, lane_module
from lathesim.engine.run import run
from lathesim.engine.run_arrays import RunArrays
from lathesim.engine.wiring import Plan, wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import lesson_files, load_lesson, load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import load_registry
from tests.engine.small_machine import PARTS, WIRES, loop

MACHINES = Path(__file__).parents[2] / "lesson_configs" / "machines"


class Trial(Component):
    """A voltage through what laws are made of: branches, an early return, a library function, a memory, a whole number, an end."""

    held = DiscreteState("V", doc="voltage of this sample")
    count = DiscreteState("1", doc="samples on the high side")
    past = Memory("V", doc="voltages before", length=4, start=0.0)
    given = Input("V", doc="voltage")
    edge = Parameter("V", 0.5, doc="edge of a dead zone")
    last = Parameter("1", 1e9, doc="samples on the high side at the end")
    out = Output("V", doc="voltage out")
    done = Output("1", doc="one at the end")

    @staticmethod
    def update(given: float, edge: float, count: float, past: list[float], time: float, sample_period: float) -> tuple[float, float]:
        place = int(time / sample_period) % 4
        before = past[place]
        past[place] = given
        bent = math.tanh(given) if given > edge else given
        if -edge < bent < edge or not bent > before:
            return 0.9 * before, count
        if bent > 0.0 and bent > edge:
            count += 1.0
            bent = bent - edge
        return bent, count

    @staticmethod
    def output(held: float, count: float, last: float) -> tuple[float, float]:
        if count >= last:
            return 0.0, 1.0
        return min(max(held, -4.0), math.floor(4.5)), 0.0


def trial_plan() -> Plan:
    """Return the small machine with the trial between controller and axis."""
    wires = [wire for wire in WIRES if wire.target != "axis.voltage"]
    wires += [Wire("trial.given", "controller.voltage"), Wire("axis.voltage", "trial.out")]
    return wire(replace(loop(), parts=(*PARTS, Part("trial", Trial)), wires=tuple(wires), finish="trial.done"))


class Recorded(Component):
    """A signal of a table, row after row."""

    recorded = Table("m", ("signal",), doc="one row a sample")
    now = DiscreteState("m", doc="signal of this sample")
    reference = Output("m", doc="signal")
    noise = Noise(doc="noise of the signal")

    @staticmethod
    def update(recorded: list[list[float]], time: float, sample_period: float, noise: float) -> float:
        return recorded[int(time / sample_period + 0.5)][0] + 0.1 * noise

    @staticmethod
    def output(now: float) -> float:
        return now


def recorded_plan() -> Plan:
    """Return the small machine with a recorded reference."""
    return wire(replace(loop(), parts=(Part("source", Recorded, tables={"recorded": np.zeros((120, 1))}), *PARTS[1:])))


NAMES = ("axis.lag", "controller.gain", "trial.edge", "trial.last")


def values(count: int) -> np.ndarray:
    """Return members of which some end early."""
    random = np.random.default_rng(5)
    columns = (random.uniform(0.05, 0.2, count), random.uniform(1.0, 8.0, count), random.uniform(0.0, 0.9, count))
    return np.column_stack([*columns, np.where(np.arange(count) % 3 == 1, 5.0 + np.arange(count), 1e9)])


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Have every batch go over to lanes at once; gives how many members each call of theirs had."""
    calls: list[int] = []
    made = lanes.Lanes.run

    def counted(self: lanes.Lanes, members: Sequence[RunArrays], *others: Any) -> object:
        calls.append(len(members))
        return made(self, members, *others)

    monkeypatch.setattr(lanes, "WORTH_A_LOOK", 0.0)
    monkeypatch.setattr(lanes, "compile_time", lambda fused: 0.0)
    monkeypatch.setattr(lanes, "_SPENT", {})  # what machines of other tests took is not known
    monkeypatch.setattr(lanes.Lanes, "run", counted)
    return calls


def one_by_one(made: Batch, names: Sequence[str], members: np.ndarray, lengths: Sequence[int] | None = None) -> list[np.ndarray]:
    """Return the records of members, each run in a batch of its own."""
    return [
        made.run(names, member, tables=None, lengths=None if lengths is None else [lengths[place]])[0]
        for place, member in enumerate(members)
    ]


def same(some: Sequence[np.ndarray], others: Sequence[np.ndarray]) -> bool:
    """Return whether all bits are the same, but for those of a NaN, which say nothing."""
    numbers = [np.where(np.isnan(item), np.nan, item).tobytes() for item in (*some, *others)]
    return numbers[: len(some)] == numbers[len(some) :]


def test_lanes_have_the_bits_of_runs_one_by_one_and_of_plain_python(at_once: list[int]) -> None:
    plan, members = trial_plan(), values(21)
    made = Batch(plan, 600, seed=3, threads=1)
    together = made.run(NAMES, members)
    assert at_once == [16, 5]
    assert same(together, one_by_one(made, NAMES, members))
    for member, record in zip(members[:2], together, strict=False):
        plain = run(plan, duration=599 * 0.005, seed=3, engine="plain", overrides=dict(zip(NAMES, member, strict=True)))
        for place, channel in enumerate(plan.channels):
            numbers = record[place][np.isfinite(record[place])]
            assert np.array_equal(plain[channel], numbers)
    assert np.isnan(together[1]).any() and not np.isnan(together[0]).any()


def test_each_member_may_have_a_length_of_its_own(at_once: list[int]) -> None:
    plan, members, lengths = trial_plan(), values(16), [40 * place for place in range(1, 17)]
    made = Batch(plan, 600, threads=1)
    assert same(made.run(NAMES, members, lengths=lengths), one_by_one(made, NAMES, members, lengths))
    assert at_once == [16]


def test_a_lane_that_breaks_down_leaves_the_others_as_they_were(at_once: list[int]) -> None:
    plan, members = trial_plan(), values(16)
    made = Batch(plan, 300, threads=1)
    sound = made.run(NAMES, members)
    members[3, 0] = math.nan
    broken = made.run(NAMES, members)
    assert at_once == [16, 16]
    assert same(broken[:3] + broken[4:], sound[:3] + sound[4:])
    assert np.isnan(broken[3]).any()


def test_threads_share_the_members(at_once: list[int]) -> None:
    plan, members = trial_plan(), values(70)
    assert same(Batch(plan, 200, threads=3).run(NAMES, members), Batch(plan, 200, threads=1).run(NAMES, members))


def test_few_members_are_run_one_by_one(at_once: list[int]) -> None:
    Batch(trial_plan(), 100, threads=1).run(NAMES, values(lanes.FEWEST - 1))
    assert not at_once
    Batch(trial_plan(), 100, threads=1).run(NAMES, values(18))
    assert at_once == [16]


def test_members_may_have_tables_and_noise_of_their_own(at_once: list[int]) -> None:
    plan = recorded_plan()
    random = np.random.default_rng(8)
    tables, members = [random.normal(size=(120, 1)) for _ in range(20)], values(20)[:, :1]
    made = Batch(plan, 100, threads=1)
    together = made.run(["axis.lag"], members, tables={"source.recorded": tables}, seeds=range(20))
    alone = [
        made.run(["axis.lag"], members[place : place + 1], tables={"source.recorded": tables[place : place + 1]}, seeds=[place])[0]
        for place in range(20)
    ]
    assert at_once == [16, 4]
    assert same(together, alone)
    assert not same(together[:1], made.run(["axis.lag"], members[:1], tables={"source.recorded": tables[:1]}, seeds=[1]))


def test_lanes_are_compiled_only_where_the_runs_take_longer_than_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = wire(loop(0.0005))
    asked: list[object] = []
    looked: list[object] = []

    def later(fused: object) -> float:
        asked.append(fused)
        return 1e9

    def absent(fused: object) -> bool:
        looked.append(fused)
        return False

    monkeypatch.setattr(lanes, "_SPENT", {})
    monkeypatch.setattr(lanes, "compile_time", later)
    monkeypatch.setattr(lanes, "is_compiled", absent)
    Batch(plan, 50, threads=1).run(["axis.lag"], np.linspace(0.1, 0.2, 20)[:, None])
    assert not asked  # not even a text is written for so little
    monkeypatch.setattr(lanes, "WORTH_A_LOOK", 0.0)
    for _ in range(3):
        Batch(plan, 50, threads=1).run(["axis.lag"], np.linspace(0.1, 0.2, 20)[:, None])
    assert len(asked) == len(looked) == 1  # the folder that is looked through may hold thousands of files


def test_a_text_for_lanes_is_written_once_and_read_by_a_later_start(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, varied = trial_plan(), frozenset(NAMES)
    written = lane_module(plan, varied, {})
    monkeypatch.setattr(lane_text, "_WRITTEN", {})
    assert lane_text.known_module(plan, varied, {}) == written


@pytest.mark.parametrize(
    ("law", "line"), [(Trial.update, "before = past[place]"), (Trial.output, ""), (Recorded.update, "return recorded")]
)
def test_the_line_that_keeps_a_law_from_lanes_is_named(law: Callable[..., Any], line: str) -> None:
    found = refusal(law)
    place, _, text = found.partition(": ")
    assert text.startswith(line) and bool(found) == bool(line)
    if line:
        path, _, number = place.rpartition(":")
        assert Path(path) == Path(__file__) and Path(path).read_text(encoding="utf-8").splitlines()[int(number) - 1].strip() == text


def test_what_does_not_depend_on_the_lanes_is_computed_once() -> None:
    text = lane_module(wire(loop()), frozenset({"axis.lag"}), {}).fused.source
    assert "\n        source__now = " in text


@pytest.mark.slow
@pytest.mark.parametrize("path", list(lesson_files()), ids=lambda path: path.stem)
def test_every_lesson_has_the_same_bits_in_lanes(path: Path, at_once: list[int]) -> None:
    """Six parameters of the lesson's machine are varied."""
    lesson = load_lesson(path)
    plan = wire(assemble(lesson, load_registry(installed=False), next(iter(lesson.variants), None)))
    left_alone = ("bits", "resolution", "interpolator", "sample", "stages")
    given = {name: plan.values[name] for name in plan.parameters}
    sized = [name for name, value in given.items() if value not in (0.0, 1.0) and abs(value) < 1e8]
    names = [name for name in sized if not any(word in name for word in left_alone)][:6]
    start = np.array([given[name] for name in names])
    members = start * np.random.default_rng(0).uniform(0.9, 1.1, (16, len(names)))
    made = Batch(plan, 300, threads=1)
    assert same(made.run(names, members), one_by_one(made, names, members))
    assert at_once == [16]


@pytest.mark.slow
@pytest.mark.parametrize("template", ["cascade_axis", "cutting_process", "torque_spindle"])
def test_every_effect_has_the_same_bits_in_lanes(template: str, at_once: list[int]) -> None:
    """All candidates of the template act at once, each with another size in every lane, and in the last three lanes none does."""
    registry = load_registry(installed=False)
    assembly = check_machine(load_machine(MACHINES / f"{template}.yaml"), registry).assembly
    filled, _ = insert_candidates(assembly, registry.effects.values())  # type: ignore[arg-type]
    plan = wire(filled)
    idle = {f"{part.name}.{name}": value for part in plan.parts.values() for name, value in idle_values(plan, part).items()}
    given = np.array(list(idle.values()))
    members = np.where(given > 1e8, 5.0, given + 1e-4) * np.random.default_rng(1).uniform(0.5, 1.5, (16, len(given)))
    members[13:] = given
    made = Batch(plan, 60, threads=1)
    assert same(made.run(list(idle), members), one_by_one(made, list(idle), members))
    assert at_once == [16]


class GainAndOffset(Component):
    """A voltage with two errors, each nothing by itself."""

    given = Input("V", doc="voltage")
    gain = Parameter("1", 0.0, doc="error of its gain")
    offset = Parameter("V", 0.0, doc="error of its zero")
    out = Output("V", doc="voltage out")

    @classmethod
    def idle(cls) -> tuple[dict[str, float], dict[str, str]]:
        return {"gain": 0.0, "offset": 0.0}, {"out": "given"}

    @staticmethod
    def output(given: float, gain: float, offset: float) -> float:
        return given + gain * given + offset


def test_one_of_two_neutral_values_may_vary_alone(at_once: list[int]) -> None:
    wires = [wire for wire in WIRES if wire.target != "axis.voltage"]
    wires += [Wire("off.given", "controller.voltage"), Wire("axis.voltage", "off.out")]
    plan = wire(replace(loop(), parts=(*PARTS, Part("off", GainAndOffset)), wires=tuple(wires)))
    made, members = Batch(plan, 100, threads=1), np.linspace(0.0, 0.1, 17)[:, None]
    assert same(made.run(["off.gain"], members), one_by_one(made, ["off.gain"], members))
    assert at_once


def test_only_a_full_group_decides_whether_lanes_are_given_up() -> None:
    plan = wire(loop())
    choice = lanes.Choice(plan, ["axis.lag"], np.array([plan.values[name] for name in plan.parameters]), {})
    choice.spend(1.0, 1, side_by_side=False)
    choice.spend(8.0, 4, side_by_side=True)
    assert not choice.refused
    choice.spend(2.0 * lanes.LANES, lanes.LANES, side_by_side=True)
    assert choice.refused


def test_a_machine_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    working: list[int] = []
    together: list[int] = []
    made = batch.compiled_machine

    def watched(fused: Any) -> Any:
        working.append(1)
        together.append(len(working))
        try:
            return made(fused)
        finally:
            working.pop()

    monkeypatch.setattr(batch, "compiled_machine", watched)
    plan = wire(replace(loop(), finish=""))

    def one(_: int) -> np.ndarray:
        found: np.ndarray = Batch(plan, 200, noisy=False).run([], np.zeros((1, 0)))[0]
        return found

    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(one, range(8)))
    assert together == [1] * 8
    assert all(np.array_equal(run, runs[0]) for run in runs)


def test_a_text_waits_for_what_the_compiler_took_for_the_same_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most candidates of a diagnosis are given up before lanes of their own would pay."""
    plan, written = trial_plan(), list[frozenset[str]]()
    made = lanes.lane_module

    def counted(plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> LaneModule:
        written.append(varied)
        return made(plan, varied, idle)

    monkeypatch.setattr(lanes, "_SPENT", {(fuse(plan).digest, frozenset({("other", True)})): lanes._Spent(price=1e9)})
    monkeypatch.setattr(lanes, "WORTH_A_LOOK", 0.0)
    monkeypatch.setattr(lanes, "known_module", lambda plan, varied, idle: None)
    monkeypatch.setattr(lanes, "lane_module", counted)
    Batch(plan, 50, threads=1).run(NAMES, values(20))
    assert not written
    monkeypatch.setattr(lanes, "_SPENT", {})
    Batch(plan, 50, threads=1).run(NAMES, values(20))
    assert written[0] == frozenset(NAMES)


def test_a_value_that_every_member_leaves_as_the_plan_has_it_does_not_vary(at_once: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    plan, members = trial_plan(), values(16)
    members[:, 1] = plan.values[NAMES[1]]
    asked = list[frozenset[str]]()
    made = lanes.lane_module

    def counted(plan: Plan, varied: frozenset[str], idle: Mapping[str, bool]) -> LaneModule:
        asked.append(varied)
        return made(plan, varied, idle)

    monkeypatch.setattr(lanes, "lane_module", counted)
    batch = Batch(plan, 300, threads=1)
    together = batch.run(NAMES, members)
    assert at_once == [16]
    assert set(asked) == {frozenset(NAMES) - {NAMES[1]}}
    assert same(together, one_by_one(batch, NAMES, members))
