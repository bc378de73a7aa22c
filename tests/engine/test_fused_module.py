"""The generated module: named by what it is made of, the same for every value, never stale."""

from __future__ import annotations

import ast
import itertools
import math
import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.cli.speed.bench_rows import SEED, lathe_plan
from lathesim.component import Component, DiscreteState, Input, Output, State
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.fuse import fuse, grouped
from lathesim.engine.law_text import NotInPlaceError, in_place
from lathesim.engine.module_cache import module_path
from lathesim.engine.rk4 import HEUN, RK4, Tableau
from lathesim.engine.run import run
from lathesim.engine.run_arrays import draw_noise
from lathesim.engine.wiring import wire
from lathesim.errors import ComponentError
from tests.engine import small_machine
from tests.engine.small_machine import PARTS, WIRES, Axis, loop


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


class Counter(Component):
    """Counts samples; the law reads its first state after it has given the second."""

    count = DiscreteState("1", doc="samples so far")
    last = DiscreteState("1", doc="samples before this one")
    measured = Input("m", doc="anything")
    counted = Output("1", doc="samples so far")
    before = Output("1", doc="samples before this one")

    @staticmethod
    def update(count: float, last: float, measured: float) -> tuple[float, float]:
        following = count + 1.0
        if measured > 1e9:
            following = count
        return following, count

    @staticmethod
    def output(count: float, last: float) -> tuple[float, float]:
        return count, last


def test_a_state_that_a_law_still_reads_is_replaced_after_the_law() -> None:
    plan = wire(Assembly((*PARTS, Part("counter", Counter)), (*WIRES, Wire("counter.measured", "axis.position")), 0.005, 0.0005))
    record = run(plan, duration=0.02, engine="plain")
    assert record["counter.counted"].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert record["counter.before"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_plain_and_compiled_lathe_agree_to_the_bit() -> None:
    plan = lathe_plan()
    plain, compiled = (run(plan, seed=SEED, duration=0.5, engine=engine) for engine in ("plain", "compiled"))
    assert all(plain[name].tobytes() == compiled[name].tobytes() for name in plan.channels)


@pytest.mark.parametrize(("tableau", "order"), [(RK4, 4.0), (HEUN, 2.0)])
def test_a_tableau_has_the_order_of_its_method(tableau: Tableau, order: float) -> None:
    """Against runs with a much finer step the error of a free decay falls by 2^order with half the step."""

    def end(step: float) -> float:
        assembly = Assembly((Part("decay", Decay, {}, {"size": 1.0}),), (), 1.0, step)
        return float(run(wire(assembly, tableau), duration=1.0, engine="plain", check_stability=False)["decay.shown"][-1])

    errors = [abs(end(step) - math.exp(-1.0)) for step in (0.25, 0.125, 0.0625)]
    assert np.log2(np.array(errors[:-1]) / np.array(errors[1:])) == pytest.approx([order, order], abs=0.25)


class Decay(Component):
    """dx/dt = -x, computed in a variable that has the name of one of the engine."""

    size = State("m", doc="what is left")
    shown = Output("m", doc="what is left")

    @staticmethod
    def derivative(size: float) -> float:
        share = -1.0
        return share * size

    @staticmethod
    def output(size: float) -> float:
        return size


def branch(part: str, source: str) -> list[str]:
    """A part that passes on its source where it idles, and adds one where it does not."""
    return [f"if {part}__idle:", f"    {part} = {source}", "else:", f"    {part} = {source} + 1.0"]


CHAIN = [*branch("a", "x"), *branch("b", "a"), *branch("c", "b")]


def result(lines: list[str], idle: dict[str, bool]) -> float:
    """Return what a chain makes of 10 (the text is this file's own)."""
    text = "\n".join(["def chain(x, a__idle, b__idle, c__idle):", *[f"    {line}" for line in lines], "    return c"])
    variables: dict[str, Any] = {}
    exec(text, variables)  # noqa: S102 - the text of this file
    return float(variables["chain"](10.0, *(idle[part] for part in "abc")))


def test_a_chain_gives_the_same_whoever_idles() -> None:
    made, asked = grouped(CHAIN)
    assert asked == ["idle_0 = a__idle and b__idle and c__idle"]
    for number in range(8):
        idle = {part: bool(number >> place & 1) for place, part in enumerate("abc")}
        assert result([*asked, *made], idle) == result(CHAIN, idle)


def test_what_idles_together_is_one_branch() -> None:
    made, _ = grouped(CHAIN)
    assert made[:5] == ["if idle_0:", "    a = x", "    b = a", "    c = b", "else:"]


def test_a_branch_by_itself_and_other_lines_stay_as_they_are() -> None:
    lines = [*branch("a", "x"), "y = a * 2.0", *branch("b", "y"), "for k in range(3):", *[f"    {line}" for line in branch("c", "b")]]
    assert grouped(lines) == (lines, [])


def test_a_long_chain_is_cut_into_pieces() -> None:
    parts = "abcdefgh"
    lines = [line for part, source in zip(parts, "x" + parts, strict=False) for line in branch(part, source)]
    _, asked = grouped(lines)
    assert [len(line.split(" and ")) for line in asked] == [6, 2]


def test_the_same_parts_are_asked_about_once() -> None:
    again = [line.replace("a =", "aa =").replace("b =", "bb =").replace("c =", "cc =") for line in CHAIN]
    assert len(grouped([*CHAIN, "y = 1.0", *again])[1]) == 1


LAW = """
def law(depth, speed):
    slow = speed < 1.0
    if depth <= 0.0:
        return (0.0, 1.0 if slow else 2.0)
    if slow:
        speed = 1.0
        feed = depth / speed
    else:
        feed = depth
        for _ in range(2):
            feed = feed + speed
    return (feed, feed * speed)
"""


def executed(source: str, **variables: object) -> dict[str, object]:
    exec(source, variables)  # noqa: S102 - the text of these tests
    return variables


def written(source: str, targets: list[str], *arguments: str) -> str:
    law = ast.parse(textwrap.dedent(source)).body[0]
    assert isinstance(law, ast.FunctionDef)
    given = [ast.parse(argument, mode="eval").body for argument in arguments]
    return "\n".join(ast.unparse(statement) for statement in in_place(law, given, targets, "part__"))


def test_a_body_in_place_gives_what_the_call_gives() -> None:
    text = written(LAW, ["feed", "power"], "d", "s + 0.0")
    law = executed(LAW)["law"]
    assert callable(law)
    for depth, speed in itertools.product((-1.0, 0.0, 0.5), (0.5, 1.0, 3.0)):
        found = executed(text, d=depth, s=speed)
        assert (found["feed"], found["power"]) == law(depth, speed)
        assert (found["d"], found["s"]) == (depth, speed)


def test_targets_that_a_law_still_reads_are_assigned_at_once() -> None:
    source = """
    def law(a, b):
        if a > 0.0:
            return (b, a)
        return (a, a)
    """
    found = executed(written(source, ["a", "b"], "a", "b"), a=3.0, b=8.0)
    assert (found["a"], found["b"]) == (8.0, 3.0)


@pytest.mark.parametrize("body", ["for _ in range(3):\n    if x > 1.0:\n        return 1.0\nreturn x", "if x > 0.0:\n    return 1.0"])
def test_what_has_to_be_called(body: str) -> None:
    with pytest.raises(NotInPlaceError):
        written("def law(x):\n" + textwrap.indent(body, "    "), ["y"], "v")
