"""A recording that contradicts itself: a command that does not follow from what its controller was given, a reading in another unit.

Between a command and what its controller was given lies no physics that could be left out, only the controller's law. Where the command
would follow with another sample period, it is the time column that is wrong.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.component import Component, Input
from lathesim.diagnosis.locate import passed_through
from lathesim.diagnosis.moving_start import shown_by
from lathesim.diagnosis.own_simulation import SETTLING, root_mean_square
from lathesim.diagnosis.problem import Rig
from lathesim.diagnosis.shortfall import FORCES
from lathesim.diagnosis.terms import Term, decides
from lathesim.engine.assembly import Assembly, FloatArray, Part
from lathesim.record import Record
from lathesim.recordings.known_factors import known_factor

CONTROLLED = 0.2
"""Share of a controller's command that may stay unexplained by what it was given before the recording is held to be at fault."""
_FOLLOWS = 0.05
"""Share that may stay unexplained with another sample period for that to be the fault."""
_LAW = 0.5
"""Share from which on it is rather a wrong column than another law: that still is most of what the lesson's controller does."""
_GAINS = (0.6, 1.6)
"""Factors between which an amplifier may be off."""
_TURNED_ROUND = 0.03
"""How far a factor may lie beside -1."""
_FURTHEST = 3.0
"""Samples by which a channel is looked for earlier or later."""
_BY_SHIFT = 0.35
"""Share of what is unexplained that may stay so with a shift for that to be the fault."""
_BY_CLOCK = 0.01
"""Share of a command that must stay unexplained for a clock that is a little off to be the fault."""
_STEP = 1e-6
"""By how much a zero is moved for its slope [SI]; commands answer in proportion."""
_PLAINLY_OFF = 0.1
_UNIT_FROM = (0.4, 2.5)
"""Factors between which a force may be another one: twice as much is no unit."""
_BESIDE_A_UNIT, _NEARLY_A_UNIT = 0.1, 0.06
"""Share of a channel that a mistaken unit may leave, and by how much its factor may be another one: values of the machine are uncertain."""
_EXCHANGED = 0.1
"""Two channels are swapped where together they are off by more than the first, as a share of their squares, and exchanged by less than the
second share of that."""
_PERIODS = (0.5, 2.0, 0.8, 1.25, 0.1, 10.0, 1e-3, 1e3)
"""Factors between the true period and the recorded one: clocks of other devices, and seconds for milliseconds."""


def at_odds(rig: Rig, values: Mapping[str, float]) -> tuple[str, ...]:
    """Give the sentences in which a recording contradicts itself with the machine at ``values``, as far as no other law of a controller
    would be behind that."""
    asked = (exchanged_with, of_another_period, swapped, in_another_unit)
    return tuple(sentence for one in asked if (sentence := one(rig, values)))


def contradicted(rig: Rig, values: Mapping[str, float], of_another_law: Mapping[str, bool] | None = None) -> str:
    """Give a sentence where a recorded command does not follow from what its controller was given, with the machine at ``values``.

    The text is empty where it does, where nothing was replayed, and for commands ``of_another_law``: what the lesson's controller leaves of
    them answers to the reference, and so is the controller's doing. One that mostly does not follow is believed to be of another law only
    where that is a simple one (true).
    """
    if not rig.machine.replay:
        return ""
    laws = of_another_law or {}
    for row, share in unexplained_share(rig, values):
        if share > CONTROLLED:
            name = rig.machine.compare[row]
            if told := _late_channel(rig, values, row, share) or _other_zero(rig, values, row, share):
                return told
            if (name in laws and (share < _LAW or laws[name])) or _reads_through_a_converter(rig, row):
                continue
            return (
                f"{share:.0%} of {name} does not follow from what its controller was given: a channel is shifted, swapped or in another "
                "unit, the sample period is another, or the controller is not that of the lesson."
            )
    return ""


def _reads_through_a_converter(rig: Rig, row: int) -> bool:
    """Say whether what a command (row) follows from was read by a converter: what that made of it, with its noise, was not recorded."""
    ports = {part.name: part.component.ports for part in rig.machine.assembly.parts}
    return any("bits" in ports.get(name, ()) for name in passed_through(rig.sensed.plan, rig.sensed.channels[row]))


def of_another_period(rig: Rig, values: Mapping[str, float]) -> str:
    """Give a sentence where a recorded command follows from what its controller was given with another sample period only; empty where it
    does so as recorded, with no other, or nothing was replayed."""
    period, clock = 1e3 * rig.machine.assembly.sample_period, rig.machine.clock
    for controller, row in _shown_commands(rig) if rig.machine.replay and clock != 1.0 else ():
        share = _beyond_floor(rig, 1.0, values, row)
        if share > _BY_CLOCK and _beyond_floor(rig, 1.0 / clock, values, row) < min(_FOLLOWS, _BY_SHIFT * share):
            name = rig.machine.compare[row]
            decides_every, how = period / rig.machine.decisions, "fast" if clock > 1.0 else "slow"
            return (
                f"{controller} decides every {decides_every / clock:.4g} ms, and by the recording's clock every "
                f"{decides_every:.4g} ms: that runs {abs(clock - 1.0):.2%} {how}. With the lesson's period {name} follows from what its "
                f"controller was given, with the recorded one {share:.0%} of it does not."
            )
    for row, share in unexplained_share(rig, values) if rig.machine.replay else ():
        name = rig.machine.compare[row]
        for factor in _PERIODS if share > CONTROLLED else ():
            if _unexplained_at(rig, factor, values, row) < _FOLLOWS:
                return (
                    f"With a sample period of {factor * period:.4g} ms {name} follows from what its controller was given, with "
                    f"{period:.4g} ms {share:.0%} of it does not: the time column, or its unit, is off by a factor of {1.0 / factor:.4g}."
                )
    return ""


def _shown_commands(rig: Rig) -> list[tuple[str, int]]:
    """Give each controller with the compared channel (row) that shows its command: itself, or what a drive makes of it."""
    parts = [part for part in rig.machine.assembly.parts if _commands(part.component)]
    rows = [(part.name, shown_by(rig.machine.assembly, part, rig.machine.compare)[:1]) for part in parts]
    return [(name, row[0]) for name, row in rows if row]


def _beyond_floor(rig: Rig, factor: float, values: Mapping[str, float], row: int) -> float:
    """Give the share of a channel that a replay with every period ``factor`` times as long does not explain, noise aside."""
    residual = (_at_period(rig, factor) if factor != 1.0 else rig).sensed.one(values)[row]
    left = root_mean_square(residual[int(SETTLING * rig.sensed.samples) :])
    size = float(np.std(np.nan_to_num(rig.sensed.recorded[row])))
    return float(np.sqrt(max(left**2 - rig.floors[rig.machine.compare[row]] ** 2, 0.0))) / size if size > 0.0 else 0.0


def _unexplained_at(rig: Rig, factor: float, values: Mapping[str, float], row: int) -> float:
    return dict(unexplained_share(_at_period(rig, factor), values))[row]


def _late_channel(rig: Rig, values: Mapping[str, float], row: int, share: float) -> str:
    """Give a sentence where a command follows from what its controller was given once one channel is shifted; empty where none does."""
    name = rig.machine.compare[row]
    controller = name.partition(".")[0]
    period = rig.machine.assembly.sample_period
    wires = {wire.target: wire.source for wire in rig.machine.assembly.wires}
    fed = {wires.get(f"{controller}.{port}", "") for port in _part(rig, controller).component.declared(Input)}
    for channel in (other for other in rig.machine.compare if other in fed):

        def left(samples: float, channel: str = channel) -> float:
            return dict(unexplained_share(_shifted(rig, channel, samples), values))[row]

        found = minimize_scalar(left, bounds=(-_FURTHEST, _FURTHEST), method="bounded", options={"xatol": 0.01, "maxiter": 25})
        if found.fun < _BY_SHIFT * share:
            how = "later" if found.x < 0.0 else "earlier"
            late = f"{abs(found.x) * period * 1e3:.3g} ms ({abs(found.x):.2g} samples)"
            return (
                f"With {channel} {late} {how} {name} follows from what its controller was given, as recorded {share:.0%} of it does not: "
                "the channels were not recorded at the same times (ChannelTimeShift)."
            )
    return ""


def _other_zero(rig: Rig, values: Mapping[str, float], row: int, share: float) -> str:
    """Give a sentence where a command follows from what its controller was given once its reference is read from another zero; empty where
    it does not. The first guess is how far apart the two are in the middle; what is left of the command then tells how far that is off."""
    name = rig.machine.compare[row]
    controller = _part(rig, name.partition(".")[0])
    ports = controller.component.ports
    target = f"{controller.name}.{ports['drive']}"
    measured = next((wire.source for wire in rig.machine.assembly.wires if wire.target == f"{controller.name}.{ports['measured']}"), "")
    if target not in rig.machine.drive or measured not in rig.machine.compare:
        return ""
    zero = float(np.nanmedian(rig.record[measured] - rig.record[target]))

    def residual(more: float) -> FloatArray:
        moved = replace(rig, record=rig.record.with_channel(target, rig.record.channels[target].unit, rig.record[target] + zero + more))
        found: FloatArray = np.nan_to_num(moved.sensed.one(values)[row])
        return found

    size, step = float(np.std(np.nan_to_num(rig.sensed.recorded[row]))), _STEP
    begin = int(SETTLING * rig.sensed.samples)
    first = residual(0.0)[begin:]
    slope = (residual(step)[begin:] - first) / step
    more = -float(slope @ first) / max(float(slope @ slope), 1e-300)
    if root_mean_square(residual(more)[begin:]) > min(_FOLLOWS * size, _BY_SHIFT * share * size):
        return ""
    shown = shown_with_unit(zero + more, rig.record.channels[target].unit, 3)
    return (
        f"With {shown} added to {target} {name} follows from what its controller was given, as recorded {share:.0%} of it does not: "
        f"it was recorded from another zero than {measured}."
    )


def _shifted(rig: Rig, channel: str, samples: float) -> Rig:
    """Give the same recording with one channel read some samples ahead, along a cubic spline."""
    recorded = rig.record[channel]
    number = np.arange(len(recorded), dtype=np.float64)
    known = np.isfinite(recorded)
    ahead = CubicSpline(number[known], recorded[known])(np.clip(number + samples, 0.0, number[-1]))
    column = rig.record.channels[channel]
    return replace(rig, record=rig.record.with_channel(channel, column.unit, np.where(known, ahead, np.nan)))


def _part(rig: Rig, name: str) -> Part:
    return next(part for part in rig.machine.assembly.parts if part.name == name)


def exchanged_with(rig: Rig, values: Mapping[str, float]) -> str:
    """Give a sentence where another channel is the command that a controller makes of what it was given, and its own is not: two columns
    are exchanged, though their units differ. The text is empty where none is."""
    if not rig.machine.replay:
        return ""
    begin = int(SETTLING * rig.sensed.samples)
    simulated = np.nan_to_num(rig.sensed.recorded - rig.sensed.one(values))[:, begin:]
    recorded = np.nan_to_num(rig.sensed.recorded)[:, begin:]
    for row, share in unexplained_share(rig, values):
        name = rig.machine.compare[row]
        for other, column in enumerate(recorded):
            size = float(np.std(column))
            if other != row and share > CONTROLLED and size > 0.0 and root_mean_square(column - simulated[row]) < _FOLLOWS * size:
                return (
                    f"{rig.machine.compare[other]} is what the lesson's controller makes of what it was given, and {share:.0%} of {name} "
                    "is not: the two look swapped. Exchange their columns in the lesson."
                )
    return ""


def swapped(rig: Rig, values: Mapping[str, float]) -> str:
    """Give a sentence where two channels of one unit are what the machine with ``values`` makes of each other; empty where none are."""
    recorded = np.nan_to_num(rig.sensed.recorded)
    simulated = recorded - np.nan_to_num(rig.sensed.one(values))
    units = [rig.record.channels[name].unit for name in rig.machine.compare]
    power = np.maximum(np.sum(recorded**2, axis=1), 1e-300)
    off = np.sum((recorded[:, None] - simulated[None]) ** 2, axis=2) / power[:, None]
    for first, second in itertools.combinations(range(len(units)), 2):
        as_mapped, exchanged = off[first, first] + off[second, second], off[first, second] + off[second, first]
        if units[first] == units[second] and as_mapped > _PLAINLY_OFF and exchanged < _EXCHANGED * as_mapped:
            names = f"{rig.machine.compare[first]} and {rig.machine.compare[second]}"
            return (
                f"{names} look swapped: as mapped the machine misses {np.sqrt(0.5 * as_mapped):.0%} of them, exchanged "
                f"{np.sqrt(0.5 * exchanged):.0%}. Exchange their columns in the lesson."
            )
    return ""


def in_another_unit(rig: Rig, values: Mapping[str, float]) -> str:
    """Give a sentence where one force is what the machine with ``values`` makes times the factor of a mistaken unit, and hardly anything
    else, and all others are nearly what it makes; empty where none is. Another effect may do the same: of a force that is a share of
    another one, a part of that other one. Where all are off the machine is another one; of motions the mapping asks."""
    begin = int(SETTLING * rig.sensed.samples)
    recorded = np.nan_to_num(rig.sensed.recorded)[:, begin:]
    simulated = recorded - np.nan_to_num(rig.sensed.one(values))[:, begin:]
    factors = [float(one @ other) / max(float(other @ other), 1e-300) for one, other in zip(recorded, simulated, strict=True)]
    off = [row for row, factor in enumerate(factors) if not _GAINS[0] < factor < _GAINS[1]]
    if len(off) != 1 or len(factors) == 1 or rig.record.unit(rig.machine.compare[off[0]]) not in FORCES:
        return ""
    (row,) = off
    factor, name = factors[row], rig.machine.compare[row]
    beside = root_mean_square(recorded[row] - factor * simulated[row])
    unit = known_factor(factor, _NEARLY_A_UNIT) if not _UNIT_FROM[0] < abs(factor) < _UNIT_FROM[1] else ""
    if not unit or not beside < _BESIDE_A_UNIT * root_mean_square(recorded[row]):
        return ""
    return f"{name} is {factor:.4g} times what the machine makes, which is the factor of a mistaken unit: {unit}."


def wrong_unit(terms: Iterable[Term], values: Mapping[str, float]) -> str:
    """Give a sentence where one of some effects would be a factor on a reading that a mistaken unit leaves; empty where none is.

    No amplifier is off by 2 pi: the column is. It is asked of effects that took most of the error away: a wrong unit does.
    """
    for term in terms:
        for name, neutral in zip(term.parameters, term.neutral, strict=True):
            factor = values.get(name, 1.0)
            if neutral == 1.0 and abs(factor + 1.0) < _TURNED_ROUND:
                return f"{term.at} reads {factor:.4g} times what the machine does: its sign is turned round."
            if neutral == 1.0 and not _GAINS[0] < abs(factor) < _GAINS[1] and (unit := known_factor(factor)):
                return f"{term.at} reads {factor:.4g} times what the machine does, which is the factor of a mistaken unit: {unit}."
    return ""


def commands(rig: Rig) -> list[tuple[int, str]]:
    """Give place and name of each compared channel that is the command of a controller."""
    parts = {part.name: part.component for part in rig.machine.assembly.parts}
    return [(row, name) for row, name in enumerate(rig.machine.compare) if _commands(parts[name.partition(".")[0]])]


def unexplained_share(rig: Rig, values: Mapping[str, float]) -> Iterator[tuple[int, float]]:
    """Give for each controller's command its place among the compared channels and the share of it that a replay does not explain."""
    rows = [row for row, _ in commands(rig)]
    residual = rig.sensed.one(values) if rows else np.zeros((0, 0))
    for row in rows:
        size = float(np.std(np.nan_to_num(rig.sensed.recorded[row])))
        settled = residual[row][int(SETTLING * rig.sensed.samples) :]
        yield row, root_mean_square(settled) / size if size > 0.0 else 0.0


def _commands(component: type[Component]) -> bool:
    return decides(component) and "displacement" not in component.ports


def _at_period(rig: Rig, factor: float) -> Rig:
    """Give the same recording with every period ``factor`` times as long; controllers that decide more often do so at their own rate."""
    decisions = max(1, round(factor * rig.machine.decisions)) if rig.machine.decisions > 1 else 1
    return replace(
        rig,
        machine=replace(rig.machine, assembly=_slower(rig.machine.assembly, factor), decisions=decisions),
        with_candidates=_slower(rig.with_candidates, factor),
        record=Record(factor * rig.record.time, rig.record.channels, dict(rig.record.meta)),
    )


def _slower(assembly: Assembly, factor: float) -> Assembly:
    return replace(assembly, sample_period=factor * assembly.sample_period, step=factor * assembly.step)
