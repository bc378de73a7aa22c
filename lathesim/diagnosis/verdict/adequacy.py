"""Whether a model is adequate: every reason for which it is not, drawn from what it leaves on the validation recording."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.candidates.periodic_starts import drawn_by_waves
from lathesim.diagnosis.location.closed_loop_fit import Compared
from lathesim.diagnosis.location.command_coherence import CommandCoherence, command_coherence
from lathesim.diagnosis.location.narrow_band import NarrowBand, narrow_bands
from lathesim.diagnosis.location.operating_conditions import TOGETHER
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controller_law import AnotherLaw
from lathesim.diagnosis.records.diagnosis import BaselineValue, ChannelFit, Evidence, listed
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import IMPLAUSIBLE
from lathesim.diagnosis.selection.refusal import is_much_of_it
from lathesim.diagnosis.verdict.limit_cycles import off_by_chance
from lathesim.diagnosis.verdict.ranking import removed_in_band
from lathesim.diagnosis.verdict.replicate_check import beyond_replicates
from lathesim.diagnosis.verdict.residual_tests import (
    degrades_every_channel,
    is_missing_for_sure,
    leaves_much,
    left_over,
    mostly_follows,
    of_another_form,
    shortfalls,
    still_follows,
    too_little,
)
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.analysis import root_mean_square


@dataclass(frozen=True)
class Adequacy:
    """What speaks against a model: ``reasons``, each the rest of a sentence, and what some of them are drawn from.

    ``weak`` reasons say that not all is explained and cost no name; ``removed`` is the share of the error that the model is credited with;
    ``form_left`` the share of what was missing that is left in a form of its own, where that is a reason.
    """

    reasons: tuple[str, ...]
    weak: tuple[str, ...]
    removed: float
    form_left: float
    implausible: tuple[str, ...]
    bands: tuple[NarrowBand, ...]
    laws: tuple[AnotherLaw, ...]
    commanded: tuple[CommandCoherence, ...] = ()
    by_chance: tuple[str, ...] = ()
    """Channels that are off by no more than converters make by chance."""

    @property
    def adequate(self) -> bool:
        """Whether nothing speaks against the model."""
        return not (self.reasons or self.weak)


def adequacy(
    experiment: Experiment,
    validation: Experiment,
    found: SearchResult,
    evidence: Evidence,
    own: Compared,
    baseline: Mapping[str, BaselineValue],
    taken: float,
    laws: Sequence[AnotherLaw],
    unsized: Sequence[Candidate],
    method: Method = STANDARD,
) -> Adequacy:
    """Return what speaks against a model that explains the share ``taken`` of the error; ``laws`` are controllers that have another one,
    ``unsized`` the effects whose size may be nothing."""
    effects = bool(found.model.candidates)
    drawn = drawn_by_waves(experiment, found.model.candidates, found.model.fitted.by_name, method=method) if effects else ()
    implausible = _implausible(experiment, found, baseline)
    evidence = _of_one_variable(evidence) if effects else evidence
    left = left_over(evidence, experiment.machine.compare, method=method) if effects else None
    other_form = of_another_form(left, method=method)
    told, fit = _told(validation, found, evidence, own.fit, method=method)
    bands, commanded = _beyond_chance(experiment, validation, found, laws, fit, method)
    reasons = [*shortfalls(told, list(fit), implausible, baseline, bands, fit, method=method), *other_form, *map(str, laws)]
    if effects:
        waves = all(is_much_of_it(candidate, found, method=method) for candidate in found.model.candidates)
        reasons += too_little(evidence, taken, waves=waves, method=method)
    elif found.far_off:
        reasons += _of_an_impossible_value(experiment, evidence, own, taken, method)
    else:
        reasons += _without_effects(validation, found, told, fit, commanded, reasons, method)
    # without anything that feeds back a simulation drifts with whatever nobody modelled
    degraded = effects and validation.feeds_back and degrades_every_channel(own.fit, method=method)
    if degraded:
        reasons.append("with it the lesson's own simulation is further off in every channel")
    weak = leaves_much(evidence, taken, method=method) if effects and not reasons else []
    weak += [f"the recordings do not determine how large {candidate.name} at {candidate.at} is" for candidate in unsized]
    reasons += _anything_drawn(drawn)
    credited = taken > 0.0 and not (degraded or drawn or _is_impossible(implausible, found, taken, unsized, method))
    return Adequacy(
        tuple(reasons),
        tuple(weak),
        removed_in_band(found) if credited else 0.0,
        left.share if left is not None and other_form else 0.0,
        implausible,
        bands,
        tuple(laws),
        tuple(commanded),
        tuple(name for name in own.fit if name not in fit),
    )


def _of_one_variable(evidence: Evidence) -> Evidence:
    """Return the evidence without tables of two variables at once: they show how finely an effect of the right form is simulated."""
    return replace(evidence, bars=tuple(bar for bar in evidence.bars if not bar.variable.startswith(TOGETHER)))


def _beyond_chance(
    experiment: Experiment, validation: Experiment, found: SearchResult, laws: Sequence[AnotherLaw], fit: Collection[str], method: Method
) -> tuple[tuple[NarrowBand, ...], list[CommandCoherence]]:
    """Return the narrow bands left in the channels of ``fit``, and what answers to a driven input, beyond what replicates show."""
    bands = tuple(
        narrow_bands(validation, found.model.validation_fit, method=method) or narrow_bands(experiment, found.model.fitted, method=method)
    )
    bands = tuple(band for band in bands if band.channel in fit)
    known = found.model.candidates or found.far_off or laws
    commanded = [] if known else _commanded(experiment, validation, found, method=method)
    return beyond_replicates(bands, commanded, (experiment, validation), found.model, method)


def _of_an_impossible_value(experiment: Experiment, evidence: Evidence, own: Compared, taken: float, method: Method) -> list[str]:
    """Return the reasons against a value that the lesson holds impossible: it has to explain what it is believed for."""
    return leaves_much(evidence, taken, method=method) or still_follows(evidence, experiment.machine.compare, own.fit, method=method)


def _without_effects(
    validation: Experiment,
    found: SearchResult,
    told: Evidence,
    fit: Mapping[str, ChannelFit],
    commanded: Sequence[CommandCoherence],
    known: Sequence[str],
    method: Method,
) -> list[str]:
    """Return the reasons against a model without effects, beside those that are ``known``."""
    reasons = [
        *map(str, commanded),
        *is_missing_for_sure(told, fit, method=method),
        *_sensors_apart(validation, found.model.validation_fit, method=method),
    ]
    return reasons if reasons or known else mostly_follows(told, list(fit), method=method)


def _anything_drawn(drawn: Sequence[Candidate]) -> list[str]:
    """Return the reason where waves draw what may be anything that goes with the place."""
    if not drawn:
        return []
    names = listed([f"{candidate.name} at {candidate.at}" for candidate in drawn])
    few = "are there so few times that together they" if len(drawn) > 1 else "is not once there as a whole and"
    return [f"{names} {few} may be anything that goes with the place"]


def _is_impossible(implausible: Collection[str], found: SearchResult, taken: float, unsized: Sequence[Candidate], method: Method) -> bool:
    """Return whether a machine cannot be and is no explanation: much is left as well, or nothing beside it is sure to be there."""
    effects = found.model.candidates
    return bool(implausible) and (taken < method.verdict.explains_most or bool(effects and len(unsized) == len(effects)))


def _told(
    experiment: Experiment, found: SearchResult, evidence: Evidence, fit: Mapping[str, ChannelFit], method: Method = STANDARD
) -> tuple[Evidence, dict[str, ChannelFit]]:
    """Return what is missing, and the fit, of the channels that are off by more than converters make by chance."""
    null_maximum = off_by_chance(experiment, found.model.validation_fit.by_name, fit, method=method)
    pairs = [pair for pair in zip(experiment.machine.compare, evidence.missing, strict=True) if pair[0] not in null_maximum]
    return replace(evidence, missing=tuple(missing for _, missing in pairs)), {name: fit[name] for name, _ in pairs}


def _commanded(experiment: Experiment, validation: Experiment, found: SearchResult, method: Method = STANDARD) -> list[CommandCoherence]:
    """Return what answers to a driven input of what a model leaves, at most one."""
    told = command_coherence((experiment, validation), (found.model.fitted.by_name, found.model.validation_fit.by_name), method=method)
    return [told] if told else []


def _sensors_apart(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> list[str]:
    """Return the reason where two sensors of one motion differ by far more than both can resolve: no load does that."""
    reasons = []
    for sight in (sight for sight in experiment.sensed.redundant_sensors if not sight.rate):
        apart = root_mean_square(fitted.residual[sight.row])
        if apart > method.verdict.sensors_apart * experiment.sensed.seen_floors[sight.row]:
            names = [experiment.machine.compare[row] for row in (sight.row, sight.first)]
            size = shown_with_unit(apart, experiment.sensed.plan.unit(experiment.sensed.channels[sight.row]))
            reasons.append(f"{names[0]} and {names[1]} differ by {size} (root mean square)")
    return reasons


def _implausible(experiment: Experiment, found: SearchResult, baseline: Mapping[str, BaselineValue]) -> tuple[str, ...]:
    """Return the values that the model needs further off than the lesson holds possible, less the one that is the answer."""
    known = (*found.values_off[:1], *found.jointly_off)
    return tuple(
        name
        for name, item in baseline.items()
        if name not in known and abs(item.refit_with - item.given) > IMPLAUSIBLE * experiment.machine.uncertain.get(name, math.inf)
    )
