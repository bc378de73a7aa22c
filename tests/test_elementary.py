"""exp, log, tanh and sin from sums and products: close to the true values, and the same bits plain, compiled and in lanes."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal, localcontext

import numpy as np
import pytest

from lathesim import elementary
from lathesim.component import Component, DiscreteState, Output, Parameter
from lathesim.elementary import cos, sin
from lathesim.engine import lanes
from lathesim.engine.assembly import Assembly, Part
from lathesim.engine.batch import Batch
from lathesim.engine.run import run
from lathesim.engine.wiring import wire

TWO = Decimal(2)


def decimal_tanh(x: Decimal) -> Decimal:
    grown = (2 * x).exp()
    return (grown - 1) / (grown + 1)


def decimal_sine(x: Decimal) -> Decimal:
    """Return the sine by its series, which loses as many digits as the largest term has."""
    term, total, power = x, Decimal(0), 1
    while abs(term) > Decimal("1e-60"):
        total, term, power = total + term, -term * x * x / ((power + 1) * (power + 2)), power + 2
    return total


HALF_PI = Decimal("1.57079632679489661923132169163975144209858469968755291")


@pytest.mark.parametrize(
    ("own", "true", "low", "high"),
    [
        (elementary.exp, lambda x: x.exp(), -700.0, 700.0),
        (elementary.exp2, lambda x: TWO**x, -1000.0, 1000.0),
        (elementary.log, lambda x: x.ln(), 1e-3, 1e3),
        (elementary.log2, lambda x: x.ln() / TWO.ln(), 1e-3, 1e3),
        (elementary.tanh, decimal_tanh, -3.0, 3.0),
        (elementary.sin, decimal_sine, -20.0, 20.0),
        (elementary.cos, lambda x: decimal_sine(x + HALF_PI), -20.0, 20.0),
    ],
)
def test_the_values_lie_within_two_units_in_the_last_place(
    own: Callable[[float], float], true: Callable[[Decimal], Decimal], low: float, high: float
) -> None:
    random = np.random.default_rng(3)
    wide, near = random.uniform(low, high, 200), random.uniform(0.5, 1.5, 200)
    with localcontext(prec=50):
        for x in (*wide.tolist(), *near.tolist(), *(1.0 + 0.1**place for place in range(1, 15))):
            found = own(x)
            assert abs(Decimal(found) - true(Decimal(x))) <= 2 * Decimal(math.ulp(found)), x


def test_beyond_the_range_of_doubles_and_at_powers_of_two() -> None:
    assert [own(math.inf) for own in (elementary.exp, elementary.exp2, elementary.log, elementary.log2)] == [math.inf] * 4
    assert (elementary.exp(-math.inf), elementary.exp2(-5000.0), elementary.log(0.0), elementary.tanh(-1e300)) == (
        0.0,
        0.0,
        -math.inf,
        -1.0,
    )
    assert all(math.isnan(own(math.nan)) for own in (elementary.exp, elementary.log, elementary.tanh))
    assert math.isnan(elementary.log2(-1.0))
    assert all(elementary.exp2(float(power)) == 2.0**power and elementary.log2(2.0**power) == power for power in range(-1020, 1024))


def test_angles_of_many_turns() -> None:
    angles = [turns * math.pi / 4.0 for turns in range(-400, 400)] + [1e3 * turns + 0.1 for turns in range(-1000, 1000, 7)]
    assert max(abs(elementary.sin(x) - math.sin(x)) for x in angles) < 3e-16
    assert max(abs(elementary.cos(x) - math.cos(x)) for x in angles) < 3e-16
    assert math.isnan(elementary.sin(math.nan))
    assert abs(elementary.sin(1e300)) <= 1.0


def test_powers() -> None:
    for base, exponent in ((2.0, 0.5), (0.3, 2.0), (1e-3, 1.4), (50.0, 3.0)):
        assert elementary.power(base, exponent) == pytest.approx(base**exponent, rel=5e-15)
    assert elementary.power(0.0, 0.5) == 0.0


class Functions(Component):
    """The functions of a number that grows."""

    number = DiscreteState("1", doc="number")
    factor = Parameter("1", 1.0, doc="factor of a sample")
    growth = Parameter("1", 0.1, doc="growth of a sample")
    exp = Output("1", doc="exp")
    exp2 = Output("1", doc="exp2")
    log = Output("1", doc="log")
    log2 = Output("1", doc="log2")
    tanh = Output("1", doc="tanh")
    sin = Output("1", doc="sin")
    cos = Output("1", doc="cos")

    @staticmethod
    def update(number: float, factor: float, growth: float) -> float:
        return number * factor + growth

    @staticmethod
    def output(number: float) -> tuple[float, float, float, float, float, float, float]:
        return math.exp(number), math.exp2(number), math.log(number), math.log2(number), math.tanh(number), sin(number), cos(number)


def test_the_bits_are_the_same_plain_compiled_and_in_lanes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lanes, "WORTH_A_LOOK", 0.0)
    monkeypatch.setattr(lanes, "compile_time", lambda fused: 0.0)
    plan = wire(Assembly((Part("part", Functions),), (), 0.01, 0.01))
    random = np.random.default_rng(1)
    members = np.column_stack([random.uniform(0.9, 1.02, 16), random.uniform(1e-3, 3.0, 16)])
    members[:4] = [[1.01, math.inf], [math.nan, 1.0], [1.0, -0.0], [-1.3, 0.2]]
    names, made = ["part.factor", "part.growth"], Batch(plan, 400, threads=1)
    together = [np.where(np.isnan(record), np.nan, record) for record in made.run(names, members)]
    for member, record in zip(members, together, strict=True):
        alone = made.run(names, member)[0]
        assert np.where(np.isnan(alone), np.nan, alone).tobytes() == record.tobytes()
    plain = run(plan, duration=3.99, engine="plain", overrides=dict(zip(names, members[5], strict=True)))
    assert all(plain[channel].tobytes() == record.tobytes() for channel, record in zip(plan.channels, together[5], strict=True))
