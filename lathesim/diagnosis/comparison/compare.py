"""``compare``: a recording held against the simulation of a lesson, without a search: how far off, where, on what it depends.

Three views side by side. The lesson's own simulation, in which only the driven inputs are recorded: what a user sees, and what a
controller may hide. The replay, in which every part gets what was recorded of its inputs: where the mismatch sits. And the flexible
explanation of what is missing there: on what it depends. Only the starting values of the replay are fitted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import known_share
from lathesim.diagnosis.explanations.conditions import Term, at_one_speed
from lathesim.diagnosis.explanations.lacking_force import lacking, quiet_every
from lathesim.diagnosis.explanations.of_recording import conditions_of, of_channels
from lathesim.diagnosis.location import FORCES, missing_share, missing_signal, places
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.checks import CHECKS_OF_RECORDINGS, found_by
from lathesim.diagnosis.recording_checks.wrong_readings import sensor_zeros
from lathesim.diagnosis.records.shown import Shown
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment, RecordedMachine
from lathesim.identification.replay.loading import Recorded, read_for
from lathesim.identification.replay.simulator import LOST
from lathesim.identification.replay.validation_split import parted
from lathesim.identification.signal import SETTLING
from lathesim.json_text import eight_digits
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry
from lathesim.units import convertible

SCHEMA = "lathesim-compare/1"


@dataclass(frozen=True)
class ChannelResidual:
    """A channel in the lesson's own simulation: recorded and simulated (samples,) [``unit``], and how far they are apart.

    ``rms`` is taken after the settling of the start; ``worst`` is the stretch of time [s] in which the residual is largest.
    """

    channel: str
    unit: str
    floor: float
    rms: float
    worst: tuple[float, float]
    time: FloatArray
    recorded: FloatArray
    simulated: FloatArray

    @property
    def over_floor(self) -> float:
        """Root mean square of the residual, in floors."""
        return self.rms / self.floor

    @property
    def is_empty(self) -> bool:
        """Whether nothing was recorded."""
        return not np.isfinite(self.recorded).any()

    @property
    def is_lost(self) -> bool:
        """Whether the simulation diverged."""
        return not (np.isfinite(self.simulated).all() and self.over_floor < LOST) and not self.is_empty

    @property
    def residual(self) -> FloatArray:
        """Recorded minus simulated."""
        return self.recorded - self.simulated


@dataclass(frozen=True)
class Replayed:
    """A channel in the replay: how far off it is, the parts whose laws make it, and what is missing there [``unit``].

    ``share`` is the size of what is missing as a share of what acts there. Both are NaN where the noise of the reading would be as large.
    """

    channel: str
    parts: tuple[str, ...]
    over_floor: float
    at: str
    unit: str
    missing: float
    share: float


@dataclass(frozen=True)
class Dependence:
    """The share of what is missing behind a channel [``unit``] that a variable explains beside those before it, learned on one part and
    scored on the other; ``size`` is the root mean square of what it explains. A wave over the variable says its period."""

    channel: str
    unit: str
    term: Term
    share: float
    size: float
    or_else: str = ""
    """What else a wave may be over, where the motion does not tell."""

    @property
    def variable(self) -> str:
        """What it is a function of."""
        return f"{self.term.variable}{self.or_else}"


@dataclass(frozen=True)
class Comparison:
    """A recording against the simulation of a lesson, each list with the worst first."""

    lesson: str
    recording: str
    samples: int
    period: float
    channels: tuple[ChannelResidual, ...]
    replayed: tuple[Replayed, ...]
    depends_on: tuple[Dependence, ...]
    findings: tuple[str, ...]
    faults: tuple[str, ...] = ()
    """What makes the recording unfit to say anything of the machine; each is among the findings too."""
    method: Method = STANDARD

    @property
    def off(self) -> float:
        """Noise floors above which a channel, or a part in the replay, counts as off."""
        return self.method.errors

    @property
    def suspects(self) -> tuple[str, ...]:
        """The parts that the replay turns red, that in which most of what acts is missing first."""
        found: list[str] = []
        for item in self._off:
            part = next((part for part in item.parts if Place.of(item.at).part == part), item.parts[0])
            found.append(self._read_by(part) or part)
        return tuple(dict.fromkeys(found))

    @property
    def suspect(self) -> str:
        """The first of these, empty where no part is off."""
        return next(iter(self.suspects), "")

    @property
    def explained_by(self) -> tuple[Dependence, ...]:
        """What the mismatch depends on, where there is one in some part."""
        shown = [item for item in self.depends_on if item.share > Shown.least_bar]
        return tuple(shown[: Shown.most_bars]) if self.suspects else ()

    @property
    def _off(self) -> list[Replayed]:
        far = [item for item in self.replayed if item.over_floor > self.off and item.parts]
        return [item for item in far if item.unit not in FORCES or not item.share < self.method.within_laws]

    @property
    def within_floors(self) -> bool:
        """Whether the lesson's own simulation is hardly off in any channel."""
        return all(item.over_floor <= self.off for item in self.channels)

    @property
    def adds_up(self) -> bool:
        """Whether a channel is off though no part is: what is next to nothing in each of them adds up where nothing recorded holds it."""
        return not self.suspects and any(item.over_floor > self.off for item in self.channels)

    def _read_by(self, part: str) -> str:
        """Return what several readings of one sensor have in common where they are off: what they measure."""
        before = [item.parts[1:2] for item in self._off if item.parts[0] == Place.of(item.at).part == part]
        return before[0][0] if len(before) > 1 and before[0] and all(parts == before[0] for parts in before) else ""


def load_recording(lesson: Lesson, file: Path, registry: Registry, variant: str | None = None) -> tuple[RecordedMachine, Recorded]:
    """Return the machine of a lesson and a recording of it; raises what ``load_case`` raises, but asks for no uncertainties."""
    return read_for(prepare(lesson, registry, variant), file, registry)


def compare(lesson: str, machine: RecordedMachine, recorded: Recorded, method: Method = STANDARD) -> Comparison:
    """Return the comparison of a recording with a machine."""
    first, second, experiment = parted(machine, recorded.name, recorded.record, ())
    fitted, *pieces = [_started(item) for item in (experiment, first, second)]
    channels, replayed = _channels(experiment, fitted), _replayed(experiment, fitted, method=method)
    faults = (*(str(item) for item in recorded.faults), *(str(item) for item in found_by(CHECKS_OF_RECORDINGS, [(experiment, {})], method)))
    findings = (*(str(item) for item in recorded.findings), *sensor_zeros(experiment, method=method), *faults)
    findings = (*findings, *(_lost(item) for item in channels if item.is_lost))
    return Comparison(
        lesson,
        recorded.name,
        len(recorded.record),
        recorded.record.sample_period,
        tuple(sorted(channels, key=lambda item: -item.over_floor)),
        replayed,
        _depends_on((first, second), pieces, replayed, method),
        tuple(dict.fromkeys(findings)),
        faults,
        method,
    )


def _started(experiment: Experiment) -> Fitted:
    """Return the replay from the start that leaves least, in floors: that which the recording shows, at rest or not, or one fitted to it.

    Where nothing feeds back a fit that allows for forces hardly knows how fast a table started, and that would show as an error.
    """
    shown = experiment.start_states(experiment.sensed.plan)
    plan = experiment.sensed.plan
    moving = {item.name for item in shown if any(convertible(plan.unit(item.name), unit) for unit in ("m/s", "rad/s"))}
    rest = [replace(item, start=experiment.sensed.given(item.name)) if item.name in moving else item for item in shown]
    tried = [fit(experiment.sensed, starts, rounds=0) for starts in (rest, shown)]
    tried.append(fit(experiment.sensed, shown, rounds=2, iterations=6, slopes="kept"))
    return min(tried, key=lambda fitted: float(np.sum((fitted.residual / experiment.sensed.seen_floors[:, None]) ** 2)))


def _channels(experiment: Experiment, fitted: Fitted) -> list[ChannelResidual]:
    """Return each channel of the recording beside the lesson's own simulation from the fitted start."""
    names = [name for name in fitted.by_name if name in experiment.own.plan.states]
    simulated = experiment.sensed.from_zero_of(experiment.own.outputs(names, np.array([[fitted.by_name[name] for name in names]]))[0])
    begin = int(SETTLING * experiment.own.samples)
    time = experiment.record.time
    found = []
    for row, channel in enumerate(experiment.machine.compare):
        recorded = experiment.own.recorded[row]
        residual = (recorded - simulated[row])[begin:]
        unit = experiment.own.plan.unit(experiment.own.channels[row])
        worst = _worst_stretch(time[begin:], residual)
        found.append(ChannelResidual(channel, unit, experiment.floors[channel], _rms(residual), worst, time, recorded, simulated[row]))
    return found


def _lost(item: ChannelResidual) -> str:
    if np.isfinite(item.simulated).all() and float(np.ptp(item.recorded)) == 0.0:
        return f"{item.channel}: the recording stands still and the simulation moves; map another column, or leave this one out."
    fact = f"{item.channel}: the lesson's own simulation diverges with these inputs"
    return f"{fact}; check the units and scales of the driven inputs, the gains and the step."


def _worst_stretch(time: FloatArray, residual: FloatArray) -> tuple[float, float]:
    """Return the fiftieth of a recording in which the residual's mean square is largest."""
    width = max(1, len(residual) // Shown.windows)
    count = len(residual) // width
    power = np.where(np.isfinite(residual), residual**2, 0.0)[: count * width].reshape(count, width).mean(axis=1)
    place = int(np.argmax(power)) * width
    return float(time[place]), float(time[min(place + width, len(time) - 1)])


def _rms(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else math.nan


def _replayed(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> tuple[Replayed, ...]:
    rows = {name: row for row, name in enumerate(experiment.machine.compare)}
    drawn = np.random.Generator(np.random.Philox(0)).standard_normal(fitted.residual.shape)
    noise = replace(fitted, residual=experiment.sensed.seen_floors[:, None] * drawn)
    found = []
    for place in places(experiment, fitted):
        row = rows[place.channel]
        missing = missing_signal(experiment, fitted, row)
        share, total = missing_share(experiment, fitted, row)
        size = _rms(missing.values)
        if not missing.mean_is_known and not (
            known_share(share) == share and size > method.errors * _rms(missing_signal(experiment, noise, row).values)
        ):
            force, swamp = (lacking(experiment, one, row).values for one in (fitted, noise))
            size, share = _quiet_force(force, swamp, total, method)
        found.append(Replayed(place.channel, place.parts, place.over_floor, missing.at, missing.unit, size, share))
    near = method.errors
    return tuple(sorted(found, key=lambda item: (item.over_floor <= near, -item.share if math.isfinite(item.share) else 0.0)))


def _quiet_force(force: FloatArray, noise: FloatArray, total: FloatArray, method: Method, fewest: int = 20) -> tuple[float, float]:
    """Return the root mean square of a force (samples,), averaged until that of the ``noise`` of its reading is little beside it, and its
    share of the ``total``; NaN where fewer than the ``fewest`` means would be left."""
    every = quiet_every(force)
    while len(force) >= fewest * every:
        means = [values[: len(values) // every * every].reshape(-1, every).mean(axis=1) for values in (force, noise, total)]
        size, swamped, acts = map(_rms, means)
        if size > method.errors * swamped:
            return size, size / acts if acts > 0.0 else math.inf
        every *= 2
    return math.nan, math.nan


def _depends_on(
    experiments: tuple[Experiment, Experiment], fits: Sequence[Fitted], replayed: Sequence[Replayed], method: Method
) -> tuple[Dependence, ...]:
    """Return what the flexible explanation makes of what is missing behind each channel that is off, the largest share first."""
    if any(item.over_floor >= LOST for item in replayed):
        return ()  # numbers without bound depend on nothing
    off = [item.channel for item in replayed if item.over_floor > method.errors]
    try:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            made = of_channels(experiments[0], fits[0], experiments[1], fits[1], off)
    except np.linalg.LinAlgError:  # damaged numbers, 1e-300 beside 1e300, explain nothing
        return ()
    judging = conditions_of(experiments[1])
    found = [
        Dependence(channel, lacking.unit, part.term, part.share, part.size, at_one_speed(part.term, judging, method))
        for channel, (lacking, flexible) in made.items()
        for part in flexible.parts
        if math.isfinite(part.share)
    ]
    return tuple(sorted(found, key=lambda item: -item.share))


def as_json(comparison: Comparison) -> dict[str, Any]:
    """Return the JSON of a comparison, schema ``lathesim-compare/1``; numbers that are not finite become null."""
    told = {
        "schema": SCHEMA,
        "lesson": comparison.lesson,
        "recording": comparison.recording,
        "samples": comparison.samples,
        "sample_period_s": comparison.period,
        "channels": {
            item.channel: {
                "unit": item.unit, "floor": item.floor, "rms": item.rms, "over_floor": item.over_floor,
                "worst_window_s": item.worst,
            }
            for item in comparison.channels
        },
        "suspect": comparison.suspect or None,
        "suspects": comparison.suspects,
        "replay": [
            {"channel": item.channel, "parts": item.parts, "over_floor": item.over_floor, "missing_at": item.at,
             "unit": item.unit, "missing": item.missing, "share": known_share(item.share)}
            for item in comparison.replayed
        ],
        "depends_on": [
            {"channel": item.channel, "variable": item.term.variable, "share": item.share} for item in comparison.depends_on
        ],
        "lines": [
            {"channel": item.channel, "against": f"{item.term.on} of {wave.of}" if wave.of else "time",
             "frequency": 1.0 / wave.period, "unit": f"1/{wave.unit}",
             "amplitude": math.sqrt(2.0) * item.size, "share": item.share}
            for item in comparison.depends_on if (wave := item.term.wave)
        ],
        "recording_findings": comparison.findings,
        "recording_faults": comparison.faults,
    }  # fmt: skip
    return dict(eight_digits(told))
