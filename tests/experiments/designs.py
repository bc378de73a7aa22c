"""Designs against what one would run without them: ``python -m tests.experiments.designs``.

1. The closed controller of lesson 27 at 10 Hz within 22 s: the designed program against 100 undesigned ones.
2. Three rivals on lesson 22: processor time of a design with 100 programs, all of them runs of one plan.
3. What each step of a design is good for: programs chosen without it, judged with all steps.
4. Designs for precision over draws and at the given values alone, judged at other values: of a loop, and of a friction that falls with a
   speed known to an order of magnitude.
5. A force that only shifts readings, with and without the share of a floor that does not average out.
6. 5000 simulations of the staircase of lesson 27, which took 182 minutes as published.
7. Single settings for a friction that falls with a speed known to a factor of three: where the average over draws matters.
"""

from __future__ import annotations

import argparse
import resource
import time as clock
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lathesim.experiments.candidate_programs import lay_candidate
from lathesim.experiments.design_experiment import DesignWish, design_experiment
from lathesim.experiments.discrimination import Ablation, refitted_worth
from lathesim.experiments.families import CandidateProgram
from lathesim.experiments.free_values import free_values
from lathesim.experiments.precision import PrecisionBench, design_for_precision
from lathesim.experiments.replica import ProgramRuns
from lathesim.experiments.rivals import NamedRival, named_between
from lathesim.experiments.room import DesignedMove, Room, room_of
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry, load_registry

CLOSED, AXIS = "27_a_controller_that_tells_nothing", "22_what_is_wrong_with_this_machine"
FRICTION = str(Path(__file__).parent / "uncertain_friction.yaml")
WITHIN = 22.0
STAIRCASE = 25.0
PUBLISHED = 182.0 * 60.0
"""What 5000 simulations of the staircase took [s]: Tiwari et al. (2023)."""
THREE = "Backlash@x_axis,PreslidingFriction@x_axis,CoulombFriction@x_axis"
TWO = "TransportDelay@x_drive,CurrentLoopLag@x_drive"
LEFT_OUT = ("nothing", "average", "refit", "price", "floor")


def undesigned(random: np.random.Generator, room: Room) -> CandidateProgram:
    """Return 20 s of strokes of both axes there and back, of lengths and speeds that one would try, and 1 s of rest."""
    lengths = random.choice([0, 1, 2])
    ways = ((0.5e-3, 2e-3, 6e-3), (2e-3, 10e-3, 30e-3), (5e-3, 20e-3))[int(lengths)]
    speed, pause = float(random.choice([0.02, 0.05, 0.1])), float(random.choice([0.0, random.uniform(0.0, 0.15)]))
    moves, seconds = [], 0.0
    while seconds < 20.0:
        axis = room.axes[int(random.integers(2))]
        way = float(random.choice(ways)) * float(random.choice([-1.0, 1.0]))
        for end in (axis.start + way, axis.start):
            moves.append(DesignedMove({axis.letter: end}, speed))
            seconds += abs(way) / speed
        if pause > 0.0:
            moves.append(DesignedMove(rest=pause))
            seconds += pause
    return CandidateProgram("strokes that nobody designed", (*moves, DesignedMove(rest=1.0)), seconds + 1.0)


def precision(registry: Registry, count: int, seed: int) -> list[str]:
    """Return how a designed program does against undesigned ones."""
    lesson = load_lesson(CLOSED)
    wish = DesignWish(WITHIN, seed=seed, rate=10.0)
    found = design_for_precision(lesson, ["all"], registry, wish)
    prepared = prepare(lesson, registry)
    free = free_values(lesson, prepared.plan, (), 4.0)
    room = room_of(prepared)
    bench = PrecisionBench(prepared, room, free, found.readout, replace(wish, draws=1))
    random = np.random.default_rng(seed)
    programs = [lay_candidate(undesigned(random, room), room) for _ in range(count)]
    values = bench.values(programs)
    best = programs[int(np.argmax(values))]
    own = bench.values([found.program])[0]
    return [
        f"designed: {found.program.seconds:.1f} s, ln det {own:.1f}, {found.told.known} directions known to 10 %",
        f"best of {count} undesigned: {best.seconds:.1f} s, ln det {max(values):.1f} (median {np.median(values):.1f}), "
        f"{bench.told(best).known} directions",
    ]


def three_rivals(registry: Registry, seed: int) -> list[str]:
    """Return what a design for three rivals takes."""
    lesson, named = load_lesson(AXIS), named_between(THREE)
    design_experiment(lesson, named, registry, DesignWish(6.5, 4, draws=1, seed=seed))  # compiles
    before = resource.getrusage(resource.RUSAGE_SELF)
    found = design_experiment(lesson, named, registry, DesignWish(8.0, seed=seed))
    after = resource.getrusage(resource.RUSAGE_SELF)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return [
        f"three rivals, {len(found.search.tried)} programs, {found.search.runs} runs of one plan: "
        f"{used:.0f} s of processor time once compiled; chance {found.worth.chance:.2f}"
    ]


def ablations(registry: Registry, count: int, seed: int, between: str) -> list[str]:
    """Return for each step left out the program that is chosen, judged with all steps."""
    lesson, named, lines = load_lesson(AXIS), named_between(between), []
    for name in LEFT_OUT:
        conditions = Ablation(*(name != step for step in LEFT_OUT[1:]))
        found = design_experiment(lesson, named, registry, DesignWish(12.0, count, seed=seed, conditions=conditions))
        judged = refitted_worth(found.scene, found.program, found.floors, 3, Ablation(), 8, lambda worth: True)
        assert judged is not None
        far = float(min(np.minimum(judged.apart[a, b], judged.apart[b, a]).min() for a in range(len(named)) for b in range(a)))
        lines.append(
            f"without {name:8} {found.program.seconds:5.1f} s, said {found.worth.chance:.2f}, worth {judged.score:+.3f}: chance "
            f"{judged.chance:.2f}, T {far:.3g}; {found.program.candidate.title}"
        )
    return lines


def without_average(registry: Registry, count: int, seed: int, name: str, rate: float) -> list[str]:
    """Return how well programs for precision do at values that no design had seen: designed at the given values, and over draws."""
    lesson, lines, short = load_lesson(name), [], 8.0
    prepared = prepare(lesson, registry)
    room = room_of(prepared)
    for average in (True, False):
        wish = DesignWish(short, count, draws=5, seed=seed, rate=rate, conditions=Ablation(average=average))
        found = design_for_precision(lesson, ["all"], registry, wish)
        judge = replace(wish, draws=13, seed=seed + 1000)
        bench = PrecisionBench(prepared, room, found.free, found.readout, judge)
        fresh = [bench.value_at(found.program, point) for point in bench.points[1:]]
        here = bench.values([found.program])[0]
        way = "over draws" if average else "at the given values"
        lines.append(
            f"{lesson.name}, designed {way}: ln det {here:.1f} at the given values; at 12 others mean {np.mean(fresh):.1f}, "
            f"worst {min(fresh):.1f}; "
            f"{found.program.seconds:.1f} s"
        )
    return lines


def without_floor(registry: Registry, count: int, seed: int) -> list[str]:
    """Return what is said of a small force that only shifts readings: a share of a floor that does not average out hides it."""
    lesson, lines = load_lesson(AXIS), []
    for size in (0.1, 0.3, 1.0):
        named = [NamedRival("ForceOffset", "x_axis", {"offset": (0.8 * size, 1.25 * size)}), NamedRival("nothing", "", {})]
        for floor in (True, False):
            wish = DesignWish(8.0, count, seed=seed, conditions=Ablation(steady_floor=floor))
            found = design_experiment(lesson, named, registry, wish)
            said = f"{size:g} N {'with' if floor else 'without'} the floor: chance {found.worth.chance:.2f} said, T {found.pairs[0][2]:.3g}"
            lines.append(f"{said}, {found.program.seconds:.1f} s; {found.program.candidate.title}")
    return lines


def single_settings() -> list[str]:
    """Return how well single speeds make a friction known that falls with a speed known to a factor of three, one way only.

    F = Fc + Fs exp(-v/w) + Fv v with Fs = 1 and w about 5 mm/s, as derivatives by Fc, Fs, Fv and ln w. The design at w = 5 mm/s and the one
    over draws of w are each held against the best design at the w that the machine has, by (det/best det)^(1/4).
    """
    speeds = np.geomspace(2e-4, 0.1, 400)

    def regressors(fall: float) -> np.ndarray:
        shape = np.exp(-speeds / fall)
        return np.column_stack([np.ones_like(speeds), shape, speeds / 0.1, shape * speeds / fall])

    draws = [regressors(5e-3 * 3.0**power) for power in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    designs = {"at the given value": d_optimal_over(draws[2:3]), "over draws": d_optimal_over(draws)}
    lines = []
    for name, weights in designs.items():
        shares = [
            float(np.linalg.det(information(rows, weights)) / np.linalg.det(information(rows, d_optimal_over([rows])))) ** 0.25
            for rows in draws
        ]
        lines.append(f"single settings, designed {name}: efficiency at w/3 .. 3 w: {', '.join(f'{share:.2f}' for share in shares)}")
    return lines


def information(regressors: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return sum w f f' for regressors (settings, values) and weights (settings,)."""
    return np.asarray(regressors.T @ (regressors * weights[:, None]))


def d_optimal_over(draws: Sequence[np.ndarray]) -> np.ndarray:
    """Return weights (settings,) that make the mean of ln det of the information over draws of regressors (settings, values) largest."""
    weights = np.full(len(draws[0]), 1.0 / len(draws[0]))
    for _ in range(5000):
        inverses = [np.linalg.inv(information(rows, weights)) for rows in draws]
        variance = np.mean([np.einsum("ij,jk,ik->i", rows, own, rows) for rows, own in zip(draws, inverses, strict=True)], axis=0)
        weights = weights * variance / draws[0].shape[1]
    return weights


def five_thousand(registry: Registry, seed: int) -> list[str]:
    """Return how long 5000 runs of the staircase take, each with other values, read at 10 Hz."""
    lesson = load_lesson(CLOSED)
    prepared = prepare(lesson, registry, "staircase")
    free = free_values(lesson, prepared.plan, (), 4.0)
    room, channels = room_of(prepared), mapping_of(lesson, prepared.machinery).targets("compare")
    path = room.interpolator.tables["path"]
    runs = ProgramRuns(prepared.machinery, room.interpolator.name, channels, [item.name for item in free], 10.0, STAIRCASE)
    given = np.array([item.given for item in free])
    values = given * np.exp(0.05 * np.random.default_rng(seed).standard_normal((5000, len(free))))
    runs.readings([path], [STAIRCASE], [values[:2]])  # compiles
    before, began = resource.getrusage(resource.RUSAGE_SELF), clock.perf_counter()
    found = runs.readings([path], [STAIRCASE], [values])[0]
    wall, after = clock.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    finite = int(np.isfinite(found).all(axis=(1, 2)).sum())
    return [
        f"5000 runs of {STAIRCASE:g} s, {finite} of them bounded: {used:.1f} s of processor time, {wall:.1f} s on this machine as it is; "
        f"{PUBLISHED / (used / 2.0):.0f} times faster on two free cores"
    ]


def main() -> None:
    """Print the parts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", type=int, action="append", choices=range(1, 8))
    parser.add_argument("--programs", type=int, default=100, help="undesigned programs, and programs tried for an ablation")
    parser.add_argument("--between", default=TWO, help="rivals of the ablations")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    registry = load_registry(installed=False)
    for part in asked.part or range(1, 8):
        if part == 1:
            lines = precision(registry, asked.programs, asked.seed)
        elif part == 2:
            lines = three_rivals(registry, asked.seed)
        elif part == 4:
            lines = [
                *without_average(registry, asked.programs, asked.seed, CLOSED, 10.0),
                *without_average(registry, asked.programs, asked.seed, FRICTION, 0.0),
            ]
        elif part == 6:
            lines = five_thousand(registry, asked.seed)
        elif part == 7:
            lines = single_settings()
        elif part == 5:
            lines = without_floor(registry, asked.programs, asked.seed)
        else:
            lines = ablations(registry, asked.programs, asked.seed, asked.between)
        print("\n".join(lines), flush=True)


if __name__ == "__main__":
    main()
