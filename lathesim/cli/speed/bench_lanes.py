"""``lathesim bench --lanes``: many runs of one machine side by side against the same runs one by one, and against C, as ratios in one run.

One by one means in batches of so few runs that they are never put side by side; the process, the machine and the values are the same.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.cli.speed.bench_rows import Tell, cpu_seconds
from lathesim.cli.speed.bench_servo import VARIED, no_compiler, samples_of, servo_in_c, servo_plan, spread
from lathesim.engine.assembly import FloatArray
from lathesim.engine.running.batch import Batch
from lathesim.engine.wiring import Plan

LANES = 16
ALONE = 3
"""Runs of a batch that are made one by one."""
JACOBIAN = (
    "x_axis.mass", "x_axis.viscous", "x_axis.disturbance", "x_drive.conductance", "x_drive.back_emf", "x_drive.effort_constant",
    "x_controller.position_gain", "x_controller.velocity_gain", "x_controller.integral_rate", "x_controller.mean_share",
    "x_controller.limit", "x_dac.smallest_voltage", "x_dac.largest_voltage", "x_encoder.resolution", "x_scale.resolution",
)  # fmt: skip
"""Fifteen parameters of the servo axis."""
_MEMORY_RUNS = (400, 8000)


@dataclass(frozen=True)
class LaneFigure:
    """A ratio, the bar it is held against, and the processor times [s] of one run behind it, where it is one of times."""

    name: str
    value: float
    bar: float
    is_at_least: bool
    alone_s: float | None = None
    together_s: float | None = None

    @property
    def is_within(self) -> bool:
        """Whether the bar is kept."""
        return self.value >= self.bar if self.is_at_least else self.value <= self.bar


@dataclass(frozen=True)
class Work:
    """What is measured: ``together`` makes so many runs in one batch, ``alone`` a few of them one by one."""

    name: str
    bar: float
    together: Callable[[], object]
    runs: int
    alone: Callable[[], object]
    runs_alone: int


def lane_figures(rounds: int, *, quick: bool, tell: Tell) -> tuple[list[LaneFigure], list[str]]:
    """Return the figures, measured here and now, and what was left out and why."""
    figures: list[LaneFigure] = []
    left_out = [] if not no_compiler() else [f"the same axis in C: {no_compiler()}"]
    for make in (_servo_works, _program_works, _command_works):
        for work in make(quick):
            tell(f"measuring {work.name} ...")
            figures.append(_measured(work, rounds))
    if not no_compiler():
        tell("measuring C ...")
        figures.append(_against_c(rounds))
    tell("measuring a Jacobian ...")
    figures.append(_jacobian(rounds))
    tell("measuring memory and threads ...")
    figures += [_memory(), _threads(rounds)]
    return figures, left_out


def _measured(work: Work, rounds: int) -> LaneFigure:
    """Measure both in turns, after what is compiled for them."""
    _settle(work.together)
    alone, together = _in_turns([work.alone, work.together], rounds)
    one, many = alone / work.runs_alone, together / work.runs
    return LaneFigure(f"{work.name}: one by one over side by side", one / many, work.bar, True, one, many)


def _in_turns(calls: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Return the median CPU seconds of each call, measured in turns."""
    for call in calls:
        call()
    seconds = [[cpu_seconds(call) for call in calls] for _ in range(rounds)]
    return [statistics.median(found) for found in zip(*seconds, strict=True)]


def _settle(call: Callable[[], object]) -> None:
    """Have a batch made ready for what it is about to do: it compiles what pays."""
    call()


def batch_work(name: str, bar: float, plan: Plan, samples: int, names: Sequence[str], runs: int = 64, alone: int = 12) -> Work:
    """Return a batch of a plan, each of its runs reduced to one number."""
    values = spread(plan, names, runs)
    batch = Batch(plan, samples, threads=1)

    def one_by_one() -> None:
        for first in range(0, alone, ALONE):
            batch.run(names, values[first : first + ALONE], _last)

    return Work(name, bar, lambda: batch.run(names, values, _last), runs, one_by_one, alone)


def _servo_works(quick: bool) -> list[Work]:
    named = {"": ("servo axis", 7.0), "stick-slip": ("stick-slip", 5.0), "tanh": ("tanh in the law", 2.5)}
    named |= {"stick-slip with exp": ("stick-slip with exp and pow", 2.5)}
    plans = {friction: servo_plan(friction) for friction in named}
    return [batch_work(*named[friction], plan, samples_of(plan), VARIED) for friction, plan in plans.items()]


def _program_works(quick: bool) -> list[Work]:
    from lathesim.cli.speed.bench_work import lathe_work

    work = lathe_work()
    names = ("x_controller.proportional", "z_controller.proportional", "x_axis.gain", "z_axis.gain")
    return [batch_work("two-axis lathe, program in the loop", 4.0, work.plan, work.samples, names)]


def _command_works(quick: bool) -> list[Work]:
    return [_sweep(100 if quick else 1000), _emulation(500 if quick else 5000)]


def _sweep(runs: int) -> Work:
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.lessons.sweeping.members import Members
    from lathesim.plugins import load_registry

    registry, name = load_registry(installed=False), "x_controller.proportional"
    prepared = prepare(load_lesson("01_contour_error"), registry, "I")
    members = Members(prepared, (name,), {"max_contour_error": registry.metric("max_contour_error")})
    members.compile()
    jobs = [(number, (float(value),)) for number, (value,) in enumerate(spread(prepared.plan, [name], runs))]

    def one_by_one() -> None:
        for job in jobs[:12]:
            members.run(*job)

    return Work(f"a sweep of {runs} runs of lesson 01", 5.0, lambda: members.runs(jobs, lambda member: None), runs, one_by_one, 12)


def _emulation(runs: int) -> Work:
    """Return runs of the staircase G1 of lesson 16, 25 s, read ten times a second."""
    from lathesim.experiments.emulation.free_values import free_values
    from lathesim.experiments.replica import Replica, Setting
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.plugins import load_registry

    lesson = load_lesson("16_a_controller_that_tells_nothing")
    prepared = prepare(lesson, load_registry(installed=False), "staircase")
    names = [item.name for item in free_values(lesson, prepared.plan, (), 4.0)]
    setting = Setting("G1", prepared.machinery, ("x_axis.position", "y_axis.position"), np.arange(0.0, 25.0, 0.1))
    replica = Replica([setting], names)
    values = spread(prepared.plan, names, runs)

    def one_by_one() -> None:
        for first in range(0, 12, ALONE):
            replica.readings(values[first : first + ALONE])

    return Work(f"{runs} runs of the emulation of G1", 5.0, lambda: replica.readings(values), runs, one_by_one, 12)


def _against_c(rounds: int) -> LaneFigure:
    """Return the batch over C with as many lanes, which must have the same bits."""
    plan = servo_plan()
    values = spread(plan, VARIED, 4 * LANES)
    batch, in_c = Batch(plan, samples_of(plan), threads=1), servo_in_c(plan, LANES)
    ours = batch.run(VARIED, values[:LANES])
    if not all(np.array_equal(one, other.T) for one, other in zip(ours, in_c(values[:LANES]), strict=True)):
        raise AssertionError("the axis in C has other numbers than the engine")

    def by_hand() -> None:
        for first in range(0, len(values), LANES):
            for record in in_c(values[first : first + LANES]):
                _last(record.T)

    engine, hand = _in_turns([lambda: batch.run(VARIED, values, _last), by_hand], rounds)
    return LaneFigure("servo axis: side by side over C with 16 lanes", engine / hand, 1.25, False, hand / len(values), engine / len(values))


def _jacobian(rounds: int) -> LaneFigure:
    """Return the cost of a run and of fifteen others, each with one value moved, over that of a run."""
    plan = servo_plan()
    given = np.array([plan.parameter_values[plan.parameters[name]] for name in JACOBIAN])
    values = np.vstack([given, given + np.diag(1e-6 * np.maximum(np.abs(given), 1e-6))])
    batch = Batch(plan, samples_of(plan), threads=1)

    def together() -> None:
        batch.run(JACOBIAN, values, _last)

    _settle(together)
    alone, whole = _in_turns([lambda: batch.run(JACOBIAN, values[:ALONE], _last), together], 3 * rounds)
    one = alone / ALONE
    return LaneFigure("Jacobian of 15 parameters over one run", whole / one, 2.0, False, one, whole / len(values))


def _memory() -> LaneFigure:
    """Return the largest memory of a process that makes twenty times as many runs over that with fewer."""
    few, many = (float(_child(runs)) for runs in _MEMORY_RUNS)
    return LaneFigure(f"memory of {_MEMORY_RUNS[1]} runs over {_MEMORY_RUNS[0]} runs ({many:.0f} MB)", many / few, 1.05, False)


def _child(runs: int) -> str:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    command = [sys.executable, "-m", __name__, str(runs)]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def _memory_here(runs: int) -> str:
    from lathesim.cli.speed.bench_scale import largest_memory

    plan = servo_plan()
    Batch(plan, 5000, threads=1).run(VARIED, spread(plan, VARIED, runs), _last)
    return f"{largest_memory()}"


def _threads(rounds: int) -> LaneFigure:
    """Return how many times faster two threads are than one, by the clock."""
    plan = servo_plan()
    values = spread(plan, VARIED, 16 * LANES)
    one, two = (Batch(plan, samples_of(plan), threads=threads) for threads in (1, 2))
    gains = []
    for _ in range(rounds):
        first, second = (_clock(lambda batch=batch: batch.run(VARIED, values, _last)) for batch in (one, two))  # type: ignore[misc]
        gains.append(first / second)
    return LaneFigure("two threads against one, by the clock", statistics.median(gains), 1.7, True)


def _clock(call: Callable[[], object]) -> float:
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def _last(record: FloatArray) -> float:
    return float(record[0, -1])


if __name__ == "__main__":
    print(_memory_here(int(sys.argv[1])))
