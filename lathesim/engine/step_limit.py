"""Whether the RK4 step is short enough for the machine: its fastest eigenvalue against the region of stability.

RK4 multiplies a mode of eigenvalue L by R(hL) = 1 + hL + (hL)^2/2 + (hL)^3/6 + (hL)^4/24 in each step h; a decaying mode needs
abs(R) <= 1. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.2. The machine is linearised at its start
with the sampled parts at rest; a part that grows faster while it runs is not seen here.
"""

from __future__ import annotations

import math

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import plain_module
from lathesim.engine.run_arrays import RunArrays
from lathesim.engine.wiring import Plan
from lathesim.errors import WiringError


def check_step(plan: Plan, arrays: RunArrays) -> None:
    """Refuse a step that is too long (:class:`WiringError`), naming the part that swings and the largest good step."""
    values_seen = (arrays.parameters.tobytes(), arrays.states.tobytes(), arrays.discrete.tobytes())
    if not plan.states or plan.kept.get("step checked for") == values_seen:
        return
    step = plan.assembly.step
    values, vectors = np.linalg.eig(jacobian(plan, arrays))
    if not _is_short_enough(values, step):
        values, vectors = np.linalg.eig(_without_jumps(plan, arrays))
    if _is_short_enough(values, step):
        plan.kept["step checked for"] = values_seen
        return
    decaying = values.real < 0.0
    worst = int(np.argmax(np.where(decaying, np.abs(amplification(values * step)), 0.0)))
    good = step
    while np.abs(amplification(values[decaying] * good)).max() > 1.0:
        good *= 0.97
    part = Place.of(list(plan.states)[int(np.argmax(np.abs(vectors[:, worst])))]).part
    rate = abs(values[worst])
    text = f"{rate / 1e3:.3g} krad/s" if rate >= 1e3 else f"{rate:.3g} rad/s"
    raise WiringError(
        f"The step of {step * 1e6:.4g} us is too long: {part} swings at {text}.", remedy=f"Use {_round_down(good * 1e6)} us or less."
    )


def _is_short_enough(values: np.ndarray, step: float) -> bool:
    """Return whether no mode that decays grows in a step."""
    return bool(np.all(np.abs(amplification(values[values.real < 0.0] * step)) <= 1.0 + 1e-9))


def _without_jumps(plan: Plan, arrays: RunArrays) -> np.ndarray:
    """Return the Jacobian without the entries that a jump makes, as of a dry friction that turns round with the velocity: they grow as the
    width of the difference shrinks. A jump is crossed in one step and swings nowhere."""
    wide, narrow = (jacobian(plan, arrays, width) for width in (1e-7, 1e-8))
    return np.where(np.abs(narrow) > 3.0 * np.abs(wide), 0.0, wide)


def amplification(product: np.ndarray) -> np.ndarray:
    """Return R(hL) of classical RK4 for the products of step and eigenvalue."""
    return 1.0 + product * (1.0 + product / 2.0 * (1.0 + product / 3.0 * (1.0 + product / 4.0)))


def jacobian(plan: Plan, arrays: RunArrays, share: float = 1e-7) -> np.ndarray:
    """Return the derivative of the rates with respect to the states [1/s, scaled by the states' units], by central differences whose width
    is a ``share`` of a state, or of one."""
    module = plain_module(fuse(plan))
    given = arrays.as_lists()
    count = len(plan.states)
    result = np.zeros((count, count))
    assembly = plan.assembly

    def rates(states: list[float]) -> np.ndarray:
        out = [0.0] * count
        module.rates(
            0.0, assembly.sample_period, assembly.step, given.parameters, states, given.discrete, given.memories, given.tables, out
        )
        return np.array(out)

    for column in range(count):
        width = share * max(1.0, abs(given.states[column]))
        high, low = list(given.states), list(given.states)
        high[column] += width
        low[column] -= width
        result[:, column] = (rates(high) - rates(low)) / (2.0 * width)
    return np.where(np.isfinite(result), result, 0.0)


def _round_down(number: float) -> str:
    digits = 1 - math.floor(math.log10(number))
    return f"{math.floor(number * 10**digits) / 10**digits:g}"
