"""The rows of ``lathesim bench``: the work item by the engine and by its peers, and how long commands take from nothing."""

from __future__ import annotations

import dataclasses
import importlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.run_arrays import draw_noise
from lathesim.engine.wiring import Plan, wire

LESSON = "01_contour_error"
VARIANT = "V"
SEED = 7
ENCODER_COUNT = 1e-6
"""Length of one encoder count [m]; peers must agree with the engine to one."""
SETTINGS: dict[str, str | float] = {
    "x_dac.bits": 12.0, "z_dac.bits": 12.0, "tachometer.noise": "20 mV", "x_axis.disturbance_gain": "1 um/(s*N)",
    "z_axis.disturbance_gain": "1 um/(s*N)",
}  # fmt: skip
FORCE_CONTROLLER = "NonlinearProcessController"
WANTED_FORCE = 720.0
"""Cutting force [N] that the force controller holds; with it the program takes about as long as without."""
CHANNELS = (
    "interpolator.x_reference", "interpolator.z_reference", "interpolator.feed_speed", "interpolator.spindle_reference",
    "interpolator.segment_number", "interpolator.cutting_block",
    "x_encoder.position", "x_controller.error", "x_dac.voltage", "x_axis.position", "x_axis.velocity",
    "z_encoder.position", "z_controller.error", "z_dac.voltage", "z_axis.position", "z_axis.velocity",
    "cross_coupling.voltage", "contour.contour_error", "tachometer_adc.reading", "spindle_dac.voltage", "spindle.speed",
    "cutting.depth_of_cut", "cutting.feed", "cutting.cutting_speed",
    "cutting_force.cutting_force", "cutting_force.longitudinal_force", "cutting_force.radial_force",
    "load.torque", "tool_wear.flank_wear", "surface_finish.roughness",
)  # fmt: skip


@dataclass(frozen=True)
class Work:
    """What every contestant is given: plan (for the engine), parameters by ``part.name`` and path (for the others), all SI.

    ``noise`` maps ``part.noise`` to its numbers, ``samples`` is the number of sample instants with the first at t = 0.
    """

    plan: Plan
    parameters: Mapping[str, float]
    path: np.ndarray[Any, np.dtype[np.float64]]
    noise: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]
    samples: int
    period: float
    step: float
    steps: int
    channels: tuple[str, ...]
    seed: int = SEED

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return (self.samples - 1) * self.period


def lathe_plan() -> Plan:
    """Return the work item's machine: both axes, spindle, cutting force, wear, contour and force control, noise, 12-bit converters."""
    from lathesim.lessons.assemble import assemble
    from lathesim.lessons.lesson import load_lesson
    from lathesim.plugins import load_registry

    registry = load_registry(installed=False)
    assembly = assemble(load_lesson(LESSON), registry, VARIANT, SETTINGS)
    controller = registry.component(FORCE_CONTROLLER).with_units({"signal": "N"})
    parts = dict(assembly.by_name)
    holding = dataclasses.replace(parts["process_controller"], component=controller, parameters={"reference": WANTED_FORCE})
    parts[holding.name] = holding
    return wire(dataclasses.replace(assembly, parts=tuple(parts.values()), record=CHANNELS))


def lathe_work() -> Work:
    """Return the work item, with the number of samples its program takes."""
    from lathesim.engine.run import run

    plan = lathe_plan()
    samples = len(run(plan, seed=SEED))
    names = list(plan.arrays.noises)
    noise = dict(zip(names, draw_noise(names, SEED, 0, samples), strict=True))
    parameters = {name: plan.values[name] for name in plan.parameters}
    (path,) = (part.tables["path"] for part in plan.parts.values() if "path" in part.tables)
    return Work(
        plan, parameters, np.ascontiguousarray(path, dtype=float), noise, samples, plan.assembly.sample_period, plan.assembly.step,
        plan.assembly.steps_per_sample, plan.channels,
    )  # fmt: skip


Tell = Callable[[str], None]
START = {
    "start: lathesim --help": ("--help",),
    "start: lathesim run --json --no-plots, warm": ("run", "01_contour_error", "--variant", "I", "--json", "--no-plots"),
    "start: lathesim run of one case with plots, warm": ("run", "01_contour_error", "--variant", "I"),
}
_COMPILE = """\
import time
from lathesim.cli.speed.bench_rows import lathe_plan
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import compiled_machine
fused = fuse(lathe_plan())
begun = time.process_time()
compiled_machine(fused)
print(time.process_time() - begun)
"""


@dataclass(frozen=True)
class Row:
    """One line: CPU seconds (the median), and how far its positions are from the engine's [encoder counts], none where not compared."""

    name: str
    median_s: float
    difference: float | None = None


@dataclass(frozen=True)
class Skipped:
    """What was not measured, and why."""

    name: str
    reason: str


def cpu_seconds(call: Callable[[], Any]) -> float:
    """Return the CPU seconds of this process that a call takes; other programs on the machine count less than with the clock."""
    begun = time.process_time()
    call()
    return time.process_time() - begun


def work_rows(work: Work, rounds: int, *, slow: bool, tell: Tell) -> tuple[list[Row], list[Skipped]]:
    """Measure the work by the engine (compiled, in a batch, plain) and by the peers that are here.

    The peers are the files of ``tests/benchmarks/peers`` of a checkout. What takes about as long as the engine is measured in turns with
    it, so that a busy moment of the machine strikes all alike.
    """
    from lathesim.engine.batch import Batch
    from lathesim.engine.run import run

    record = run(work.plan, seed=SEED, engine="compiled")
    ours = np.stack([record["x_axis.position"], record["z_axis.position"]])
    members = 10
    batch = Batch(work.plan, work.samples, seed=SEED, threads=1)
    values = np.full((members, 1), work.parameters["x_controller.proportional"])

    calls: dict[str, tuple[Callable[[], Any], int]] = {
        "compiled": (lambda: run(work.plan, seed=SEED, engine="compiled"), 1),
        "compiled, one run of a batch": (
            lambda: batch.run(["x_controller.proportional"], values, lambda record: float(record[0, -1])),
            members,
        ),
    }
    differences: dict[str, float] = {}
    present, skipped = _present(slow)
    for module in present:
        if getattr(module, "IN_TURNS", False):
            differences[module.NAME] = _difference(ours, module.simulate(work))
            calls[module.NAME] = (lambda module=module: module.simulate(work), 1)  # type: ignore[misc]
    tell(f"measuring {', '.join(calls)} ...")
    rows = [Row(name, seconds, differences.get(name)) for name, seconds in _in_turns(calls, rounds).items()]
    tell("measuring plain ...")
    plain = [cpu_seconds(lambda: run(work.plan, seed=SEED, engine="plain")) for _ in range(max(3, rounds // 3))]
    rows.append(Row("plain", statistics.median(plain)))
    for module in present:
        if getattr(module, "IN_TURNS", False):
            continue
        tell(f"measuring {module.NAME} ...")
        repeats = 1 if getattr(module, "SLOW", False) else max(1, min(3, rounds // 3))
        try:
            seconds, positions = _peers().times_and_positions(module.__name__.rpartition(".")[2], work, repeats)
        except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
            skipped.append(Skipped(module.NAME, str(error)))
            continue
        rows.append(Row(module.NAME, statistics.median(seconds), _difference(ours, positions)))
    return rows, skipped


def _in_turns(calls: dict[str, tuple[Callable[[], Any], int]], rounds: int) -> dict[str, float]:
    """Return the median CPU seconds of each call (name -> call and what to divide by), measured in turns."""
    for call, _ in calls.values():
        call()
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, (call, share) in calls.items():
            seconds[name].append(cpu_seconds(call) / share)
    return {name: statistics.median(found) for name, found in seconds.items()}


def _present(slow: bool) -> tuple[list[Any], list[Skipped]]:
    """Return the peers that can be measured here, and why the others cannot."""
    peers = _peers()
    if peers is None:
        return [], [Skipped("peers", "they are measured from a checkout, with its folder tests/benchmarks/peers")]
    present, skipped = [], []
    for peer in peers.PEERS:
        module = peers.peer_module(peer)
        reason = module.absent() or ("it is slow, and --quick leaves it out" if getattr(module, "SLOW", False) and not slow else "")
        if reason:
            skipped.append(Skipped(module.NAME, reason))
        else:
            present.append(module)
    return present, skipped


def start_rows(rounds: int, tell: Tell) -> list[Row]:
    """Measure how long commands take from nothing, and compiling."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        compiled = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(Path(folder) / "byte_code")}  # as an installation has it
        for name, arguments in START.items():
            tell(f"measuring {name} ...")
            command = [sys.executable, "-m", "lathesim", *arguments]
            _child(command, folder, compiled)
            rows.append(Row(name, statistics.median(_child(command, folder, compiled)[0] for _ in range(rounds))))
        tell("measuring how long compiling takes ...")
        known: list[float] = []
        unknown: list[float] = []
        for number in range(max(1, rounds // 3)):
            cache = {**compiled, "LATHESIM_CACHE": str(Path(folder) / f"cache_{number}")}
            command = [sys.executable, "-c", _COMPILE]
            unknown.append(float(_child(command, folder, cache)[1]))
            for file in Path(cache["LATHESIM_CACHE"]).glob("machine_*"):
                file.unlink()
            known.append(float(_child(command, folder, cache)[1]))
        rows.append(Row("first compile of a new wiring, its parts known", statistics.median(known)))
        rows.append(Row("first compile of all, nothing known", statistics.median(unknown)))
    return rows


def _child(command: list[str], folder: str, more: dict[str, str] | None = None) -> tuple[float, str]:
    """Run a command and give its CPU seconds (those of the clock where the system does not count them), and what it wrote."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), **(more or {})}
    before = os.times()
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder, env=environment)
    after = os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return spent or after.elapsed - before.elapsed, done.stdout


def _difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Return the largest difference of the positions [encoder counts]; infinite where the runs are not equally long."""
    return float(np.abs(ours - theirs).max() / ENCODER_COUNT) if ours.shape == theirs.shape else float("inf")


def checkout() -> Path | None:
    """Return the checkout this package runs from, from which its tests can now be imported; none where it is installed without them."""
    root = Path(__file__).parents[3]
    if not (root / "tests" / "benchmarks" / "peers").is_dir():
        return None
    if str(root) not in sys.path:
        sys.path.insert(0, str(root))
    return root


def _peers() -> Any:
    return None if checkout() is None else importlib.import_module("tests.benchmarks.peers")


def row_data(rows: Sequence[Row], compiled: float) -> list[dict[str, Any]]:
    """Return rows as JSON has them, beside the seconds of the compiled engine."""
    return [{"name": row.name, "median_s": row.median_s, "ratio_to_compiled": row.median_s / compiled} for row in rows]


def seconds_text(value: float) -> str:
    """Return seconds as text with three digits."""
    return f"{value * 1e3:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def measured_on() -> dict[str, str]:
    """Return what the figures depend on."""
    import datetime
    import platform
    from importlib.metadata import version

    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "numba": version("numba"),
        "date": datetime.date.today().isoformat(),
    }


def measured_on_line() -> str:
    """Return the same in one line."""
    machine = measured_on()
    versions = ", ".join(f"{name} {machine[name]}" for name in ("python", "numpy", "numba"))
    busy = f"load {machine['load']}"
    return f"{machine['processor']}, {machine['cores']} cores, {busy}, {machine['system']}; {versions}; {machine['date']}."


def _processor() -> str:
    import platform

    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
