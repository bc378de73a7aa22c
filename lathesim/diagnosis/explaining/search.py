"""Which explanation predicts best: the model grows by what predicts the validation recording better, and loses what does not help.

In each round all candidates are screened, the most promising are fitted jointly with everything that is free already, and each is judged by
what it predicts of the validation recording. Of those that cannot be told from the best the simplest is taken. Afterwards finer forms are
put in the place of effects, and each effect is left out once: what it is worth then, and which rivals predict as well in its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.explaining.chance import is_clear
from lathesim.diagnosis.explaining.plausible import IMPLAUSIBLE, deviations, is_plausible, is_usual, own_residuals, released
from lathesim.diagnosis.explaining.resolution import as_good, best_of, significant, simplest, small_and_unsure
from lathesim.diagnosis.explaining.rounds import Rounds, is_finer, is_off, led_to
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import modelled, neutral, over, settled_trial, tried, was_there_before, without, worth
from lathesim.diagnosis.method.method import FIRSTS, MOST_EFFECTS, SEARCH_TIME
from lathesim.diagnosis.records.comparison import Step
from lathesim.diagnosis.records.found import Found, Screened, Tried
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import until
from lathesim.identification.records import Candidate, Model
from lathesim.identification.replay.experiment import baseline_free
from lathesim.identification.replay.joined import JoinedExperiment
from lathesim.identification.roles import closes_a_loop


def explains_the_motion(study: Study, model: Model) -> bool:
    """Return whether the lesson's own simulation of a model leaves less of each channel than what is put down to a cause may leave.

    A closed loop follows its command whatever is missing: without an effect it has to leave little.
    """
    method, own, residual = study.method, study.validation.own, own_residuals(study, model)[1]
    size = method.larger_part * np.maximum(own.seen_spread, own.seen_floors)
    if not model.candidates and is_closed_loop(study):
        size = np.maximum(method.little * own.seen_spread, method.errors * own.seen_floors)
    return bool(np.all(np.mean(residual**2, axis=1) < size**2))


def is_closed_loop(study: Study) -> bool:
    """Return whether a part of the machine closes a loop."""
    return any(closes_a_loop(part) for part in study.estimation.machine.assembly.parts)


def explain(
    study: Study, begun: Model | None = None, *, of_motion: bool = False, instead: Callable[[Found], Found | None] | None = None
) -> Found:
    """Return the explanation that predicts the validation recording best; Ctrl-C and a deadline keep what was found until then.

    The search begins with the lesson as it stands, or goes on with what was ``begun``. With ``of_motion`` only what explains the motion is
    of use: the effects that grew are not held against rivals where they do not. What ``instead`` returns for what has grown ends the
    search, before pairs and rivals are tried, which takes longest.
    """
    # without the lesson itself there is no answer: only the search beyond it ends with its share of the time
    ends = study.ends.share(SEARCH_TIME)
    sensed = study.estimation.sensed
    fitted = fit(sensed, [*baseline_free(study.estimation.machine), *study.estimation.start_states(sensed.plan)], rounds=3)
    baseline = modelled(study, (), fitted)
    found = Found(baseline, begun or baseline)
    try:
        for state in _states(replace(study, progress=until(ends, study.progress)), found, of_motion, instead):
            found = state
    except KeyboardInterrupt:
        study.progress("stopped; what was found until here is kept")
        return found
    return replace(found, complete=True)


def _states(study: Study, found: Found, of_motion: bool, instead: Callable[[Found], Found | None] | None) -> Iterator[Found]:
    """Yield the search as far as it has come."""
    rounds = Rounds(study)
    if found.model is found.baseline:
        found = _with_other_values(study, found, rounds)
    yield found
    if instead is not None:
        for found in _grown(study, found, rounds, pairs=False):  # noqa: B020
            yield found
        if (other := instead(found)) is not None:
            yield other
            return
    for found in _grown(study, found, rounds):  # noqa: B020
        yield found
    while True:
        for found in _refined(study, found):  # noqa: B020
            yield found
        if of_motion and not explains_the_motion(study, found.model):
            return
        refined = len(found.model.candidates)
        for found in _compared(study, found, rounds):  # noqa: B020
            yield found
        if len(found.model.candidates) == refined:
            return
        # what went may have stood for what a finer form of another one does, or for values that were not reached before
        if rounds.is_new(found.model):
            rounds.others, rounds.ahead = [], []
            for found in _grown(study, found, rounds):  # noqa: B020
                yield found


def _with_other_values(study: Study, found: Found, rounds: Rounds) -> Found:
    """Return the search from values of the lesson that are further off than it holds possible, where these predict as well as an effect.

    Each value may then be another one by a factor, and costs half the square of its deviation in nats, as any value does.
    """
    if deviations(found.baseline.fitted).max(initial=0.0) < IMPLAUSIBLE:
        return found
    study.progress("values further off than the lesson declares")
    values = modelled(study, (), fit(study.estimation.sensed, released(study), rounds=3))
    fitted, predicted = over(values, found.baseline)
    if not (is_clear(fitted, study.method) and is_clear(predicted, study.method)):
        return found
    trials = rounds.on(found.model)
    found = found.having_tried(trials)
    best = chosen(study, trials)
    if best is not None and not as_good(values, best, study):
        return found
    step = Step("other values", (), (), fitted.nats, predicted.nats, "other values of the lesson predict as well as any effect")
    return replace(found, model=values, values=values, history=(step,))


def _grown(study: Study, found: Found, rounds: Rounds, *, pairs: bool = True) -> Iterator[Found]:
    """Yield the search with effects added as long as one predicts better, and without those that a later one made needless; then with
    ``pairs`` of effects in the place of what came in.

    By the error of a simulation only what explains the motion is found: what is left then is not as white as it is taken for.
    """
    needless = set[str]()
    while len(found.model.candidates) < MOST_EFFECTS and not _is_done(study, found):
        model = found.model
        trials = rounds.on(model, growing=True)
        found = found.having_tried(trials)
        best = chosen(study, [one for one in trials if one.candidate.part not in found.there_before | needless])
        if best is None:
            found = _on_another(study, found, _firsts(study, model, rounds), rounds) if pairs else found
            yield found
            if found.model is model:
                break
            rounds.others, rounds.ahead = [], []
        elif (led := _led_to(study, found, best)) is not None:
            needless |= set() if rounds.is_new(led.model) else {best.candidate.part}
            found = led
            yield found
        else:
            found = _otherwise(study, found, best, rounds)
            if found.model is not model:
                yield found
                continue
            for found in _with_added(study, found, best, trials, rounds):  # noqa: B020
                yield found


def _with_added(study: Study, found: Found, best: Tried, trials: Sequence[Tried], rounds: Rounds) -> Iterator[Found]:
    """Yield the search with the best trial of a round added, and without what it made needless."""
    good = [one for one in trials if significant(one, study)]
    rounds.rivals[best.candidate.part] = tuple(one.candidate for one in good if one is not best and as_good(one.model, best, study))
    rounds.others = [one for one in good if one is not best and is_plausible(study, one.model)]
    rounds.ahead += [one for one in rounds.others if one.predicted.nats > best.predicted.nats]
    if was_there_before(study, best):
        found = replace(found, there_before=found.there_before | {best.candidate.part})
    study.progress(f"{best.name} predicts better, by a gain of {best.predicted.nats:.0f}")
    found = found.changed("add", best, f"predicts better than without it, by a gain of {best.predicted.nats:.0f}")
    yield found
    for candidate in found.model.candidates[:-1]:
        left = without(study, found.model, candidate)
        if not significant(worth(candidate, left, found.model), study):
            found = _dropped(study, found, candidate, left)
            yield found


def _led_to(study: Study, found: Found, best: Tried) -> Found | None:
    """Return the search with the values that a further effect led to, see :func:`led_to`; none where it is worth something, or is the
    first."""
    left = led_to(study, found.model, best) if found.model.candidates else None
    if left is None:
        return None
    study.progress(f"{best.name} is not needed: the others predict as well with the values that it led to")
    fitted, predicted = over(left, found.model)
    step = Step("refit", (), (), fitted.nats, predicted.nats, f"fitted from where {best.name} led, which is worth nothing then")
    return replace(found, model=left, worth={}, rivals={}, history=(*found.history, step))


def _is_done(study: Study, found: Found) -> bool:
    """Return whether a search by the error of the simulation has found what explains the motion. One stroke shows no more of a small
    effect, and what no effect explains on both recordings may be a mixture of values that hides one."""
    confirmed = bool(found.model.candidates) and isinstance(study.estimation, JoinedExperiment)
    return study.estimation.machine.output_error and (confirmed or not study.judges_itself) and explains_the_motion(study, found.model)


def _firsts(study: Study, model: Model, rounds: Rounds) -> list[Tried]:
    """Return the effects that may stand at the beginning of a better explanation than what was found, the best first.

    They are the others of the last round where what was found does not explain the motion, and what was ahead in some round.
    """
    if not is_off(study, model):
        return []
    last = () if explains_the_motion(study, model) else rounds.others
    places = {(one.family, one.at) for one in model.candidates}
    apart = [one for one in rounds.ahead if (one.candidate.family, one.candidate.at) not in places]
    earlier = [one for one in apart if not any(one is other for other in last)]
    return [one for firsts in (last, earlier) for one in sorted(firsts, key=lambda one: -one.predicted.nats)[:FIRSTS]]


def _on_another(study: Study, found: Found, firsts: Sequence[Tried], rounds: Rounds) -> Found:
    """Return the search with two effects in the place of what came in since the first of them was tried; as it was where none predict
    better.

    A friction that holds a weight has no slope that leads to the weight, while the friction is found beside the weight. A resonance does
    what an early reading and a friction do, and nothing more is found beside it.
    """
    for first in firsts:
        there = {one.part for one in first.before.candidates}
        went = tuple(f"{one.name} at {one.place}" for one in found.model.candidates if one.part not in there)
        names = " and ".join(went)
        study.progress(f"{names}: trying {first.name} in the place, and another effect beside it")
        found, both = _beside(study, found, first, rounds)
        if both is not None and significant(both, study):
            why = f"predict better than {names} by {both.predicted.nats:.0f} nats"
            study.progress(f"{first.name} and {both.name} {why}")
            step = Step("add", (first.name, both.name), went, both.fitted.nats, both.predicted.nats, why)
            return replace(found, model=both.model, worth={}, rivals={}, history=(*found.history, step))
    return found


def _beside(study: Study, found: Found, first: Tried, rounds: Rounds) -> tuple[Found, Tried | None]:
    """Return the search with what was tried beside an effect, and the best of that with the effect itself, over the model before both."""
    beside = rounds.on(first.model)
    found, second = found.having_tried(beside), chosen(study, beside)
    if second is None:
        return found, None
    return found, worth(second.candidate, found.model, second.model)


def _otherwise(study: Study, found: Found, best: Tried, rounds: Rounds) -> Found:
    """Return the search with what is simpler than the best further effect and predicts as well: a finer form or a rival in the place of
    what was found; as it was where there is none."""
    model = found.model
    found = _finer_instead(study, found, best)
    return found if found.model is not model else _rival_instead(study, found, best, rounds)


def chosen(study: Study, trials: Sequence[Tried]) -> Tried | None:
    """Return the simplest of the trials that predict as well as the best one; none where none predicts better than the model before.

    A finer form waits where its simpler one predicts better too: it may take its place later.
    """
    good = [one for one in trials if significant(one, study) and is_plausible(study, one.model)]
    plain = [one for one in good if not is_finer(one.candidate, [other.candidate for other in good])]
    best = best_of(study, plain or good)
    return None if best is None else simplest(best, good, study)


def _dropped(study: Study, found: Found, candidate: Candidate, left: Model, why: str = "the others predict as well without it") -> Found:
    study.progress(f"{candidate.name} at {candidate.place} is not needed: {why}")
    return found.changed("drop", worth(candidate, found.model, left), why, [candidate])


def _refined(study: Study, found: Found) -> Iterator[Found]:
    """Yield the search with finer forms in the place of effects where these predict much of what is left."""
    for candidate in found.model.candidates:
        trials = _finer_forms(study, found.model, candidate)
        found = found.having_tried(trials)
        best = chosen(study, trials)
        if best is not None and min(best.predicted.share, best.fitted.share) > study.share_of_rest:
            found = _with_finer(study, found, candidate, best)
            yield found


def _finer_forms(study: Study, model: Model, candidate: Candidate) -> list[Tried]:
    """Return the finer forms of an effect of a model, each fitted in its place."""
    here = [one for one in study.estimation.candidates if one.at == candidate.at]
    finer = [one for one in here if candidate.name in one.effect.identification.generalises]
    return [_in_place(study, model, candidate, form) for form in (*finer, *([candidate.shaped] if candidate.shaped is not None else []))]


def _with_finer(study: Study, found: Found, candidate: Candidate, best: Tried) -> Found:
    """Return the search with a finer form in the place of an effect, or with values that it led to and the simpler one had not reached."""
    again = _in_place(study, best.model, best.candidate, candidate)
    if as_good(again.model, best, study):
        gained = worth(candidate, found.model, again.model)
        return found.changed("refit", gained, f"fitted from where {best.candidate.name} led, which predicts no better")
    study.progress(f"{best.candidate.name} takes the place of {candidate.name}")
    return found.changed("refine", best, "a finer form predicts better", [candidate])


def _finer_instead(study: Study, found: Found, added: Tried) -> Found:
    """Return the search with a finer form of an effect that predicts as well as a further effect would and has no more values, predicts
    better than it, or is the shape of a wave where that effect is a second wave; as it was where there is none.

    Otherwise several effects stand in the end for what one is, as two late sensors do for a slow loop, or a weight beside a dry friction
    does for one that differs between the directions.
    """
    for candidate in found.model.candidates:
        trials = _finer_forms(study, found.model, candidate)
        found = found.having_tried(trials)
        best = chosen(study, trials)
        if best is None or not as_good(best.model, added, study):
            continue
        periodic = [one.effect.identification.periodic for one in (added.candidate, candidate)]
        fewer = best.parameters <= candidate.counted + added.parameters
        if fewer or (added.candidate.at == candidate.at and all(periodic)) or not as_good(added.model, best, study):
            return _with_finer(study, found, candidate, best)
    return found


def _rival_instead(study: Study, found: Found, added: Tried, rounds: Rounds) -> Found:
    """Return the search with a rival in the place of an effect where it predicts as well as a further effect beside that one would, with
    no more values; as it was where none does.

    A filter of a reading does what the lag of a motor does until a friction is found. Beside the lag another sensor is then late too.
    """
    for candidate in found.model.candidates:
        rivals = [one for one in rounds.rivals.get(candidate.part, ()) if one is not added.candidate and not found.holds(one)]
        trials = [_in_place(study, found.model, candidate, one) for one in rivals if one.counted <= candidate.counted + added.parameters]
        found = found.having_tried(trials)
        best = chosen(study, trials)
        if best is not None and as_good(best.model, added, study):
            study.progress(f"{best.candidate.name} takes the place of {candidate.name}")
            return found.changed("swap", best, f"predicts as well as {added.name} would beside it", [candidate])
    return found


def _in_place(study: Study, model: Model, candidate: Candidate, form: Candidate) -> Tried:
    """Return a form fitted in the place of an effect, beginning with the values that both have."""
    shared = {Place.of(name).port: model.fitted.by_name[name] for name in candidate.parameters}
    starts = [
        np.array([shared.get(Place.of(name).port, value) for name, value in zip(form.parameters, row, strict=True)])
        for row in (form.neutral, *form.points)
    ]
    made = tried(study, neutral(model, candidate), Screened(form, 0.0, tuple(starts[:1])), np.array(starts[1:]))
    return replace(settled_trial(study, model, made), before=model)


def _compared(study: Study, found: Found, rounds: Rounds) -> Iterator[Found]:
    """Yield the search with what each effect of the model is worth and its rivals; a better or a simpler rival takes its place."""
    swaps, waiting = 0, list(found.model.candidates)
    while True:
        if not waiting:
            doubtful = small_and_unsure(study, found.model, found.worth.values())
            if doubtful is None:
                return
            rivals = rounds.on(doubtful.before) if swaps < MOST_EFFECTS else []
            swaps, found = swaps + 1, surer_instead(study, found, doubtful, rivals)
            waiting = list(found.model.candidates)
            yield found
            continue
        candidate = waiting.pop(0)
        left = without(study, found.model, candidate)
        own = worth(candidate, left, found.model)
        if not significant(own, study):
            found = _dropped(study, found, candidate, left)
            waiting = list(found.model.candidates)
            yield found
            continue
        trials = [one for one in rounds.on(left, own) if one.candidate.part != candidate.part]
        trials += _shaped_rivals(study, found.model, own, trials)
        found = found.having_tried(trials)
        believed = is_usual(study, candidate, found.model.fitted.by_name)
        best = chosen(study, [own, *trials])
        better = best is not None and best is not own and swaps < MOST_EFFECTS and (not believed or _better(study, found.model, best, own))
        # what would be dropped in the end takes no place, which would be empty then
        if best is not None and better and small_and_unsure(study, best.model, [best]) is None:
            study.progress(f"{best.candidate.name} takes the place of {candidate.name}")
            why = "predicts better, or as well with fewer values" if believed else f"{candidate.name} is no longer plausible"
            swaps, found = swaps + 1, found.changed("swap", best, why, [candidate])
            waiting = list(found.model.candidates)
            yield found
            continue
        if not believed:
            found = _dropped(study, found, candidate, left, "fitted beside them it is no longer plausible")
            waiting = list(found.model.candidates)
            yield found
            continue
        alike = ties(study, own, trials)
        found = replace(found, worth={**found.worth, candidate.part: own}, rivals={**found.rivals, candidate.part: alike})
        yield found


def _shaped_rivals(study: Study, model: Model, own: Tried, trials: Sequence[Tried]) -> list[Tried]:
    """Return the finer shapes of what leaves a like trace and does not predict as well as an effect of a model, fitted in its place.

    A share of the drive does to a ripple what the second harmonic of a cogging does, where a loop answers to both.
    """
    trace = own.candidate.family, own.candidate.at
    alike = [one for one in trials if (one.candidate.family, one.candidate.at) == trace and significant(one, study)]
    behind = [one.candidate.shaped for one in alike if one.candidate.shaped is not None and not as_good(one.model, own, study)]
    made = [_in_place(study, model, own.candidate, shaped) for shaped in behind]
    return [worth(one.candidate, own.before, one.model) for one in made]


def ties(study: Study, own: Tried, trials: Sequence[Tried]) -> tuple[Tried, ...]:
    """Return the trials in the place of an effect that predict as well, other effects than a finer form of it or the other sensor."""
    good = [one for one in trials if significant(one, study) and is_plausible(study, one.model) and as_good(one.model, own, study)]
    return tuple(one for one in good if not (is_finer(one.candidate, [own.candidate]) or is_the_other_sensor(one.candidate, own.candidate)))


def surer_instead(study: Study, found: Found, doubtful: Tried, trials: Sequence[Tried]) -> Found:
    """Return the search with the best of some trials whose size is sure in the place of a doubtful effect; without it where there is none.

    A lag that may as well be more inertia hides a lag of another form, which the inertia cannot stand for.
    """
    others = [one for one in trials if not found.holds(one.candidate)]
    best = chosen(study, [one for one in others if small_and_unsure(study, one.model, [one]) is None])
    if best is None:
        return _dropped(study, found, doubtful.candidate, doubtful.before, "it explains little, and its size may be zero")
    study.progress(f"{best.candidate.name} takes the place of {doubtful.candidate.name}")
    return found.changed("swap", best, f"predicts better too, and the size of {doubtful.candidate.name} may be zero", [doubtful.candidate])


def _better(study: Study, model: Model, best: Tried, worth: Tried) -> bool:
    """Return whether a rival predicts better than the effect in whose place it is, or as well with fewer values."""
    return (best.parameters < worth.parameters and as_good(best.model, worth, study)) or not as_good(model, best, study)


def is_the_other_sensor(rival: Candidate, candidate: Candidate) -> bool:
    """Return whether a rival is the same effect between the same two sensors, which is reported at the second of them."""
    return (
        rival.name == candidate.name
        and rival.seat.of_motion == candidate.seat.of_motion
        and candidate.effect.identification.between_sensors
    )
