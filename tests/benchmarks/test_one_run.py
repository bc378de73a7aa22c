"""Timed by pytest-benchmark (``--benchmark-enable``): one run of the work item, compiled, plain, in a batch and by hand in C."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lathesim.cli.speed.bench_rows import SEED, Work
from lathesim.engine.batch import Batch
from lathesim.engine.run import run
from tests.benchmarks.many_axes import axes_plan
from tests.benchmarks.peers import hand_written_c

pytestmark = pytest.mark.slow


@pytest.mark.benchmark(group="one run")
def test_compiled(benchmark: Any, work: Work) -> None:
    record = benchmark(lambda: run(work.plan, seed=SEED, engine="compiled"))
    assert len(record) == work.samples


@pytest.mark.benchmark(group="one run")
def test_hand_written_c(benchmark: Any, work: Work) -> None:
    if hand_written_c.absent():
        pytest.skip(hand_written_c.absent())
    assert len(benchmark(lambda: hand_written_c.record(work))) == work.samples


@pytest.mark.benchmark(group="one run")
def test_plain(benchmark: Any, work: Work) -> None:
    record = benchmark.pedantic(lambda: run(work.plan, seed=SEED, engine="plain"), rounds=3)
    assert len(record) == work.samples


@pytest.mark.benchmark(group="a batch")
@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_of_twenty(benchmark: Any, work: Work, threads: int) -> None:
    batch = Batch(work.plan, work.samples, seed=SEED, threads=threads)
    gains = work.parameters["x_controller.proportional"] * np.linspace(0.9, 1.1, 20)[:, None]
    costs = benchmark(lambda: batch.run(["x_controller.proportional"], gains, lambda record: float(np.nanmax(np.abs(record[17])))))
    assert len(set(costs)) > 1


@pytest.mark.benchmark(group="axes")
@pytest.mark.parametrize("axes", [1, 10, 50])
def test_many_axes(benchmark: Any, axes: int) -> None:
    plan = axes_plan(axes)
    record = benchmark(lambda: run(plan, duration=10.0, engine="compiled", check_stability=False))
    assert len(record.channels) == 2 * axes
