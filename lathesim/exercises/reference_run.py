"""A machine run by another integrator than the engine's: Heun's method with a finer step, for recordings whose truth is not the model's.

    k1 = f(t, x),   k2 = f(t + h, x + h k1),   x <- x + h/2 (k1 + k2)

The laws, their order and the sample instants are those of the fused plan; the stepping between two instants is another. What is of second
order here and of fourth there differs in the last digits, as two programs of two people would, and a friction that holds a body within
two steps holds it in other instants. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import replace

from lathesim.engine.assembly import Assembly
from lathesim.engine.fusing.fuse import FusedModule, fuse
from lathesim.engine.running.run import run
from lathesim.engine.wiring import Plan, wire
from lathesim.record import Record

FINER = 10
"""Steps of this run for each step of the lesson."""

_HEUN = (
    (r"^    stages = .*$", "    stages = ((1.0, step), (1.0, step))"),
    (r"^    sixth = .*$", "    sixth = 0.5 * step"),
)
"""What is put in the place of the engine's table of stages (weight in the sum, reach of the next stage) and of its share of the sum."""


def fine_plan(assembly: Assembly, *, finer: int = FINER) -> Plan:
    """Return the plan of an assembly that runs by Heun's method with steps ``finer`` times shorter."""
    plan = wire(replace(assembly, step=assembly.step / finer))
    if plan.states:
        fuse(plan)
        plan.kept.update({key: by_heun(kept) for key, kept in plan.kept.items() if isinstance(kept, FusedModule)})
    return plan


def by_heun(fused: FusedModule) -> FusedModule:
    """Return a fused module with Heun's method in place of the engine's classical Runge-Kutta method."""
    source = fused.source
    for engine, own in _HEUN:
        source, count = re.subn(engine, own, source, flags=re.MULTILINE)
        if count != 1:
            raise AssertionError(f"the engine's module has {count} lines like '{engine}', and one is wanted")
    return FusedModule(source, fused.pieces, hashlib.sha256(source.encode()).hexdigest()[:32])


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
