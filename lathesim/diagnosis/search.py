"""Which effects were left out: forward selection with everything refitted each time, backward elimination, refinement, and a judge.

An effect is believed when (a) the likelihood of the fitted recording rises by more than its parameters and what chance does among as many
candidates can explain, (b) the held-out recording agrees, (c) it removes a share of the error that is worth a name, and (d) it moves a
channel by more than the floor. Simple effects come first; what only refines one of them (a friction that is also asymmetric) may then
take its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.fit import fit
from lathesim.diagnosis.other_forms import form_starts, forms_of_two, is_harmonic, two_for_one
from lathesim.diagnosis.problem import Rig, baseline_free
from lathesim.diagnosis.screening import Screened, is_limit, least_shown, screen, screened_instead
from lathesim.diagnosis.side_by_side import TOGETHER, Asked, side_by_side
from lathesim.diagnosis.starting_points import starting_points
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.time_limit import until
from lathesim.diagnosis.trial import STRAINED, Bench, Model, Tell, Trial, is_strained, is_wide, judged_score, strains, strains_anew
from lathesim.diagnosis.value_far_off import value_far_off
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray

_EQUAL = 1.0
"""Nats within which two candidates are equals; of equals the one that comes first in the catalogue, the commoner one, is taken."""
_EQUAL_SHARE = 0.01
"""The same as a share of what they gain: a trial's fit is rough."""
_LAST = 1000
_TIMINGS = ("ChannelTimeShift", "SensorFilter")
_LEAST_SHIFT = 0.2
"""Share of a sample by which a channel must be late."""
TIE_SHARE = 0.03
"""Share of what the better of two candidates gains within which they cannot be told apart, as a model is never quite right."""
_ALIKE = 0.1
"""Candidates whose promises differ by less than this share may be the same thing to the channels."""
_MOST_RIVALS = 3
_RELATED = 0.5
"""Share of the promise of an effect that a simpler one of its family must have promised to be fitted too."""
_NEAR = ((0.98, 0.85), (0.95, 0.6))
"""Once one candidate removes this share of what is left, others are fitted only where they promised that share of the best promise: what
cannot be told from it promises as much."""


@dataclass(frozen=True)
class Settings:
    """How the search goes about it."""

    most_effects: int = 4
    longest: float = np.inf
    """Time after which the search ends and keeps what is known [s]."""
    screened: int = 5
    """Candidates fitted in one round."""
    worth_a_fit: float = 0.25
    """Share of the best candidate's promise below which a candidate is not fitted."""
    margin: float = 10.0
    """Nats by which a fit must get better beyond its parameters' due and beyond what chance reaches among the candidates."""
    per_parameter: float = 3.0
    against_chance: bool = True
    """Whether what chance reaches among the candidates counts against an effect."""
    held_out_margin: float = 3.0
    smallest_move: float = 1.0
    """An effect must move a channel by more than this many times what is left unexplained there ..."""
    small_move: float = 0.3
    almost_all: float = 0.9
    """... or this many times, where it removes almost all of the error: effects not found yet may leave more there than it moves."""
    most_spoilt: float = 1.5
    """Factor by which an effect may make a channel of the lesson's own simulation worse."""
    largest_size: float = 30.0
    """Largest usual sizes of an effect beyond which it is not believed ..."""
    largest_shape: float = 10.0
    """... and the same of its other values, where these are usually positive: a peak at low speed that lasts to 5 m/s is none."""
    smallest_shape: float = 100.0
    """Factor below their usual range: a warm-up of a millisecond is a constant in disguise."""
    share_of_all: float = 0.03
    share_of_rest: float = 0.15
    """An effect must remove both of these shares of the error: of all that was there, and of what the others left ..."""
    nearly_all_of_rest: float = 0.6
    """... or this share of what the others left, however little of all that is."""
    refined_share_of_rest: float = 0.9
    """The same for a refined form that takes the place of a simple one."""
    nearly_worth: float = 0.5
    """Share of ``nearly_all_of_rest`` that a candidate must promise to be fitted, where it cannot come to the other two."""


@dataclass
class Found:
    """The outcome of a search, as far as it has come: the refitted baseline, the model, and what was tried beside each effect."""

    baseline: Model
    model: Model
    trials: dict[str, list[Trial]] = field(default_factory=dict)
    tried: list[Trial] = field(default_factory=list)
    """Every candidate that was fitted, in order."""
    screened: tuple[Screened, ...] = ()
    chance: float = 0.0
    """What chance reaches in the last round of screening [nats]."""
    forms: dict[str, list[Term]] = field(default_factory=dict)
    """By the part of an effect: refined forms that explain as much as it does with another effect of the model."""
    unseen: dict[str, list[Term]] = field(default_factory=dict)
    """By the part of an effect: refined forms of usual size that would show too little here to be told from it."""
    straining: set[str] = field(default_factory=set)
    """Parts of effects that came in together with a value further off than the lesson holds possible."""
    far_off: tuple[str, ...] = ()
    """A value of the lesson that is further off than it holds possible and explains more than effects do, and others that would."""
    values_instead: tuple[str, ...] = ()
    """Values of the lesson that would explain as much as what was found, were they so far off."""
    complete: bool = False


def search(rig: Rig, held_out: Rig, settings: Settings | None = None, tell: Tell | None = None) -> Found:
    """Search the candidates of a rig; ``held_out`` judges. Stopped with Ctrl-C it gives what was found until then."""
    chosen = settings or Settings()
    say = tell or (lambda text: None)
    say("fitting the baseline")
    bench = Bench(rig, held_out, until(chosen.longest, say), least_gain=chosen.margin)
    fitted = fit(rig.sensed, [*baseline_free(rig.machine), *rig.start_states(rig.sensed.plan)], rounds=3)
    bench.weigh(fitted)
    fitted = bench.feeling(fitted, ())
    bench.weigh(fitted)
    baseline = bench.model((), fitted)
    found = Found(baseline, baseline)
    try:
        _grow(bench, found, chosen)
        if _refine(bench, found, chosen):
            _grow(bench, found, chosen)
        while strains_anew(baseline.fitted, found.model.fitted) or _is_straining(found):
            last = found.model.terms[-1]
            bench.say(f"{last.name} at {last.at} is refused: with it a value would be further off than the lesson holds possible")
            leave_out(found, [last], rig, held_out, bench.say)
        if simpler := two_for_one(bench, baseline, found.model):
            found.model = bench.settled(simpler[0])
            found.trials |= {trial.term.part: [trial] for trial in simpler[1]}
            bench.say(f"as good and simpler: {' and '.join(trial.term.name for trial in simpler[1])}")
        if far := value_far_off(bench, baseline, found.model):
            names = (far.name, *far.instead)
            if far.better:
                bench.say(f"better than any effect: {far.name} is further off than the lesson holds possible")
                found.model, found.far_off = far.model, names
            elif found.model.terms:
                found.values_instead = names
        found.forms = forms_of_two(bench, found.model)
        found.complete = True
    except KeyboardInterrupt:
        bench.say("stopped; what was found until here is kept")
    return found


def _is_straining(found: Found) -> bool:
    """Say whether the effect that came in last needs a machine that is not there."""
    return (
        bool(found.model.terms)
        and found.model.terms[-1].part in found.straining
        and strains(found.model.fitted).max(initial=0.0) > STRAINED
    )


def _grow(bench: Bench, found: Found, settings: Settings) -> None:
    """Add effects one at a time as long as one is believable."""
    while len(found.model.terms) < settings.most_effects:
        if not any(_add(bench, found, settings, some(found.model, bench.rig)) for some in (_due, _finer)):
            return


def _add(bench: Bench, found: Found, settings: Settings, left: list[Term]) -> bool:
    """Add the best of some candidates; False where none is believable."""
    if not left:
        return False
    bench.say(f"screening {len(left)} candidates")
    screening = screen(bench.rig.sensed, found.model.fitted, left, starting_points(bench.rig, found.model.fitted, left))
    found.screened, found.chance = screening.ranked, screening.chance if settings.against_chance else 0.0
    first = ", ".join(f"{item.term.name} at {item.term.at} {item.gain:.0f} ({item.share:.0%})" for item in screening.ranked[:5])
    bench.say(f"  promised nats (chance gives {found.chance:.0f}): {first}")
    tried: list[Trial] = []
    waiting = list(screening.ranked[: settings.screened])
    while wave := _wave(bench, found, waiting, screening.ranked[0].gain, tried, settings):
        asked = [Asked(item.term, found.model.terms, found.model.free, _starts(item), item.share) for item in wave]
        tried += side_by_side(bench, found.model, asked)
    found.tried += tried
    period = bench.rig.machine.assembly.sample_period
    good = [trial for trial in tried if believable(trial, settings, found.chance) and not is_harmonic(trial, found.model)]
    good = [trial for trial in good if _is_of_a_clock(trial, period)]
    if not good:
        return False
    good.sort(key=lambda trial: -merit(trial, settings))
    best = _simplest(good, settings)
    good += [trial for trial in _rivals(bench, found, screening.ranked, best, tried) if believable(trial, settings, found.chance)]
    best = _simplest(sorted(good, key=lambda trial: -merit(trial, settings)), settings)
    found.trials[best.term.part] = good
    before, found.model = found.model, bench.settled(best.model)
    if strains_anew(before.fitted, found.model.fitted):
        found.straining.add(best.term.part)
    bench.say(f"{best.term.name} at {best.term.at}: {best.gain:.0f} nats, removes {best.share_of_all:.0%}")
    _eliminate(bench, found, settings)
    return True


def _simplest(good: Sequence[Trial], settings: Settings) -> Trial:
    """Give the trial that is taken of good ones, the best first: of those that cannot be told from the best one with the fewest values, as
    a model is never quite right, and of equals among these the one that comes first in the catalogue."""
    reached = merit(good[0], settings)
    width = max(_EQUAL, TIE_SHARE * reached)
    near = [trial for trial in good if reached - merit(trial, settings) < width and _removes_as_much(trial, good[0])]
    fewest = min(len(trial.term.parameters) for trial in near)
    simple = [trial for trial in near if len(trial.term.parameters) == fewest]
    equals = [trial for trial in simple if merit(simple[0], settings) - merit(trial, settings) < max(_EQUAL, _EQUAL_SHARE * reached)]
    return min(equals, key=lambda trial: trial.term.effect.catalogue or _LAST)


def _removes_as_much(trial: Trial, other: Trial) -> bool:
    return abs(trial.share_of_all - other.share_of_all) < TIE_SHARE


def _wave(bench: Bench, found: Found, waiting: list[Screened], best: float, tried: Sequence[Trial], settings: Settings) -> list[Screened]:
    """Take from the waiting candidates those that are tried next, as far as the trials so far leave them worth it."""
    good = [trial for trial in tried if believable(trial, settings, found.chance)]
    kept = {trial.term.part for trial in good}
    # what promised much and kept none of it is no yardstick
    promised = max((item.gain for item in found.screened if item.term.part in kept), default=0.0)
    least = max(0.5 * (settings.margin + found.chance), settings.worth_a_fit * promised)
    explained = max((trial.share_of_rest for trial in good), default=0.0)
    near = best * next((share for removed, share in _NEAR if explained > removed), 0.0)
    wave: list[Screened] = []
    while waiting and len(wave) < TOGETHER:
        item = waiting.pop(0)
        if item.gain < least:
            waiting.clear()
        elif _may_be_worth(bench, found.model, item, settings) and item.gain >= near:
            wave.append(item)
    return wave


def _starts(item: Screened) -> Sequence[FloatArray]:
    """Give the starting values of a fit: of an effect that is linear in its one size, one is enough."""
    return item.starts[: 1 if len(item.term.parameters) == 1 and not is_limit(item.term).any() else 2]


def _due(model: Model, rig: Rig) -> list[Term]:
    return [term for term in rig.candidates if term not in model.terms and _is_due(term, model, rig)]


def _finer(model: Model, rig: Rig) -> list[Term]:
    """Give the refined forms of which the simpler ones are not in the model, and those that stand on others that are not there: for when no
    simple effect is believable."""
    there = {(term.name, term.at) for term in model.terms}
    refined = {(name, term.at) for term in model.terms for name in term.effect.refines}
    return [
        term
        for term in rig.candidates
        if (term.effect.refines or not _stands(term, model, rig))
        and not any((name, term.at) in there for name in (term.name, *term.effect.refines))
        and (term.name, term.at) not in refined
    ]


def _may_be_worth(bench: Bench, model: Model, item: Screened, settings: Settings) -> bool:
    """Say whether what a candidate promises may come to the shares of the error that an effect must remove."""
    if is_strained(model.fitted):
        return True
    # beside effects that were found already the noise is known well, and what is promised is hardly ever surpassed
    share = 1.0 if model.terms else settings.worth_a_fit
    if item.share < share * settings.share_of_rest:
        return False
    if item.share > settings.nearly_worth * settings.nearly_all_of_rest:
        return True
    rest = model.error + np.maximum(bench.everything - bench.baseline_error, 0.0)
    return float(np.max(item.shares * rest / bench.everything)) > share * settings.share_of_all


def _rivals(bench: Bench, found: Found, ranked: Sequence[Screened], best: Trial, tried: Sequence[Trial]) -> list[Trial]:
    """Fit what promised as much as the best, or is a simpler relative of it, and was not fitted yet: what cannot be told from it is said to
    be tied, and the simpler one is taken."""
    known = {trial.term.part for trial in tried}
    promised = next(item.gain for item in ranked if item.term.part == best.term.part)
    others = [item for item in ranked if item.term.part not in known]
    alike = [item for item in others if abs(item.gain - promised) < _ALIKE * promised][:_MOST_RIVALS]
    alike += [item for item in others if item not in alike and _is_simpler(item.term, best.term) and item.gain > _RELATED * promised]
    asked = [Asked(item.term, found.model.terms, found.model.free, item.starts[:1]) for item in alike]
    rivals = side_by_side(bench, found.model, asked)
    found.tried += rivals
    return rivals


def _is_simpler(term: Term, than: Term) -> bool:
    """Say whether a term is one of the same family at the same place with fewer values."""
    return term.at == than.at and term.family == than.family and len(term.parameters) < len(than.parameters)


def _is_due(term: Term, model: Model, rig: Rig) -> bool:
    """Say whether a term may be added: it is no refinement, what it stands on is there, and no refined form of it is."""
    refined = {(name, other.at) for other in model.terms for name in other.effect.refines}
    return not term.effect.refines and _stands(term, model, rig) and (term.name, term.at) not in refined


def _stands(term: Term, model: Model, rig: Rig) -> bool:
    """Say whether what a term stands on is there: in the model or in the lesson's machine."""
    there = {(name, other.at) for other in model.terms for name in (other.name, *other.effect.refines)} | _in_baseline(rig)
    return not term.effect.needs or any((name, term.at) in there for name in term.effect.needs)


def _in_baseline(rig: Rig) -> set[tuple[str, str]]:
    """Give what the lesson's machine has already: (effect, host), an inserted one or a parameter of the host with its name."""
    parts = {part.name: part.component for part in rig.machine.assembly.parts}
    there = set()
    for wire in rig.machine.assembly.wires:
        source, target = wire.source.partition(".")[0], wire.target.partition(".")[0]
        for effect, host in ((source, target), (target, source)):
            if effect in parts and host in parts and issubclass(parts[effect], Effect):
                there.add((parts[effect].__name__, host))
    for name, component in parts.items():
        if any("coulomb" in item for item in component.declared(Parameter)):
            there.add(("CoulombFriction", name))
    return there


def _refine(bench: Bench, found: Found, settings: Settings) -> bool:
    """Let a refined form take the place of an effect where it removes much of what is left; say whether one did."""
    changed = False
    for term in found.model.terms:
        rest = tuple(other for other in found.model.terms if other is not term)
        finer = [other for other in bench.rig.candidates if other.at == term.at and term.name in other.effect.refines]
        kept = [item for item in found.model.free if item.name not in term.parameters]
        asked = []
        for other in finer:
            starts = form_starts(term, other, found.model)
            promise = screened_instead(bench.rig.sensed, found.model.fitted, term, other, starts[1:])
            due = settings.margin + settings.per_parameter * len(other.parameters)
            if least_shown(bench.rig.sensed, found.model.fitted, term, other) < due:
                found.unseen.setdefault(term.part, []).append(other)
            if promise.gain > 0.5 * settings.margin and _may_be_worth(bench, found.model, promise, settings):
                asked.append(Asked(other, rest, kept, starts))
                if other.bare:
                    asked.append(Asked(other.bare, rest, kept, form_starts(term, other.bare, found.model)))
        swaps = side_by_side(bench, found.model, asked)
        found.tried += swaps
        good = [trial for trial in swaps if believable(trial, settings, 0.0) and _replaces(trial, settings)]
        if not good:
            # the first micrometres of a friction are felt through the noise of an encoder: promising, and yet not to be fitted
            found.unseen.setdefault(term.part, []).extend(trial.term for trial in swaps if not trial.gain > settings.margin)
        if good:
            best = max(good, key=lambda trial: merit(trial, settings))
            bench.say(f"{best.term.name} takes the place of {term.name}: {best.gain:.0f} nats")
            found.trials[best.term.part] = good
            found.model = bench.settled(best.model)
            changed = True
    return changed


def _replaces(trial: Trial, settings: Settings) -> bool:
    """Say whether a refined form is so much better that the simple one has to go."""
    return trial.share_of_all > settings.share_of_all or trial.share_of_rest > settings.refined_share_of_rest


def merit(trial: Trial, settings: Settings) -> float:
    """Give what a trial is chosen by: its gain on both recordings, less its parameters' due [nats]."""
    agreed = min(trial.wide_gain, trial.wide_held_out_gain) + 0.5 * trial.wide_gain
    return agreed - settings.per_parameter * len(trial.term.parameters)


def believable(trial: Trial, settings: Settings, chance: float) -> bool:
    """Say whether a trial's effect is to be believed."""
    due = settings.margin + settings.per_parameter * len(trial.term.parameters) + chance
    much = trial.share_of_all > settings.share_of_all and trial.share_of_rest > settings.share_of_rest
    worth = much or trial.share_of_rest > settings.nearly_all_of_rest or trial.relieves
    judged = trial.gain > due and trial.held_out_gain > settings.held_out_margin and trial.moves > _due_move(trial, settings)
    worth = worth and trial.spoils < settings.most_spoilt
    if trial.strained:
        # values that are wrong beyond belief leave an error that any wave takes a part of
        worth = worth and trial.share_of_rest > settings.nearly_all_of_rest
    if trial.strains_anew:
        # a little of the error is no reason to make the machine another one
        worth = worth and much
    return judged and worth and _of_usual_size(trial, settings)


def _due_move(trial: Trial, settings: Settings) -> float:
    return settings.small_move if trial.share_of_all > settings.almost_all else settings.smallest_move


def _of_usual_size(trial: Trial, settings: Settings) -> bool:
    """Say whether an effect's size is not far beyond what is met on machines: whatever it then explains, it is not that effect."""
    if not np.isfinite(settings.largest_size):
        return True
    term, values = trial.term, trial.model.fitted.by_name
    for name, neutral, points in zip(term.parameters, term.neutral, term.points.T, strict=True):
        item = name.partition(".")[2]
        if item in term.effect.neutral:
            usual, size, most = float(np.abs(points - neutral).max(initial=0.0)), abs(values[name] - neutral), settings.largest_size
        else:
            usual, size, most = float(points.max(initial=0.0)), abs(values[name]), settings.largest_shape
            if item in term.effect.nuisance or points.min(initial=1.0) <= 0.0:
                continue
            if size < points.min(initial=np.inf) / settings.smallest_shape:
                return False
        if usual > 0.0 and size >= most * usual:
            return False
    return True


def _is_of_a_clock(trial: Trial, period: float) -> bool:
    """Say whether a shift in time or a filter's lag is a fair part of a sample, if the effect is one: a smaller one is how a simulation
    steps, or a friction that sits somewhere else."""
    return trial.term.name not in _TIMINGS or abs(trial.model.fitted.by_name[trial.term.parameters[0]]) > _LEAST_SHIFT * period


def _eliminate(bench: Bench, found: Found, settings: Settings) -> None:
    """Take out effects that the others have made needless."""
    model = found.model
    for term in model.terms[:-1]:
        rest: Sequence[Term] = tuple(other for other in model.terms if other is not term)
        free = [item for item in model.free if item.name not in term.parameters]
        fitted = fit(bench.rig.sensed, free, model.fitted.constant, rounds=1, wide=is_wide(rest))
        lost = model.score.above(judged_score(bench.rig, fitted), wide=is_wide(model.terms))
        if lost < settings.margin + settings.per_parameter * len(term.parameters):
            bench.say(f"{term.name} at {term.at} is no longer needed")
            found.model = bench.model(tuple(rest), fitted)
            return


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
