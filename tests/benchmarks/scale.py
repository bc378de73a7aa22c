"""How the cost grows: ``lathesim bench --scale`` over axes, program time and runs, with record writing, threads and memory."""

from __future__ import annotations

import dataclasses
import json
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.cli.speed.bench_rows import (
    SEED,
    Row,
    Tell,
    Work,
    cpu_seconds,
    lathe_plan,
    lathe_work,
    measured_on,
    measured_on_line,
    row_data,
    seconds_text,
)
from lathesim.cli.writing import CommandResult
from lathesim.engine.wiring import Plan
from lathesim.whole_file import make_folder
from tests.benchmarks.held import clock, in_child, last
from tests.benchmarks.many_axes import axes_plan

AXES = (1, 2, 5, 10, 20, 50)
TIMES = (10.0, 30.0, 100.0, 300.0, 1000.0, 3600.0)
RUNS = (1, 10, 100, 1000, 5000)
HOUR = 3600.0
_AXES_TIME = 20.0
_PLAIN_TIME = 4.0
"""Simulated seconds of a run over axes, compiled and plain."""
_LONG = 5.0
"""CPU seconds of what is measured only once."""
_MEMORY_RUNS = (100, 10000)
_PARAMETER = "x_controller.proportional"


@dataclass(frozen=True)
class Series:
    """Cost [CPU s] over a size; a slope of 1 on a log plot means that the cost is in proportion."""

    name: str
    sizes: tuple[float, ...]
    seconds: tuple[float, ...]

    @property
    def slope(self) -> float:
        """The slope of the least-squares line through the logarithms of all points."""
        return self._slope(0)

    @property
    def upper_slope(self) -> float:
        """The same without the smaller sizes, in which what does not grow with the size still counts."""
        return self._slope(len(self.sizes) // 3)

    def _slope(self, first: int) -> float:
        return float(np.polyfit(np.log(self.sizes[first:]), np.log(self.seconds[first:]), 1)[0])

    def rows(self) -> list[Row]:
        """Return one row a point."""
        return [Row(f"{size:g} {self.name}", seconds) for size, seconds in zip(self.sizes, self.seconds, strict=True)]


def measured(quick: bool, save: Path | None, tell: Tell) -> tuple[CommandResult, list[str]]:
    """Measure and draw how the cost grows."""
    tell("preparing the work ...")
    work = lathe_work()
    series = scale_series(work, 2 if quick else 5, quick=quick, tell=tell)
    gain = thread_gain(work, 3 if quick else 5, tell)
    long, memory = hour(tell), batch_memory(tell)
    place = _draw(series, save or Path("lathesim_runs") / "scale.png")
    compiled = next(row.median_s for row in series[-1].rows())
    data = {
        "rows": row_data([row for item in series for row in item.rows()], compiled),
        "slopes": {item.name: {"all": item.slope, "upper": item.upper_slope} for item in series},
        "two_threads": gain,
        "hour": long,
        "batch_memory_mb": memory,
        "figure": place,
        "machine": measured_on(),
    }
    return CommandResult("lathesim-bench/1", data, _lines(series, gain, long, memory, place)), []


def _lines(series: Sequence[Series], gain: float, long: Hour, memory: dict[int, float], place: Path) -> Iterator[str]:
    for item in series:
        yield "\n".join(f"{row.name:<28} {seconds_text(row.median_s)}" for row in item.rows())
    yield "\n" + "\n".join(told(series))
    yield f"two threads are {gain:.2f} times as fast as one"
    yield (
        f"an hour of program at 5 ms: {long.unrecorded_cpu_s:.2f} s of CPU compiled, {long.cpu_s:.2f} s with 30 channels recorded to disk "
        f"({long.file_mb:.0f} MB), {long.memory_mb:.0f} MB of memory"
    )
    sizes = ", ".join(f"{size:.0f} MB for {runs} runs" for runs, size in memory.items())
    yield f"a batch that keeps one cost a run: {sizes}"
    yield f"\n{measured_on_line()}\nFigure: {place}"


def _draw(series: Sequence[Series], place: Path) -> Path:
    from lathesim.analysis.plots import save_figure

    make_folder(place.parent)
    save_figure(_scale_figure({item.name: (item.sizes, item.seconds, item.slope) for item in series}), place)
    return place


def _scale_figure(series: Mapping[str, tuple[Sequence[float], Sequence[float], float]]) -> Any:
    """Return a figure with one log panel a series: name -> (sizes, CPU seconds, slope); a grey line of slope 1 shows proportion."""
    from lathesim.analysis.figure_style import CYCLE, INK, QUIET, dress, new_figure

    figure = new_figure(3.6 * len(series), 3.4)
    panels = np.atleast_1d(figure.subplots(1, len(series)))
    for number, (panel, (name, (sizes, seconds, slope))) in enumerate(zip(panels, series.items(), strict=True)):
        dress(panel, "CPU time [s]" if number == 0 else "", name, f"slope {slope:.3f}")
        panel.set_xscale("log")
        panel.set_yscale("log")
        middle = len(sizes) // 2
        along = np.array([sizes[0], sizes[-1]], dtype=float)
        panel.plot(along, seconds[middle] * along / sizes[middle], color=QUIET, linewidth=1.0, linestyle="--")
        panel.plot(sizes, seconds, color=CYCLE[number % len(CYCLE)], marker="o", markersize=4.5, linewidth=1.4)
        for size, value in zip(sizes, seconds, strict=True):
            panel.annotate(f"{value:.3g}", (size, value), (4, -9), textcoords="offset points", fontsize=7, color=INK)
    return figure


def long_plan(seconds: float) -> Plan:
    """Return the work item's lathe with one straight cut that lasts as long as asked for, at the programmed feed."""
    from lathesim.lessons.program_path import path_of_program

    plan = lathe_plan()
    feed = 50.0 / (1.2 * seconds / 60.0)
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "long.nc"
        program.write_text(f"N10 G90 G94 G71\nN20 G00 X15.0 Z14.0\nN30 M03 G01 Z64.0 F{feed:.9f} S1000\nN40 M30\n")
        table = path_of_program(program, "paper").table
    parts = tuple(_changed(part, table) for part in plan.assembly.parts)
    from lathesim.engine.wiring import wire

    return wire(dataclasses.replace(plan.assembly, parts=parts))


def _changed(part: Any, table: Any) -> Any:
    """Return a part with the long path; the force controller gives way to the programmed feed, so that the cut lasts as long as planned."""
    if "path" in part.tables:
        return dataclasses.replace(part, tables={**part.tables, "path": table})
    if part.name == "process_controller":
        from lathesim.components.process_control import ProgrammedFeed

        return dataclasses.replace(part, component=ProgrammedFeed.with_units({"signal": "N"}), parameters={})
    return part


def scale_series(work: Work, rounds: int, *, quick: bool, tell: Tell) -> list[Series]:
    """Measure the cost over axes (compiled and plain), program time and runs.

    Plain, every axis costs what its operations cost. Compiled, one axis keeps the processor waiting for the result before (subtract,
    divide, multiply, add: 25 cycles a stage); the next three are computed in that time, and cost next to nothing.
    """
    from lathesim.engine.batch import Batch
    from lathesim.engine.fuse import fuse
    from lathesim.engine.module_cache import compiled_machine
    from lathesim.engine.run import Attendance, run

    found = []
    plans = {number: axes_plan(number) for number in AXES}
    for number, plan in plans.items():
        tell(f"compiling {number} axes ...")
        compiled_machine(fuse(plan))
    for name, engine, duration in (("axes", "compiled", _AXES_TIME), ("axes, plain", "plain", _PLAIN_TIME)):
        calls: dict[float, Callable[[], Any]] = {
            number: lambda plan=plan, engine=engine, end=duration: run(plan, duration=end, engine=engine, check_stability=False)  # type: ignore[misc]
            for number, plan in plans.items()
        }
        found.append(_series(f"{name}, {duration:g} s", calls, rounds, tell))
    calls = {}
    for seconds in TIMES:
        plan = long_plan(seconds)
        calls[seconds] = lambda plan=plan, end=seconds: run(  # type: ignore[misc]
            plan, duration=end, engine="compiled", seed=SEED, check_stability=False, attended=Attendance(sink=_Nowhere())
        )
    found.append(_series("s of program", calls, max(1, rounds // 2), tell))
    batch = Batch(work.plan, work.samples, seed=SEED, threads=1)
    calls = {}
    for number in RUNS[:4] if quick else RUNS:
        values = _values(work, number)
        calls[number] = lambda values=values: batch.run([_PARAMETER], values, last)  # type: ignore[misc]
    found.append(_series("runs, one thread", calls, max(1, rounds // 5), tell))
    return found


def _series(name: str, calls: dict[float, Callable[[], Any]], rounds: int, tell: Tell) -> Series:
    """Measure calls in turns, what takes long only once; the least counts, as a busy machine only ever adds to it."""
    seconds: dict[float, list[float]] = {}
    for size, call in calls.items():
        tell(f"measuring {size:g} {name} ...")
        if size == next(iter(calls)):
            call()
        seconds[size] = [cpu_seconds(call)]
    for _ in range(rounds):
        for size, call in calls.items():
            often = 5 if seconds[size][0] < 0.1 else 1 if seconds[size][0] < _LONG else 0
            seconds[size] += [cpu_seconds(call) for _ in range(often)]
    return Series(name, tuple(calls), tuple(min(found) for found in seconds.values()))


def thread_gain(work: Work, rounds: int, tell: Tell) -> float:
    """Return how many times faster two threads are than one, by the clock: the median over pairs of batches, one after the other."""
    from lathesim.engine.batch import Batch

    values = _values(work, 100)
    batches = [Batch(work.plan, work.samples, seed=SEED, threads=threads) for threads in (1, 2)]
    gains = []
    for turn in range(rounds):
        tell(f"measuring two threads against one, {turn + 1} of {rounds} ...")
        one, two = (clock(lambda batch=batch: batch.run([_PARAMETER], values, last)) for batch in batches)  # type: ignore[misc]
        gains.append(one / two)
    return statistics.median(gains)


@dataclass(frozen=True)
class Hour:
    """A program of one hour, recorded to disk: seconds by the clock and of CPU, those without recording, largest memory, size on disk."""

    clock_s: float
    cpu_s: float
    unrecorded_cpu_s: float
    memory_mb: float
    file_mb: float


def hour(tell: Tell) -> Hour:
    """Run an hour of program at 5 ms, recorded to disk block by block, in a process of its own."""
    tell("measuring an hour of program, recorded to disk ...")
    return Hour(**json.loads(in_child(__name__, "hour")))


def batch_memory(tell: Tell) -> dict[int, float]:
    """Return the largest memory [MB] of a process that runs so many runs and keeps one cost of each."""
    tell("measuring the memory of batches ...")
    return {runs: float(in_child(__name__, f"batch:{runs}")) for runs in _MEMORY_RUNS}


def _hour_here() -> str:
    from lathesim.engine.run import Attendance, run
    from lathesim.record_writer import RecordWriter

    plan = long_plan(HOUR)
    run(plan, duration=1.0, engine="compiled")
    unrecorded = cpu_seconds(lambda: run(plan, duration=HOUR, engine="compiled", seed=SEED, attended=Attendance(sink=_Nowhere())))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.h5"
        channels = [plan.channel(name, np.zeros(0)) for name in plan.channels]

        def recorded() -> None:
            with RecordWriter(path, channels, compress=False) as writer:
                writer.finish(run(plan, duration=HOUR, engine="compiled", seed=SEED, attended=Attendance(sink=writer)).meta)

        begun = time.perf_counter()
        cpu = cpu_seconds(recorded)
        clock, size = time.perf_counter() - begun, path.stat().st_size / 1e6
    return json.dumps(dataclasses.asdict(Hour(clock, cpu, unrecorded, largest_memory(), size)))


class _Nowhere:
    """Takes the blocks of a run and keeps none."""

    def write(self, time: np.ndarray, values: np.ndarray) -> None:
        """Take a block."""


def _batch_here(runs: int) -> str:
    from lathesim.engine.batch import Batch

    plan = lathe_plan()
    value = plan.values[_PARAMETER]
    costs = Batch(plan, 200, seed=SEED).run([_PARAMETER], value * np.linspace(0.9, 1.1, runs)[:, None], last)
    assert len(costs) == runs
    return f"{largest_memory()}"


def largest_memory() -> float:
    """Return the largest memory of this process so far [MB]; ``ru_maxrss`` also counts what its parent had when it started it."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        return float(line.split()[1]) * 1024 / 1e6
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def _values(work: Work, runs: int) -> np.ndarray:
    return work.parameters[_PARAMETER] * np.linspace(0.9, 1.1, runs)[:, None]


def told(series: Sequence[Series]) -> list[str]:
    """Return in words how the cost grows."""
    lines = []
    for item in series:
        factor = item.seconds[-1] / item.seconds[0]
        sizes = f"{item.sizes[0]:g} to {item.sizes[-1]:g} {item.name}"
        upper = f"{item.upper_slope:.3f} from {item.sizes[len(item.sizes) // 3]:g} on"
        lines.append(f"{sizes}: {factor:.4g} times the cost; slope on a log plot {item.slope:.3f}, {upper} (1 is in proportion)")
        costs = dict(zip(item.sizes, item.seconds, strict=True))
        if 1000 in costs and 5000 in costs and not math.isclose(costs[1000], 0.0):
            lines.append(f"5000 runs take {costs[5000] / costs[1000]:.2f} times as long as 1000")
    return lines


if __name__ == "__main__":
    kind, _, number = sys.argv[1].partition(":")
    print(_hour_here() if kind == "hour" else _batch_here(int(number)))
