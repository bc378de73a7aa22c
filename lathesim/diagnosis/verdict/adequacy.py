"""Whether a model is adequate: what the tests of what is left are asked about, gathered, and what they say."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.candidates.periodic_starts import drawn_by_waves
from lathesim.diagnosis.location.closed_loop_fit import Compared
from lathesim.diagnosis.location.command_coherence import CommandCoherence, command_coherence
from lathesim.diagnosis.location.narrow_band import NarrowBand, narrow_bands
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controller_law import AnotherLaw
from lathesim.diagnosis.records.condition import Kind
from lathesim.diagnosis.records.diagnosis import BaselineValue, Evidence, listed
from lathesim.diagnosis.records.residual_test import ResidualTest
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.refusing.refusal import is_much_of_it
from lathesim.diagnosis.verdict.judged import Judged, SensorsApart, Unsized, ValueOff
from lathesim.diagnosis.verdict.limit_cycles import off_by_chance
from lathesim.diagnosis.verdict.ranking import removed_in_band
from lathesim.diagnosis.verdict.replicate_check import calibrated_doubts
from lathesim.diagnosis.verdict.residual_tests import CALIBRATED, OTHER_FORM, not_adequate, residual_tests
from lathesim.identification.estimation.estimates import CONFIDENCE, Estimates, half_intervals_from_neutral
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.analysis import root_mean_square


@dataclass(frozen=True)
class Adequacy:
    """What a model leaves, and the tests of it."""

    judged: Judged
    tests: tuple[ResidualTest, ...]

    @property
    def adequate(self) -> bool:
        """Whether nothing speaks against the model."""
        return all(test.passed for test in self.tests)

    @property
    def shortfall(self) -> str:
        """Why it is not adequate, in one sentence."""
        return not_adequate(self.tests)

    @property
    def form_left(self) -> float:
        """The share of what was missing that is left in a form of its own, where that speaks against the model."""
        return next((test.statistic for test in self.tests if test.name == OTHER_FORM and not test.passed), 0.0)

    @property
    def implausible(self) -> tuple[str, ...]:
        """The values that the model needs further off than the lesson holds possible, less the one that is the answer."""
        return tuple(item.name for item in self.judged.values if self._fails("plausible value", item.name))

    @property
    def bands(self) -> tuple[NarrowBand, ...]:
        """The narrow bands that no replicate shows."""
        return tuple(band for band in self.judged.bands if self._fails("narrow band", band.channel))

    @property
    def commanded(self) -> tuple[CommandCoherence, ...]:
        """What answers to a driven input and no replicate shows."""
        return tuple(one for one in self.judged.coherent if self._fails("coherent with the command", one.channel))

    def _fails(self, name: str, channel: str) -> bool:
        return any((test.name, test.channel) == (name, channel) and not test.passed for test in self.tests)


def adequacy(
    experiment: Experiment,
    validation: Experiment,
    found: SearchResult,
    evidence: Evidence,
    own: Compared,
    baseline: Mapping[str, BaselineValue],
    taken: float,
    laws: Sequence[AnotherLaw],
    values: Estimates,
    method: Method = STANDARD,
) -> Adequacy:
    """Return what speaks against a model that explains the share ``taken`` of the error; ``laws`` are controllers that have another one."""
    candidates = found.model.candidates
    by_chance = frozenset(off_by_chance(validation, found.model.validation_fit.by_name, own.fit, method=method))
    judged = Judged(
        channels=tuple(experiment.machine.compare),
        evidence=_of_one_variable(evidence) if candidates else evidence,
        fit=own.fit,
        effects=bool(candidates),
        value_is_answer=bool(found.far_off),
        feeds_back=validation.feeds_back,
        waves=all(is_much_of_it(candidate, found, method=method) for candidate in candidates),
        removed=taken,
        removed_here=removed_in_band(found),
        by_chance=by_chance,
        values=_values_off(experiment, found, baseline),
        bands=_bands(experiment, validation, found, by_chance, method),
        coherent=() if candidates or found.far_off or laws else _coherent(experiment, validation, found, method),
        laws=tuple(laws),
        sensors=redundant_sensors(validation, found),
        sizes=tuple(Unsized(one.name, one.at, half_intervals_from_neutral(one, values)) for one in candidates),
        drawn=_drawn(experiment, candidates, found.model.fitted.by_name, method),
    )
    judged = _with_replicates(judged, experiment, validation, found, method)
    return Adequacy(judged, residual_tests(judged, method))


def _of_one_variable(evidence: Evidence) -> Evidence:
    """Return the evidence without tables of two variables at once: they show how finely an effect of the right form is simulated."""
    return replace(evidence, bars=tuple(bar for bar in evidence.bars if bar.kind is not Kind.TOGETHER))


def _bands(
    experiment: Experiment, validation: Experiment, found: SearchResult, by_chance: frozenset[str], method: Method
) -> tuple[NarrowBand, ...]:
    """Return the narrow bands that are left, on the validation recording or else on the estimation recording."""
    bands = narrow_bands(validation, found.model.validation_fit, method=method) or narrow_bands(
        experiment, found.model.fitted, method=method
    )
    return tuple(band for band in bands if band.channel not in by_chance)


def _coherent(experiment: Experiment, validation: Experiment, found: SearchResult, method: Method) -> tuple[CommandCoherence, ...]:
    """Return what answers to a driven input of what a model leaves, at most one."""
    told = command_coherence((experiment, validation), (found.model.fitted.by_name, found.model.validation_fit.by_name), method=method)
    return (told,) if told else ()


def _with_replicates(judged: Judged, experiment: Experiment, validation: Experiment, found: SearchResult, method: Method) -> Judged:
    """Return the same with the probabilities of its statistics under the fitted model; nothing is simulated where no test fails that is
    held against them."""
    asked = any(test.name in CALIBRATED and not test.passed for test in residual_tests(judged, method))
    doubts = calibrated_doubts(experiment, validation, found.model, method) if asked and not method.ends.is_over else None
    return judged if doubts is None else replace(judged, probabilities=doubts.probability, replicates=doubts.replicates)


def _drawn(experiment: Experiment, candidates: Sequence[Candidate], values: Mapping[str, float], method: Method) -> str:
    """Return in words which waves may draw what may be anything that goes with the place; empty where none does."""
    drawn = drawn_by_waves(experiment, candidates, values, method=method) if candidates else ()
    if not drawn:
        return ""
    names = listed([f"{candidate.name} at {candidate.at}" for candidate in drawn])
    few = "are there so few times that together they" if len(drawn) > 1 else "is not once there as a whole and"
    return f"{names} {few} may be anything that goes with the place"


def redundant_sensors(experiment: Experiment, found: SearchResult) -> tuple[SensorsApart, ...]:
    """Return the pairs of sensors of one motion, with how far they differ."""
    pairs = []
    for sight in (sight for sight in experiment.sensed.redundant_sensors if not sight.rate):
        apart = root_mean_square(found.model.validation_fit.residual[sight.row])
        size = shown_with_unit(apart, experiment.sensed.plan.unit(experiment.sensed.channels[sight.row]))
        names = experiment.machine.compare[sight.row], experiment.machine.compare[sight.first]
        pairs.append(SensorsApart(names, size, apart / experiment.sensed.seen_floors[sight.row]))
    return tuple(pairs)


def _values_off(experiment: Experiment, found: SearchResult, baseline: Mapping[str, BaselineValue]) -> tuple[ValueOff, ...]:
    """Return how far the values of the lesson had to move, but for those that are the answer."""
    known, declared = (*found.values_off[:1], *found.jointly_off), experiment.machine.uncertain
    return tuple(
        ValueOff(
            name,
            item,
            abs(item.refit_with - item.given) / declared[name],
            0.5 * (item.high - item.low) / (CONFIDENCE * declared[name]) if math.isfinite(item.high - item.low) else 0.0,
        )
        for name, item in baseline.items()
        if name not in known and declared.get(name, 0.0) > 0.0
    )
