"""A machine run by another integrator than the engine's: Heun's method with a finer step, for recordings whose truth is not the model's.

    k1 = f(t, x),   k2 = f(t + h, x + h k1),   x <- x + h/2 (k1 + k2)

The laws, their order and the sample instants are those of the fused plan; the stepping between two instants is another. What is of second
order here and of fourth there differs in the last digits, as two programs of two people would, and a friction that holds a body within
two steps holds it in other instants. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from lathesim.engine.assembly import Assembly
from lathesim.engine.rk4 import HEUN
from lathesim.engine.run import run
from lathesim.engine.wiring import Plan, wire
from lathesim.record import Record

FINER = 10
"""Steps of this run for each step of the lesson."""


def fine_plan(assembly: Assembly, *, finer: int = FINER) -> Plan:
    """Return the plan of an assembly that runs by Heun's method with steps ``finer`` times shorter."""
    return wire(replace(assembly, step=assembly.step / finer), HEUN)


def fine_run(
    plan: Plan,
    duration: float | None,
    overrides: Mapping[str, float] | None = None,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Record:
    """Run a plan made by :func:`fine_plan` and give its Record; raises :class:`SimulationError` where a law breaks."""
    return run(plan, duration=duration, seed=seed, overrides=overrides, progress=progress)
