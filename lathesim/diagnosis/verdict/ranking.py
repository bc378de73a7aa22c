"""From what a search found to what is said: how sure each name is, what it is tied with, and whether the model is adequate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import WAVES
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import TIE_SHARE, merit
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.noise.noise_model import white_noise
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Rig

TIE = 4.0
"""Nats within which two candidates cannot be told apart, or :data:`TIE_SHARE` of what the better one gains."""
_HARDLY_ANY = 1.5
"""Floors of a channel up to which its error is hardly any."""
_NOTHING = 0.03
"""Share of the error of a channel, its floor included, that is nothing."""
NAMED_SHARE = 0.5
"""Share of the baseline's error that the effects must remove for them to be named."""


@dataclass(frozen=True)
class Standing:
    """How sure an effect is: its probability among all candidates, and the terms it is tied with."""

    term: Term
    probability: float
    tied: tuple[Term, ...]
    forms: tuple[Term, ...]
    """Single effects that do what this one and another of the model do together."""
    share: float
    removes: float
    unseen: tuple[Term, ...] = ()
    """Refined forms of it that would show too little in the recording to be told from it."""


def standing(found: Found, settings: Settings, one_sided: Sequence[Term] = ()) -> list[Standing]:
    """Give how sure each effect of the model is, the one that removes most first. It is tied with a ``one_sided`` form of it, which no
    recording could have shown."""
    result = []
    for term in found.model.terms:
        trials = found.trials.get(term.part, [])
        chosen = next((trial for trial in trials if trial.term.part == term.part), None)
        unseen = tuple({other.part: other for other in found.unseen.get(term.part, ())}.values())
        if chosen is None:
            result.append(Standing(term, 0.5, (), (), 0.0, 0.0, unseen))
            continue
        best = merit(chosen, settings)
        width = max(TIE, TIE_SHARE * best)
        trials = [trial for trial in trials if abs(trial.share_of_all - chosen.share_of_all) < TIE_SHARE or trial is chosen]
        others = [trial for trial in trials if trial.term.part != term.part]
        tied = tuple(trial.term for trial in others if best - merit(trial, settings) < width and trial.term not in found.model.terms)
        weights = [np.exp(-max(0.0, best - merit(trial, settings)) / (0.5 * width)) for trial in others]
        probability = float(1.0 / (1.0 + sum(weights)))
        tied += tuple(other for other in one_sided if other.at == term.at and is_told_by_direction(term, other))
        forms = tuple(found.forms.get(term.part, ()))
        share = min(chosen.share_of_all, 1.0)
        result.append(Standing(term, probability, tied, forms, share, chosen.share_of_rest, unseen))
    return sorted(result, key=lambda item: -item.share)


def is_told_by_direction(term: Term, other: Term) -> bool:
    """Say whether a term is told from another only by how both act in two directions: it is refined by that, or repeats like it and acts at
    the same port."""
    alike = (term.effect.family, term.effect.site) == (other.effect.family, other.effect.site)
    return term.name in other.effect.refines or (alike and term.family == WAVES)


def removed_in_band(found: Found) -> float:
    """Give the share of the baseline's error, in the band of the motion, that the effects remove on the fitted recording."""
    before, after = found.baseline.error, found.model.error
    return float(1.0 - after[::2].sum() / before[::2].sum()) if before[::2].sum() > 0.0 else 0.0


def takes_nothing(rig: Rig, before: Fitted, after: Fitted) -> bool:
    """Say whether a fit takes away no more than chance does of another's error, whichever channel of the recording is looked at, and
    whether there is hardly any: where an error is left that nothing takes away, something is missing."""
    over = np.sqrt(np.mean(np.square(before.residual), axis=1)) / rig.sensed.seen_floors
    if np.max(over) > _HARDLY_ANY:
        return False
    bench = Bench(rig, rig, lambda text: None)
    bench.weigh(before)
    return bench.most_removed(rig, before, after) < _NOTHING


def removed_share(rig: Rig, before: Fitted, after: Fitted) -> float:
    """Give the share of a recording's error, above its floor and in the band of the motion, that one fit removes of another's.

    It is weighed as forces and sensor noise of the size of the first are, as in the search: what loads add up to over a recording, a metre
    or a turn that no model could know, does not outweigh what an effect does. White noise of a sensor beyond its floor, as it is left
    after, is nothing that a model could remove.
    """
    bench = Bench(rig, rig, lambda text: None)
    bench.weigh(before)
    shapes = rig.sensed.noise_shapes(after.by_name)
    white = np.array([white_noise(row, shape) for row, shape in zip(after.residual, shapes, strict=True)])
    error, left = (float(bench.error(rig, fitted, white)[::2].sum()) for fitted in (before, after))
    return 1.0 - left / error if error > 0.0 else 0.0
