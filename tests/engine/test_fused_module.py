"""The generated module: named by what it is made of, the same for every value, never stale."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.speed.bench_axes import axes_plan
from lathesim.component import Component, Output, State
from lathesim.engine.assembly import Assembly, Part
from lathesim.engine.compiling.module_cache import module_path, quick_module
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.running.batch import Batch
from lathesim.engine.running.noise import draw_noise
from lathesim.engine.running.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import ComponentError
from tests.engine import small_machine
from tests.engine.small_machine import PARTS, Axis, loop


def digest(assembly: Assembly) -> str:
    return fuse(wire(assembly)).digest


def test_changed_values_never_make_new_source() -> None:
    changed = replace(loop(), parts=(*PARTS[:2], Part("axis", Axis, {"lag": 0.2}, {"travel": 1.0})))
    assert digest(changed) == digest(loop())


def test_a_changed_constant_or_helper_makes_new_source(monkeypatch: pytest.MonkeyPatch) -> None:
    before = digest(loop())
    monkeypatch.setattr(small_machine, "AMPLITUDE", 3.0)
    assert digest(loop()) != before
    monkeypatch.undo()
    assert digest(loop()) == before


def test_a_file_tampered_with_is_written_anew() -> None:
    fused = fuse(wire(loop()))
    path = module_path(fused)
    path.write_text("raise SystemExit")
    assert Path(module_path(fused)).read_text() == fused.source


def test_a_law_that_reaches_outside_is_refused() -> None:
    class Reaching(Component):
        """Uses numpy, which a law may not."""

        size = State("m", doc="size")
        shown = Output("m", doc="size")

        @staticmethod
        def derivative(size: float) -> float:
            return float(np.sin(size))

        @staticmethod
        def output(size: float) -> float:
            return size

    with pytest.raises(ComponentError, match="the law uses 'np'"):
        fuse(wire(Assembly((Part("part", Reaching),), (), 0.01, 0.01)))


def test_noise_does_not_depend_on_the_length_of_a_block() -> None:
    whole = draw_noise(["a.noise", "b.noise"], 7, 0, 10_000)
    pieces = np.hstack([draw_noise(["a.noise", "b.noise"], 7, first, 2500) for first in range(0, 10_000, 2500)])
    assert np.array_equal(whole, pieces)
    assert abs(whole.mean()) < 0.03
    assert abs(whole.std() - 1.0) < 0.03


def test_a_batch_gives_what_single_runs_give() -> None:
    plan = wire(loop())
    lags = np.array([[0.05], [0.1], [0.2]])
    together = Batch(plan, 201, seed=4).run(["axis.lag"], lags)
    for lag, values in zip(lags[:, 0], together, strict=True):
        alone = run(plan, duration=1.0, seed=4, engine="compiled", overrides={"axis.lag": float(lag)})
        assert np.array_equal(values, np.array([alone[name] for name in plan.channels]))


def test_a_batch_reduces_on_the_way() -> None:
    peaks = Batch(wire(loop()), 201).run(["controller.gain"], np.array([[1.0], [5.0]]), lambda record: float(np.abs(record).max()))
    assert len(peaks) == 2
    assert all(isinstance(peak, float) for peak in peaks)


def test_python_reaches_the_variables_of_a_step_in_one_byte() -> None:
    large, small = axes_plan(12), wire(loop())
    names = quick_module(fuse(large)).run_block.__code__.co_varnames
    assert len(names) > 256
    assert max(names.index(f"axis{number}__speed__rate_4") for number in range(1, 13)) < 256
    assert len(quick_module(fuse(small)).run_block.__code__.co_varnames) < 256
