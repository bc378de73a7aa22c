"""``run_block`` written for plain Python: the bits of the text it is made from, and of machine code."""

from __future__ import annotations

import types

import numpy as np
import pytest

from lathesim.cache_folder import cache_folder
from lathesim.cli.speed.bench_axes import axes_plan
from lathesim.cli.speed.bench_work import SEED, lathe_plan
from lathesim.component import Component, DiscreteState, Input, Output
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.compiling.module_cache import plain_module, quick_module
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.fusing.plain_text import PLAIN_FORMAT, plain_text
from lathesim.engine.running.noise import draw_noise
from lathesim.engine.running.run import run
from lathesim.engine.running.run_arrays import start_arrays
from lathesim.engine.wiring import Plan, wire
from tests.engine.small_machine import PARTS, WIRES, loop


class Counter(Component):
    """Counts samples; the law reads its first state after it has given the second."""

    count = DiscreteState("1", doc="samples so far")
    last = DiscreteState("1", doc="samples before this one")
    seen = Input("m", doc="anything")
    counted = Output("1", doc="samples so far")
    before = Output("1", doc="samples before this one")

    @staticmethod
    def update(count: float, last: float, seen: float) -> tuple[float, float]:
        following = count + 1.0
        if seen > 1e9:
            following = count
        return following, count

    @staticmethod
    def output(count: float, last: float) -> tuple[float, float]:
        return count, last


def outcome(plan: Plan, module: types.ModuleType, samples: int) -> tuple[object, ...]:
    """Return all that ``run_block`` of a module leaves behind."""
    live = start_arrays(plan).as_lists()
    record = np.zeros(samples * len(plan.channels))
    noise = draw_noise(plan.noises, SEED, 0, samples).tolist()
    done = module.run_block(
        0, samples, plan.assembly.sample_period, plan.assembly.step, plan.steps_per_sample, live.parameters, live.states, live.discrete,
        live.memories, live.tables, noise, record,
    )  # fmt: skip
    return done, record.tobytes(), repr((live.states, live.discrete, live.memories))


@pytest.mark.parametrize("make", [lambda: wire(loop()), lathe_plan, lambda: axes_plan(1), lambda: axes_plan(12)])
def test_the_text_for_plain_python_gives_every_bit_of_the_text_it_is_made_from(make: types.FunctionType) -> None:
    plan = make()
    fused = fuse(plan)
    assert outcome(plan, quick_module(fused), 40) == outcome(plan, plain_module(fused), 40)


def test_plain_and_compiled_lathe_agree_to_the_bit() -> None:
    plan = lathe_plan()
    plain, compiled = (run(plan, seed=SEED, duration=0.5, engine=engine) for engine in ("plain", "compiled"))
    assert all(plain[name].tobytes() == compiled[name].tobytes() for name in plan.channels)


def test_laws_stand_in_place_constants_are_numbers_and_what_samples_share_is_done_once() -> None:
    text = plain_text(fuse(lathe_plan()).source)
    before, _, samples = text.partition("    for sample in range(count):\n")
    assert "SpindleController_update(" not in text
    assert "nonlinear_force_MILLIMETRES" not in text
    assert "    math_sqrt = math.sqrt\n" in before
    assert "    held_5 = 1.0 + cutting_force__cutting_feed_exponent\n" in before
    assert "__quantum = (x_dac__largest_voltage - x_dac__smallest_voltage) / " in before
    assert "math." not in samples
    assert "keep_30(record, 8 * (row + 0), interpolator__x_reference," in samples


def test_a_state_that_a_law_still_reads_is_replaced_after_the_law() -> None:
    plan = wire(Assembly((*PARTS, Part("counter", Counter)), (*WIRES, Wire("counter.seen", "axis.position")), 0.005, 0.0005))
    record = run(plan, duration=0.02, engine="plain")
    assert record["counter.counted"].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert record["counter.before"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_law_with_a_while_is_called_so_that_it_can_be_named() -> None:
    text = plain_text(fuse(lathe_plan()).source)
    assert "= Stock_update(" in text
    assert "def Stock_update(" in text
    assert "= stock_radius_at(" not in text  # which the law calls, and which stands in its place there


def test_a_text_damaged_in_the_cache_is_written_anew() -> None:
    fused = fuse(wire(loop(0.001)))
    quick_module(fused)
    path = cache_folder() / f"quick_{fused.digest}.{PLAIN_FORMAT}.py"
    whole = path.read_text()
    path.write_text(whole.replace("half = 0.5", "half = 0.6"))
    quick_module.cache_clear()
    quick_module(fused)
    assert path.read_text() == whole
