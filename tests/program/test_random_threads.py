"""Random chains of threads, read a second time by themselves: nothing stands inside a thread, and the tool stays on its leads.

``python -m tests.program.test_random_threads 200`` tries as many programs in each dialect.
"""

from __future__ import annotations

import math
import random
import sys
from dataclasses import dataclass

import numpy as np
import pytest

from lathesim.components.accelerating_interpolators import ConstantAccelerationInterpolator
from lathesim.components.interpolator import ConstantVelocityInterpolator
from lathesim.path_columns import FEED_MODE, THREAD
from lathesim.program.interpreter import interpret
from lathesim.program.path import lay_path
from lathesim.program.words import read_program
from tests.components.paths import SAMPLE_PERIOD, Walk

HEADS = {"fanuc": "G99", "fanuc-b": "G95 G90", "linuxcnc": "G18 G8 G90 G95"}
CODES = {"fanuc": "G32", "fanuc-b": "G33", "linuxcnc": "G33"}
TURN = 2.0 * math.pi


@dataclass
class Chain:
    """What a chain of threads shall do: its corners [mm], how many turns each move lasts, and the turn behind the index where it begins."""

    points: list[tuple[float, float]]
    turns: list[float]
    start: float


def thread_program(chance: random.Random, dialect: str) -> tuple[str, list[Chain], float]:
    """Return a program, its chains, and the speed of the spindle [turns/s], below 0 for M4."""
    unit, speed = chance.choice([1.0, 25.4]), chance.uniform(2.0, 20.0)
    across = unit if dialect == "linuxcnc" else 0.5 * unit
    x, z, turn = chance.uniform(5.0, 20.0), chance.uniform(1.0, 5.0), chance.choice([1, -1])
    lines = [f"{HEADS[dialect]} {'G21' if unit == 1.0 else 'G20'} G97 S{60.0 * speed:.6f} M{3 if turn > 0 else 4}"]
    lines.append(f"G0 X{x / across:.7f} Z{z / unit:.7f}")
    chains = []
    for _ in range(chance.randint(1, 3)):
        chain = Chain([(x, z)], [], chance.choice([0, chance.randint(1000, 359_999)]) / 360_000)
        for number in range(chance.randint(1, 5)):
            to_x = max(1.0, x + chance.choice([0.0, 0.0, chance.uniform(-2.0, 2.0)]))
            to_z, lead = z - chance.choice([1, 1, 1, -1]) * 10.0 ** chance.uniform(-2.0, 0.8), chance.uniform(0.5, 4.0)
            along, longer = math.hypot(to_x - x, to_z - z), max(abs(to_x - x), abs(to_z - z))
            code = f"{CODES[dialect]} " if number == 0 or chance.random() < 0.5 else ""
            words = f"{code}X{to_x / across:.7f} Z{to_z / unit:.7f} {'K' if dialect == 'linuxcnc' else 'F'}{lead / unit:.7f}"
            angle = f" D{360.0 * chain.start:.3f}" if dialect == "linuxcnc" else f" Q{360_000 * chain.start:.0f}"
            lines.append(words + (angle if number == 0 and chain.start else ""))
            x, z = to_x, to_z
            chain.points.append((x, z))
            chain.turns.append((along if dialect == "linuxcnc" else longer) / lead)
        chains.append(chain)
        x, z = x + 3.0, chance.uniform(1.0, 5.0)
        lines += [f"G0 X{x / across:.7f}", f"Z{z / unit:.7f}", *(["G4 P0.05"] if dialect == "linuxcnc" and chance.random() < 0.5 else [])]
    return "\n".join([*lines, "M2" if dialect == "linuxcnc" else "M30"]), chains, turn * speed


def walked(component: type, table: list[list[float]], speed: float, begin: float) -> np.ndarray:
    """Return turns in the sense of the spindle, x, z [mm], row and path speed of each sample, while the spindle turns unevenly."""
    bench, samples, time = Walk(component, {"path": table}), [], 0.0
    sense = math.copysign(1.0, speed)
    sample = bench.sample(spindle_angle=sense * TURN * begin)
    while sample["finished"] < 0.5:
        time += SAMPLE_PERIOD
        turned = begin + abs(speed) * time + 0.05 * math.sin(7.0 * time)
        sample = bench.sample(spindle_angle=sense * TURN * turned)
        x, z = 1e3 * sample["x_reference"], 1e3 * sample["z_reference"]
        samples.append([turned, x, z, sample["segment_number"], sample["feed_speed"]])
    return np.array(samples)


def check_program(seed: str, dialect: str) -> None:
    """Hold one random program in both interpolators against its own reading."""
    text, chains, speed = thread_program(chance := random.Random(seed), dialect)
    table = lay_path(interpret(read_program(text), dialect)).table
    rows = np.flatnonzero(table[:, FEED_MODE] == THREAD)
    assert len(rows) == len(chains), text
    for component in (ConstantVelocityInterpolator, ConstantAccelerationInterpolator):
        samples = walked(component, table.tolist(), speed, chance.uniform(0.0, 3.0))
        for row, chain in zip(rows, chains, strict=True):
            inside = samples[(samples[:, 3] >= row) & (samples[:, 3] < row + len(chain.turns))]
            moving = np.flatnonzero(inside[:, 4] > 0.0)
            assert (np.diff(moving) == 1).all(), text
            begin = math.floor(inside[moving[0], 0] - chain.start + 1e-9) + chain.start
            at = begin + np.cumsum([0.0, *chain.turns])
            wanted = np.array([np.interp(inside[:, 0], at, places) for places in zip(*chain.points, strict=True)])
            assert np.abs(inside[:, 1:3].T - wanted).max() < 1e-3, text


@pytest.mark.parametrize("dialect", HEADS)
def test_no_tool_stands_inside_a_random_chain_of_threads(dialect: str) -> None:
    for number in range(10):
        check_program(f"{dialect} {number}", dialect)


if __name__ == "__main__":
    for name in HEADS:
        for count in range(int(sys.argv[1])):
            check_program(f"{name} {count}", name)
        print(f"{name}: {sys.argv[1]} programs, no standstill inside a thread, no difference above 1 um")
