"""What may be added to a model: effects of the catalogue at every place where they can sit, all neutral in one machine.

One machine carries all candidates at once; with neutral values each is the identity bit for bit, so trying another candidate changes
numbers and never compiles.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import SIDES, Assembly, FloatArray, Part, Place
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError
from lathesim.identification.records import MOST_DAMPED, QUARTER_TURNS, Candidate, Seat
from lathesim.identification.roles import comes_from_effect, decides, further_readings_of, inputs_of_readings, readings_of
from lathesim.lessons.insertion import beyond_its_spring, host_of, insert_effect

WIDE_RANGE = 3.0
"""Ratio of its ends above which a positive range is walked through in factors."""
_ORDERS = 3
"""Whole numbers a turn that are tried."""
_ROTARY_UNITS = ("N*m", "rad/s", "rad")


def insert_candidates(
    assembly: Assembly, effects: Iterable[type[Effect]], compared: Collection[str] | None = None
) -> tuple[Assembly, list[Candidate]]:
    """Return the assembly with every candidate in it, neutral, and the candidates they make.

    With ``compared`` channels, sensors that neither give one of them nor feed a part are left alone: nothing at them can be seen.
    """
    second, measured = _second_sensors(assembly), _measured_parts(assembly)
    places = _places(assembly, effects, compared, measured)
    candidates: list[Candidate] = []
    result = assembly
    for effect, host, senses in places:
        beside = "".join(f"_{Place.of(source).part}" for source in senses.values())
        name = f"try_{host.replace('.', '_')}_{snake(effect.__name__)}{beside}"
        neutral = {item: float(value) for item, value in effect.neutral.items()}
        try:
            before, part = host_of(assembly, host)
            before = before or _first_of_the_drive(assembly, part, effect)
            host = part.name if before else host
            trial = insert_effect(result, effect, before or host, name=name, parameters=neutral, sources=dict(senses))
            placed = trial.by_name[name]
            carried = effect.identification.carried
            if carried is not None and placed.component.declarations["incoming"].unit not in carried:
                continue
            wire(replace(trial, finish="", record=()))
        except LatheSimError:
            continue
        result = trial
        unsaid = beyond_its_spring(trial, name, host) if effect.beyond else {}
        seat = Seat(before, host in second, measured.get(host, ""), senses, unsaid)
        candidate = _as_sampled(_candidate(name, effect, placed.component, host), assembly.sample_period)
        candidate = _coarser(candidate, assembly.by_name[Place.of(host).part])
        candidates.append(replace(candidate, seat=seat, shaped=replace(candidate.shaped, seat=seat) if candidate.shaped else None))
    return result, candidates


def _places(
    assembly: Assembly, effects: Iterable[type[Effect]], compared: Collection[str] | None, measured: Mapping[str, str]
) -> list[tuple[type[Effect], str, dict[str, str]]]:
    """Return the effects with where they fit, in the order in which they act, and what feeds their further inputs there."""
    unseen = {part.name for part in assembly.parts if compared is not None and _is_unseen(assembly, part, compared)}
    driven = {part.name for part in assembly.parts if _has_drive_before_it(assembly, part)}
    return [
        (effect, at, senses)
        for effect in _in_acting_order(effects)
        for part in assembly.parts
        if part.name not in unseen
        for at in (
            *_own_places(effect, part, driven),
            *_further_readings(effect, part, compared or ()),
            *_shown_outputs(effect, part, compared or ()),
        )
        for senses in (
            _from_beside(effect, part, at, assembly, compared)
            if effect.identification.senses_beside
            else _from_elsewhere(effect, measured.get(part.name, part.name), assembly)
        )
    ]


def _as_sampled(candidate: Candidate, period: float) -> Candidate:
    """Return a candidate whose resonance, if it has one, is no faster than samples show and does resonate: what swings beyond half their
    rate may be anything, and what does not swing is a lag."""
    how = candidate.effect.identification
    most = {f"{candidate.part}.{how.resonance}": 0.5 / period, f"{candidate.part}.{how.damping}": MOST_DAMPED}
    if not set(most) & set(candidate.parameters):
        return candidate
    high = np.minimum(candidate.high, [most.get(name, np.inf) for name in candidate.parameters])
    shaped = _as_sampled(candidate.shaped, period) if candidate.shaped else None
    return replace(candidate, high=high, points=np.minimum(candidate.points, high), shaped=shaped)


def _coarser(candidate: Candidate, host: Part) -> Candidate:
    """Return a candidate whose grid, if the effect is one, is a bit coarser than that which its sensor is said to have: a replay leaves the
    sensor's own rounding out, and would find it again."""
    spacing, known = f"{candidate.part}.{candidate.effect.identification.spacing}", host.component.ports.get("resolution", "")
    if spacing not in candidate.parameters or not known:
        return candidate
    low = np.where(np.array(candidate.parameters) == spacing, 2.0 * host.value(known), candidate.low)
    return replace(candidate, low=np.maximum(low, candidate.low), points=np.maximum(candidate.points, low))


def _from_elsewhere(effect: type[Effect], host: str, assembly: Assembly) -> list[dict[str, str]]:
    """Return what may feed the inputs of an effect that sense another part: each output of that role of every other part that is pushed and
    moves as the host does; nothing to be fed where the effect senses its host alone."""
    component = assembly.by_name[host].component
    found: list[dict[str, str]] = [{}]
    for item, role in effect.identification.senses_elsewhere.items():
        unit = effect.declarations[item].unit
        if role not in component.ports or component.declarations[component.ports[role]].unit != unit:
            return []
        outputs = [
            f"{part.name}.{part.component.ports[role]}"
            for part in assembly.parts
            if part.name != host and {role, "effort"} <= set(part.component.ports) and not issubclass(part.component, Effect)
            if part.component.declarations[part.component.ports[role]].unit == unit
        ]
        found = [{**senses, item: output} for senses in found for output in outputs]
    return found


def _from_beside(effect: type[Effect], part: Part, at: str, assembly: Assembly, compared: Collection[str] | None) -> list[dict[str, str]]:
    """Return what may feed the input of an effect that senses another channel of its sensor: what feeds the sensor's other inputs, as
    far as their readings are compared, which tell it from a factor on the own one."""
    reading = Place.of(at).port or part.component.ports.get("reading", "")
    readings = [port for port in readings_of(part.component) if port != reading]
    seen = [port for port in readings if compared is None or f"{part.name}.{port}" in compared]
    fed = [assembly.sources.get(f"{part.name}.{name}", "") for name in inputs_of_readings(part.component, seen)]
    return [{effect.identification.senses_beside: source} for source in fed if source]


def _measured_parts(assembly: Assembly) -> dict[str, str]:
    """Return for each sensor the part whose motion it measures."""
    sources = {wire.target: Place.of(wire.source).part for wire in assembly.wires}
    sensors = [part for part in assembly.parts if "reading" in part.component.ports and "measured" in part.component.ports]
    return {part.name: sources[target] for part in sensors if sources.get(target := f"{part.name}.{part.component.ports['measured']}")}


def _own_places(effect: type[Effect], part: Part, driven: Collection[str]) -> list[str]:
    """Return the part, if the effect fits it; what a drive leaves out belongs to the first part that is driven."""
    return [part.name] if _fits(effect, part.component) and not (effect.site == "drive" and part.name in driven) else []


def _shown_outputs(effect: type[Effect], part: Part, compared: Collection[str]) -> list[str]:
    """Return the compared outputs of a part that is no sensor, as an amplifier's current: what shows it has errors of its own.

    A place that is compared itself was read by a scale or an encoder too, with the screw before it.
    """
    component = part.component
    if "reading" in component.ports or issubclass(component, Effect) or decides(component):
        return []
    if effect.site == "reading" or effect.identification.of_any_reading:
        shown = list(component.declared(Output))
    else:
        shown = [component.ports[role] for role in ("displacement",) if role in component.ports and effect.site == "measured"]
    return [f"{part.name}.{name}" for name in shown if f"{part.name}.{name}" in compared]


def _further_readings(effect: type[Effect], part: Part, compared: Collection[str]) -> list[str]:
    """Return the other compared readings of a sensor of several channels, each with an amplifier and a zero of its own."""
    if effect.site != "reading" or not _fits(effect, part.component):
        return []
    readings = [f"{part.name}.{port}" for port in further_readings_of(part.component)]
    return [reading for reading in readings if reading in compared]


def _is_unseen(assembly: Assembly, part: Part, compared: Collection[str]) -> bool:
    ports = part.component.ports
    if "reading" not in ports or "measured" not in ports:
        return False
    outputs = {f"{part.name}.{name}" for name in part.component.declared(Output)}
    return not outputs & set(compared) and not any(wire.source in outputs for wire in assembly.wires)


def _second_sensors(assembly: Assembly) -> set[str]:
    """Return the sensors of a part of which another tells already: one at the motor, one that closes a loop, or one before them."""
    sources = {wire.target: Place.of(wire.source).part for wire in assembly.wires}
    feeding = {source for target, source in sources.items() if Place.of(target).part != source}
    sensors: dict[str, list[str]] = {}
    for sensor, part in _measured_parts(assembly).items():
        sensors.setdefault(part, []).append(sensor)
    side = {part.name: SIDES.index(part.side) for part in assembly.parts}
    first = [sorted(names, key=lambda name: (side[name], name not in feeding))[0] for names in sensors.values()]
    return {name for names in sensors.values() for name in names} - set(first)


def _in_acting_order(effects: Iterable[type[Effect]]) -> list[type[Effect]]:
    """Return effects in the order in which they act on one port: frictions after all that pushes, as they answer to the sum of it, and last
    the spring behind which they hold; what samples a reading after what filters it, which would see steps else; a cut's depth after the
    forces that are in proportion to it."""

    def order(effect: type[Effect]) -> tuple[bool, bool, bool, int, int, str]:
        samples = effect.site == "reading" and bool(effect.declared(DiscreteState))
        return bool(effect.behind), bool(effect.identification.sticks), samples, effect.stage, effect.catalogue, effect.__name__

    return sorted(effects, key=order)


def _first_of_the_drive(assembly: Assembly, host: Part, effect: type[Effect]) -> str:
    """Return the first of the lags and limits that the lesson inserts in a drive, empty where there is none: a command comes late, or finds
    a dead zone, before they take it."""
    first, target = "", f"{host.name}.{host.component.ports.get('drive', '')}"
    while effect.site == "drive" and comes_from_effect(source := assembly.sources.get(target, "")):
        if not issubclass(assembly.by_name[Place.of(source).part].component, Effect):
            break
        first, target = Place.of(source).part, f"{Place.of(source).part}.incoming"
    return first


def _has_drive_before_it(assembly: Assembly, part: Part) -> bool:
    """Return whether a part's command comes from a drive of its own (amplifier, motor): what a drive leaves out then belongs there."""
    port = part.component.ports.get("drive")
    before = assembly.by_name.get(Place.of(assembly.sources.get(f"{part.name}.{port}", "")).part)
    return before is not None and "drive" in before.component.ports and not decides(before.component)


def _fits(effect: type[Effect], host: type[Component]) -> bool:
    if issubclass(host, Effect):
        # behind a spring of the lesson another part is pushed
        return bool(host.behind) and effect.site == "effort" and not effect.behind
    return not decides(host) and set(effect.pairs()) <= set(host.ports)


def snake(name: str) -> str:
    """Return ``coulomb_friction`` for ``CoulombFriction``."""
    return "".join(f"_{letter.lower()}" if letter.isupper() and place else letter.lower() for place, letter in enumerate(name))


def _candidate(part: str, effect: type[Effect], placed: type[Component], host: str, *, shaped: bool = False) -> Candidate:
    """Return the candidate of an effect, in its plain shape or with the values of a finer one free too."""
    declared, extended, ranges = placed.declared(Parameter), effect.identification.extended, _ranges(effect, placed)
    names = [name for name in declared if name in ranges and (shaped or name not in extended)]
    points = _points(names, effect.identification.starts, ranges)
    values = {**effect.neutral, **({name: declared[name].default for name in extended} if shaped else {})}
    neutral = np.array([values.get(name, _middle(*ranges[name])) for name in names])
    # a disc on the axis turns once a turn, whatever a recording shows
    whole = {name: ends for name, ends in ranges.items() if ends[0] == ends[1]}
    low, high = (
        np.array([whole[name][0] if name in whole else getattr(declared[name], bound) for name in names]) for bound in ("low", "high")
    )
    sizes = np.sort(np.abs(np.array([ranges[name] for name in names])).reshape(-1, 2), axis=1)
    least, usual = sizes[:, 0], sizes[:, 1]
    finer = _candidate(part, effect, placed, host, shaped=True) if extended and not shaped else None
    return Candidate(part, effect, host, tuple(f"{part}.{name}" for name in names), neutral, low, high, least, usual, points, shaped=finer)


def _ranges(effect: type[Effect], placed: type[Component]) -> Mapping[str, tuple[float, float]]:
    """Return the typical ranges of an effect's parameters where it is placed: those of a host that turns, if the effect has such."""
    rotary = any(item.unit in _ROTARY_UNITS for item in placed.declared(Input).values())
    declared = effect.identification
    return declared.typical_rotary if rotary and declared.typical_rotary else declared.typical


def _points(names: list[str], starts: Mapping[str, Sequence[float]], ranges: Mapping[str, tuple[float, float]]) -> FloatArray:
    """Return where a search for some parameters begins, shape (points, names)."""
    if starts:
        return np.array([starts[name] for name in names]).T
    return _points_of_orders(names, ranges) if "order" in names else _spread([ranges[name] for name in names])


def _points_of_orders(names: list[str], ranges: Mapping[str, tuple[float, float]]) -> FloatArray:
    """Return starting points, shape (points, names), of what comes in whole numbers a turn, as lobes and ripples do, the lowest first:
    between two of them nothing adds up over many turns. All phases of an order have one size: from responses of one size the best phase
    is worked out."""
    lowest, highest = (round(bound) for bound in ranges["order"])
    orders = np.arange(lowest, min(highest, lowest + _ORDERS - 1) + 1)
    points = np.tile([_middle(*ranges[name]) for name in names], (len(QUARTER_TURNS) * len(orders), 1))
    points[:, names.index("order")] = np.repeat(orders, len(QUARTER_TURNS))
    if "phase" in names:
        points[:, names.index("phase")] = np.tile(QUARTER_TURNS, len(orders))
    return points


def _middle(low: float, high: float) -> float:
    return float(np.sqrt(low * high)) if low > 0 else 0.5 * (low + high)


def _spread(ranges: Sequence[tuple[float, float]]) -> FloatArray:
    """Return starting values over the ranges: logarithmic where a range is positive and wide, a Sobol sequence over all of them."""
    if not ranges:
        return np.zeros((0, 0))
    count = 8 if len(ranges) > 1 else 3
    unit = qmc.Sobol(len(ranges), scramble=False).random(16)[1 : count + 1]
    columns = []
    for column, (low, high) in enumerate(ranges):
        share = unit[:, column]
        columns.append(low * (high / low) ** share if low > 0 and high > WIDE_RANGE * low else low + (high - low) * share)
    return np.stack(columns, axis=1)
