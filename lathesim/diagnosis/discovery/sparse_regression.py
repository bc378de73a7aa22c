"""What a mismatch outside the catalogue looks like as a formula: sparse regression of the missing signal on functions with units.

    missing(t) = sum_j c_j f_j(v, q, t)

Groups of functions are added one at a time, each time the one that explains most of the missing signal on the validation recording, as long
as it explains more. What the uncertain values can absorb (a friction absorbs what is linear in speed, a mass what goes with acceleration)
is taken out of both sides. The coefficients are then fitted together with those values by replaying the recording, and judged by replaying
the validation one: no derivative of noisy data decides. The formula is empirical and holds where the recording has been.
Source: Brunton, Proctor, Kutz, Discovering governing equations from data by sparse identification of nonlinear dynamical systems, PNAS
113 (2016), here with validation selection in place of a threshold.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import irfft, rfft
from scipy.signal import lombscargle

from lathesim.diagnosis.location import missing_signal
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted, Free, with_start
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import velocity_of
from lathesim.identification.replay.open_loop import seen
from lathesim.identification.replay.recorded_parts import SplineTerm
from lathesim.identification.signal import root_mean_square
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.sensor_sides import first_input


@dataclass(frozen=True)
class Addend:
    """One addend of a discovered formula: coefficient and its standard error [``unit``], the function's text and its unit in letters."""

    coefficient: float
    unit: str
    text: str
    error: float = 0.0
    of: str = "1"


@dataclass(frozen=True)
class Span:
    """The values [``unit``] of a letter (v, q, t) between which a formula was found."""

    letter: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class Discovered:
    """A formula for what is missing at ``at`` [``unit``]; ``share`` is how much of it the formula explains on the validation recording.

    ``role`` is the role of the port at ``at``; ``domain`` says where the recording has been; ``size`` is the root mean square of what is
    missing at the frequencies of the motion [``unit``], which may be far less than what is missing at all frequencies.
    """

    at: str
    unit: str
    addends: tuple[Addend, ...]
    share: float
    role: str = "effort"
    domain: tuple[Span, ...] = ()
    size: float = 0.0

    @property
    def formula(self) -> str:
        """The formula as text, with units and standard errors."""
        # the error to one digit that counts, written out: 10 and not 1e+01
        addends = [f"({item.coefficient:.4g} +- {float(f'{item.error:.1g}'):g} {item.unit}) {item.text}" for item in self.addends]
        return f"{' + '.join(addends)}  [{self.unit}]"


@dataclass(frozen=True)
class Column:
    """A function of the motion: its text, its unit in the letters of the motion (``v^2``), its values."""

    text: str
    unit: str
    values: Callable[[Mapping[str, FloatArray]], FloatArray]


def groups_of(motion: Mapping[str, FloatArray], signal: FloatArray) -> list[list[Column]]:
    """Return the groups of functions to be tried on a signal; those whose letters the motion has."""
    # a step at a reversal is smoothed over a share of the top speed
    slow = float(f"{0.02 * float(np.max(np.abs(motion['v']))) or 1.0:.3g}")
    simple = [
        Column("1.0", "1", lambda m: np.ones_like(m["t"])),
        Column("v", "v", lambda m: m["v"]),
        Column("v * abs(v)", "v^2", lambda m: m["v"] * np.abs(m["v"])),
        Column("v * v * v", "v^3", lambda m: m["v"] ** 3),
        Column("abs(v)", "v", lambda m: np.abs(m["v"])),
        Column("v * v", "v^2", lambda m: m["v"] ** 2),
        Column(f"tanh(v / {slow!r})", "1", lambda m: np.tanh(m["v"] / slow)),
        Column("q", "q", lambda m: m["q"]),
        Column("q * q", "q^2", lambda m: m["q"] ** 2),
        Column("q * q * q", "q^3", lambda m: m["q"] ** 3),
        Column("t", "t", lambda m: m["t"]),
        Column(f"q * tanh(v / {slow!r})", "q", lambda m: m["q"] * np.tanh(m["v"] / slow)),
        Column("q * v", "q*v", lambda m: m["q"] * m["v"]),
    ]
    groups = [[column] for column in simple]
    for letter in ("q", "t"):
        wave = strongest_wave(motion[letter], signal)
        if wave > 0.0:
            groups.append([_wave("sin", np.sin, wave, letter), _wave("cos", np.cos, wave, letter)])
    return groups


def _wave(name: str, function: Callable[[FloatArray], FloatArray], wave: float, letter: str) -> Column:
    return Column(f"{name}({wave!r} * {letter})", "1", lambda m: np.asarray(function(wave * m[letter])))


def strongest_wave(where: FloatArray, signal: FloatArray) -> float:
    """Return the angular frequency over ``where`` at which the signal is strongest [rad a unit], 0 where ``where`` does not move.

    Source: Lomb, Least-squares frequency analysis of unequally spaced data, Astrophysics and Space Science 39 (1976).
    """
    span = float(np.ptp(where))
    if span <= 0.0:
        return 0.0
    thin = slice(None, None, max(1, len(where) // 4000))
    frequencies = 2.0 * np.pi / span * np.geomspace(1.5, 150.0, 400)
    power = lombscargle(where[thin], signal[thin] - np.mean(signal[thin]), frequencies)
    best = int(np.argmax(power))
    finer = np.linspace(frequencies[max(best - 1, 0)], frequencies[min(best + 1, len(frequencies) - 1)], 41)
    power = lombscargle(where[thin], signal[thin] - np.mean(signal[thin]), finer)
    return float(f"{finer[int(np.argmax(power))]:.6g}")


_TERM = "discovered_term"
_MOST_COLUMNS = 8
"""Columns of a formula at most."""


@dataclass(frozen=True)
class _Draft:
    """A formula before it is replayed: where it belongs and its columns with their amounts."""

    row: int
    at: str
    unit: str
    columns: tuple[Column, ...]
    amounts: FloatArray
    share: float


def discover(
    experiment: Experiment, fitted: Fitted, validation: Experiment, judged: Fitted, method: Method = STANDARD
) -> Discovered | None:
    """Return a formula for the largest missing signal, or none where no function explains it on the validation recording.

    Recordings that were fitted together, or one that judges itself, leave none on which a formula could fail.
    """
    if validation is experiment:
        return None
    drafts = [
        draft
        for row in range(len(experiment.machine.compare))
        if (draft := _draft(experiment, fitted, validation, judged, row, method=method)) is not None
    ]
    for draft in sorted(drafts, key=lambda item: -item.share):
        found = _replayed(experiment, fitted, validation, judged, draft, method=method)
        if found is not None:
            return found
    return None


def _draft(
    experiment: Experiment, fitted: Fitted, validation: Experiment, judged: Fitted, row: int, method: Method = STANDARD
) -> _Draft | None:
    here, there = missing_signal(experiment, fitted, row), missing_signal(validation, judged, row)
    motion, other = _motion(experiment, here.at, row), _motion(validation, there.at, row)
    if motion is None or other is None or not np.any(there.values):
        return None
    band = experiment.sensed.noise_shapes(fitted.by_name)[row].band
    own = _absorbed(experiment, fitted, row, motion, band, method=method)
    signal, scored = _inner(here.values), _inner(there.values)
    taken = _columns(own, motion, band), _columns(own, other, band)
    groups = groups_of(motion, here.values)
    chosen: list[Column] = []
    best, amounts = 0.0, np.zeros(0)
    for _ in range(3):
        trials = []
        for group in groups:
            columns = [*chosen, *group]
            if len(columns) <= _MOST_COLUMNS:
                tried = _columns(columns, motion, band), _columns(columns, other, band)
                trials.append((*_explained(signal, scored, *tried, *taken), group))
        share, weights, group = max(trials, key=lambda trial: trial[0])
        if share < best + method.material:
            break
        best, amounts, chosen = share, weights, [*chosen, *group]
        groups = [left for left in groups if left is not group]
    return _Draft(row, here.at, here.unit, tuple(chosen), amounts, best) if chosen else None


def _motion(experiment: Experiment, at: str, row: int) -> dict[str, FloatArray] | None:
    """Return time, position, velocity and acceleration of the part where something is missing, none where nothing moves there."""
    period = experiment.machine.assembly.sample_period
    part = Place.of(at).part
    ports = next((item.component.ports for item in experiment.machine.assembly.parts if item.name == part), {})
    time = np.asarray(np.arange(experiment.sensed.samples) * period, dtype=np.float64)
    if "flow" in ports:
        motion = experiment.motion
        velocity = motion.get(f"{part}.{ports['flow']}")
        position = motion.get(f"{part}.{ports.get('displacement', '')}")
        if velocity is None:
            return None
        place = position if position is not None else np.asarray(np.cumsum(velocity) * period)
        return {"t": time, "v": velocity, "q": place, "a": velocity_of(velocity, period)}
    if experiment.sensed.plan.unit(experiment.sensed.channels[row]) not in ("m", "rad"):
        return None
    values = np.nan_to_num(experiment.sensed.recorded[row])
    rate = velocity_of(values, period)
    return {"t": time, "q": values, "v": rate, "a": velocity_of(rate, period)}


def _absorbed(
    experiment: Experiment, fitted: Fitted, row: int, motion: Mapping[str, FloatArray], band: int, method: Method = STANDARD
) -> list[Column]:
    """Return what the fitted values of the machine take up anyway, of speed and acceleration."""
    if fitted.sensitivity is None or not len(fitted.free):
        return []
    changed = [_inner(missing_signal(experiment, replace(fitted, residual=slope), row).values) for slope in fitted.sensitivity]
    space = np.stack([item / max(float(np.sqrt(item @ item)), 1e-300) for item in changed], axis=1)
    found = []
    for column in (Column("v", "v", lambda m: m["v"]), Column("a", "a", lambda m: m["a"])):
        values = _columns([column], motion, band)[:, 0]
        left = values - space @ np.linalg.lstsq(space, values, rcond=1e-8)[0]
        if float(left @ left) < (1.0 - method.nearly_all) * float(values @ values):
            found.append(column)
    return found


def _explained(
    signal: FloatArray, scored: FloatArray, here: FloatArray, there: FloatArray, own_here: FloatArray, own_there: FloatArray
) -> tuple[float, FloatArray]:
    """Return the share of ``scored`` that columns fitted to ``signal`` explain beside the machine's own columns, and their amounts."""
    both = np.hstack([here, own_here])
    scale = np.maximum(np.sqrt(np.mean(both**2, axis=0)), 1e-300)
    amounts = (np.linalg.lstsq(both / scale, signal, rcond=1e-8)[0] / scale)[: here.shape[1]]
    basis = np.linalg.qr(own_there)[0] if own_there.shape[1] else np.zeros((len(scored), 0))
    off = scored - there @ amounts
    off, whole = (values - basis @ (basis.T @ values) for values in (off, scored))
    power = float(whole @ whole)
    return (1.0 - float(off @ off) / power if power > 0.0 else 0.0), amounts


def _columns(columns: Sequence[Column], motion: Mapping[str, FloatArray], band: int) -> FloatArray:
    """Return columns (samples, columns) in the band of the motion, without the ends."""
    if not columns:
        return np.zeros((len(_inner(motion["t"])), 0))
    return np.stack([_inner(_in_band(column.values(motion), band)) for column in columns], axis=1)


def _in_band(values: FloatArray, band: int) -> FloatArray:
    transformed = rfft(values)
    transformed[band:] = 0.0
    return np.asarray(irfft(transformed, n=len(values)))


def _inner(values: FloatArray) -> FloatArray:
    # the missing force is tapered at either end
    cut = int(0.06 * len(values))
    return values[cut : len(values) - cut]


def _replayed(
    experiment: Experiment, fitted: Fitted, validation: Experiment, judged: Fitted, draft: _Draft, method: Method = STANDARD
) -> Discovered | None:
    """Return the formula with its amounts fitted by replaying, with all else that is free, and judged on the validation recording."""
    motion, other = _motion(experiment, draft.at, draft.row), _motion(validation, draft.at, draft.row)
    assert motion is not None
    assert other is not None
    sizes = [max(float(np.sqrt(np.mean(column.values(motion) ** 2))), 1e-300) for column in draft.columns]
    both = ((experiment, motion), (validation, other))
    first, second = (replace(item, with_candidates=_with_term(item.with_candidates, draft, moved, sizes)) for item, moved in both)
    names = [f"{_TERM}.weight_{number}" for number in range(len(draft.columns))]
    starts = [float(amount * size) for amount, size in zip(draft.amounts, sizes, strict=True)]
    weights = [Free(name, start, max(abs(start), 1e-12)) for name, start in zip(names, starts, strict=True)]
    found = fit(first.sensed, [*with_start(fitted), *weights], fitted.constant, rounds=2)
    sure = [abs(found.by_name[name]) > method.errors * found.error(name) for name in names]
    if not any(sure):
        return None
    if not all(sure):
        # what the machine's own values or the other addends explain as well is no part of the formula
        kept = [number for number, keeps in enumerate(sure) if keeps]
        fewer = replace(draft, columns=tuple(draft.columns[number] for number in kept), amounts=draft.amounts[kept])
        return _replayed(experiment, fitted, validation, judged, fewer, method=method)
    share = _share_of_formula(validation, judged, second, found, names, draft.row)
    if share < method.material:
        return None
    addends = tuple(
        Addend(found.by_name[name] / size, _unit_over(draft.unit, column.unit), column.text, found.error(name) / size, column.unit)
        for name, size, column in zip(names, sizes, draft.columns, strict=True)
    )
    size = root_mean_square(missing_signal(validation, judged, draft.row).values)
    role = next((role for role, port in experiment.machine.assembly.ports(draft.at).items() if port == Place.of(draft.at).port), "")
    return Discovered(draft.at, draft.unit, addends, share, role, _domain(draft, motion), size)


def _share_of_formula(validation: Experiment, judged: Fitted, second: Experiment, found: Fitted, names: Sequence[str], row: int) -> float:
    """Return the share of what is left that a formula explains itself on the validation recording: ``second`` is that with its addends,
    whose amounts have the ``names``. Other values of the machine may explain as well, and do so without it."""
    own = {item.name for item in judged.free}
    values = {name: value for name, value in found.by_name.items() if name not in own}
    held, without = (fit(second.sensed, with_start(judged), {**values, **less}, rounds=2) for less in ({}, dict.fromkeys(names, 0.0)))
    pairs = ((validation, judged), (second, without), (second, held))
    *before, after = (float(np.sum(_inner(missing_signal(one, by, row).values) ** 2)) for one, by in pairs)
    return 1.0 - after / max(min(before), 1e-300)


def _domain(draft: _Draft, motion: Mapping[str, FloatArray]) -> tuple[Span, ...]:
    """Return the range of each variable of a draft in the recording: the formula says nothing beyond it."""
    used = set(re.findall(r"\b[vqt]\b", " ".join(column.text for column in draft.columns)))
    length = "rad" if draft.unit in ("N*m", "rad") else "m"
    units = {"v": f"{length}/s", "q": length, "t": "s"}
    ends = {name: (float(np.min(motion[name])), float(np.max(motion[name]))) for name in units if name in used}
    return tuple(Span(name, units[name], *span) for name, span in ends.items())


def _with_term(assembly: Assembly, draft: _Draft, motion: Mapping[str, FloatArray], sizes: Sequence[float]) -> Machinery:
    """Return the assembly with the draft's columns, each of root mean square one, added where something is missing."""
    table = np.zeros((len(motion["t"]), _MOST_COLUMNS))
    for number, (column, size) in enumerate(zip(draft.columns, sizes, strict=True)):
        values = column.values(motion) / size
        # a row holds over its sample: the value in its middle
        table[:, number] = 0.5 * (values + np.append(values[1:], values[-1]))
    seen_as = dict(assembly.seen_as) if isinstance(assembly, Machinery) else {}
    wires, declared = dict(assembly.wired), assembly.declared(draft.at)
    if declared.kind == "output":
        wires[f"{_TERM}.incoming"] = Wire(f"{_TERM}.incoming", seen(assembly, draft.at))
        seen_as[draft.at] = f"{_TERM}.outgoing"
    else:
        target = first_input(assembly.by_name, wires, draft.at)
        feeding = wires.get(target) or Wire(target, constant=float(getattr(declared, "default", 0.0) or 0.0))
        wires[f"{_TERM}.incoming"] = replace(feeding, target=f"{_TERM}.incoming")
        wires[target] = Wire(target, f"{_TERM}.outgoing")
    candidate = Part(_TERM, SplineTerm.with_units({"signal": declared.unit}), tables={"basis": table})
    known = {key: getattr(assembly, key) for key in ("sample_period", "step", "finish", "record")}
    return Machinery((*assembly.parts, candidate), tuple(wires.values()), **known, seen_as=seen_as)


def _unit_over(unit: str, of: str) -> str:
    """Return the unit of a coefficient: that of the missing signal over that of the function, in m or rad."""
    length = "rad" if unit in ("N*m", "rad") else "m"
    units = {"1": "", "v": f"({length}/s)", "v^2": f"({length}/s)^2", "v^3": f"({length}/s)^3"}
    units |= {"q": length, "q^2": f"{length}^2", "q^3": f"{length}^3", "t": "s", "q*v": f"({length}^2/s)"}
    return f"{unit}/{units[of]}" if units[of] else unit
