"""How a controller stood when a recording began in the middle of a motion: what its integral held, what it had measured before.

A replay gives a controller all that was recorded of its inputs, but not what it remembers of the time before. What it remembers, c, moves
its command from there on,

    u_k = u_0,k + sum_j c_j du_k/dc_j,

and with no physics between inputs and command nothing else does, so least squares give c. Where the recording began at rest there is
nothing to remember, and the command follows as it is. Source: Ljung, System Identification, 2nd ed. 1999, section 4.3 (the initial state as
a parameter).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.component import DiscreteState, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, of_part
from lathesim.identification.replay.simulator import Simulator
from lathesim.identification.roles import decides, start_values
from lathesim.identification.signal import LARGER_PART, ROUNDING, SLOPE_ROUNDING, root_mean_square

_LITTLE = 0.01
"""Share of a command below which it follows from its controller without any memory, and by which a memory is moved to be seen."""
_STEPS = 10.0 ** np.arange(-6.0, 0.0)
"""By how much a memory is moved for its slope, from a micrometre and a microvolt on: the least that shows beyond a converter's steps."""
_BEGINNING, _FEWEST = 0.1, 200
"""Share of a recording, and samples at the least, in which the memory is looked for."""
_TIMES = 3


def remembered_at_start(assembly: Assembly, compared: Sequence[str], replay: Simulator) -> dict[str, float]:
    """Return what the controllers remember at the first sample whose commands are compared, or what a drive makes of them: ``part.name`` ->
    value [SI]; nothing where these follow without, or do not follow with it either."""
    found: dict[str, float] = {}
    for part in assembly.parts:
        if decides(part.component) and "displacement" not in part.component.ports:
            for row in shown_by(assembly, part, compared)[:1]:
                found |= _memory(part, row, _start_speeds(assembly, part, compared, replay), replay)
    return found


def shown_by(assembly: Assembly, controller: Part, compared: Sequence[str]) -> list[int]:
    """Return the compared channels (rows) that show the command of a controller: its own, or those of what passes it on to a part that
    moves, as a converter's voltage or a drive's current; the nearest first."""
    rows: list[int] = []
    waiting, seen = [controller.name], {controller.name}
    while waiting:
        name = waiting.pop(0)
        rows += [row for row, channel in enumerate(compared) if Place.of(channel).part == name]
        for wire in assembly.wires:
            target, port = Place.of(wire.target)
            ports = assembly.ports(target)
            passed_on = Place.of(wire.source).part == name and port == ports.get("drive") and "effort" not in ports
            if passed_on and target not in seen and ports.get("measured") in (None, port):
                seen.add(target)
                waiting.append(target)
    return rows


def _start_speeds(assembly: Assembly, part: Part, compared: Sequence[str], replay: Simulator) -> dict[str, float]:
    """Return the speeds before the first sample that a controller can be told, as the first two samples of what it measures show them.

    Without them the command may begin at its limit, where it answers to nothing.
    """
    measured = f"{part.name}.{part.component.ports['measured']}"
    source = assembly.sources.get(measured, "")
    if source not in compared:
        return {}
    first, second = np.nan_to_num(replay.recorded[compared.index(source)][:2])
    speed = float(second - first) / assembly.sample_period
    unit = assembly.declared(measured).unit
    declared = part.component.declared(Parameter)
    return {f"{part.name}.{name}": speed for name in start_values(part.component) if declared[name].unit == f"{unit}/s"}


def with_memory(assembly: Assembly, memory: dict[str, float]) -> Assembly:
    """Return the assembly whose controllers remember it."""
    parts = []
    for part in assembly.parts:
        own = of_part(part.name, memory)
        parameters = {name: value for name, value in own.items() if name in part.component.declared(Parameter)}
        start = {name: value for name, value in own.items() if name not in parameters}
        parts.append(replace(part, parameters={**part.parameters, **parameters}, start={**part.start, **start}) if own else part)
    return replace(assembly, parts=tuple(parts))


def _memory(part: Part, row: int, speeds: Mapping[str, float], replay: Simulator) -> dict[str, float]:
    """Return what one controller remembers, from its command (``row``); ``speeds`` are first guesses."""
    plan = replay.plan
    memories = [f"{part.name}.{name}" for name in part.component.declared(DiscreteState)]
    memories += [f"{part.name}.{name}" for name in start_values(part.component)]
    memories = [name for name in memories if name in plan.discrete or name in plan.parameters]
    if not memories:
        return {}
    size = float(np.std(np.nan_to_num(replay.recorded[row])))
    # later on an integral holds what rounding added up to as well
    begins = max(_FEWEST, int(_BEGINNING * replay.samples))
    given = np.array([plan.values[name] if name in plan.discrete else replay.given(name) for name in memories])

    def left(values: FloatArray) -> FloatArray:
        """Return what of the command does not follow at first, (runs, samples), with some rows of memories."""
        found: FloatArray = np.nan_to_num(np.array([run[row, :begins] for run in replay.residuals(memories, values)]))
        return found

    before = left(given[None])[0]
    if root_mean_square(before) < _LITTLE * size:
        return {}
    values = np.array([speeds.get(name, value) for name, value in zip(memories, given, strict=True)])
    values, best = _fitted(left, values, _LITTLE * size)
    kept = root_mean_square(best) < LARGER_PART * root_mean_square(before)
    return {name: float(value) for name, value, old in zip(memories, values, given, strict=True) if value != old} if kept else {}


def _fitted(left: Callable[[FloatArray], FloatArray], start: FloatArray, least: float) -> tuple[FloatArray, FloatArray]:
    """Return the memories with which least of a command is left, and that, by least squares along the directions that it shows."""
    from scipy.optimize import least_squares

    def slopes(values: FloatArray) -> FloatArray:
        """Return d left / d memory, (memories, samples), of one batch: by the first step that moves it by ``least``, or the largest."""
        moves = [values, *(values + step * one for one in np.eye(len(values)) for step in _STEPS)]
        here, moved = np.split(left(np.array(moves)), [1])
        moved = moved.reshape(len(values), len(_STEPS), -1) - here
        shown = np.abs(moved).max(axis=2) >= least
        step = np.where(shown.any(axis=1), shown.argmax(axis=1), len(_STEPS) - 1)
        return np.asarray(moved[np.arange(len(values)), step] / _STEPS[step][:, None])

    first, best = slopes(start), left(start[None])[0]
    scale = np.abs(first).max(axis=1, keepdims=True)
    answers = (scale > SLOPE_ROUNDING * scale.max(initial=0.0))[:, 0]
    _, sizes, turned = np.linalg.svd((first[answers] / scale[answers]).T, full_matrices=False)
    shown = np.square(sizes) > ROUNDING * np.square(sizes.max(initial=0.0))
    directions = np.zeros((np.count_nonzero(shown), len(start)))
    directions[:, answers] = turned[shown] / sizes[shown, None] / scale[answers, 0]
    unit = float(np.linalg.norm(best))
    if not len(directions) or unit == 0.0:
        return start, best
    end = least_squares(
        lambda place: left((start + unit * place @ directions)[None])[0] / unit,
        np.zeros(len(directions)),
        lambda place: (directions @ (slopes(start + unit * place @ directions) if place.any() else first)).T,
        max_nfev=_TIMES + 1,
    )
    return start + unit * end.x @ directions, unit * end.fun
