"""How a model grows: forward selection with everything refitted each time, backward elimination, and refinement.

Simple effects come first; what only refines one of them (a friction that is also asymmetric) may then take its place.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from lathesim.diagnosis.candidates.eligibility import due, finer
from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.candidates.periodic_starts import is_a_wave
from lathesim.diagnosis.candidates.screening import Screening, is_limit, screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable, credible_if_it_moves, merit, simplest
from lathesim.diagnosis.selection.compare_models import Gains, compare_models
from lathesim.diagnosis.selection.compare_models import due as cost
from lathesim.diagnosis.selection.elimination import is_in_time, without_needless, without_parts_of_a_shape
from lathesim.diagnosis.selection.laboratory import Laboratory, becomes_implausible, is_implausible
from lathesim.diagnosis.selection.moves.extend import extend_parameters
from lathesim.diagnosis.selection.moves.generalise import generalise, may_be_worth
from lathesim.diagnosis.selection.moves.merge_harmonics import merge_harmonics
from lathesim.diagnosis.selection.refusing.refusal import Refusal, pushes_at, quiet_parts, refusal
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.engine.assembly import FloatArray
from lathesim.identification.execution.threads import TOGETHER
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import CandidateStanding, Model, Standing, Trial
from lathesim.identification.replay.experiment import Experiment

_PUSHED = "effort"


States = Generator[SearchResult, None, SearchResult]
"""The states that a search goes through; the last one is returned too."""


def last_of(states: States) -> SearchResult:
    """Return the state that a search comes to."""
    while True:
        try:
            next(states)
        except StopIteration as end:
            return cast(SearchResult, end.value)


def grow(laboratory: Laboratory, found: SearchResult, method: Method, known: Collection[Candidate] = ()) -> States:
    """Return the states of a search that adds effects one at a time: as long as one is believable, or until the model has come to the
    ``known`` effects of another one or the search has cost all that it may."""
    while len(found.model.candidates) < method.most_effects:
        if known and same_effects(found.model.candidates, known):
            return found
        if not method.affords(laboratory.runs, len(laboratory.experiment.candidates)):
            found = replace(found, ended_after=laboratory.runs)
            yield found
            return found
        before = found.model
        found = _grown_by_one(laboratory, found, method)
        yield found
        if found.model is before:
            return found
    return found


def _grown_by_one(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with a further effect, or with a finer shape of one: first a shape that scores what the best candidate does, then
    candidates in turn, then any shape."""
    screening, simple = _screened(laboratory, found, method)
    found = replace(found, null_maximum=screening.null_maximum if method.against_null_maximum else 0.0)
    promised = max((item.gain for item in screening.ranked), default=0.0)
    shaped = extend_parameters(laboratory, found, method, method.selection.rival * promised)
    if shaped.model is not found.model:
        return without_parts_of_a_shape(laboratory, shaped, method)
    added = shaped
    for ranked in in_turn(screening.ranked, simple, method=method):
        added = _add(laboratory, added, method, ranked, screening.ranked)
        if added.model is not found.model:
            return added
    shaped = extend_parameters(laboratory, added, method)
    return without_parts_of_a_shape(laboratory, shaped, method) if shaped.model is not found.model else shaped


def _screened(laboratory: Laboratory, found: SearchResult, method: Method) -> tuple[Screening, list[Candidate]]:
    """Return the screening scores of all candidates that may come in, and which of these are simple."""
    quiet = quiet_parts(laboratory, found.model, method=method)
    simple, refined = (
        [
            candidate
            for candidate in asked(found.model, laboratory.experiment)
            if candidate.part not in found.excluded and not pushes_at(candidate, quiet)
        ]
        for asked in (due, finer)
    )
    laboratory.progress(f"screening {len(simple) + len(refined)} candidates")
    points = starting_points(laboratory.experiment, found.model.fitted, [*simple, *refined], method=method)
    screening = screen(laboratory.experiment.sensed, found.model.fitted, [*simple, *refined], points, method=method)
    return _with_sizes_elsewhere(laboratory, found, screening, method), simple


def _with_sizes_elsewhere(laboratory: Laboratory, found: SearchResult, screening: Screening, method: Method) -> Screening:
    """Return the screening with what acts in several places, by a size in each, in that finer shape where it promises more than in one
    place: of a wear that raises all forces the lesson's specific force takes what it does to the main force."""
    finer = [item.candidate.shaped for item in screening.ranked if item.candidate.shaped is not None and item.candidate.acts_elsewhere]
    if not finer:
        return screening
    shaped = screen(laboratory.experiment.sensed, found.model.fitted, finer, method=method)
    plain = {item.candidate.part: item for item in screening.ranked}
    best = dict(plain)
    for item in shaped.ranked:
        other = plain[item.candidate.part]
        more = len(item.candidate.parameters) - len(other.candidate.parameters)
        if compare_models(Gains(item.gain - other.gain), method, parameters=more).better:
            best[item.candidate.part] = item
    ranked = sorted(best.values(), key=lambda item: -item.gain)
    return Screening(tuple(ranked), max(screening.null_maximum, shaped.null_maximum))


def same_effects(candidates: Collection[Candidate], others: Collection[Candidate]) -> bool:
    """Return whether two models have the same effects."""
    return {candidate.part for candidate in candidates} == {candidate.part for candidate in others}


def in_turn(ranked: Sequence[Screened], plain: Sequence[Candidate], method: Method = STANDARD) -> list[tuple[Screened, ...]]:
    """Return the candidates as they are tried: simple effects and then finer ones, or the other way round where nothing simple scores what
    a finer one does."""
    parts = {candidate.part for candidate in plain}
    simple = tuple(item for item in ranked if item.candidate.part in parts)
    refined = tuple(item for item in ranked if item.candidate.part not in parts)
    of_refined, of_simple = (max((item.share for item in items), default=0.0) for items in (refined, simple))
    return [refined, simple] if of_refined > method.selection.almost_all and of_simple < method.selection.rival else [simple, refined]


def _add(
    laboratory: Laboratory, found: SearchResult, method: Method, ranked: tuple[Screened, ...], screened: tuple[Screened, ...]
) -> SearchResult:
    """Return the search with the best of some candidates, ``ranked``, of all that were ``screened``; without one where none is
    believable."""
    if not ranked:
        return found
    _told_screened(laboratory, ranked[:5], found.null_maximum)
    tried = _tried_in_batches(laboratory, found, ranked, method)
    found = replace(found, screened=ranked).having_tried(tried)
    good = _credible(laboratory, found, tried, method)
    if not good:
        return merge_harmonics(laboratory, found, method, [trial for trial in tried if believable(trial, method, found.null_maximum)])
    rivals = _rivals(laboratory, found, ranked, screened, simplest(good, method), tried, method=method)
    found = found.having_tried(rivals)
    good += [trial for trial in rivals if believable(trial, method, found.null_maximum)]
    best = simplest(sorted(good, key=lambda trial: -merit(trial, method)), method)
    if found.model.candidates and best.share_of_all < method.share_of_all:
        # what is so small beside the effects that were found is rather a finer form of one of them
        finer_form = generalise(laboratory, found, method, best.share_of_rest)
        if finer_form.model is not found.model:
            return finer_form
        found = finer_form
    settled = laboratory.settled(best.model)
    while why := refusal(laboratory, found, best, settled, method):
        laboratory.progress(f"  {best.candidate.name} at {best.candidate.at} is refused: {why.value}")
        if why is Refusal.OLD_AND_SMALL:
            found = replace(found, there_before=found.there_before | {best.candidate.part})
        good = [trial for trial in good if trial is not best]
        if not good:
            return found
        best = simplest(good, method)
        settled = laboratory.settled(best.model)
    return without_needless(laboratory, _accepted(laboratory, found, best, settled, good, tried, method), method)


def _tried_in_batches(laboratory: Laboratory, found: SearchResult, ranked: Sequence[Screened], method: Method) -> list[Trial]:
    """Return trials of candidates, the best ones first, as long as the trials so far leave the others worth a fit."""
    tried: list[Trial] = []
    further = [item for item in ranked[method.screened :] if item.share > method.shared.larger_part]
    waiting = [*ranked[: method.screened], *further[: method.selection.most_rivals]]
    while batch := _batch(laboratory, found, ranked, waiting, tried, method):
        asked = [
            Asked(item.candidate, found.model.candidates, found.model.free, _starts(item, method=method), item.share) for item in batch
        ]
        asked += [*_bare(batch, found.model), *_of_more_stages(batch, found.model)]
        made = side_by_side(laboratory, found.model, asked)
        to_feel = [
            *_with_simulated_motion(made, tried, found.model, method=method),
            *_held_at_rest(laboratory.experiment, batch, made, found.model, method=method),
        ]
        with_simulated_motion = side_by_side(laboratory, found.model, to_feel)
        tried += [*made, *[trial for trial in with_simulated_motion if _holds_still(trial, made, method=method)]]
    return tried


def _credible(laboratory: Laboratory, found: SearchResult, tried: Sequence[Trial], method: Method) -> list[Trial]:
    """Return the trials that may be taken, the best first: believable, in time, no part of a known wave and no wave longer than the way."""
    good = [
        trial
        for trial in tried
        if believable(trial, method, found.null_maximum) and not is_part_of_a_wave(trial, found.model, method=method)
    ]
    good = [trial for trial in good if is_in_time(laboratory, trial.candidate, trial.model, method=method)]
    good = [trial for trial in good if is_a_wave(laboratory.experiment, trial.candidate, trial.model.fitted.by_name, method=method)]
    return sorted(_without_degradation(good, method=method), key=lambda trial: -merit(trial, method))


def _accepted(
    laboratory: Laboratory,
    found: SearchResult,
    best: Trial,
    settled: Model,
    good: list[Trial],
    tried: Sequence[Trial],
    method: Method,
) -> SearchResult:
    """Return the search with the best trial in the model, ``settled``, and what else was as ``good``, or would have been if it moved."""
    part, known = best.candidate.part, {trial.candidate.part for trial in good}
    others = [trial for trial in tried if trial.candidate.part not in known]
    unmoved = [trial for trial in others if credible_if_it_moves(trial, method, found.null_maximum)]
    first = sorted((trial for trial in good if trial is not best), key=lambda trial: -merit(trial, method))
    implausible = {part} if becomes_implausible(found.model.fitted, settled.fitted) else set()
    laboratory.progress(f"{best.candidate.name} at {best.candidate.at}: {best.gain:.0f} nats, removes {best.share_of_all:.0%}")
    return found.accepted(
        settled,
        "add",
        f"explains {best.share_of_rest:.0%} of what was left",
        trials={**found.trials, part: good},
        unmoved={**found.unmoved, part: unmoved},
        restarted_from=found.restarted_from if found.model.candidates else first,
        before={**found.before, part: found.model},
        implausible_effects=found.implausible_effects | implausible,
    )


def _without_degradation(good: Sequence[Trial], method: Method = STANDARD) -> list[Trial]:
    """Return the trials without those with which the lesson's own simulation is further off, where another one explains nearly as much and
    that is no further off: a replay that runs away is held by whatever keeps the machine at rest, and a controller would not have it."""
    kept = max((trial.share_of_rest for trial in good if trial.closed_loop_degradation <= 1.0), default=0.0)
    return [
        trial
        for trial in good
        if trial.closed_loop_degradation < method.shared.hardly_more or kept < method.selection.rival * trial.share_of_rest
    ]


def _bare(batch: Sequence[Screened], model: Model) -> list[Asked]:
    """Return the barest forms of candidates, to be tried with frictions that sense the recorded motion and with such that sense the
    simulated one: with more values a fit gets lost where a table stands still."""
    found = []
    for item in batch:
        if (bare := item.candidate.bare) is not None:
            start = item.starts[0][[item.candidate.parameters.index(name) for name in bare.parameters]]
            found += [
                Asked(bare, model.candidates, model.free, [start], with_simulated_motion=with_simulated_motion)
                for with_simulated_motion in (False, True)
            ]
    return found


def _with_simulated_motion(made: Sequence[Trial], before: Sequence[Trial], model: Model, method: Method = STANDARD) -> list[Asked]:
    """Return frictions that explain one recording much better than the other, to be tried with the simulated motion: where they hold a part
    still, what the recorded motion lets go adds up over each recording in its own way. So are such that explain nearly all, where
    something else of which that is true as well gains more: a dead zone holds a part still too."""
    frictions = [trial for trial in made if trial.candidate.effect.identification.sticks and trial.gain > 0.0]
    others = [
        trial.gain
        for trial in (*before, *made)
        if not trial.candidate.effect.identification.sticks and trial.share_of_rest > method.selection.almost_all
    ]
    most = max(others, default=0.0)
    doubted = [
        trial
        for trial in frictions
        if not method.selection.rival * trial.gain < trial.validation_gain < trial.gain / method.selection.rival
        or (trial.share_of_rest > method.selection.almost_all and _gains_more(most, trial.gain, method))
    ]
    found = []
    for trial in doubted:
        values = trial.model.fitted.by_name
        start = np.array([values[name] for name in trial.candidate.parameters])
        found.append(Asked(trial.candidate, model.candidates, model.free, [start], with_simulated_motion=True))
    return found


def _held_at_rest(
    experiment: Experiment, batch: Sequence[Screened], made: Sequence[Trial], model: Model, method: Method = STANDARD
) -> list[Asked]:
    """Return pushing effects that kept little of what they expected, to be tried with frictions that sense the simulated motion: at rest
    these hold whatever pushes, and one that senses the recorded motion lets go."""
    found = []
    for item in batch:
        kept = max((trial.share_of_rest for trial in made if trial.candidate.part == item.candidate.part), default=1.0)
        pushes = item.candidate.effect.site == _PUSHED and not item.candidate.effect.identification.sticks
        if (
            pushes
            and item.share > method.shared.larger_part
            and kept < method.shared.larger_part * item.share
            and experiment.simulated_motion_of(model.candidates)
        ):
            found.append(Asked(item.candidate, model.candidates, model.free, item.starts[:1], with_simulated_motion=True))
    return found


def _holds_still(trial: Trial, made: Sequence[Trial], method: Method = STANDARD) -> bool:
    """Return whether a friction explains the estimation recording clearly better with the motion it makes: else that is no reason to
    prefer it to what holds nothing still."""
    as_recorded = max(other.gain for other in made if other.candidate.part == trial.candidate.part)
    return _gains_more(trial.gain, as_recorded, method)


def _gains_more(gain: float, other: float, method: Method) -> bool:
    """Return whether a gain of the estimation recording is clearly above another one."""
    return compare_models(Gains(gain - other), method, explained=other).better


def _of_more_stages(batch: Sequence[Screened], model: Model) -> list[Asked]:
    """Return what makes a reading late in its finer shape too: a filter of several stages is nearer to a shift than to one stage, and would
    lose its name to it."""
    found = []
    for item in batch:
        shaped, late = item.candidate.shaped, item.candidate.effect.identification.delay
        if shaped is not None and late:
            start = 0.5 * shaped.usual
            # about as late as the plain shape, in two stages
            for name, value in zip(item.candidate.parameters, item.starts[0], strict=True):
                start[shaped.parameters.index(name)] = 0.5 * value if name == f"{shaped.part}.{late}" else value
            found.append(Asked(shaped, model.candidates, model.free, [start]))
    return found


def _batch(
    laboratory: Laboratory, found: SearchResult, ranked: Sequence[Screened], waiting: list[Screened], tried: Sequence[Trial], method: Method
) -> list[Screened]:
    """Return the candidates that are tried next, taken from the waiting ones, as far as the trials so far leave them worth it."""
    good = [trial for trial in tried if believable(trial, method, found.null_maximum)]
    kept = {trial.candidate.part for trial in good}
    # what expected much and kept none of it is no yardstick
    promised = max((item.gain for item in ranked if item.candidate.part in kept), default=0.0)
    least = max(0.5 * cost(method, null_maximum=found.null_maximum), method.worth_a_fit * promised)
    # of all channels together: what explains one of them may be a part of what explains all
    rest = float(found.model.error[::2].sum())
    explained = max((1.0 - float(trial.model.error[::2].sum()) / rest for trial in good), default=0.0)
    # once almost all is explained, only rivals of the best are fitted
    near = method.selection.rival * ranked[0].gain if explained > method.selection.almost_all else 0.0
    first = ranked[: method.screened]
    batch: list[Screened] = []
    while waiting and len(batch) < TOGETHER:
        item = waiting.pop(0)
        if item.gain < least:
            waiting.clear()
        elif not _may_add(item, *((explained, near) if item in first else (explained + method.selection.hopeless, np.inf))):
            continue
        elif may_be_worth(laboratory, found.model, item, method):
            batch.append(item)
    return batch


def _may_add(item: Screened, explained: float, near: float) -> bool:
    """Return whether a candidate may do as well as what was tried: it scores a larger share of the error than was ``explained``, or as much
    gain as what cannot be told from the best, ``near`` [nats]."""
    return item.share > explained or item.gain >= near


def _starts(item: Screened, method: Method = STANDARD) -> Sequence[FloatArray]:
    """Return the starting values of a fit: of an effect that is linear in its one size, one is enough."""
    return item.starts[: 1 if len(item.candidate.parameters) == 1 and not is_limit(item.candidate).any() else 2]


def _rivals(
    laboratory: Laboratory,
    found: SearchResult,
    ranked: Sequence[Screened],
    screened: Sequence[Screened],
    best: Trial,
    tried: Sequence[Trial],
    method: Method = STANDARD,
) -> list[Trial]:
    """Return trials of candidates that were not tried yet: they score as much as the best, or are relatives of it that are no less simple.

    What cannot be distinguished from it is tied with it, and the simpler one is taken. Beside implausible values scores say little.
    """
    known, together = {trial.candidate.part for trial in tried}, {item.candidate.part for item in ranked}
    promised = next(item.gain for item in ranked if item.candidate.part == best.candidate.part)
    others = [item for item in screened if item.candidate.part not in known]
    near, most = method.shared.nearly_all, method.selection.most_rivals
    alike = [item for item in others if item.candidate.part in together and near * promised < item.gain < promised / near]
    alike = sorted(alike, key=lambda item: abs(item.gain - promised))[:most]
    implausible = is_implausible(found.model.fitted, method=method)
    least = method.selection.hopeless if implausible else method.shared.larger_part
    alike += [item for item in others if item not in alike and _is_relative(item.candidate, best.candidate, item.gain > least * promised)]
    if implausible:
        # of one family at another place: a force and a voltage that add a constant score alike but for implausible values
        elsewhere = [
            item for item in others if item.candidate.family == best.candidate.family and item.gain > method.shared.larger_part * promised
        ]
        fewer_values = [item for item in elsewhere if len(item.candidate.parameters) <= len(best.candidate.parameters)]
        alike += [item for item in fewer_values if item not in alike][: method.selection.most_rivals]
    asked = [Asked(item.candidate, found.model.candidates, found.model.free, item.starts[:1]) for item in alike]
    return side_by_side(laboratory, found.model, asked)


def _is_relative(candidate: Candidate, other: Candidate, promising: bool) -> bool:
    """Return whether a candidate is what another one refines, or one of its family at the same place with no more values that is
    ``promising``."""
    if candidate.at != other.at or len(candidate.parameters) > len(other.parameters):
        return False
    return candidate.name in other.effect.identification.generalises or (candidate.family == other.family and promising)


def _told_screened(laboratory: Laboratory, ranked: Sequence[Screened], null_maximum: float) -> None:
    """Report the scores of the best candidates before any of them is fitted."""
    named = [(f"{item.candidate.name} at {item.candidate.at}", item) for item in ranked]
    words = ", ".join(f"{name} {item.gain:.0f} ({item.share:.0%})" for name, item in named)
    standings = [CandidateStanding(name, item.gain, np.nan, item.share) for name, item in named]
    laboratory.progress(Standing.told(f"  screening scores in nats (null maximum {null_maximum:.0f}): {words}", standings))
