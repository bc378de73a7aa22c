"""Effects that go again once everything is fitted: their size may be nothing, or they do not improve the validation recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lathesim.diagnosis.location.closed_loop_fit import Compared, compared
from lathesim.diagnosis.location.missing_share import FORCES, missing_signals, next_to_nothing
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.preparation import Prepared
from lathesim.diagnosis.records.diagnosis import ChannelFit, Diagnosis, Evidence
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.evidence import gather
from lathesim.diagnosis.reporting.lesson_entry import on_validation
from lathesim.diagnosis.selection.acceptance import is_of_a_clock
from lathesim.diagnosis.selection.elimination import leave_out
from lathesim.diagnosis.selection.refusing.refusal import all_push, is_much_of_it
from lathesim.diagnosis.verdict.judged import structured_share
from lathesim.diagnosis.verdict.ranking import explains_nothing
from lathesim.identification.estimation.estimates import (
    Estimates,
    estimates,
    interval_includes_neutral,
    is_significant,
    only_combination_identifiable,
)
from lathesim.identification.execution.budget import Progress
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.replay.experiment import Experiment


def prune_undetermined(prepared: Prepared, found: SearchResult, progress: Progress) -> tuple[SearchResult, Estimates]:
    """Return the search without the effects that the recordings do not determine, and the estimates of the rest."""
    experiment, validation, method = prepared.experiment, prepared.validation, prepared.question.method
    values = estimates(found.model, experiment, validation, prepared.whole)
    if doubtful := doubtful_effects(found, experiment, validation, values, method=method):
        progress(f"dropping {', '.join(candidate.name for candidate in doubtful)}: its confidence interval includes zero")
        found = leave_out(found, doubtful, experiment, validation, progress, method=method)
        values = estimates(found.model, experiment, validation, prepared.whole)
    reported_fit = on_validation(validation, found, values.values())
    if (
        not method.beside_earlier
        and found.model.candidates
        and explains_nothing(validation, found.baseline.validation_fit, reported_fit, method=method)
    ):
        names = ", ".join(candidate.name for candidate in found.model.candidates)
        progress(f"dropping {names}: it does not improve the validation recording")
        found = leave_out(found, found.model.candidates, experiment, validation, progress, method=method)
        values = estimates(found.model, experiment, validation, prepared.whole)
    return found, values


def doubtful_effects(
    found: SearchResult, experiment: Experiment, validation: Experiment, values: Estimates, method: Method = STANDARD
) -> list[Candidate]:
    """Return the effects whose size may be nothing: those whose sizes the recordings do not agree on, lags of a small part of a sample, and
    such whose intervals hold nothing.
    All go that act at moving parts and explain next to nothing of what acts there.
    Of these a single one goes where nothing that matters was missing, and small ones beside others where no force that matters was missing
    at their place or the lesson's own simulation is further off with the whole model in some channel. Beside a recording from before a
    change all that matters is what is new, however little of what acts that is."""
    if not method.beside_earlier and _all_trifling(found, experiment, validation, method):
        return list(found.model.candidates)
    period, model = experiment.machine.assembly.sample_period, found.model.fitted.by_name
    in_time = [
        candidate
        for candidate in found.model.candidates
        if is_of_a_clock(candidate, model, period, len(experiment.record) * period, method=method)
    ]
    doubtful = [candidate for candidate in found.model.candidates if candidate not in in_time or not is_significant(candidate, values)]
    unsure = [
        candidate
        for candidate in found.model.candidates
        if candidate not in doubtful
        and interval_includes_neutral(candidate, values)
        and not only_combination_identifiable(candidate, values)
    ]
    single = len(found.model.candidates) == 1
    unsure = [candidate for candidate in unsure if single or found.removed_by(candidate) < method.shared.larger_part]
    if not unsure or method.beside_earlier:
        return doubtful
    own = _own(validation, found, values)
    if not single and degrades_a_channel(own.fit, method=method):
        return doubtful + unsure
    evidence = gather(experiment, validation, found, own, method=method)
    channels = validation.machine.compare
    return doubtful + [
        candidate for candidate in unsure if hardly_missed(evidence, channels, "" if single else candidate.at, method=method)
    ]


def _all_trifling(found: SearchResult, experiment: Experiment, validation: Experiment, method: Method) -> bool:
    """Return whether all effects act at moving parts and explain next to nothing of what acts there."""
    effects = found.model.candidates
    if not effects or not all_push(experiment, effects) or any(is_much_of_it(candidate, found, method=method) for candidate in effects):
        return False
    return next_to_nothing(missing_signals(validation, found.baseline, found.model, method=method), method=method)


def degrades_a_channel(fit: Mapping[str, ChannelFit], method: Method = STANDARD) -> bool:
    """Return whether the closed-loop simulation is further off with the effects than without them in some channel."""
    return any(item.after > method.shared.alike * item.before for item in fit.values())


def hardly_missed(evidence: Evidence, channels: Sequence[str], at: str = "", method: Method = STANDARD) -> bool:
    """Return whether what was missing before any effect was found, and followed the motion, is little of all that acts, wherever it is;
    with a part, what force ``at`` it: of a position any error is little."""
    asked = [
        structured_share(
            max((bar.before for bar in evidence.bars if bar.channel == channel), default=0.0),
            missing.share_before,
        )
        for channel, missing in zip(channels, evidence.missing, strict=True)
        if not at or (missing.at.partition(".")[0] == at and missing.unit in FORCES)
    ]
    return bool(asked) and max(asked) < method.verdict.within_laws


def _own(validation: Experiment, found: SearchResult, values: Estimates) -> Compared:
    return compared(validation, found.baseline.validation_fit.by_name, on_validation(validation, found, values.values()).by_name)


def leaner_model(
    prepared: Prepared, found: SearchResult, answer: Diagnosis, values: Estimates, progress: Progress
) -> tuple[SearchResult, bool] | None:
    """Return the search without effects whose size may be nothing, or without any where none improves the validation recording (true);
    nothing where all would go for their size."""
    useless = bool(found.model.candidates) and answer.removed_share <= 0.0 and prepared.question.method.against_null_maximum
    doubtful = [
        candidate
        for candidate in found.model.candidates
        if useless or (interval_includes_neutral(candidate, values) and not only_combination_identifiable(candidate, values))
    ]
    if not doubtful or (len(doubtful) == len(found.model.candidates) and not useless):
        return None
    why = "which do not improve the validation recording" if useless else "whose interval includes zero"
    progress(f"asking whether {', '.join(candidate.name for candidate in doubtful)} can go, {why}")
    leaner = leave_out(found, doubtful, prepared.experiment, prepared.validation, progress, method=prepared.question.method)
    return leaner, useless
