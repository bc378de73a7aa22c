"""Lesson 3, for teachers: searches a lathe for the least performance index within all limits.

    python 14_lathe_design_search.py            searches, about half a minute, and writes the design as options of 'lathesim run'
    python 14_lathe_design_search.py --check    runs the design noted in 14_lathe_design_solution.md instead

The search is differential evolution over speeds, time constants and gains; what costs nothing but money (bits, encoders, a quiet
tachometer) is bought cheap, and the limits are kept by a penalty. Axes are never asked for a rapid that they cannot follow.
"""

from __future__ import annotations

import argparse
import math
import os
import shlex
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution

from lathesim.analysis.metric import Measured
from lathesim.lessons.grading import judge
from lathesim.lessons.lesson import find_program, load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.lessons.sweep_runs import Members
from lathesim.plugins import load_registry
from lathesim.units import from_si, quantity

HERE = Path(__file__).parent
PROGRAM = "lathe_design.nc"
PROGRAMMED_SPEED = 1000.0 * 2.0 * math.pi / 60.0
RANGE = 10.0
"""Volts at which axes and spindle reach their top speed."""
MARGIN = 0.97
"""Share of each limit that the search uses, so that another noise does not break it."""

SEARCHED = {
    "spindle speed": (1.0, 6.0),
    "spindle time constant": (0.1, 5.0),
    "spindle loop": (0.5, 20.0),
    "feed": (0.5, 1.06),
    "x speed": (0.01, 0.4),
    "x time constant": (0.01, 0.6),
    "x loop": (0.1, 2.0),
    "z speed": (0.01, 0.4),
    "z time constant": (0.01, 0.6),
    "z loop": (0.1, 2.0),
}
"""What is searched, between which bounds, in equal ratios. Speeds of axes in m/s, times in s, the rest as factors."""
CHEAP = {
    "design.x_resolution": 10e-6,
    "design.z_resolution": 10e-6,
    "design.tachometer_noise": 1.0,
    "design.spindle_ad_bits": 8.0,
    "design.spindle_da_bits": 8.0,
    "design.x_bits": 8.0,
    "design.z_bits": 8.0,
}

NOTED = {
    "interpolator.spindle_override": "5.83",
    "interpolator.feed_override": "1.06",
    "interpolator.rapid_speed": "43.1 mm/s",
    "design.spindle_gain": "64.2 rad/(s*V)",
    "design.spindle_time_constant": "1.29 s",
    "spindle_controller.proportional": "0.13 V*s/rad",
    "spindle_controller.integral": "0.1 V/rad",
    "tachometer.gain": "0.0136 V*s/rad",
    "design.x_gain": "4.86 mm/(s*V)",
    "design.x_time_constant": "79.4 ms",
    "x_controller.proportional": "1.23 V/mm",
    "design.z_gain": "4.54 mm/(s*V)",
    "design.z_time_constant": "20.3 ms",
    "z_controller.proportional": "5.34 V/mm",
    "design.x_resolution": "10 um",
    "design.z_resolution": "10 um",
    "design.tachometer_noise": "1 V",
    "design.spindle_ad_bits": "8",
    "design.spindle_da_bits": "8",
    "design.x_bits": "8",
    "design.z_bits": "8",
}
"""The design of the solution notes, found by this search."""


def design(searched: np.ndarray) -> dict[str, float]:
    """Return the parameters [SI] that numbers from 0 to 1 stand for, rounded to three digits as a person would order them."""
    low, high = (np.log(np.array(ends)) for ends in zip(*SEARCHED.values(), strict=True))
    value = dict(zip(SEARCHED, np.exp(low + searched * (high - low)), strict=True))
    spindle = value["spindle speed"] * PROGRAMMED_SPEED * 1.05 / RANGE
    x, z = value["x speed"] / RANGE, value["z speed"] / RANGE
    found = {
        "interpolator.spindle_override": value["spindle speed"],
        "interpolator.feed_override": value["feed"],
        "interpolator.rapid_speed": 0.95 * RANGE * min(x, z),
        "design.spindle_gain": spindle,
        "design.spindle_time_constant": value["spindle time constant"],
        "spindle_controller.proportional": value["spindle loop"] / spindle,
        "spindle_controller.integral": value["spindle loop"] / spindle / value["spindle time constant"],
        "tachometer.gain": RANGE / (1.2 * value["spindle speed"] * PROGRAMMED_SPEED),
        "design.x_gain": x,
        "design.x_time_constant": value["x time constant"],
        "x_controller.proportional": value["x loop"] / (4.0 * value["x time constant"] * x),
        "design.z_gain": z,
        "design.z_time_constant": value["z time constant"],
        "z_controller.proportional": value["z loop"] / (4.0 * value["z time constant"] * z),
    }
    return {name: float(f"{number:.3g}") for name, number in found.items()} | CHEAP


class Project:
    """The lesson with the design's program, ready to be run with any design."""

    def __init__(self) -> None:
        registry = load_registry(installed=False)
        lesson = load_lesson(HERE / "14_lathe_design.yaml")
        self.prepared: Prepared = prepare(lesson, registry, program=find_program(PROGRAM, HERE.parent / "part_programs"))
        self.goals = lesson.settings.goals
        self.metrics = {goal.metric: registry.metric(goal.metric) for goal in self.goals}
        self.metrics |= {name: registry.metric(name) for name in ("machine_cost", "cycle_time")}
        self.members = Members(self.prepared, tuple(design(np.zeros(len(SEARCHED)))), self.metrics)
        self.members.compile()

    def measured(self, values: dict[str, float]) -> dict[str, Measured]:
        """Run a design; no metrics where it breaks down."""
        member = self.members.run(0, tuple(values[name] for name in self.members.names))
        if member.status != "complete":
            return {}
        return {name: Measured(name, number, self.metrics[name].unit) for name, number in zip(self.metrics, member.metrics, strict=True)}

    def merit(self, searched: np.ndarray) -> float:
        """Return the performance index, and ten times by what share the limits are broken on top."""
        found = self.measured(design(searched))
        if not found:
            return 100.0
        broken = 0.0
        for goal in self.goals[1:]:
            limit = quantity(str(goal.at_most), found[goal.metric].unit)
            over = found[goal.metric].value - MARGIN * limit
            broken += max(0.0, over / limit if limit > 0.0 else over)
        return found["performance_index"].value + 10.0 * broken


def search(project: Project, rounds: int) -> dict[str, float]:
    """Return the best design that so many rounds find, the same at every call."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        result = differential_evolution(
            project.merit, [(0.0, 1.0)] * len(SEARCHED), maxiter=rounds, popsize=6, seed=3, init="sobol", polish=False,
            updating="deferred", workers=pool.map,
        )  # fmt: skip
    return design(result.x)


def told(project: Project, values: dict[str, float]) -> str:
    """Return the design as a command, its cost, time and index, and how each limit is kept."""
    from lathesim.cli.lessons.run_tables import goals_text

    found = project.measured(values)
    options = [f"--set {shlex.quote(f'{name}={text}')}" for name, text in as_text(project, values).items()]
    command = " \\\n  ".join([f"lathesim run 14_lathe_design --program {PROGRAM}", *options])
    cost, time, index = (found[name].value for name in ("machine_cost", "cycle_time", "performance_index"))
    summary = f"cost {cost:.0f} dollar, cycle time {time:.2f} s, performance index {index:.3f}"
    return f"{command}\n\n{summary}\n\n{goals_text(judge(project.goals, found))}"


def as_text(project: Project, values: dict[str, float]) -> dict[str, str]:
    """Return the values with their units."""
    shown = {"V/m": "V/mm", "m/(s*V)": "mm/(s*V)", "m/s": "mm/s", "m": "um"}
    texts = {}
    for name, value in values.items():
        unit = project.prepared.plan.unit(name)
        unit = shown.get(unit, unit)
        texts[name] = f"{from_si(value, unit):.6g} {unit}".removesuffix(" 1")
    return texts


def noted(project: Project) -> dict[str, float]:
    """Return the design of the notes in SI."""
    return {name: quantity(text, project.prepared.plan.unit(name)) for name, text in NOTED.items()}


def main() -> None:
    """Search, or check the design of the notes, and write it."""
    parser = argparse.ArgumentParser(description="Searches a lathe for the least performance index within all limits of lesson 14.")
    parser.add_argument("--check", action="store_true", help="run the design of the solution notes")
    parser.add_argument("--rounds", type=int, default=60, help="rounds of the search [60]")
    arguments = parser.parse_args()
    project = Project()
    print(told(project, noted(project) if arguments.check else search(project, arguments.rounds)))


if __name__ == "__main__":
    main()
