"""Stretches left out of a fit are judged as if it had been made without them."""

import threading
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.free_values import FreeValue
from lathesim.experiments.left_out import gained, left_out
from lathesim.experiments.objective import Objective
from lathesim.experiments.replica import Replica
from lathesim.experiments.waypoints import Waypoints
from lathesim.lessons.simulate import Prepared

FREE = [FreeValue(name, "m", 0.0, -10.0, 10.0, 1.0) for name in ("slope", "offset")]


class Lines:
    """A machine whose two programs read slope t + offset, and slope t^2 + offset."""

    names = ("slope", "offset")
    runs = 0
    stop: threading.Event | None = None

    def __init__(self, time: FloatArray) -> None:
        self.shapes = [np.vstack([time, np.ones_like(time)]), np.vstack([time**2, np.ones_like(time)])]

    def readings(
        self, values: FloatArray, only: Sequence[int] | None = None, later: float = 0.0, until: float = 1e9
    ) -> list[FloatArray]:  # fmt: skip
        """Return the readings of both programs."""
        return [(values @ shape)[:, None, :] for shape in self.shapes]


def recorded(time: FloatArray, values: FloatArray) -> Waypoints:
    """Return way-points of one channel of length."""
    prepared = cast(Prepared, SimpleNamespace(plan=SimpleNamespace(unit=lambda name: "m")))
    return Waypoints("program", Path("program.csv"), prepared, time, {"x": values}, {}, ())


def test_each_stretch_is_judged_by_a_fit_to_the_others() -> None:
    time = np.linspace(0.0, 1.0, 50)
    random = np.random.default_rng(3)
    machine = Lines(time)
    truth = [np.array([1.0, 0.2]) @ shape + 0.1 * random.standard_normal(50) for shape in machine.shapes]
    objective = Objective(cast(Replica, machine), FREE, [recorded(time, row) for row in truth], 0.0, 0.1)
    whole = np.hstack(machine.shapes).T
    noise = 1.0
    for _ in range(50):
        point = np.linalg.solve(whole.T @ whole / 0.01 / noise + np.eye(2), whole.T @ np.concatenate(truth) / 0.01 / noise)
        noise = float(np.square(objective.vector(point)[0]).mean())
    found, _ = left_out(objective, point)
    values, stretches = np.concatenate(truth), np.repeat(np.arange(8), [13, 12, 13, 12] * 2)
    for stretch in range(8):
        own, others = stretches == stretch, stretches != stretch
        rows = whole[others]
        alone = np.linalg.solve(rows.T @ rows / 0.01 / noise + np.eye(2), rows.T @ values[others] / 0.01 / noise)
        assert found[own] == pytest.approx((whole[own] @ alone - values[own]) / 0.1, abs=1e-6)
    assert np.square(found).sum() > np.square(objective.vector(point)[0]).sum()


def test_gain_counts_standard_errors() -> None:
    random = np.random.default_rng(1)
    noise, error = random.standard_normal(1000), 2.0 * np.sin(np.arange(1000) / 20.0)
    assert gained(noise + error, noise) > 10.0
    assert abs(gained(noise, random.standard_normal(1000))) < 2.0
