"""Which effects of the catalogue have the form that was found, and from which values a joint fit of them begins.

Each candidate is led along the recorded motion by its own laws, alone: what it adds is compared with the whole of the function that was
found and with each part of it. Its size follows by least squares, the phase of a wave from two waves a quarter of a turn apart, its period
from what was found. So no formula has to be printed that an effect of the catalogue matches. Left out: effects with states that are
integrated, as a spring, and those that sense a force; a replay tries them.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.component import DiscreteState, Input, Memory, Noise, Parameter, State
from lathesim.diagnosis.explanations.conditions import Conditions, Motion, Wave
from lathesim.diagnosis.explanations.flexible import Flexible
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate

_SENSED = {"flow": "velocity", "displacement": "position", "angle": "position", "spindle_speed": "velocity", "acceleration": "acceleration"}
"""Inputs of effects that a motion gives."""
_READ = ("position", "velocity")
_LENGTHS = ("period", "lead", "turn", "signal_period", "order")
"""Parameters that say how long a wave is."""
_TINY = sys.float_info.min


@dataclass(frozen=True, eq=False)
class Near:
    """A candidate whose form is near to what was found: ``likeness`` is the share that it explains (1 all), of the whole or of the
    part ``of_part``; ``start`` are values of ``candidate.parameters`` for a fit [SI]."""

    candidate: Candidate
    likeness: float
    of_part: str
    start: FloatArray

    def __str__(self) -> str:
        """Return its name with place, likeness and starting values [SI]."""
        values = zip(self.candidate.parameters, self.start, strict=True)
        given = ", ".join(f"{name.partition('.')[2]} {value:.3g}" for name, value in values if value)
        return f"{self.candidate.name} at {self.candidate.at}, {self.likeness:.0%} ({given})"


def nearest_effects(found: Flexible, candidates: Iterable[Candidate], conditions: Conditions, shows: str, samples: int = 600) -> list[Near]:
    """Return the candidates by how near their form is to what was found, the nearest first: those at the part or the sensor it belongs to.

    What was found ``shows`` a "force" on a part, its "position" or its "velocity", or something else, which is near to nothing here. The
    motion is that of the first term, or the first one where no term has any. The ``conditions`` are those of the estimation recording,
    thinned to about so many ``samples``.
    """
    thin = conditions.thinned(max(1, len(conditions.time) // samples))
    if not found.terms or not thin.motions:
        return []
    motion = thin.motion(next((term.of for term in found.terms if term.of), thin.motions[0].name))
    shapes = found.each(thin)
    led = _Led(thin, motion, getattr(motion, shows) if shows in _READ else np.zeros(len(thin.time)))
    asked = [("", sum(shapes, np.zeros(len(thin.time))))] + [(str(one), shape) for one, shape in zip(found.terms, shapes, strict=True)]
    names, wanted = [name for name, _ in asked], np.stack([shape - shape.mean() for _, shape in asked])
    waves = [term.wave for term in found.terms if term.wave]
    fitting = [candidate for candidate in candidates if _can_be_led(candidate.effect, shows)]
    near = [_nearest_form(led, candidate, names, wanted, waves) for candidate in fitting]
    return sorted((one for one in near if one is not None), key=lambda one: -one.likeness)


def _can_be_led(effect: type[Effect], shows: str) -> bool:
    """Return whether an effect makes what is shown and needs nothing but a motion: no state that is integrated, and no force."""
    inputs = effect.declared(Input)
    if effect.site not in (("effort",) if shows == "force" else ("measured", "reading") if shows in _READ else ()):
        return False
    known = {"incoming", "applied", "inertia", *_SENSED}
    return "output" in effect.laws and not effect.declared(State) and set(inputs) <= known


def _nearest_form(led: _Led, candidate: Candidate, names: Sequence[str], wanted: FloatArray, waves: Sequence[Wave]) -> Near | None:
    """Return a candidate at the starting point, and with the size, that explain most of one of the ``wanted`` shapes (shapes, samples)."""
    items = [parameter.partition(".")[2] for parameter in candidate.parameters]
    best: tuple[float, int, FloatArray] | None = None
    for point in _points(candidate, items, waves):
        turned = [_with(point, items.index("phase"), phase) for phase in (0.0, 0.5 * math.pi)] if "phase" in items else [point]
        columns = np.stack([led.added(candidate, items, one) for one in turned], axis=1)
        if not np.isfinite(columns).all() or not np.any(np.ptp(columns, axis=0) > 0.0):
            continue
        scales = np.asarray(np.linalg.lstsq(columns, wanted.T, rcond=None)[0], dtype=np.float64)
        explained = 1.0 - np.sum((wanted.T - columns @ scales) ** 2, axis=0) / np.maximum(np.sum(wanted**2, axis=1), _TINY)
        place = int(np.argmax(explained))
        if best is None or explained[place] > best[0]:
            best = float(explained[place]), place, _sized(candidate, items, point, scales[:, place])
    if best is None:
        return None
    _, place, start = best
    # a size is bounded, and few effects are in proportion to it
    left = wanted[place] - led.added(candidate, items, start)
    return Near(candidate, 1.0 - float(left @ left) / max(float(wanted[place] @ wanted[place]), _TINY), names[place], start)


def _sized(candidate: Candidate, items: Sequence[str], point: FloatArray, scales: FloatArray) -> FloatArray:
    """Return a point with its sizes multiplied, and its phase turned where there are two scales: of sine and cosine."""
    start = point.copy()
    sizes = [place for place, item in enumerate(items) if item in candidate.effect.neutral]
    start[sizes] *= math.hypot(*scales) if len(scales) > 1 else float(scales[0])
    if len(scales) > 1:
        start[items.index("phase")] = math.atan2(scales[1], scales[0])
    return np.asarray(np.clip(start, candidate.low, candidate.high))


def _points(candidate: Candidate, items: Sequence[str], waves: Sequence[Wave]) -> Iterator[FloatArray]:
    """Return the starting points of a candidate, those of a wave with the periods that were found."""
    length = next((items.index(name) for name in _LENGTHS if name in items), None)
    if length is None:
        yield from candidate.points
        return
    sizes = [place for place, item in enumerate(items) if item in candidate.effect.neutral]
    plain = np.asarray(candidate.points[0]).copy()
    # a wave of several sizes is tried with its first one
    plain[sizes[1:]] = candidate.neutral[sizes[1:]]
    for wave in waves:
        yield _with(plain, length, 2.0 * math.pi / wave.period if items[length] == "order" else wave.period)


def _with(point: FloatArray, place: int, value: float) -> FloatArray:
    changed = point.copy()
    changed[place] = value
    return changed


@dataclass(frozen=True, eq=False)
class _Led:
    """Conditions, and a motion of them, along which effects are led."""

    thin: Conditions
    motion: Motion
    carried: FloatArray
    """What the wires carry that effects are put on (samples,): no force, or what a reading shows."""

    def added(self, candidate: Candidate, items: Sequence[str], values: FloatArray) -> FloatArray:
        """Return what a candidate adds to what its wire carries (samples,), less the mean."""
        effect, time = candidate.effect, self.thin.time
        period = float(time[1] - time[0])
        known: dict[str, object] = {name: item.default for name, item in effect.declared(Parameter).items()}
        known |= dict(zip(items, values.tolist(), strict=True))
        known |= dict.fromkeys(effect.declared(Noise), 0.0) | {"applied": 0.0, "inertia": 1e6, "step": period, "sample_period": period}
        known |= {name: item.start for name, item in effect.declared(DiscreteState).items()}
        known |= {name: [item.start] * item.length for name, item in effect.declared(Memory).items()}
        sensed = {name: getattr(self.motion, role) for name, role in _SENSED.items()} | {"incoming": self.carried, "time": time}
        used = {name for arguments in effect.arguments.values() for name in arguments}
        inputs = [name for name in sensed if name in used]
        states, laws, arguments = list(effect.declared(DiscreteState)), effect.laws, effect.arguments
        found = np.empty(len(time))
        for sample, row in enumerate(zip(*(sensed[name].tolist() for name in inputs), strict=True)):
            known.update(zip(inputs, row, strict=True))
            if "update" in laws:
                made = laws["update"](*(known[name] for name in arguments["update"]))
                known.update(zip(states, made if isinstance(made, tuple) else (made,), strict=True))
            given = laws["output"](*(known[name] for name in arguments["output"]))
            found[sample] = given[0] if isinstance(given, tuple) else given
        added = found - self.carried
        return np.asarray(added - added.mean())
