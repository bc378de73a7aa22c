"""How a model grows: forward selection with everything refitted each time, backward elimination, and refinement.

Simple effects come first; what only refines one of them (a friction that is also asymmetric) may then take its place.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from lathesim.diagnosis.candidates.eligibility import due, finer
from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.candidates.periodic_starts import is_a_wave
from lathesim.diagnosis.candidates.screening import is_limit, screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import believable, credible_if_it_moves, is_an_event, is_of_a_clock, merit, simplest
from lathesim.diagnosis.selection.elimination import fewer, fitted_without
from lathesim.diagnosis.selection.laboratory import Bench, is_strained, judged_score, strains_anew
from lathesim.diagnosis.selection.moves.extend import take_finer_shape
from lathesim.diagnosis.selection.moves.generalise import may_be_worth, refine
from lathesim.diagnosis.selection.moves.merge_harmonics import take_whole_wave
from lathesim.diagnosis.selection.refusal import pushes_at, quiet_parts, refusal
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Tell
from lathesim.identification.execution.threads import TOGETHER
from lathesim.identification.records.candidate import Term, instants_of
from lathesim.identification.records.model import Model, Trial, is_wide
from lathesim.identification.replay.experiment import STICKING, Rig

_ALIKE = 0.1
"""Candidates whose promises differ by less than this share may be the same thing to the channels."""
_MOST_RIVALS = 3
_AS_MUCH = 0.8
"""Share of what the best candidate promises that a finer shape of an effect of the model must promise to be tried before it."""
_RELATED, _RELATED_IF_STRAINED = 0.5, 0.1
"""Share of the promise of an effect that one of its family with no more values must have promised to be fitted too."""
_NEARLY_ALL, _FAR_FROM_ALL = 0.95, 0.8
"""Share of the error that a finer effect must promise to be tried before simple ones, and how little these must promise then."""
_MUCH, _MORE, _MUCH_MORE = 0.5, 4, 0.2
"""Share of the error that further candidates, at most so many, must promise to be fitted, and by how much that must be more than what the
first ones explained."""
_PUSHED = "effort"
_KEPT = 0.5
"""Share of what it promised that an effect must keep not to be tried again with the simulated motion."""
_AGREES = 0.6
"""Share of its gain on one recording that a friction must gain on the other not to be tried again with the simulated motion."""
_CLEARLY_BETTER = 1.1
"""Times by which a friction must gain more with the motion it makes."""
_SPOILT, _NEARLY_AS_MUCH = 1.05, 0.9
"""Factor by which an effect may make the lesson's own simulation worse, and share of what it takes away that another one must that does
not."""
_NEAR = ((0.98, 0.85), (0.95, 0.6))
"""Once one candidate removes this share of what is left, others are fitted only where they promised that share of the best promise: what
cannot be told from it promises as much."""


def grow(bench: Bench, found: Found, settings: Settings, known: Collection[Term] = ()) -> None:
    """Add effects one at a time as long as one is believable, or until the model has come to the ``known`` effects of another one or the
    search has cost all that it may."""
    while len(found.model.terms) < settings.most_effects:
        if known and same_effects(found.model.terms, known):
            return
        if not settings.affords(bench.runs, len(bench.rig.candidates)):
            found.ended_after = bench.runs
            return
        quiet = quiet_parts(bench, found.model)
        simple, refined = (
            [term for term in asked(found.model, bench.rig) if term.part not in found.refused and not pushes_at(term, quiet)]
            for asked in (due, finer)
        )
        bench.say(f"screening {len(simple) + len(refined)} candidates")
        points = starting_points(bench.rig, found.model.fitted, [*simple, *refined])
        screening = screen(bench.rig.sensed, found.model.fitted, [*simple, *refined], points)
        found.chance = screening.chance if settings.against_chance else 0.0
        promised = max((item.gain for item in screening.ranked), default=0.0)
        if take_finer_shape(bench, found, settings, _AS_MUCH * promised):
            _leave_out_unworthy(bench, found, settings)
            continue
        if any(_add(bench, found, settings, ranked, screening.ranked) for ranked in in_turn(screening.ranked, simple)):
            continue
        if not take_finer_shape(bench, found, settings):
            return
        _leave_out_unworthy(bench, found, settings)


def same_effects(terms: Collection[Term], others: Collection[Term]) -> bool:
    """Say whether two models have the same effects."""
    return {term.part for term in terms} == {term.part for term in others}


def in_turn(ranked: Sequence[Screened], plain: Sequence[Term]) -> list[tuple[Screened, ...]]:
    """Give the candidates as they are tried: simple effects and then finer ones, or the other way round where nothing simple promises what
    a finer one does."""
    simple = tuple(item for item in ranked if item.term in plain)
    refined = tuple(item for item in ranked if item.term not in plain)
    of_refined, of_simple = (max((item.share for item in items), default=0.0) for items in (refined, simple))
    return [refined, simple] if of_refined > _NEARLY_ALL and of_simple < _FAR_FROM_ALL else [simple, refined]


def _add(bench: Bench, found: Found, settings: Settings, ranked: tuple[Screened, ...], screened: tuple[Screened, ...]) -> bool:
    """Add the best of some candidates, ``ranked``, of all that were ``screened``; False where none is believable."""
    if not ranked:
        return False
    found.screened = ranked
    best_promises = ", ".join(f"{item.term.name} at {item.term.at} {item.gain:.0f} ({item.share:.0%})" for item in ranked[:5])
    bench.say(f"  promised nats (chance gives {found.chance:.0f}): {best_promises}")
    tried: list[Trial] = []
    first = ranked[: settings.screened]
    waiting = [*first, *[item for item in ranked[settings.screened :] if item.share > _MUCH][:_MORE]]
    while wave := _wave(bench, found, waiting, ranked[0].gain, tried, settings):
        asked = [Asked(item.term, found.model.terms, found.model.free, _starts(item), item.share) for item in wave]
        asked += [*_bare(wave, found.model), *_of_more_stages(wave, found.model)]
        made = side_by_side(bench, found.model, asked)
        to_feel = [*_to_be_felt(made, tried, found.model), *_held_at_rest(bench.rig, wave, made, found.model)]
        felt = side_by_side(bench, found.model, to_feel)
        tried += [*made, *[trial for trial in felt if _holds_still(trial, made)]]
    found.tried += tried
    good = [trial for trial in tried if believable(trial, settings, found.chance) and not is_part_of_a_wave(trial, found.model)]
    good = [trial for trial in good if _is_in_time(bench, trial.term, trial.model)]
    good = [trial for trial in good if is_a_wave(bench.rig, trial.term, trial.model.fitted.by_name)]
    good = _unspoilt(good)
    if not good:
        return take_whole_wave(bench, found, settings, [trial for trial in tried if believable(trial, settings, found.chance)])
    good.sort(key=lambda trial: -merit(trial, settings))
    best = simplest(good, settings)
    good += [trial for trial in _rivals(bench, found, ranked, screened, best, tried) if believable(trial, settings, found.chance)]
    best = simplest(sorted(good, key=lambda trial: -merit(trial, settings)), settings)
    if found.model.terms and best.share_of_all < settings.share_of_all and refine(bench, found, settings, best.share_of_rest):
        # what is so small beside the effects that were found is rather a finer form of one of them
        return True
    settled = bench.settled(best.model)
    while why := refusal(bench, found.model, best, settled, settings):
        bench.say(f"  {best.term.name} at {best.term.at} is refused: {why}")
        good = [trial for trial in good if trial is not best]
        if not good:
            return False
        best = simplest(good, settings)
        settled = bench.settled(best.model)
    found.trials[best.term.part] = good
    others = [trial for trial in tried if trial.term.part not in {known.term.part for known in good}]
    found.unmoved[best.term.part] = [trial for trial in others if credible_if_it_moves(trial, settings, found.chance)]
    if not found.model.terms:
        found.beginnings = sorted((trial for trial in good if trial is not best), key=lambda trial: -merit(trial, settings))
    before, found.model = found.model, settled
    found.before[best.term.part] = before
    if strains_anew(before.fitted, found.model.fitted):
        found.straining.add(best.term.part)
    bench.say(f"{best.term.name} at {best.term.at}: {best.gain:.0f} nats, removes {best.share_of_all:.0%}")
    _eliminate(bench, found, settings)
    return True


def _unspoilt(good: Sequence[Trial]) -> list[Trial]:
    """Give the trials without those with which the lesson's own simulation is further off, where another one takes away nearly as much and
    that is no further off: a replay that runs away is held by whatever keeps the machine at rest, and a controller would not have it."""
    kept = max((trial.share_of_rest for trial in good if trial.spoils <= 1.0), default=0.0)
    return [trial for trial in good if trial.spoils < _SPOILT or kept < _NEARLY_AS_MUCH * trial.share_of_rest]


def _bare(wave: Sequence[Screened], model: Model) -> list[Asked]:
    """Give the barest forms of candidates, to be tried with frictions that sense the recorded motion and with such that feel the simulated
    one: with more values a fit gets lost where a table stands still."""
    found = []
    for item in wave:
        if (bare := item.term.bare) is not None:
            start = item.starts[0][[item.term.parameters.index(name) for name in bare.parameters]]
            found += [Asked(bare, model.terms, model.free, [start], felt=felt) for felt in (False, True)]
    return found


def _to_be_felt(made: Sequence[Trial], before: Sequence[Trial], model: Model) -> list[Asked]:
    """Give frictions that explain one recording much better than the other, to be tried with the simulated motion: where they hold a part
    still, what the recorded motion lets go adds up over each recording in its own way. So are such that take away nearly all, where
    something else of which that is true as well gains more: a dead zone holds a part still too."""
    frictions = [trial for trial in made if trial.term.family == STICKING and trial.gain > 0.0]
    others = [trial.gain for trial in (*before, *made) if trial.term.family != STICKING and trial.share_of_rest > _NEARLY_ALL]
    most = max(others, default=0.0)
    doubted = [
        trial
        for trial in frictions
        if not _AGREES * trial.gain < trial.held_out_gain < trial.gain / _AGREES
        or (trial.share_of_rest > _NEARLY_ALL and most > _CLEARLY_BETTER * trial.gain)
    ]
    found = []
    for trial in doubted:
        values = trial.model.fitted.by_name
        start = np.array([values[name] for name in trial.term.parameters])
        found.append(Asked(trial.term, model.terms, model.free, [start], felt=True))
    return found


def _held_at_rest(rig: Rig, wave: Sequence[Screened], made: Sequence[Trial], model: Model) -> list[Asked]:
    """Give pushing effects that kept little of what they promised, to be tried with frictions that feel the simulated motion: at rest these
    hold whatever pushes, and one that senses the recorded motion lets go."""
    found = []
    for item in wave:
        kept = max((trial.share_of_rest for trial in made if trial.term.part == item.term.part), default=1.0)
        pushes = item.term.effect.site == _PUSHED and item.term.family != STICKING
        if pushes and item.share > _MUCH and kept < _KEPT * item.share and rig.feeling_their_motion(model.terms):
            found.append(Asked(item.term, model.terms, model.free, item.starts[:1], felt=True))
    return found


def _holds_still(trial: Trial, made: Sequence[Trial]) -> bool:
    """Say whether a friction explains the fitted recording clearly better with the motion it makes: else that is no reason to prefer it to
    what holds nothing still."""
    as_recorded = max(other.gain for other in made if other.term.part == trial.term.part)
    return trial.gain > _CLEARLY_BETTER * as_recorded


def _of_more_stages(wave: Sequence[Screened], model: Model) -> list[Asked]:
    """Give what makes a reading late in its finer shape too: a filter of several stages is nearer to a shift than to one stage, and would
    lose its name to it."""
    found = []
    for item in wave:
        shaped, late = item.term.shaped, item.term.effect.late_by
        if shaped is not None and late:
            start = 0.5 * shaped.usual
            # about as late as the plain shape, in two stages
            for name, value in zip(item.term.parameters, item.starts[0], strict=True):
                start[shaped.parameters.index(name)] = 0.5 * value if name == f"{shaped.part}.{late}" else value
            found.append(Asked(shaped, model.terms, model.free, [start]))
    return found


def _wave(bench: Bench, found: Found, waiting: list[Screened], best: float, tried: Sequence[Trial], settings: Settings) -> list[Screened]:
    """Take from the waiting candidates those that are tried next, as far as the trials so far leave them worth it."""
    good = [trial for trial in tried if believable(trial, settings, found.chance)]
    kept = {trial.term.part for trial in good}
    # what promised much and kept none of it is no yardstick
    promised = max((item.gain for item in found.screened if item.term.part in kept), default=0.0)
    least = max(0.5 * (settings.margin + found.chance), settings.worth_a_fit * promised)
    # of all channels together: what explains one of them may be a part of what explains all
    rest = float(found.model.error[::2].sum())
    explained = max((1.0 - float(trial.model.error[::2].sum()) / rest for trial in good), default=0.0)
    near = best * next((share for removed, share in _NEAR if explained > removed), 0.0)
    first = found.screened[: settings.screened]
    wave: list[Screened] = []
    while waiting and len(wave) < TOGETHER:
        item = waiting.pop(0)
        if item.gain < least:
            waiting.clear()
        elif not _may_add(item, *((explained, near) if item in first else (explained + _MUCH_MORE, np.inf))):
            continue
        elif may_be_worth(bench, found.model, item, settings):
            wave.append(item)
    return wave


def _may_add(item: Screened, explained: float, near: float) -> bool:
    """Say whether a candidate may do as well as what was tried: it promises a larger share of the error than was ``explained``, or as much
    gain as what cannot be told from the best, ``near`` [nats]."""
    return item.share > explained or item.gain >= near


def _starts(item: Screened) -> Sequence[FloatArray]:
    """Give the starting values of a fit: of an effect that is linear in its one size, one is enough."""
    return item.starts[: 1 if len(item.term.parameters) == 1 and not is_limit(item.term).any() else 2]


def _rivals(
    bench: Bench, found: Found, ranked: Sequence[Screened], screened: Sequence[Screened], best: Trial, tried: Sequence[Trial]
) -> list[Trial]:
    """Fit what promised as much as the best, or is a relative of it that is no less simple, and was not fitted yet: what cannot be told
    from it is said to be tied, and the simpler one is taken. Beside strained values promises say little."""
    known, together = {trial.term.part for trial in tried}, {item.term.part for item in ranked}
    promised = next(item.gain for item in ranked if item.term.part == best.term.part)
    others = [item for item in screened if item.term.part not in known]
    alike = [item for item in others if item.term.part in together and abs(item.gain - promised) < _ALIKE * promised][:_MOST_RIVALS]
    strained = is_strained(found.model.fitted)
    least = _RELATED_IF_STRAINED if strained else _RELATED
    alike += [item for item in others if item not in alike and _is_relative(item.term, best.term, item.gain > least * promised)]
    if strained:
        # of one family at another place: a force and a voltage that add a constant are strained values away from the same promise
        elsewhere = [item for item in others if item.term.family == best.term.family and item.gain > _RELATED * promised]
        fewer_values = [item for item in elsewhere if len(item.term.parameters) <= len(best.term.parameters)]
        alike += [item for item in fewer_values if item not in alike][:_MOST_RIVALS]
    asked = [Asked(item.term, found.model.terms, found.model.free, item.starts[:1]) for item in alike]
    rivals = side_by_side(bench, found.model, asked)
    found.tried += rivals
    return rivals


def _is_relative(term: Term, other: Term, promising: bool) -> bool:
    """Say whether a term is what another one refines, or one of its family at the same place with no more values that is ``promising``."""
    if term.at != other.at or len(term.parameters) > len(other.parameters):
        return False
    return term.name in other.effect.refines or (term.family == other.family and promising)


def _eliminate(bench: Bench, found: Found, settings: Settings) -> None:
    """Take out effects that the others have made needless, the earliest first, until none is; a lag that was a part of what they do and is
    next to nothing beside them is."""

    def is_needless(term: Term) -> bool:
        return not _is_in_time(bench, term, found.model) or _is_needless(bench, found.model, term, settings)

    while needless := next((term for term in found.model.terms[:-1] if is_needless(term)), None):
        bench.say(f"{needless.name} at {needless.at} is no longer needed")
        found.model = fewer(bench, found.model, needless)
        found.take_over(found.model.terms[-1], needless)


def _leave_out_unworthy(bench: Bench, found: Found, settings: Settings) -> None:
    """Take out effects that were a part of the finer shape of the last one, and with that take away too little to be worth a name."""
    for term in found.model.terms[:-1]:
        without = fewer(bench, found.model, term)
        lost = without.error - found.model.error
        rest = without.error + np.maximum(bench.everything - bench.baseline_error, 0.0)
        of_all, of_rest = float(np.max(lost / bench.everything)), float(np.max(lost / rest))
        much = of_all > settings.share_of_all and of_rest > settings.share_of_rest
        if not (much or of_rest > settings.nearly_all_of_rest):
            bench.say(f"{term.name} at {term.at} was a part of the shape of {found.model.terms[-1].name}")
            found.model = without
            found.trials.pop(term.part, None)


def _is_in_time(bench: Bench, term: Term, model: Model) -> bool:
    period = bench.rig.machine.assembly.sample_period
    values, duration = model.fitted.by_name, len(bench.rig.record) * period
    return is_of_a_clock(term, values, period, duration) and is_an_event(instants_of(term.parameters), values, duration)


def _is_needless(bench: Bench, model: Model, term: Term, settings: Settings) -> bool:
    """Say whether a model without one of its terms loses no more than the term's parameters cost."""
    without = judged_score(bench.rig, fitted_without(bench, model, term))
    lost = model.score.above(without, wide=is_wide(model.terms))
    return lost < settings.margin + settings.per_parameter * len(term.parameters)


def leave_out(found: Found, terms: Sequence[Term], rig: Rig, held_out: Rig, tell: Tell) -> None:
    """Take effects out of what was found and fit the rest again."""
    bench = Bench(rig, held_out, tell)
    bench.weigh(found.baseline.fitted)
    rest = tuple(term for term in found.model.terms if term not in terms)
    if not rest:
        found.model = found.baseline
        return
    gone = {name for term in terms for name in term.parameters}
    free = [item for item in found.model.free if item.name not in gone]
    found.model = bench.model(rest, fit(rig.sensed, free, found.model.fitted.constant, rounds=2, wide=is_wide(rest)))
