"""``lathesim bench --lanes``: many runs of one machine side by side against the same runs one by one, and against C, as ratios in one run.

One by one means the batch as it is for few runs, which is how all were made before there were lanes; process, machine and values are the
same. What is compiled ahead is not measured. Runs are a multiple of 16, but for the rest of a command's own.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

from lathesim.cli.speed.bench_rows import Tell, cpu_seconds, measured_on_line, seconds_text
from lathesim.cli.writing import CommandResult
from lathesim.engine import batch, lanes
from lathesim.engine.assembly import FloatArray
from lathesim.engine.batch import Batch
from lathesim.engine.lane_text import LANES
from lathesim.engine.wiring import Plan
from tests.benchmarks.held import Held, clock, held_result, in_child, last
from tests.benchmarks.servo_axis import VARIED, no_compiler, samples_of, servo_in_c, servo_plan, spread

ALONE = 12
"""Runs that are made one by one."""
JACOBIAN = (
    "x_axis.mass", "x_axis.viscous", "x_axis.disturbance", "x_drive.conductance", "x_drive.back_emf", "x_drive.effort_constant",
    "x_controller.position_gain", "x_controller.velocity_gain", "x_controller.integral_rate", "x_controller.mean_share",
    "x_controller.limit", "x_dac.smallest_voltage", "x_dac.largest_voltage", "x_encoder.resolution", "x_scale.resolution",
)  # fmt: skip
"""Fifteen parameters of the servo axis."""
_LONG = 2.0
"""CPU seconds of what is measured only once."""
_MEMORY_RUNS = (400, 4000)


@dataclass(frozen=True)
class LaneFigure(Held):
    """A ratio, the bar it is held against, and the processor times [s] of one run behind it, where it is one of times."""

    name: str
    value: float
    bar: float
    is_at_least: bool
    alone_s: float | None = None
    together_s: float | None = None


@dataclass(frozen=True)
class Work:
    """What is measured: ``run`` makes runs with ``values`` (runs, names) in one batch."""

    name: str
    bar: float
    values: FloatArray
    run: Callable[[FloatArray], object]


def measured(quick: bool, save: Path | None, tell: Tell) -> tuple[CommandResult, list[str]]:
    """Measure runs side by side."""
    figures, left_out = lane_figures(3 if quick else 5, quick=quick, tell=tell)
    return held_result("lathesim-bench-lanes/1", figures, _lines(figures, left_out), skipped=left_out)


def _lines(figures: Sequence[LaneFigure], left_out: Sequence[str]) -> Iterator[str]:
    yield "| ratio | before | after | value | bar | |\n|---|---:|---:|---:|---:|---|"
    for figure in figures:
        word = "at least" if figure.is_at_least else "at most"
        before, after = ("" if value is None else seconds_text(value) for value in (figure.alone_s, figure.together_s))
        yield f"| {figure.name} | {before} | {after} | {figure.value:.3g} | {word} {figure.bar:g} | {figure.sign} |"
    yield "\n".join(["", *(f"Left out: {item}." for item in left_out), measured_on_line()])


def lane_figures(rounds: int, *, quick: bool, tell: Tell) -> tuple[list[LaneFigure], list[str]]:
    """Return the figures, measured here and now, and what was left out and why."""
    figures: list[LaneFigure] = []
    for make in (_servo_works, _lathe_works, _command_works):
        for work in make(quick):
            tell(f"measuring {work.name} ...")
            figures.append(_measured(work, rounds))
    tell("measuring a Jacobian, memory and threads ...")
    figures += [_jacobian(rounds), _memory(), _threads(rounds)]
    if no_compiler():
        return figures, [f"the servo axis in C: {no_compiler()}"]
    tell("measuring C ...")
    return [*figures, _against_c(rounds)], []


def _measured(work: Work, rounds: int) -> LaneFigure:
    """Measure both in turns, after what is compiled for them."""
    _make_ready(work.run, work.values)
    alone, together = _in_turns([lambda: _one_by_one(work.run, work.values[:ALONE]), lambda: work.run(work.values)], rounds)
    one, many = alone / ALONE, together / len(work.values)
    return LaneFigure(f"{work.name}: one by one over side by side", one / many, work.bar, True, one, many)


def _one_by_one(run: Callable[[FloatArray], object], values: FloatArray) -> None:
    """Make runs of a batch one by one, as if there were too few of them for lanes."""
    with patch.object(batch, "LEAST", len(values) + 1):
        run(values)


def _make_ready(run: Callable[[FloatArray], object], values: FloatArray) -> None:
    """Make runs of a batch until it looks for lanes, as if compiling them cost nothing."""
    spent = 0.0
    with patch.object(lanes, "compile_time", lambda fused: 0.0):
        while spent < 2.0 * lanes.WORTH_A_LOOK:
            spent += cpu_seconds(lambda: run(values))


def _in_turns(calls: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Return the median CPU seconds of each call, measured in turns; only once where they take long."""
    takes_long = max(cpu_seconds(call) for call in calls) > _LONG
    seconds = [[cpu_seconds(call) for call in calls] for _ in range(1 if takes_long else rounds)]
    return [statistics.median(found) for found in zip(*seconds, strict=True)]


def batch_work(name: str, bar: float, plan: Plan, samples: int, names: Sequence[str], runs: int = 4 * LANES) -> Work:
    """Return a batch of a plan, each of its runs reduced to one number."""
    made = Batch(plan, samples, threads=1)
    return Work(name, bar, spread(plan, names, runs), lambda values: made.run(names, values, last))


def _servo_works(quick: bool) -> list[Work]:
    named = {"": ("servo axis", 7.0), "stick-slip": ("stick-slip", 5.0), "tanh": ("tanh in the law", 2.5)}
    named |= {"stick-slip with exp": ("stick-slip with exp and pow", 2.5)}
    plans = {friction: servo_plan(friction) for friction in named}
    return [batch_work(*named[friction], plan, samples_of(plan), VARIED) for friction, plan in plans.items()]


def _lathe_works(quick: bool) -> list[Work]:
    from lathesim.cli.speed.bench_rows import lathe_work

    work = lathe_work()
    names = ("x_controller.proportional", "z_controller.proportional", "x_axis.gain", "z_axis.gain")
    return [batch_work("two-axis lathe, program in the loop", 4.0, work.plan, work.samples, names)]


def _command_works(quick: bool) -> list[Work]:
    share = 10 if quick else 1
    sweeps = (
        ("22_what_is_wrong_with_this_machine", "x_controller.position_gain", "max_x_voltage"),
        ("01_contour_error", "x_controller.proportional", "max_contour_error"),
    )
    found = [_sweep(*given, _in_lanes(1000 // share)) for given in sweeps]
    return [*found, _emulation(_in_lanes(5000 // share))]


def _in_lanes(runs: int) -> int:
    """Return a number of runs of which the last are as many side by side as the first."""
    return -(-runs // LANES) * LANES


def _sweep(lesson: str, name: str, metric: str, runs: int) -> Work:
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.lessons.sweep_runs import Members
    from lathesim.plugins import load_registry

    registry = load_registry(installed=False)
    loaded = load_lesson(lesson)
    prepared = prepare(loaded, registry, next(iter(loaded.variants), None))
    members = Members(prepared, (name,), {metric: registry.metric(metric)})
    members.compile()

    def run(values: FloatArray) -> None:
        members.runs([(number, (float(value),)) for number, (value,) in enumerate(values)], lambda member: None)

    return Work(f"a sweep of {runs} runs of lesson {lesson[:2]}", 5.0, spread(prepared.plan, [name], runs), run)


def _emulation(runs: int) -> Work:
    """Return runs of the staircase G1 of lesson 27, 25 s, read ten times a second."""
    from lathesim.experiments.free_values import free_values
    from lathesim.experiments.replica import Replica, Setting
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.plugins import load_registry

    lesson = load_lesson("27_a_controller_that_tells_nothing")
    prepared = prepare(lesson, load_registry(installed=False), "staircase")
    names = [item.name for item in free_values(lesson, prepared.plan, (), 4.0)]
    replica = Replica([Setting(prepared.machinery, ("x_axis.position", "y_axis.position"), np.arange(0.0, 25.0, 0.1))], names)
    return Work(f"{runs} runs of the emulation of G1", 5.0, spread(prepared.plan, names, runs), replica.readings)


def _against_c(rounds: int) -> LaneFigure:
    """Return the batch over C with as many lanes, which must have the same bits."""
    plan = servo_plan()
    work, in_c = batch_work("", 0.0, plan, samples_of(plan), VARIED, 16 * LANES), servo_in_c(plan, LANES)
    _make_ready(work.run, work.values)
    ours = Batch(plan, samples_of(plan), threads=1).run(VARIED, work.values[:LANES])
    if not all(np.array_equal(one, other.T) for one, other in zip(ours, in_c(work.values[:LANES]), strict=True)):
        raise AssertionError("the axis in C has other numbers than the engine")

    def by_hand() -> None:
        for first in range(0, len(work.values), LANES):
            for record in in_c(work.values[first : first + LANES]):
                last(record.T)

    engine, hand = (seconds / len(work.values) for seconds in _in_turns([lambda: work.run(work.values), by_hand], rounds))
    return LaneFigure("servo axis: side by side over C with 16 lanes", engine / hand, 1.25, False, hand, engine)


def _jacobian(rounds: int) -> LaneFigure:
    """Return the cost of a run and of fifteen others, each with one value moved, over that of a run."""
    plan = servo_plan()
    given = np.array([plan.values[name] for name in JACOBIAN])
    values = np.vstack([given, given + np.diag(1e-6 * np.maximum(np.abs(given), 1e-6))])
    work = batch_work("", 0.0, plan, samples_of(plan), JACOBIAN)
    _make_ready(work.run, values)
    alone, whole = _in_turns([lambda: _one_by_one(work.run, values[:ALONE]), lambda: work.run(values)], 3 * rounds)
    one = alone / ALONE
    return LaneFigure("Jacobian of 15 parameters over one run", whole / one, 2.0, False, one, whole / len(values))


def _memory() -> LaneFigure:
    """Return the largest memory of a process that makes ten times as many runs over that with fewer."""
    few, many = (float(in_child(__name__, str(runs))) for runs in _MEMORY_RUNS)
    return LaneFigure(f"memory of {_MEMORY_RUNS[1]} runs over {_MEMORY_RUNS[0]} runs ({many:.0f} MB)", many / few, 1.05, False)


def _memory_here(runs: int) -> str:
    from tests.benchmarks.scale import largest_memory

    work = batch_work("", 0.0, servo_plan(), 5000, VARIED, runs)
    _make_ready(work.run, work.values)
    return f"{largest_memory()}"


def _threads(rounds: int) -> LaneFigure:
    """Return how many times faster two threads are than one, by the clock."""
    plan = servo_plan()
    work = batch_work("", 0.0, plan, samples_of(plan), VARIED, 16 * LANES)
    _make_ready(work.run, work.values)
    two = Batch(plan, samples_of(plan), threads=2)
    gains = []
    for _ in range(rounds):
        first, second = clock(lambda: work.run(work.values)), clock(lambda: two.run(VARIED, work.values, last))
        gains.append(first / second)
    return LaneFigure("two threads against one, by the clock", statistics.median(gains), 1.7, True)


if __name__ == "__main__":
    print(_memory_here(int(sys.argv[1])))
