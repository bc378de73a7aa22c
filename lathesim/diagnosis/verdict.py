"""How sure each effect is, what a model leaves that could be predicted, and the verdict that follows from what predicts best."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Output
from lathesim.diagnosis.candidates.eligibility import is_told_by_direction
from lathesim.diagnosis.explaining.chance import is_clear, size_error, unresolved
from lathesim.diagnosis.explaining.resolution import least_size
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import over
from lathesim.diagnosis.explanations.conditions import Term
from lathesim.diagnosis.explanations.flexible import Flexible
from lathesim.diagnosis.explanations.lacking_force import Lacking
from lathesim.diagnosis.explanations.of_recording import of_channels
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.recording_checks.added_input import UnrecordedInput
from lathesim.diagnosis.records.comparison import Step
from lathesim.diagnosis.records.diagnosis import Diagnosis, Location, MissingSignal, Verdict
from lathesim.diagnosis.records.found import Found, Gain, RankedEffect
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.identification.noise import NoiseModel, carried_over, white_noise
from lathesim.identification.records import Fitted, Model
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import measured_output
from lathesim.identification.replay.open_loop import seen
from lathesim.identification.signal import SETTLING, root_mean_square


def decided(named: bool, doubts: Sequence[Doubt], *, tied: bool, values_differ: bool, another_law: bool = False) -> tuple[Verdict, str]:
    """Return the verdict with its reason: what predicts best names it; unknown is only what nothing of the catalogue predicts."""
    if named:
        return ("tied", "another explanation predicts as well") if tied else ("named", "no other explanation predicts as well")
    if another_law:
        return "unknown", "a controller follows another law than the lesson's"
    if any(doubt.clear for doubt in doubts):
        return "unknown", "a smooth function of what the machine does predicts better than every explanation of the catalogue"
    if values_differ:
        return "parameters_only", "other values of the lesson predict best"
    return "no_mismatch", "no explanation predicts better than the lesson"


def ranked(study: Study, found: Found) -> list[RankedEffect]:
    """Return how sure each effect is: the probability of its explanation among its rivals, and those that predict as well."""
    result = []
    for candidate in (one for one in found.model.candidates if one.part not in found.there_before):
        worth, rivals = found.worth.get(candidate.part), found.rivals.get(candidate.part, ())
        if worth is None:
            result.append(RankedEffect(candidate, 0.5, (), math.nan))
            continue
        # on the scale by which they were taken to be as good: nothing is sure that may as well be something else
        behind = [over(worth.model, one.model)[1] for one in rivals]
        scaled = [one.nats / unresolved(one, worth.predicted.nats, study.method) for one in behind]
        probability = 1.0 / (1.0 + sum(math.exp(-min(max(0.0, one), 1.0)) for one in scaled))
        tied = tuple(one.candidate for one in rivals)
        tied += tuple(one for one in study.estimation.one_sided if one.at == candidate.at and is_told_by_direction(candidate, one))
        of_size = max(size_error(one, study.method) for one in (worth.fitted, worth.predicted))
        result.append(RankedEffect(candidate, float(probability), tied, worth.predicted.share, of_size))
    return sorted(result, key=lambda one: -found.worth[one.candidate.part].predicted.nats if one.candidate.part in found.worth else np.inf)


def removed_share(experiment: Experiment, before: Fitted, after: Fitted) -> float:
    """Return the share of a recording's error, above its floor and in the band of the motion, that one fit removes of another's.

    It is weighed as forces and sensor noise of the size of the first are, as in the search: what loads add up to over a recording, a metre
    or a turn that no model could know, does not outweigh what an effect does. White noise of a sensor beyond its floor, as it is left
    after, is nothing that a model could remove.
    """
    shapes = experiment.sensed.noise_shapes(after.by_name)
    white = np.array([white_noise(row, shape) for row, shape in zip(after.residual, shapes, strict=True)])
    error, left = (float(_above_floors(experiment, fitted, before.noise, white).sum()) for fitted in (before, after))
    return 1.0 - left / error if error > 0.0 else 0.0


def _above_floors(experiment: Experiment, fitted: Fitted, noise: Sequence[NoiseModel], white: FloatArray) -> FloatArray:
    """Return for each channel the squared error of a fit above the floor, in the band of the motion, weighed by ``noise`` of a fit.

    ``white`` (channels,) is the power of what the sensors add to their floors, which is no error.
    """
    errors = []
    for row, shape, base, more in zip(fitted.residual, experiment.sensed.noise_shapes(fitted.by_name), noise, white, strict=True):
        weight = carried_over(base, shape)
        whitened = weight.whiten(row)
        kept = slice(0, weight.bins(full_band=False))
        floor = float(np.sum(2.0 * (shape.floor**2 + more) * shape.shapes[0][kept] / weight.power[kept]))
        errors.append(max(float(np.sum(whitened * whitened)) - floor, 1e-9))
    return np.array(errors)


@dataclass(frozen=True)
class Doubt:
    """What the flexible explanation makes of what a model leaves behind a channel.

    ``gain`` with its ``error`` is what it predicts better [nats]. ``before`` and ``after`` are root mean squares of what is lacking ``at``
    a port, without and with it, less its ``mean`` [unit]; ``depends_on`` says on what, ``terms`` are the functions, and ``variables`` names
    what they are of. It is ``clear`` where something is left that an effect should explain.
    """

    channel: str
    at: str
    unit: str
    gain: float
    error: float
    before: float
    after: float
    mean: float
    depends_on: tuple[str, ...]
    variables: tuple[str, ...]
    clear: bool
    terms: tuple[Term, ...] = ()

    @property
    def structured(self) -> float:
        """The size of what could be predicted, one root mean square [unit]."""
        return math.sqrt(max(self.before**2 - self.after**2, 0.0))

    @property
    def whole(self) -> float:
        """The same with the mean, which is all that a weight is [unit]."""
        return math.hypot(self.structured, self.mean)

    @property
    def conditions(self) -> set[tuple[str, str]]:
        """What the functions are of."""
        return {term.condition for term in self.terms}


def doubts(study: Study, model: Model) -> tuple[Doubt, ...]:
    """Return what the flexible explanation makes of each compared channel that no controller gives.

    What acts on the estimation recording alone, as a spring at one end of the stroke does, is looked for where the lesson explains the
    other one: the first half of the recording is learned from, and the second half judges.
    """
    estimation, validation = study.estimation, study.validation
    found = _doubted(study, model, of_channels(estimation, model.fitted, validation, model.validation_fit))
    if model.candidates or study.judges_itself or any(one.clear for one in found):
        return found
    middle = len(estimation.record) // 2
    halves = (slice(middle), slice(middle, None))
    within = _doubted(study, model, of_channels(estimation, model.fitted, estimation, model.fitted, parts=halves))
    return within if any(one.clear for one in within) else found


def _doubted(study: Study, model: Model, made_of: Mapping[str, tuple[Lacking, Flexible]]) -> tuple[Doubt, ...]:
    validation, found = study.validation, []
    for channel, (lacking, made) in made_of.items():
        row = study.estimation.machine.compare.index(channel)
        gain, error = made.without_faint_lines(study.share_of_rest), made.standard_error
        size = math.sqrt(max(made.before**2 - made.after**2, 0.0))
        least = least_size(study, model, row) if lacking.is_force else float(validation.sensed.seen_floors[row])
        clear = is_clear(Gain(gain, error), study.method) and size > least
        on, variables = tuple(map(str, made.terms)), tuple(term.variable for term in made.terms)
        left = (made.before, made.after, made.mean)
        found.append(Doubt(channel, lacking.at, lacking.unit, gain, error, *left, on, variables, clear, made.terms))
    return tuple(found)


def outdone(study: Study, found: Found, doubted: tuple[Doubt, ...]) -> tuple[Found, tuple[Doubt, ...]]:
    """Return a search without its effects, and what is then left, where smooth functions of what the machine does predict far more than the
    effects do, and these add nothing to them: effects that stand for something else. Else both as they are.

    An effect beside the functions has to explain of what they leave as much as any other explanation has to: a model is never quite right.
    Functions do what a dry friction or a factor does, and leave no less beside it: such an effect makes one of them needless, and stays.
    The forces behind a spring that is named are no longer those of the lesson: there the effects stay.
    """
    candidates, alike = found.model.candidates, study.method.alike
    if study.earlier is not None or any(one.effect.beyond for one in candidates) or not (candidates and any(one.clear for one in doubted)):
        return found, doubted
    lesson = found.values or found.baseline
    without = {one.channel: one for one in doubts(study, lesson)}
    pairs = [(one, without[one.channel]) for one in doubted if one.clear]
    least = study.method.larger_part
    if not all(
        other.clear
        and alike * other.after < one.before
        and (1.0 - study.least_share) * other.after**2 <= one.after**2
        and one.whole > least * other.whole
        and other.conditions <= one.conditions
        for one, other in pairs
    ):
        return found, doubted
    names = tuple(f"{one.name} at {one.at}" for one in candidates)
    study.progress(f"smooth functions predict more than {' and '.join(names)}")
    fitted, predicted = over(lesson, found.model)
    why = "smooth functions of what the machine does predict far more, and the effects add nothing to them"
    step = Step("drop", (), names, fitted.nats, predicted.nats, why)
    return replace(found, model=lesson, worth={}, rivals={}, history=(*found.history, step)), tuple(without.values())


_RECORDABLE = ("current", "rate", "reading", "flow", "displacement")
"""Roles of outputs that are recorded, the easiest to log first."""


def deciding_channel(experiment: Experiment, found: Found, item: RankedEffect, method: Method) -> str:
    """Return a sentence on the channel, the easiest to log, that tells an effect from all it is tied with, and by how much these differ
    there, as a share of what it does; empty where nothing is tied, or none does."""
    chosen = found.worth.get(item.candidate.part)
    tied = {candidate.part for candidate in item.tied}
    rivals = [trial.model.fitted for trial in found.rivals.get(item.candidate.part, ()) if trial.candidate.part in tied]
    channels = recordable(experiment)
    if chosen is None or not rivals or not channels:
        return ""
    first, *others = simulated(experiment, channels, [one.by_name for one in (chosen.model.fitted, *rivals)])
    sizes = np.maximum(np.std(first, axis=1), 1e-300)
    apart = np.array([[root_mean_square(row) for row in other - first] for other in others]) / sizes
    least = np.min(np.nan_to_num(apart, nan=0.0, posinf=0.0), axis=0)
    told = [(channel, 100.0 * share) for channel, share in zip(channels, least.tolist(), strict=True) if share > method.little]
    return next((f"Record {channel} too, where the explanations differ by {percent:.0f} %." for channel, percent in told), "")


def recordable(experiment: Experiment) -> list[str]:
    """Return what could be recorded and no compared channel shows, the easiest first."""
    assembly = experiment.machine.assembly
    shown = {measured_output(assembly, name) for name in experiment.machine.compare} | set(experiment.machine.compare)
    found = [
        f"{part.name}.{part.component.ports[role]}"
        for role in _RECORDABLE
        for part in assembly.parts
        if part.component.ports.get(role, "") in part.component.declared(Output) and not issubclass(part.component, Effect)
    ]
    return [name for name in dict.fromkeys(found) if name not in shown and measured_output(assembly, name) not in shown]


def simulated(experiment: Experiment, channels: Sequence[str], values: Sequence[Mapping[str, float]]) -> list[FloatArray]:
    """Return channels (channels, samples) of the lesson's own simulation with each of some values by name."""
    own = experiment.own
    plan = wire(replace(own.plan.assembly, record=tuple(seen(experiment.with_candidates, name) for name in channels)))
    names = [name for name in own.settable([name for some in values for name in some]) if name in plan.values]
    given = {name: own.given(name) for name in names}
    rows = np.array([[{**given, **some}[name] for name in names] for some in values])
    samples, begin = (own.samples - 1) * own.every + 1, int(SETTLING * own.samples)
    runs = Batch(plan, samples, noisy=False).run(names, rows, lambda record: record[:, :: own.every][:, begin:].copy())
    return [np.asarray(run) for run in runs]


RULE = "a command does not follow from its controller, and everything else agrees"


def agrees(answer: Diagnosis) -> bool:
    """Return whether nothing else speaks against the model once the added signals are known, or effects are named."""
    return answer.verdict != "recording_fault" and (answer.rest.adequate or answer.names)


def with_added_signals(answer: Diagnosis, added: Sequence[UnrecordedInput]) -> Diagnosis:
    """Return the answer with the signals that are added to commands; where no effect is named, they are what is unknown."""
    if not added or answer.verdict == "recording_fault":
        return answer
    told = [f"{one}." for one in added]
    evidence = replace(answer.evidence, missing=(*map(_missing, added[-1:]), *answer.evidence.missing))
    answer = replace(answer, rest=replace(answer.rest, left=(*told, *answer.rest.left)), evidence=evidence)
    if answer.names:
        return answer
    parts = tuple(dict.fromkeys(Place.of(one.wire).part for one in added))
    location = Location(parts, tuple(dict.fromkeys(one.command for one in added)), added[-1].shape.windows)
    rest = "Everything else agrees with the lesson." if answer.rest.adequate else "Physics is missing besides."
    sentence = f"{added[0]}. {rest}"
    not_told = (*answer.rest.not_told, f"Record what is added to {added[0].command}, or switch it off, and ask again.")
    still, search = replace(answer.rest, not_told=not_told), replace(answer.search, rule=RULE)
    return replace(answer, verdict="unknown", sentence=sentence, location=location, rest=still, search=search)


def _missing(one: UnrecordedInput) -> MissingSignal:
    size, all_of_it = (float(np.sqrt(np.mean(np.square(values)))) for values in (one.values, one.total))
    share = size / all_of_it if all_of_it > 0.0 else np.nan
    return MissingSignal(one.wire, one.unit, one.time, one.values, one.values, one.total, share, share)
