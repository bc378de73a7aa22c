"""What a mismatch outside the catalogue looks like as a formula: sparse regression of the missing force on functions with units.

    missing(t) = sum_j c_j f_j(v, q, a, t)

The functions come in groups (a power of the speed, a wave over the position ...); groups are added one at a time, each time the one that
explains most of the missing signal, as long as it explains more of it on the held-out recording too. Every coefficient carries its unit.
Source: Brunton, Proctor, Kutz, Discovering governing equations from data by sparse identification of nonlinear dynamical systems, PNAS
113 (2016), here with held-out selection in place of a threshold.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lombscargle

from lathesim.diagnosis.fit import Fitted
from lathesim.diagnosis.locate import missing_signal
from lathesim.diagnosis.motion import recorded_motion, velocity_of
from lathesim.diagnosis.problem import Rig
from lathesim.engine.assembly import FloatArray

WORTH = 0.05
"""Share of the missing signal that a group must explain further on the held-out recording."""
_MOST_GROUPS = 3
_WAVES = 400


@dataclass(frozen=True)
class Column:
    """A function of the motion: as Python text in ``v``, ``q`` and ``t`` with its number ``{0}`` if any, and the unit it has."""

    text: str
    unit: str
    shape: float
    values: Callable[[Mapping[str, FloatArray]], FloatArray]


@dataclass(frozen=True)
class Addend:
    """One addend of a discovered formula: coefficient [unit], the function's text."""

    coefficient: float
    unit: str
    text: str


@dataclass(frozen=True)
class Discovered:
    """A formula for what is missing at ``at`` [``unit``]; ``share`` is how much of it the formula explains on the held-out recording."""

    at: str
    unit: str
    addends: tuple[Addend, ...]
    share: float

    @property
    def formula(self) -> str:
        """The formula as text, with units."""
        return " + ".join(f"({item.coefficient:.4g} {item.unit}) {item.text}" for item in self.addends) + f"  [{self.unit}]"


def discover(rig: Rig, fitted: Fitted, held_out: Rig, judged: Fitted) -> Discovered | None:
    """Give a formula for the largest missing signal, or none where no function explains it on the held-out recording."""
    best: Discovered | None = None
    for row in range(len(rig.machine.compare)):
        here, there = missing_signal(rig, fitted, row), missing_signal(held_out, judged, row)
        motion, other = _motion(rig, here.at, row), _motion(held_out, there.at, row)
        if motion is None or other is None:
            continue
        found = _regress(here.at, here.unit, here.values, motion, there.values, other)
        if found is not None and (best is None or found.share > best.share):
            best = found
    return best


def _motion(rig: Rig, at: str, row: int) -> dict[str, FloatArray] | None:
    """Give time, position, velocity and acceleration at the place where something is missing."""
    period = rig.machine.assembly.sample_period
    part = at.partition(".")[0]
    ports = next((item.component.ports for item in rig.machine.assembly.parts if item.name == part), {})
    time = np.asarray(np.arange(rig.sensed.samples) * period, dtype=np.float64)
    if "flow" in ports:
        motion = recorded_motion(rig.with_candidates, {name: rig.record[name] for name in rig.machine.compare})
        velocity = motion.get(f"{part}.{ports['flow']}")
        position = motion.get(f"{part}.{ports.get('displacement', '')}")
        if velocity is None:
            return None
        place = position if position is not None else np.asarray(np.cumsum(velocity) * period)
        return {"t": time, "v": velocity, "q": place, "a": velocity_of(velocity, period)}
    values = np.nan_to_num(rig.sensed.seen[row])
    rate = velocity_of(values, period)
    return {"t": time, "q": values, "v": rate, "a": velocity_of(rate, period)}


def _groups(motion: Mapping[str, FloatArray], signal: FloatArray) -> list[list[Column]]:
    """Give the groups of functions that are tried."""
    slow = 0.05 * float(np.max(np.abs(motion["v"]))) or 1.0
    simple = [
        Column("1", "1", 0.0, lambda m: np.ones_like(m["t"])),
        Column("v", "v", 0.0, lambda m: m["v"]),
        Column("v * abs(v)", "v^2", 0.0, lambda m: m["v"] * np.abs(m["v"])),
        Column("v * v * v", "v^3", 0.0, lambda m: m["v"] ** 3),
        Column("abs(v)", "v", 0.0, lambda m: np.abs(m["v"])),
        Column("v * v", "v^2", 0.0, lambda m: m["v"] ** 2),
        Column(f"tanh(v / {slow:.3g})", "1", slow, lambda m: np.tanh(m["v"] / slow)),
        Column("q", "q", 0.0, lambda m: m["q"]),
        Column("q * q", "q^2", 0.0, lambda m: m["q"] ** 2),
        Column("q * q * q", "q^3", 0.0, lambda m: m["q"] ** 3),
        Column("a", "a", 0.0, lambda m: m["a"]),
        Column("t", "s", 0.0, lambda m: m["t"]),
        Column(f"q * tanh(v / {slow:.3g})", "q", slow, lambda m: m["q"] * np.tanh(m["v"] / slow)),
        Column("q * v", "q*v", 0.0, lambda m: m["q"] * m["v"]),
    ]
    groups = [[column] for column in simple]
    for name in ("q", "t"):
        wave = _strongest_wave(motion[name], signal)
        if wave > 0.0:
            groups.append(
                [
                    Column(f"sin({wave:.6g} * {name})", "1", wave, lambda m, w=wave, n=name: np.sin(w * m[n])),  # type: ignore[misc]
                    Column(f"cos({wave:.6g} * {name})", "1", wave, lambda m, w=wave, n=name: np.cos(w * m[n])),  # type: ignore[misc]
                ]
            )
    return groups


def _strongest_wave(where: FloatArray, signal: FloatArray) -> float:
    """Give the angular frequency over ``where`` at which the signal is strongest, 0 where ``where`` does not move."""
    span = float(np.ptp(where))
    if span <= 0.0:
        return 0.0
    thin = slice(None, None, max(1, len(where) // 4000))
    frequencies = 2.0 * np.pi / span * np.geomspace(1.5, 150.0, _WAVES)
    power = lombscargle(where[thin], signal[thin] - np.mean(signal[thin]), frequencies)
    return float(frequencies[int(np.argmax(power))])


def _regress(
    at: str, unit: str, signal: FloatArray, motion: Mapping[str, FloatArray], other: FloatArray, other_motion: Mapping[str, FloatArray]
) -> Discovered | None:
    groups = _groups(motion, signal)
    chosen: list[Column] = []
    share, weights = 0.0, np.zeros(0)
    power = float(other @ other)
    if power <= 0.0:
        return None
    for _ in range(_MOST_GROUPS):
        trials = []
        for group in groups:
            columns = [*chosen, *group]
            matrix = np.stack([column.values(motion) for column in columns], axis=1)
            scale = np.maximum(np.sqrt(np.mean(matrix**2, axis=0)), 1e-300)
            amount = np.linalg.lstsq(matrix / scale, signal, rcond=1e-8)[0] / scale
            predicted = np.stack([column.values(other_motion) for column in columns], axis=1) @ amount
            trials.append((1.0 - float(np.sum((other - predicted) ** 2)) / power, amount, group))
        best = max(trials, key=lambda trial: trial[0])
        if best[0] < share + WORTH:
            break
        share, weights = best[0], best[1]
        chosen = [*chosen, *best[2]]
        groups = [group for group in groups if group is not best[2]]
    if not chosen:
        return None
    pairs = zip(weights, chosen, strict=True)
    addends = tuple(Addend(float(weight), _unit_over(unit, column.unit), column.text) for weight, column in pairs)
    return Discovered(at, unit, addends, share)


def _unit_over(unit: str, of: str) -> str:
    """Give the unit of a coefficient: that of the missing signal over that of the function, in m or rad."""
    length = "rad" if "N*m" in unit or unit == "rad" else "m"
    units = {"1": "", "v": f"{length}/s", "v^2": f"({length}/s)^2", "v^3": f"({length}/s)^3"}
    units |= {"q": length, "q^2": f"{length}^2", "q^3": f"{length}^3"}
    units |= {"a": f"{length}/s^2", "s": "s", "q*v": f"({length}^2/s)"}
    below = units[of]
    return f"{unit}/({below})" if below else unit


def plugin_text(found: Discovered, name: str = "DiscoveredTerm") -> str:
    """Give a plug-in file with the discovered term as an effect, ready for ``insert: [{effect: DiscoveredTerm, at: ...}]``."""
    port = found.at.partition(".")[2]
    site = "effort" if port not in ("position", "angle", "voltage", "main") else "reading"
    used = " ".join(item.text for item in found.addends)
    arguments = [argument for argument, letter in (("flow", "v"), ("displacement", "q"), ("time", "t")) if _uses(used, letter)]
    inputs = [
        f'    {argument} = Input("{{{argument}}}", doc="{doc} of the host")'
        for argument, doc in (("flow", "velocity"), ("displacement", "position"))
        if argument in arguments
    ]
    letters = (("flow", "v"), ("displacement", "q"), ("time", "t"))
    law = [f"        {letter} = {argument}" for argument, letter in letters if argument in arguments]
    coefficients = [
        f'    coefficient_{number} = Parameter("1", {item.coefficient!r}, doc="coefficient of {item.text} [{item.unit}]")'
        for number, item in enumerate(found.addends, start=1)
    ]
    total = " + ".join(f"coefficient_{number} * ({_in_math(item.text)})" for number, item in enumerate(found.addends, start=1))
    names = [f"coefficient_{number}" for number in range(1, len(found.addends) + 1)]
    neutral = ", ".join(f'"{item}": 0.0' for item in names)
    signature = ", ".join(f"{item}: float" for item in ["incoming", *arguments, *names])
    lines = [
        f'"""A term that was discovered in a recording: {found.formula}. It explains {found.share:.0%} of what was missing."""',
        "",
        "import math",
        "",
        "from lathesim.component import Input, Output, Parameter",
        "from lathesim.effects.effect import Effect",
        "from lathesim.hookspecs import hookimpl",
        "",
        "",
        f"class {name}(Effect):",
        f'    """Adds what was missing:  {found.formula}."""',
        "",
        f'    catalogue, family, site = 0, "discovered", "{site}"',
        f"    neutral = {{{neutral}}}",
        '    fingerprint = "what the formula says"',
        '    experiment = "repeat the recording with other speeds and positions, and see whether the formula holds"',
        '    source = "regression of a recording"',
        '    incoming = Input("{signal}", doc="what the wire carries")',
        *inputs,
        '    outgoing = Output("{signal}", doc="with the discovered term")',
        *coefficients,
        "",
        "    @staticmethod",
        f"    def output({signature}) -> float:",
        *law,
        f"        return incoming + ({total})",
        "",
        "",
        "@hookimpl",
        "def register_effects() -> list[type[Effect]]:",
        '    """Give the discovered term."""',
        f"    return [{name}]",
        "",
    ]
    return "\n".join(lines)


def _uses(text: str, letter: str) -> bool:
    return letter in text.replace("tanh", "").replace("abs", "").replace("sin", "").replace("cos", "")


def _in_math(text: str) -> str:
    for function in ("tanh", "sin", "cos"):
        text = text.replace(f"{function}(", f"math.{function}(")
    return text
