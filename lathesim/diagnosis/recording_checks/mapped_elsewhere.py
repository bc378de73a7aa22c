"""Columns that belong elsewhere than the lesson maps them: behind a converter, in counts, with the other sign, some rows later.

A converter leaves what lies on its levels as it is. A column that its law does not change was recorded behind it, whatever the lesson says.
Where a column would have to be rounded first to be what the replayed converter gives, it was recorded before it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from lathesim.component import DiscreteState, Law, Output
from lathesim.diagnosis.method.method import MOST_SHIFTED, STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import share_with, unexplained_share
from lathesim.engine.assembly import FloatArray, Part, Place
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import decides
from lathesim.identification.signal import FEWEST_LEVELS, OFF_GRID, SETTLING, grid_spacing, late, root_mean_square, smallest_step


def mapped_elsewhere(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where a column is of another place than the lesson maps it to; empty where none is."""
    simulated = np.nan_to_num(experiment.sensed.recorded - experiment.sensed.one(values)) if experiment.machine.replay else None
    return (
        _behind_converter(experiment)
        or (_before_converter(experiment, simulated, method) if simulated is not None else "")
        or _in_counts(experiment, method)
        or (_turned_round(experiment, simulated, method) if simulated is not None else "")
        or (_rows_shifted(experiment, values, method) if simulated is not None else "")
    )


def _converters(experiment: Experiment) -> Iterator[tuple[Part, str, str, Callable[[FloatArray], FloatArray]]]:
    """Return the parts that round what arrives and do nothing else: part, what feeds it, what it gives, and its law for many values."""
    sources = experiment.machine.assembly.sources
    for part in experiment.machine.assembly.parts:
        ports = part.component.ports
        if not decides(part.component) or ports["drive"] != ports["measured"] or len(part.component.declared(DiscreteState)) != 1:
            continue
        update, arguments = part.component.laws["update"], part.component.arguments["update"]
        known = {name: value for name, value in part.values.items() if name in arguments}
        # a range that another part sets is not known here
        if set(arguments) != {ports["drive"], *known} or any(f"{part.name}.{name}" in sources for name in known):
            continue

        law = functools.partial(_rounded, update, ports["drive"], known)
        yield part, sources.get(f"{part.name}.{ports['drive']}", ""), f"{part.name}.{ports['reading']}", law


def _rounded(update: Law, name: str, known: Mapping[str, float], column: FloatArray) -> FloatArray:
    """Return what the law of a converter makes of a column (samples,)."""
    different, places = np.unique(column, return_inverse=True)
    return np.array([update(**{name: float(value)}, **known) for value in different], dtype=float)[places]


def _is_finer(law: Callable[[FloatArray], FloatArray], column: FloatArray) -> bool:
    """Return whether a converter's levels lie closer than the values of a column: then it leaves any such column as it is.

    That is asked between the values, which a converter takes: beyond its range each of them gives its last level.
    """
    different = np.unique(column)
    gap = float(np.min(np.diff(different)))
    between = different[:-1] + gap / math.e  # no simple fraction of a step
    return bool(np.max(np.abs(law(between) - between)) < OFF_GRID * gap)


def _behind_converter(experiment: Experiment) -> str:
    for part, before, behind, law in _converters(experiment):
        if before not in experiment.machine.compare:
            continue
        column = np.nan_to_num(experiment.record[before])
        rounded = law(column)
        levels = np.unique(rounded)
        if len(levels) < FEWEST_LEVELS or _is_finer(law, column):
            continue
        if np.max(np.abs(rounded - column)) < OFF_GRID * float(np.min(np.diff(levels))):
            return (
                f"{before} holds only the levels of {part.name}: the column was recorded behind that converter. "
                f"Compare {behind} with it, and leave {before} out."
            )
    return ""


def _before_converter(experiment: Experiment, simulated: FloatArray, method: Method) -> str:
    for part, before, behind, law in _converters(experiment):
        if behind not in experiment.machine.compare or not before:
            continue
        row = experiment.machine.compare.index(behind)
        begin = int(SETTLING * experiment.sensed.samples)
        column, replayed = np.nan_to_num(experiment.record[behind])[begin:], simulated[row][begin:]
        rounded = law(column)
        levels = np.unique(rounded)
        if len(levels) < FEWEST_LEVELS:
            continue
        step = float(np.min(np.diff(levels)))
        off = float(np.mean(np.abs(rounded - column) > OFF_GRID * step))
        if off > method.nearly_all and float(np.mean(np.abs(rounded - replayed) < OFF_GRID * step)) > method.nearly_all:
            return (
                f"{behind} holds what lies between the levels of {part.name}: the column was recorded before that converter. "
                f"Compare {before} with it, and leave {behind} out."
            )
    return ""


def _in_counts(experiment: Experiment, method: Method) -> str:
    """Return the sentence for a reading of whole numbers which, worth a count each, spans as much as the command that it follows."""
    for name in experiment.machine.compare:
        part = experiment.machine.assembly.by_name[Place.of(name).part]
        ports = part.component.ports
        if Place.of(name).port != ports.get("reading") or "resolution" not in ports:
            continue
        count = experiment.machine.resolution.get(name, 0.0) or part.value(ports["resolution"])
        column = np.nan_to_num(experiment.record[name])
        spacing = smallest_step(column) or grid_spacing(column)
        unit = part.component.declared(Output)[ports["reading"]].unit
        followed = [experiment.record[target] for target in experiment.machine.drive if experiment.record.unit(target) == unit]
        if not count or not spacing or spacing < count / OFF_GRID or not followed:
            continue
        span, asked = float(np.ptp(column)) * count / spacing, max(float(np.ptp(np.nan_to_num(one))) for one in followed)
        if asked / method.alike < span < method.alike * asked:
            return f"{name} holds whole counts of the encoder, each worth {count:.4g} {unit}. Write unit: counts for its column."
    return ""


def _turned_round(experiment: Experiment, simulated: FloatArray, method: Method) -> str:
    """Return the sentence for the one channel that is what the machine makes, with the other sign: no physics turns a sign round."""
    begin = int(SETTLING * experiment.sensed.samples)
    rows = zip(np.nan_to_num(experiment.sensed.recorded)[:, begin:], simulated[:, begin:], strict=True)
    turned = [name for name, pair in zip(experiment.machine.compare, rows, strict=True) if has_other_sign(*pair, method)]
    if len(turned) != 1:
        return ""
    return f"{turned[0]} has the other sign than what the machine makes. Write scale: -1 for its column."


def has_other_sign(recorded: FloatArray, made: FloatArray, method: Method = STANDARD) -> bool:
    """Return whether a recorded channel (samples,) is what the machine makes times a negative factor, but for a small part.

    A place that an open loop integrates drifts. Where a channel stands and how it drifts tells no sign, so a straight line is taken away.
    """
    one, other = _motions(recorded, made)
    factor = float(one @ other) / max(float(other @ other), 1e-300)
    return factor < 0.0 and root_mean_square(one - factor * other) < method.little * root_mean_square(one)


def against_the_machine(experiments: Sequence[Experiment], values: Mapping[str, float], method: Method = STANDARD) -> list[str]:
    """Return the channels that move against the simulated ones on every recording, the clearest first: they may have the other sign.

    r^2 > little and r < 0, with r the correlation of both without a straight line. What the lesson left out may do the same.
    """
    found: dict[str, float] = {}
    for row, name in enumerate(experiments[0].machine.compare):
        alike = [_correlation(experiment, values, row) for experiment in experiments]
        if max(alike) < -math.sqrt(method.little):
            found[name] = max(alike)
    return sorted(found, key=lambda name: found[name])


def _correlation(experiment: Experiment, values: Mapping[str, float], row: int) -> float:
    """Return how alike a recorded channel and the simulated one move, -1 to 1."""
    recorded = np.nan_to_num(experiment.sensed.recorded[row])
    simulated = recorded - np.nan_to_num(experiment.sensed.one(values)[row])
    begin = int(SETTLING * experiment.sensed.samples)
    one, other = _motions(recorded[begin:], simulated[begin:])
    return float(one @ other) / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-300)


def _motions(*channels: FloatArray) -> list[FloatArray]:
    """Return channels (samples,) without a straight line each."""
    from scipy.signal import detrend

    return [detrend(channel) for channel in channels]


def _rows_shifted(experiment: Experiment, values: Mapping[str, float], method: Method) -> str:
    """Return the sentence for a column that was written some whole rows late or early: a command is arithmetic, and follows from what its
    controller was given with that column moved, be it the command itself."""
    wires = experiment.machine.assembly.sources
    for row, share in unexplained_share(experiment, values):
        command = experiment.machine.compare[row]
        controller = Place.of(command).part
        targets = [name for name in dict.fromkeys((*experiment.machine.drive, *wires)) if Place.of(name).part == controller]
        fed = dict.fromkeys(name for target in targets for name in (target, wires.get(target, "")) if name in experiment.record)
        if not method.recordings.command_floor < share:
            continue
        shifts = [(name, rows) for name in (command, *fed) for rows in range(-MOST_SHIFTED, MOST_SHIFTED + 1) if rows]
        # a column that is moved ends where nothing was recorded: a derivative makes a large command of that
        left = {
            (name, by): share_with(experiment, name, late(experiment.record[name], -by), row, values, MOST_SHIFTED) for name, by in shifts
        }
        best = min(left, key=lambda one: left[one], default=None)
        if best is not None and left[best] < method.little * share:
            name, rows = best
            how, period = ("late", "earlier") if rows > 0 else ("early", "later"), 1e3 * experiment.machine.assembly.sample_period
            number = f"{abs(rows)} sample{'s' if abs(rows) > 1 else ''}"
            return (
                f"{name} is {number} ({abs(rows) * period:.3g} ms) {how[0]}: with its rows moved {how[1]} by that {command} follows from "
                f"what its controller was given, as recorded {share:.1%} of it does not (ChannelTimeShift)."
            )
    return ""
