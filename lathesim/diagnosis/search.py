"""Which effects were left out: forward selection with everything refitted each time, backward elimination, and a judge.

An effect is believed when (a) the whitened error of the fitted recording falls by more than the number of its parameters and of the
candidates tried can explain, (b) the held-out recording agrees, and (c) it moves a channel by more than the floor. Ties are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.fit import Fitted, Free, fit, profile_likelihood, with_start
from lathesim.diagnosis.problem import Rig, baseline_free
from lathesim.diagnosis.screening import Screened, screen
from lathesim.diagnosis.terms import Term
from lathesim.engine.assembly import FloatArray

_FAST_FAMILIES = frozenset({"lag", "structure", "once per turn", "encoder", "drive range", "recording"})
"""Families that show above the frequencies of the motion; a model with one of them is fitted on all frequencies."""

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """How the search goes about it."""

    most_effects: int = 4
    screened: int = 10
    margin: float = 12.0
    """Nats by which a fit must get better beyond its parameters' due; calibrated on recordings in which nothing is hidden."""
    held_out_margin: float = 3.0
    tie: float = 4.0
    """Nats within which two candidates cannot be told apart."""
    smallest_move: float = 1.0
    """Floors by which an effect must move a channel to be worth a name."""


@dataclass(frozen=True)
class Trial:
    """A candidate that was fitted on top of a model: its likelihood gain on the fitted and on the held-out recording [nats]."""

    term: Term
    fitted: Fitted
    gain: float
    held_out_gain: float
    moves: float


@dataclass(frozen=True)
class Model:
    """The baseline with the effects believed so far."""

    terms: tuple[Term, ...]
    fitted: Fitted
    held_out: float


@dataclass(frozen=True)
class Found:
    """The outcome of a search: the refitted baseline, the model, and for each believed effect what was tried beside it."""

    baseline: Model
    model: Model
    trials: dict[str, list[Trial]] = field(default_factory=dict)
    screened: tuple[Screened, ...] = ()
    rejected: tuple[Trial, ...] = ()


def search(rig: Rig, held_out: Rig, settings: Settings | None = None, tell: Tell | None = None) -> Found:
    """Search the candidates of a rig; ``held_out`` judges."""
    chosen = settings or Settings()
    say = tell or (lambda text: None)
    say("fitting the baseline")
    free = [*baseline_free(rig.machine), *rig.start_states(rig.sensed.plan)]
    fitted = fit(rig.sensed, free, rounds=4)
    baseline = Model((), fitted, held_out_score(held_out, fitted, ()))
    model = baseline
    trials: dict[str, list[Trial]] = {}
    rejected: list[Trial] = []
    ranked: list[Screened] = []
    while len(model.terms) < chosen.most_effects:
        say(f"screening {len(rig.candidates) - len(model.terms)} candidates")
        left = [term for term in rig.candidates if term not in model.terms]
        ranked = screen(rig.sensed, model.fitted, left)
        tried = [_try(rig, held_out, model, item, say) for item in ranked[: chosen.screened] if item.gain > 0.5 * chosen.margin]
        good = [trial for trial in tried if _believable(trial, chosen)]
        rejected = [trial for trial in tried if trial not in good]
        if not good:
            break
        good.sort(key=lambda trial: -_merit(trial))
        best = good[0]
        trials[best.term.part] = good
        model = Model((*model.terms, best.term), best.fitted, model.held_out + best.held_out_gain)
        say(f"{best.term.name} at {best.term.at}: {best.gain:.0f} nats, {best.held_out_gain:.0f} on the held-out recording")
        model = _eliminate(rig, held_out, model, chosen, say)
    return Found(baseline, model, trials, tuple(ranked), tuple(rejected))


def _merit(trial: Trial) -> float:
    return min(trial.gain, 2.0 * trial.held_out_gain + trial.gain) - 2.5 * len(trial.term.parameters)


def _believable(trial: Trial, settings: Settings) -> bool:
    due = settings.margin + 3.0 * len(trial.term.parameters)
    return trial.gain > due and trial.held_out_gain > settings.held_out_margin and trial.moves > settings.smallest_move


def _try(rig: Rig, held_out: Rig, model: Model, item: Screened, say: Tell) -> Trial:
    best: Fitted | None = None
    for start in item.starts[:2]:
        free = [*with_start(model.fitted), *term_free(item.term, start)]
        fitted = fit(rig.sensed, free, model.fitted.constant, rounds=3, wide=is_wide((*model.terms, item.term)))
        if best is None or fitted.score > best.score:
            best = fitted
    assert best is not None
    terms = (*model.terms, item.term)
    gain = judged_score(rig, best) - judged_score(rig, model.fitted)
    held = held_out_score(held_out, best, terms) - model.held_out if gain > 0 else -np.inf
    say(f"  {item.term.name} at {item.term.at}: {gain:.0f}, held out {held:.0f}")
    return Trial(item.term, best, gain, float(held), _moves(rig, best, item.term))


def is_wide(terms: Sequence[Term]) -> bool:
    """Say whether a model is to be fitted on all frequencies."""
    return any(term.family in _FAST_FAMILIES for term in terms)


def judged_score(rig: Rig, fitted: Fitted) -> float:
    """Give the likelihood of a fit with noise that may be slow, less its penalty [nats]."""
    shapes = rig.sensed.noise_shapes(fitted.by_name, coloured=True)
    return profile_likelihood(fitted.residual, shapes) - 0.5 * fitted.penalty


def term_free(term: Term, start: FloatArray) -> list[Free]:
    """Give the parameters of a term as free ones, starting at ``start``."""
    spread = np.maximum(np.abs(term.points).max(axis=0, initial=0.0), np.abs(start)) if len(term.points) else np.abs(start)
    return [
        Free(name, float(value), max(float(scale) * 0.3, 1e-12), float(low), float(high))
        for name, value, scale, low, high in zip(term.parameters, start, spread, term.low, term.high, strict=True)
    ]


def _moves(rig: Rig, fitted: Fitted, term: Term) -> float:
    """Give by how many floors the effect moves the channel it moves most (root mean square)."""
    with_it = fitted.by_name
    without = {**with_it, **dict(zip(term.parameters, term.neutral.tolist(), strict=True))}
    names = list(with_it)
    first, second = rig.sensed.residuals(names, np.array([[with_it[name] for name in names], [without[name] for name in names]]))
    return float(np.max(np.sqrt(np.mean((first - second) ** 2, axis=1)) / rig.sensed.floors))


def held_out_score(rig: Rig, fitted: Fitted, terms: Sequence[Term]) -> float:
    """Give the likelihood of the held-out recording under a fitted model [nats]; what belongs to one recording is fitted anew."""
    starts = rig.start_states(rig.sensed.plan)
    own = {item.name for item in starts}
    nuisance = {name for term in terms for name in term.nuisance}
    values = fitted.by_name
    free = [*starts, *[replace(item, start=values[item.name]) for item in fitted.free if item.name in nuisance]]
    constant = {name: value for name, value in values.items() if name not in own and name not in nuisance}
    judged = fit(rig.sensed, free, constant, rounds=2, iterations=6)
    return judged_score(rig, judged)


def _eliminate(rig: Rig, held_out: Rig, model: Model, settings: Settings, say: Tell) -> Model:
    """Take out effects that the others have made needless."""
    for term in model.terms[:-1]:
        rest = tuple(other for other in model.terms if other is not term)
        free = [item for item in with_start(model.fitted) if item.name not in term.parameters]
        fitted = fit(rig.sensed, free, model.fitted.constant, rounds=3, wide=is_wide(rest))
        if judged_score(rig, model.fitted) - judged_score(rig, fitted) < settings.margin + 3.0 * len(term.parameters):
            say(f"{term.name} at {term.at} is no longer needed")
            return Model(rest, fitted, held_out_score(held_out, fitted, rest))
    return model
