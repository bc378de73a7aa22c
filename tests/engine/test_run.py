"""Running: engines that agree bit for bit, the order of RK4, blocks, STOP, failures that name the place."""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import numpy as np
import pytest

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.signals import DelayLine
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import Attendance, Hints, run
from lathesim.engine.run_arrays import RecordedValues, start_arrays
from lathesim.engine.wiring import wire
from lathesim.errors import SimulationError, WiringError
from lathesim.record import FloatArray, Record
from tests.engine.small_machine import PARTS, WIRES, Axis, loop


def same(first: Record, second: Record) -> bool:
    return all(np.array_equal(first[name], second[name]) for name in first.channels)


def test_compiled_equals_plain_in_every_bit_over_random_parameters() -> None:
    plan = wire(loop())
    random = np.random.default_rng(5)
    for _ in range(25):
        values = {"axis.lag": random.uniform(0.02, 0.3), "axis.gain": random.uniform(0.5, 2.0), "controller.gain": random.uniform(1.0, 9.0)}
        plain = run(plan, duration=2.0, seed=3, engine="plain", overrides=values)
        assert same(plain, run(plan, duration=2.0, seed=3, engine="compiled", overrides=values))


def test_the_seed_decides_the_noise() -> None:
    plan = wire(loop())
    assert same(run(plan, duration=1.0, seed=1), run(plan, duration=1.0, seed=1))
    assert not same(run(plan, duration=1.0, seed=1), run(plan, duration=1.0, seed=2))


class Pendulum(Component):
    """d2a/dt2 = -w^2 sin a, started by a push."""

    angle = State("rad", 1.0, doc="angle")
    speed = State("rad/s", 0.0, doc="angular speed")
    frequency = Parameter("1/s", 3.0, doc="w")
    shown = Output("rad", doc="angle")

    @staticmethod
    def derivative(speed: float, angle: float, frequency: float) -> tuple[float, float]:
        return speed, -frequency * frequency * math.sin(angle)

    @staticmethod
    def output(angle: float) -> float:
        return angle


def test_runge_kutta_has_order_four_on_a_wired_machine() -> None:
    def end(step: float) -> float:
        plan = wire(Assembly((Part("pendulum", Pendulum),), (), 0.2, step))
        return float(run(plan, duration=2.0)["pendulum.shown"][-1])

    exact = end(0.2 / 512)
    errors = [abs(end(0.2 / steps) - exact) for steps in (4, 8, 16)]
    orders = [math.log2(errors[0] / errors[1]), math.log2(errors[1] / errors[2])]
    assert all(3.9 < order < 4.1 for order in orders), orders


def test_a_record_holds_units_and_descriptions() -> None:
    record = run(wire(loop()), duration=0.1)
    assert record.channels["axis.position"].unit == "m"
    assert record.channels["controller.voltage"].description == "command voltage"
    assert len(record.time) == 21
    assert record.meta["status"] == "complete"


def test_stop_keeps_what_was_computed() -> None:
    stop = threading.Event()
    seen: list[float] = []

    def progress(time: float) -> None:
        seen.append(time)
        stop.set()

    record = run(wire(loop()), duration=1000.0, engine="plain", attended=Attendance(progress, stop))
    assert record.meta["status"] == "stopped"
    assert 0 < len(record.time) < 200_000


class Watched:
    """An onlooker that keeps what it saw."""

    def __init__(self) -> None:
        self.times: list[FloatArray] = []
        self.values: list[FloatArray] = []

    def write(self, time: FloatArray, values: FloatArray) -> None:
        self.times.append(time)
        self.values.append(values)


def test_an_onlooker_sees_every_block_that_the_record_keeps() -> None:
    onlooker = Watched()
    record = run(wire(loop()), duration=1.0, seed=1, hints=Hints(largest_block=20), attended=Attendance(onlooker=onlooker))
    assert max(len(time) for time in onlooker.times) == 20
    assert np.array_equal(np.concatenate(onlooker.times), record.time)
    assert np.array_equal(np.concatenate(onlooker.values, axis=1), [record[name] for name in record.channels])
    assert same(record, run(wire(loop()), duration=1.0, seed=1))


def test_interrupting_keeps_what_was_computed() -> None:
    def progress(time: float) -> None:
        raise KeyboardInterrupt

    record = run(wire(loop()), duration=1000.0, engine="plain", attended=Attendance(progress))
    assert record.meta["status"] == "stopped"
    assert len(record.time) > 0


def test_a_step_too_long_is_refused_with_a_good_one() -> None:
    with pytest.raises(WiringError) as caught:
        run(wire(loop()), duration=1.0, overrides={"axis.lag": 1e-5})
    assert str(caught.value) == "The step of 500 us is too long: axis swings at 100 krad/s. Use 27 us or less."


class Runaway(Component):
    """dx/dt = x^2, which ends at t = 1/x0."""

    size = State("m", 4.0, doc="size")
    push = Input("m", default=0.0, doc="push")
    shown = Output("m", doc="size")

    @staticmethod
    def derivative(size: float, push: float) -> float:
        return size * size + push

    @staticmethod
    def output(size: float) -> float:
        return math.exp(size)


@pytest.mark.parametrize("engine", ["plain", "compiled"])
def test_a_broken_law_is_named_with_its_time_and_inputs_and_the_data_are_kept(engine: str) -> None:
    plan = wire(Assembly((Part("blob", Runaway),), (), 0.01, 0.001))
    with pytest.raises(SimulationError) as caught:
        run(plan, duration=1.0, engine=engine)
    assert "blob" in str(caught.value)
    assert "Runaway.output" in str(caught.value)
    assert "it was given size = " in str(caught.value)
    kept = caught.value.record
    assert isinstance(kept, Record)
    assert 20 <= len(kept.time) <= 26
    assert np.isfinite(kept["blob.shown"]).all()


def test_a_run_without_an_end_is_refused() -> None:
    with pytest.raises(SimulationError, match="the run has no end"):
        run(wire(loop()))


def test_a_slower_part_holds_between_its_samples() -> None:
    parts = (replace(PARTS[0], every=4), *PARTS[1:])
    record = run(wire(Assembly(parts, WIRES, 0.005, 0.0005)), duration=0.5)
    held = record["source.reference"][:100].reshape(-1, 4)
    assert np.array_equal(held, np.repeat(held[:, :1], 4, axis=1))
    assert len(np.unique(held[:, 0])) == 25


def test_a_start_value_may_be_overridden() -> None:
    quiet = Assembly((Part("axis", Axis),), (Wire("axis.voltage", constant=0.0),), 0.005, 0.0005)
    assert run(wire(quiet), duration=0.1, overrides={"axis.travel": 0.25})["axis.position"][0] == 0.25


class Limit:
    """Ends a run where the axis passes 1 m."""

    def look(self, first: int, values: FloatArray) -> tuple[int, str] | None:
        outside = np.flatnonzero(values[self.row] > 1.0)
        return (int(outside[0]), f"axis at sample {first + int(outside[0])}") if len(outside) else None

    def __init__(self, row: int) -> None:
        self.row = row


def test_a_guard_ends_the_run_at_the_same_sample_in_both_engines() -> None:
    plan = wire(loop())
    whole = run(plan, duration=4.0, seed=3, engine="plain")
    row = plan.channels.index("axis.position")
    first = int(np.argmax(whole["axis.position"] > 1.0))
    ended = []
    for engine, hints in (("plain", Hints(largest_block=7)), ("compiled", Hints())):
        with pytest.raises(SimulationError, match=f"axis at sample {first}") as caught:
            run(plan, duration=4.0, seed=3, engine=engine, hints=hints, attended=Attendance(guard=Limit(row)))
        assert isinstance(caught.value.record, Record)
        ended.append(caught.value.record)
    assert same(*ended)
    assert ended[0].status == f"failed: axis at sample {first}"
    assert all(np.array_equal(ended[0][name], whole[name][: first + 1]) for name in whole.channels)


@pytest.mark.parametrize("expected", [0, 3, 10, 100])
def test_blocks_are_put_one_behind_the_other(expected: int) -> None:
    whole = np.arange(20.0).reshape(2, 10)
    recorded = RecordedValues(2, expected)
    scratch = np.zeros((2, 4))
    for first in range(0, 10, 4):
        block = scratch[:, : min(4, 10 - first)]
        block[:] = whole[:, first : first + 4]
        recorded.add(block)
    assert np.array_equal(recorded.values, whole)


def test_nothing_recorded_is_no_samples() -> None:
    assert RecordedValues(3, 1000).values.shape == (3, 0)


def test_a_ring_holds_its_delay_and_the_samples_beside_it() -> None:
    line = Part("line", DelayLine.with_units({"signal": "m"}), {"delay": 0.3})
    plan = wire(Assembly((line,), (Wire("line.incoming", constant=0.0),), 1e-3, 1e-3))
    (ring,) = start_arrays(plan).memories
    (longer,) = start_arrays(plan, {"line.delay": 2.0005}).memories
    assert (len(ring), len(longer)) == (305, 2006)
