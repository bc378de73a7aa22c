"""A machine and its recordings, made ready for the search: which simulators there are, and what is free in them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.fft import prev_fast_len

from lathesim.component import Input, Output, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place
from lathesim.engine.wiring import Plan, wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.records import Candidate, Free
from lathesim.identification.replay.controller_memory import remembered_at_start, with_memory
from lathesim.identification.replay.controller_rate import at_controllers_rate
from lathesim.identification.replay.converter_rounding import plain_replay, resolving_everything, with_rounding
from lathesim.identification.replay.measured_motion import counted_motion, measured_output, recorded_motion, start_from, velocity_of
from lathesim.identification.replay.open_loop import cut, drive, follow, look, recorded_part, seen, sense, sensed_share
from lathesim.identification.replay.simulator import RedundantSensor, Simulator
from lathesim.identification.roles import acting, commands, decides, is_led
from lathesim.identification.signal import ROUNDING, SETTLING, channel_floor
from lathesim.lessons.schema import UNKNOWN
from lathesim.record import Record
from lathesim.recordings.mapping import BetweenRows


@dataclass(frozen=True)
class RecordedMachine:
    """What a lesson says of the machine: the assembly [SI], the inputs that recordings drive, the channels they are compared with.

    ``uncertain`` gives one standard deviation of given values [SI] by ``part.parameter``; ``resolution`` that of a recorded channel.
    Without ``replay`` the search works in the lesson's own simulation, and with ``white`` it takes every residual for white noise: see
    :mod:`lathesim.diagnosis.ablation`. The ``assembly`` is sampled as the recordings are; controllers make so many ``decisions`` for
    each of their samples. By the recording's ``clock`` these take so many times as long as the lesson says.
    """

    assembly: Assembly
    drive: tuple[str, ...]
    compare: tuple[str, ...]
    uncertain: Mapping[str, float]
    resolution: Mapping[str, float]
    replay: bool = True
    white: bool = False
    decisions: int = 1
    clock: float = 1.0
    between: Mapping[str, BetweenRows] = field(default_factory=dict)
    """What driven inputs do between two rows: measured ones are interpolated, commanded ones are held."""
    output_error: bool = False
    """Whether errors are weighed alike at all frequencies of the motion, rather than by what forces that nobody measured make of it."""
    noise: Mapping[str, float] = field(default_factory=dict)
    """What the rows of a recorded channel cannot resolve [SI], where samples were interpolated between them: these have less noise."""

    def driven_by(self, assembly: Assembly, record: Record) -> Assembly:
        """Return an assembly of this machine whose driven inputs take their recorded values."""
        moving = {name for name, between in self.between.items() if between.moves}
        return drive(assembly, {name: record[name] for name in self.drive}, moving)

    def at_controllers_rate(self, assembly: Assembly) -> Assembly:
        """Return a driven assembly of this machine that is sampled as its controllers decide."""
        held = {recorded_part(name) for name, between in self.between.items() if between.held and not between.assumed}
        return at_controllers_rate(assembly, self.decisions, held)


TELLING = ("in_cut", "angle", "flow")
"""Roles of the outputs that a mismatch may depend on."""


@dataclass(frozen=True)
class Experiment:
    """One recording on its sample grid, with the simulators held against it.

    ``sensed`` replays every part with recorded inputs and lets effects sense the recorded motion (nearly linear: for the search);
    ``replayed`` lets them sense the simulated motion; ``own`` is the lesson's simulation, in which only the drive is recorded.
    """

    machine: RecordedMachine
    record: Record
    name: str
    candidates: tuple[Candidate, ...]
    with_candidates: Assembly
    weights: FloatArray | None = None
    """Which samples count (samples,), 0 to 1; without it all do."""
    one_sided: tuple[Candidate, ...] = ()
    """Effects that are no candidates, as no recording moves their host both ways: what they refine is all that shows of them."""

    def by_output_error(self) -> Experiment:
        """Return the recording whose errors are weighed alike at all frequencies of the motion."""
        return replace(self, machine=replace(self.machine, output_error=True))

    @property
    def seams(self) -> list[int]:
        """The samples with which a recording behind another one begins; none in one recording."""
        return []

    def last_with(self, values: Mapping[str, float]) -> tuple[Experiment, Mapping[str, float]]:
        """Return the last of the recordings that this holds, and some values by name with those with which it begins."""
        return self, values

    @cached_property
    def floors(self) -> dict[str, float]:
        """What the recording cannot resolve in each compared channel, one standard deviation [SI]."""
        machine = self.machine
        floors = {name: channel_floor(self.record[name], machine.resolution.get(name, 0.0)) for name in machine.compare}
        return {name: max(floor, machine.noise.get(name, 0.0)) for name, floor in floors.items()}

    @cached_property
    def _recorded(self) -> dict[str, FloatArray]:
        return {name: self.record[name] for name in self.machine.compare}

    def _driven(self) -> Assembly:
        return self.machine.driven_by(self.with_candidates, self.record)

    def _channels(self) -> dict[str, str]:
        """Return the output that stands for each compared channel."""
        return {name: seen(self.with_candidates, name) for name in self.machine.compare}

    def _simulator(self, assembly: Assembly, shown: Mapping[str, str] | None = None) -> Simulator:
        channels = tuple({**self._channels(), **(shown or {})}.values())
        beside = (*[source for _, source in acting(assembly)], *commands(assembly).values(), *self._telling(assembly))
        beside += tuple(
            f"{candidate.part}.{candidate.effect.identification.along}"
            for candidate in self.candidates
            if candidate.effect.identification.along
        )
        beside = tuple(name for name in dict.fromkeys(beside) if name not in channels)
        finer = self.machine.at_controllers_rate(assembly)
        plan = wire(replace(finer, record=(*channels, *beside), finish="", step=self._step(finer)))
        recorded = np.array([self._recorded[name] for name in self.machine.compare])
        floors = np.array([self.floors[name] for name in self.machine.compare])
        ports = self.machine.assembly.ports
        rates = frozenset(row for row, name in enumerate(self.machine.compare) if Place.of(name).port == ports(name).get("rate"))
        again = self._redundant_sensors(recorded)
        every = self.machine.decisions
        how = (self.machine.white, every, rates, self._led(), self.machine.output_error)
        return Simulator(plan, channels, recorded, floors, again, self.weights, *how)

    def _led(self) -> frozenset[int]:
        """Return the rows of the compared channels that show the position of a part that follows its reference exactly."""
        assembly = self.machine.assembly
        again = {sight.row for sight in self._redundant_sensors(np.array([self._recorded[name] for name in self.machine.compare]))}
        found = set()
        for row, name in enumerate(self.machine.compare):
            host, item = Place.of(measured_output(assembly, name))
            if is_led(assembly.by_name[host].component) and row not in again and item == assembly.ports(host)["displacement"]:
                found.add(row)
        return frozenset(found)

    def _telling(self, assembly: Assembly) -> tuple[str, ...]:
        """Return the outputs that tell what the machine does where no sensor does: in the cut or not, the spindle angle, a velocity."""
        moved = recorded_motion(self.with_candidates, self._whole())
        own = [(part.name, part.component.ports) for part in assembly.parts if not issubclass(part.component, Effect)]
        outputs = [f"{name}.{ports[role]}" for name, ports in own for role in TELLING if role in ports]
        return tuple(output for output in outputs if output not in moved and self._gives(output))

    def _gives(self, output: str) -> bool:
        part = self.machine.assembly.by_name.get(Place.of(output).part)
        return part is not None and Place.of(output).port in part.component.declared(Output)

    @cached_property
    def doing(self) -> dict[str, FloatArray]:
        """What the machine did where no sensor tells, as simulated with the lesson's values: output -> values (samples,)."""
        channels = self.sensed.plan.channels
        return {name: self.sensed.channel([], [], channels.index(name)) for name in self._telling(self.with_candidates)}

    @cached_property
    def motion(self) -> dict[str, FloatArray]:
        """Where parts were and how fast: as sensors recorded it, or as a reference leads them; output -> values (samples,)."""
        given = {
            f"{part.name}.{part.component.ports[role]}": self.record[f"{part.name}.{part.component.ports[source]}"]
            for part in self.machine.assembly.parts
            for role, source in (("displacement", "reference"), ("flow", "reference_rate"))
            if is_led(part.component) and f"{part.name}.{part.component.ports[source]}" in self.machine.drive
        }
        return given | recorded_motion(self.with_candidates, self._recorded)

    @cached_property
    def unsmoothed(self) -> dict[str, FloatArray]:
        """The motion of parts as ``motion`` has it, from row to row, with the noise of sensors: a filter rings past a sudden stop."""
        return recorded_motion(self.with_candidates, self._recorded, smoothed=False)

    def way_of(self, candidate: Candidate) -> FloatArray:
        """Return the way along which an effect repeats, as simulated (samples,); with next to nothing of it, as without any it idles."""
        channels = self.sensed.plan.channels
        sizes = [name for name in candidate.parameters if Place.of(name).port in candidate.effect.neutral]
        nearly = [float(candidate.neutral[candidate.parameters.index(name)]) + ROUNDING for name in sizes]
        return self.sensed.channel(sizes, nearly, channels.index(f"{candidate.part}.{candidate.effect.identification.along}"))

    def _redundant_sensors(self, recorded: FloatArray) -> tuple[RedundantSensor, ...]:
        """Return the channels that show a motion which a channel before them shows already."""
        shown = [measured_output(self.machine.assembly, name) for name in self.machine.compare]
        period = self.machine.assembly.sample_period
        found: list[RedundantSensor] = []
        for row, output in enumerate(shown):
            host, item = Place.of(output)
            ports = self.machine.assembly.ports(output)
            earlier = {shown[first]: first for first in range(len(shown)) if first != row and all(first != one.row for one in found)}
            place = f"{host}.{ports.get('displacement', '')}"
            if output == place and earlier.get(place, row) < row:
                found.append(RedundantSensor(row, earlier[place]))
            elif item == ports.get("flow") and place in earlier:
                speed = velocity_of(np.nan_to_num(recorded[earlier[place]]), period)
                power = float(speed @ speed)
                if power > 0.0:
                    gain = float(speed @ np.nan_to_num(recorded[row])) / power
                    found.append(RedundantSensor(row, earlier[place], gain, rate=True))
        return tuple(found)

    @cached_property
    def sensed(self) -> Simulator:
        """Recorded inputs for every part, recorded motion for the effects."""
        if not self.machine.replay or self.machine.output_error:
            return self.replayed
        replayed = self._cut(self._exact(self._driven()))
        motion = recorded_motion(self.with_candidates, self._whole())
        parts = [(part.name, part.component) for part in self.with_candidates.parts]
        effects = {name for name, item in parts if issubclass(item, Effect) and not item.identification.as_simulated}
        return self._simulator(*look(sense(replayed, motion, effects), self._channels(), motion))

    def sensed_with(self, name: str, column: FloatArray) -> Simulator:
        """Return :attr:`sensed` with another column (samples,) [SI] of a driven input or a channel, in all that it feeds; the motion that
        effects and processes take from sensors stays as it was recorded."""
        plan, part = self.sensed.plan, recorded_part(name)
        recorded = self.sensed.recorded.copy()
        recorded[[row for row, compared in enumerate(self.machine.compare) if compared == name]] = column
        if part in plan.parts:
            given = replace(plan.parts[part], tables={"recorded": np.reshape(column, (-1, 1))})
            plan = replace(plan, parts={**plan.parts, part: given})  # only numbers differ, so it is neither wired nor fused again
        return replace(self.sensed, plan=plan, recorded=recorded)

    def simulated_motion_of(self, candidates: Iterable[Candidate]) -> dict[str, float]:
        """Return the settings of :attr:`sensed` with which candidates, and effects of the lesson's own, that may hold a part still sense
        the simulated motion: they have to feel that it stands."""
        tried = {candidate.part for candidate in self.candidates}
        own = [(part.name, part.component) for part in self.with_candidates.parts if part.name not in tried]
        sticking = [(candidate.part, candidate.effect) for candidate in candidates] + [
            (name, item) for name, item in own if issubclass(item, Effect)
        ]
        names = [
            sensed_share(f"{part}.{name}") for part, effect in sticking if effect.identification.sticks for name in effect.declared(Input)
        ]
        return {name: 0.0 for name in names if name in self.sensed.plan.parameters}

    @cached_property
    def replayed(self) -> Simulator:
        """Recorded inputs for every part, simulated motion for the effects."""
        exact = self._exact(self._driven())
        return self._simulator(self._cut(exact) if self.machine.replay else exact)

    def _cut(self, assembly: Assembly) -> Assembly:
        """Return a driven assembly whose parts take what was recorded of their inputs, and whose processes go on where the machine was."""
        made = self._made_plainly
        followed = follow(cut(assembly, self._whole()), counted_motion(self.with_candidates, self._whole(), made))
        rounding = {name: values for name, values in made.items() if "bits" in self.machine.assembly.ports(name)}
        return with_rounding(followed, rounding)

    @cached_property
    def _made_plainly(self) -> dict[str, FloatArray]:
        """What the lesson's machine makes of the recorded inputs: the steps of its converters, and the motion that processes follow."""
        if self.machine.decisions > 1:
            return {}
        recorded = self._whole()
        driven = self.machine.driven_by(self.machine.assembly, self.record)
        counted = counted_motion(self.machine.assembly, recorded)
        replayed = cut(driven, recorded)
        followed = follow(replayed, counted)
        motion = [name for name in counted if self._gives(name)] if followed.wires != replayed.wires else []
        return plain_replay(replace(followed, step=self._step(followed)), motion, len(self.record), self.machine.compare)

    @cached_property
    def feeds_back(self) -> bool:
        """Whether a recorded channel feeds a part of the machine, so that its replay is another run than the lesson's own simulation."""
        driven = self._driven()
        return cut(driven, self._whole()).wires != driven.wires

    @cached_property
    def own(self) -> Simulator:
        """The lesson's own simulation, with its own step and its own sensors."""
        driven = self._driven()
        channels = tuple(seen(self.with_candidates, name) for name in self.machine.compare)
        plan = wire(replace(self.machine.at_controllers_rate(driven), record=channels, finish=""))
        recorded = np.array([self._recorded[name] for name in self.machine.compare])
        floors = np.array([self.floors[name] for name in self.machine.compare])
        return Simulator(plan, channels, recorded, floors, weights=self.weights, every=self.machine.decisions)

    def _exact(self, assembly: Assembly) -> Assembly:
        """Return an assembly whose sensors resolve everything: rounding belongs to the recording's noise, once and not twice.

        So does a converter that nobody recorded, behind a controller with an uncertain value: its steps would hide what that value does.
        """
        sources = {item.target: item.source for item in assembly.wires}
        unsure = {Place.of(name).part for name in self.machine.uncertain}
        parts = []
        for part in assembly.parts:
            exact, bits = resolving_everything(part.component), part.component.declared(Parameter).get("bits")
            recorded = f"{part.name}.{part.component.ports.get('reading', '')}" in self._recorded
            commands = Place.of(sources.get(f"{part.name}.{part.component.ports.get('measured', '')}", "")).part
            if bits is not None and decides(part.component) and commands in unsure and not recorded:
                exact = {**exact, "bits": bits.high}
            parts.append(replace(part, parameters={**part.parameters, **exact}) if exact else part)
        return replace(assembly, parts=tuple(parts))

    def _step(self, assembly: Assembly) -> float:
        """Return the step of a replay: half a sample, less for a quicker lag or spring that is declared, and no less than the lesson's."""
        quick = min((_quickest(part) for part in self.machine.assembly.parts), default=math.inf)
        steps = math.ceil(assembly.sample_period / min(0.5 * assembly.sample_period, 0.5 * quick) - ROUNDING)
        return max(assembly.step, assembly.sample_period / steps)

    def _whole(self) -> dict[str, FloatArray]:
        return {name: values for name, values in self._recorded.items() if np.isfinite(values).all()}

    def start_states(self, plan: Plan) -> list[Free]:
        """Return the states of the machine's own parts as free starting values, from the recorded motion where there is any."""
        motion = recorded_motion(self.with_candidates, self._whole())
        free = []
        for name in plan.states:
            part = plan.parts[Place.of(name).part]
            if issubclass(part.component, Effect):
                continue
            seen_start = start_from(part, Place.of(name).port, motion, self.with_candidates.sample_period)
            if seen_start is None:
                start = plan.values[name]
                free.append(Free(name, start, max(abs(start), 1e-2)))
            else:
                start, spread = seen_start
                free.append(Free(name, start, spread, uncertainty=spread, given=start))
        return free


def _quickest(part: Part) -> float:
    """Return the shortest time [s] in which an effect that is put into a lesson moves: its lag, or one over its angular frequency."""
    if not issubclass(part.component, Effect) or not part.component.declared(State):
        return math.inf
    declared, resonance = part.component.declared(Parameter), part.component.identification.resonance
    values = {name: part.parameters.get(name, item.default) for name, item in declared.items()}
    lags = [values[name] for name in part.component.neutral if declared[name].unit == "s"]
    swings = [1.0 / (2.0 * math.pi * values[resonance])] if resonance and values[resonance] > 0.0 else []
    return min((one for one in (*lags, *swings) if one > 0.0), default=math.inf)


def build_experiments(machine: RecordedMachine, records: Iterable[tuple[str, Record]], effects: Iterable[type[Effect]]) -> list[Experiment]:
    """Return one experiment for each recording, all with the same candidates in the same machine."""
    assembly, candidates = insert_candidates(machine.assembly, effects, machine.compare)
    experiments = [Experiment(machine, quickly_transformed(record), name, tuple(candidates), assembly) for name, record in records]
    return [_begun(experiment) for experiment in experiments]


def _begun(experiment: Experiment) -> Experiment:
    """Return the experiment whose controllers remember what they do where its recording begins."""
    memory = (
        remembered_at_start(experiment.machine.assembly, experiment.machine.compare, experiment.sensed) if experiment.machine.replay else {}
    )
    if not memory:
        return experiment
    machine = replace(experiment.machine, assembly=with_memory(experiment.machine.assembly, memory))
    return replace(experiment, machine=machine, with_candidates=with_memory(experiment.with_candidates, memory))


_SPARED = 0.02


def quickly_transformed(record: Record) -> Record:
    """Return the record without the last samples, under one in fifty, beyond a length that a Fourier transform takes quickly."""
    samples = len(record)
    # a length of the factors 2, 3 and 5 is quickest, one with 7 or 11 nearly so and never far; a large prime takes ten times as long
    kept = next((fast for real in (True, False) if samples - (fast := prev_fast_len(samples, real=real)) <= _SPARED * samples), samples)
    if kept == samples:
        return record
    channels = {name: replace(channel, values=channel.values[:kept]) for name, channel in record.channels.items()}
    return Record(record.time[:kept], channels, dict(record.meta))


POSSIBLE = 3.5
"""Declared standard deviations by which a value of the lesson may be off; further off is not believed, whatever it would explain."""


def baseline_free(machine: RecordedMachine, wider: float = 1.0) -> list[Free]:
    """Return the uncertain parameters as free ones, held by their uncertainty, ``wider`` than the lesson says, and within what that makes
    possible. Nothing but the bounds of its part holds an unknown one."""
    plan = wire(replace(machine.assembly, finish=""))
    free = []
    for name, declared_deviation in machine.uncertain.items():
        given = plan.given(name)
        part, item = Place.of(name)
        declared = plan.parts[part].component.declared(Parameter)[item]
        if 0.0 < UNKNOWN * abs(given) <= declared_deviation:
            free.append(Free(name, given, abs(given), declared.low, declared.high, given=given))
            continue
        deviation = wider * declared_deviation
        low = max(declared.low, given - POSSIBLE * deviation)
        high = min(declared.high, given + POSSIBLE * deviation)
        free.append(Free(name, given, max(deviation, 1e-12), low, high, deviation, given))
    return free


def own_run(experiment: Experiment, values: Mapping[str, float]) -> FloatArray:
    """Return the channels (channels, samples) of the lesson's own simulation with some values."""
    names = experiment.own.settable(values)
    (run,) = experiment.own.outputs(names, np.array([[values[name] for name in names]]))
    return np.asarray(run)


def own_error(experiment: Experiment, values: Mapping[str, float]) -> float:
    """Return the squared error of the lesson's own simulation with some values, in squared floors, summed over channels and samples."""
    seen_there, simulated = experiment.sensed.seen, experiment.sensed.as_seen(own_run(experiment, values))
    error = np.where(np.isfinite(seen_there), seen_there - simulated, 0.0)[:, int(SETTLING * experiment.own.samples) :]
    with np.errstate(over="ignore"):  # a run that grows beyond all bounds is infinitely far off
        return float(np.sum((np.nan_to_num(error, nan=np.inf) / experiment.sensed.seen_floors[:, None]) ** 2))
