"""Refinement of a model: a finer form takes the place of a simple effect, as a friction that is also asymmetric does of a plain one."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import WAVES
from lathesim.diagnosis.candidates.screening import least_shown, screened_instead
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import believable, merit, of_usual_size, replaces
from lathesim.diagnosis.selection.laboratory import Bench, is_strained
from lathesim.diagnosis.selection.moves.split import form_starts
from lathesim.diagnosis.selection.refusal import is_trifling, pushes_at, quiet_parts
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.records.model import Model, Trial

_SURELY_THERE = 10.0
"""Margins that a wave must promise to be fitted whatever share of the rest that is."""
_MUCH_BETTER = 0.5
"""Share of the error of the lesson's own simulation that may be left, in the channel where most is, for strained values to be eased."""


def refine(bench: Bench, found: Found, settings: Settings, least: float = 0.0) -> bool:
    """Let a refined form take the place of an effect where it removes much of what is left, or ``least`` of it; say whether one did."""
    changed = False
    quiet = quiet_parts(bench, found.model)
    for term in found.model.terms:
        rest = tuple(other for other in found.model.terms if other is not term)
        forms = [other for other in bench.rig.candidates if other.at == term.at and term.name in other.effect.refines]
        forms = [other for other in forms if other.part not in found.refused]
        kept = [item for item in found.model.free if item.name not in term.parameters]
        asked = []
        # a form of a friction that feels the simulated motion feels it too
        felt = any(found.model.fitted.constant.get(name) == 0.0 for name in bench.rig.feeling_their_motion([term]))
        for other in forms:
            starts = form_starts(term, other, found.model)
            motion = bench.rig.feeling_their_motion([other]) if felt else {}
            promise = screened_instead(bench.rig.sensed, found.model.fitted, term, other, starts[1:], motion)
            cost = settings.margin + settings.per_parameter * len(other.parameters)
            if least_shown(bench.rig.sensed, found.model.fitted, term, other) < cost:
                found.unseen.setdefault(term.part, []).append(other)
            # where a friction holds by its own motion a promise says little of how much
            promising = promise.gain > 0.5 * settings.margin and (felt or may_be_worth(bench, found.model, promise, settings))
            if promising and not pushes_at(term, quiet):
                asked.append(Asked(other, rest, kept, starts, felt=felt))
                if other.bare:
                    plain = form_starts(term, other.bare, found.model)
                    asked += [Asked(other.bare, rest, kept, plain, felt=felt) for felt in (False, True)]
        if asked:
            bench.say(f"asking whether {term.name} at {term.at} has a finer form")
        swaps = side_by_side(bench, found.model, asked)
        found.tried += swaps
        good = [trial for trial in swaps if believable(trial, settings, 0.0)]
        good = [trial for trial in good if replaces(trial, term, settings) and trial.share_of_rest >= least]
        good = good or [trial for trial in swaps if _eases(trial, settings)]
        good = [trial for trial in good if not is_trifling(bench, found.model, trial.model, trial)]
        if not good:
            # the first micrometres of a friction are felt through the noise of an encoder: promising, and yet not to be fitted
            found.unseen.setdefault(term.part, []).extend(trial.term for trial in swaps if not trial.gain > settings.margin)
        if good:
            best = max(good, key=lambda trial: merit(trial, settings))
            bench.say(f"{best.term.name} takes the place of {term.name}: {best.gain:.0f} nats")
            found.trials[best.term.part] = good
            found.take_over(best.term, term)
            found.before[best.term.part] = found.model
            found.model = bench.settled(best.model)
            changed = True
    return changed


def _eases(trial: Trial, settings: Settings) -> bool:
    """Say whether with a trial no value of the lesson is strained any more and the lesson's own simulation is much better: a friction that
    senses recorded motion explains a spring of some micrometres with a viscosity that the machine cannot have."""
    usual = of_usual_size(trial.term, trial.model.fitted.by_name, settings)
    return trial.relieves and usual and 0.0 < trial.spoils < _MUCH_BETTER


def may_be_worth(bench: Bench, model: Model, item: Screened, settings: Settings) -> bool:
    """Say whether what a candidate promises may come to the shares of the error that an effect must remove."""
    if is_strained(model.fitted) or (item.term.family == WAVES and item.gain > _SURELY_THERE * settings.margin):
        # what repeats hundreds of times promises little as long as its length is a little off
        return True
    # beside effects that were found already the noise is known well, and what is promised is hardly ever surpassed
    share = 1.0 if model.terms else settings.worth_a_fit
    if item.share < share * settings.share_of_rest:
        return False
    if item.share > settings.nearly_worth * settings.nearly_all_of_rest:
        return True
    rest = model.error + np.maximum(bench.everything - bench.baseline_error, 0.0)
    return float(np.max(item.shares * rest / bench.everything)) > share * settings.share_of_all
