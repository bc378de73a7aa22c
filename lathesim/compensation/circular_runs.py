"""The circular test of a lesson: both directions, and what each effect adds to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from lathesim.analysis.circular_test import Circle, circles, circular_deviation, hysteresis
from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import Place
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError
from lathesim.lessons.simulate import Prepared

Tell = Callable[[str], None]
DIRECTION = "direction"
"""Parameter of a reference that turns a circle round."""


@dataclass(frozen=True)
class Contribution:
    """What the circular deviation and the hysteresis would be without one effect [m]."""

    effect: str
    at: str
    deviation: float
    hysteresis: float | None


@dataclass(frozen=True)
class CircularTest:
    """The circles of both directions (or of one), the numbers of ISO 230-4 [m], and what each effect adds."""

    ways: tuple[tuple[str, Circle], ...]
    deviation: float
    hysteresis: float | None
    largest: float
    smallest: float
    contributions: tuple[Contribution, ...]


def circular_test(prepared: Prepared, *, contributions: bool = True, tell: Tell = lambda text: None) -> CircularTest:
    """Run the circle of a lesson both ways and return its test; raises :class:`LessonError` where it runs no whole circle."""
    plan = wire(replace(prepared.machinery, record=None))
    ways = _ways(prepared, plan, {})
    if not ways:
        raise LessonError(
            "no whole turn of a circle is run.",
            place=str(prepared.case.lesson.path),
            remedy="Use a CircleReference, or a program with a full circle of G2 or G3.",
        )
    deviation, both = _numbers(ways)
    found = []
    for part in prepared.machinery.parts if contributions else ():
        if issubclass(part.component, Effect) and not issubclass(part.component, Remedy):
            tell(f"without {part.component.__name__}")
            own, other = _numbers(_ways(prepared, plan, {f"{part.name}.{name}": value for name, value in part.component.neutral.items()}))
            found.append(Contribution(part.component.__name__, part.name, own, other))
    radial = [circle.radial for _, circle in ways]
    largest, smallest = max(float(item.max()) for item in radial), min(float(item.min()) for item in radial)
    return CircularTest(tuple(ways), deviation, both, largest, smallest, tuple(found))


def _numbers(ways: list[tuple[str, Circle]]) -> tuple[float, float | None]:
    deviation = max(circular_deviation(circle) for _, circle in ways)
    directions = {circle.direction: circle for _, circle in ways}
    return deviation, hysteresis(directions[1.0], directions[-1.0]) if len(directions) == 2 else None


def _ways(prepared: Prepared, plan: Plan, overrides: dict[str, float]) -> list[tuple[str, Circle]]:
    """Return the circles that are run: of both directions, where the reference can be turned round or the program runs both."""
    name = next((full for full in plan.parameters if Place.of(full).port == DIRECTION), None)
    sides: list[dict[str, float]] = [{}] if name is None else [{name: 1.0}, {name: -1.0}]
    found: dict[float, tuple[str, Circle]] = {}
    for side in sides:
        record = run(plan, duration=prepared.duration, seed=prepared.case.seed, overrides={**overrides, **side}, hints=Hints(often=True))
        for circle in circles(record):
            found[circle.direction] = ("+X to +Z" if circle.direction > 0.0 else "+Z to +X", circle)
    return [found[key] for key in sorted(found, reverse=True)]
