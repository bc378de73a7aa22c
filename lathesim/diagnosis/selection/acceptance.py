"""Whether a trial's effect is to be believed, and which of several believable ones is taken.

An effect is believed when (a) the likelihood of the estimation recording rises by more than its parameters and what chance does among as
many candidates can explain, (b) the validation recording agrees, (c) it removes a share of the error that is worth a name, and (d) it moves
a channel by more than the floor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.selection.compare_models import Gains, ModelComparison, compare_models
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial


def simplest(good: Sequence[Trial], method: Method) -> Trial:
    """Return the trial that is taken of good ones, the best first: of those that cannot be told from the best one with the fewest values
    that it takes, as a model is never quite right; of equals among these the one that comes first in the catalogue, at the sensor where
    it belongs."""
    best = good[0]
    near = [trial for trial in good if (compare_trials(trial, best, best, method).as_good) or _leaves_hardly_more(trial, best, method)]
    fewest = min(len(trial.candidate.parameters) - len(trial.candidate.spare) for trial in near)
    simple = [trial for trial in near if len(trial.candidate.parameters) - len(trial.candidate.spare) == fewest]
    equals = [trial for trial in simple if compare_trials(trial, simple[0], best, method, alike=True).as_good]
    return min(equals, key=lambda trial: (trial.candidate.effect.catalogue or math.inf, _out_of_place(trial.candidate)))


def compare_trials(trial: Trial, other: Trial, best: Trial, method: Method, *, alike: bool = False) -> ModelComparison:
    """Return how a trial compares with another one by their merits; the ``best`` of all tells how much there is to explain."""
    gains = Gains(merit(trial, method) - merit(other, method))
    apart = 0.0 if alike else abs(trial.share_of_all - other.share_of_all)
    return compare_models(gains, method, explained=max(merit(best, method), 0.0), apart=apart, alike=alike)


def _out_of_place(candidate: Candidate) -> bool:
    """Return whether an effect that sits between two sensors is told at the first."""
    return candidate.effect.identification.between_sensors and not candidate.second


def _leaves_hardly_more(trial: Trial, other: Trial, method: Method) -> bool:
    """Return whether a trial leaves next to nothing, hardly more than another one, with far fewer values: what rocks far above all
    frequencies of the motion is a plain spring. Each does so in the channel where it does most; which gains far less does so in another
    one."""
    left, of_other = 1.0 - trial.share_of_all, 1.0 - other.share_of_all
    fewer = len(trial.candidate.parameters) + 1 < len(other.candidate.parameters)
    alike = merit(trial, method) > method.selection.rival * merit(other, method)
    return alike and fewer and left < 1.0 - method.selection.almost_all and left < method.shared.alike * of_other


def replaces(trial: Trial, simple: Candidate, method: Method) -> bool:
    """Return whether a refined form is so much better than a simple one that this one has to go."""
    more = max(len(trial.candidate.parameters) - len(simple.parameters), 1)
    return trial.share_of_all > method.share_of_all or 1.0 - trial.share_of_rest < method.shared.left_by_cause / more


def merit(trial: Trial, method: Method) -> float:
    """Return what a trial is chosen by: its gain on both recordings, less its parameters' due [nats]."""
    agreed = min(trial.full_band_gain, trial.full_band_validation_gain) + 0.5 * trial.full_band_gain
    return agreed - method.per_parameter * len(trial.candidate.parameters)


def believable(trial: Trial, method: Method, null_maximum: float) -> bool:
    """Return whether a trial's effect is to be believed."""
    return trial.moves > _due_move(trial, method) and credible_if_it_moves(trial, method, null_maximum)


def credible_if_it_moves(trial: Trial, method: Method, null_maximum: float) -> bool:
    """Return whether a trial's effect is to be believed, however little it moves: beside what is not found yet that may be next to
    nothing."""
    judged = gains_enough(trial, method, null_maximum)
    much = trial.share_of_all > method.share_of_all and trial.share_of_rest > method.share_of_rest
    worth = much or trial.share_of_rest > method.nearly_all_of_rest or trial.restores_plausibility
    worth = worth and (trial.closed_loop_degradation < method.shared.alike or method.despite_degradation)
    if trial.candidate.effect.identification.size_of_recording:
        # what may be another one on each recording takes a part of any wander
        worth = worth and trial.share_of_rest > method.nearly_all_of_rest
    if trial.implausible and not method.despite_implausible_values:
        # values that are wrong beyond belief leave an error that any wave takes a part of
        worth = worth and trial.share_of_rest > method.nearly_all_of_rest
    if trial.becomes_implausible:
        # a little of the error is no reason to make the machine another one
        worth = worth and much
    if not (judged and worth):
        return False
    return math.isinf(method.largest_size) or of_usual_size(trial.candidate, trial.model.fitted.by_name, method)


def gains_enough(trial: Trial, method: Method, null_maximum: float) -> bool:
    """Return whether a trial gains on both recordings what an accepted effect must gain."""
    gains, parameters = Gains(trial.gain, trial.validation_gain), len(trial.candidate.parameters)
    return compare_models(gains, method, effects=1, parameters=parameters, null_maximum=null_maximum).better


def _due_move(trial: Trial, method: Method) -> float:
    agreed = trial.share_of_rest > method.selection.rival and trial.validation_gain > method.selection.rival * trial.gain
    return method.small_move if trial.share_of_all > method.selection.almost_all or agreed else method.smallest_move


def of_usual_size(candidate: Candidate, values: Mapping[str, float], method: Method) -> bool:
    """Return whether an effect's size is not far beyond what is met on machines: whatever it then explains, it is not that effect."""
    if math.isinf(method.largest_size):
        return True
    products = [(size, other) for size, others in candidate.effect.identification.products.items() for other in others]
    apart = {item for pair in products for item in pair}
    for name, neutral, least, points in zip(candidate.parameters, candidate.neutral, candidate.least, candidate.points.T, strict=True):
        item = name.partition(".")[2]
        if item in apart:
            continue
        if item in candidate.effect.neutral:
            usual, size, most = float(np.abs(points - neutral).max(initial=0.0)), abs(values[name] - neutral), method.largest_size
        else:
            usual, size, most = float(points.max(initial=0.0)), abs(values[name]), method.largest_size
            if item in candidate.effect.identification.nuisance or points.min(initial=1.0) <= 0.0:
                continue
            if size < least / method.largest_size and not _may_have_begun(candidate, method):
                return False
        if usual > 0.0 and size >= max(most * usual, method.possible.get(name, 0.0)):
            return False
    return all(_is_usual_product(candidate, values, method, size, other) for size, other in products)


def _may_have_begun(candidate: Candidate, method: Method) -> bool:
    """Return whether an effect may have begun between a recording from before a change and this one: it is there at once then, and how
    quickly it came does not show."""
    return method.beside_earlier and bool(candidate.effect.identification.history)


def _is_usual_product(candidate: Candidate, values: Mapping[str, float], method: Method, size: str, other: str) -> bool:
    """Return whether the product of two parameters is not far beyond what is met; each by itself may be anything."""
    names = [f"{candidate.part}.{item}" for item in (size, other)]
    if not set(names) <= set(candidate.parameters):
        return True
    usual = float(np.prod([candidate.usual[candidate.parameters.index(name)] for name in names]))
    return abs(float(np.prod([values[name] for name in names]))) < method.largest_size * usual


def is_of_a_clock(candidate: Candidate, values: Mapping[str, float], period: float, duration: float, method: Method = STANDARD) -> bool:
    """Return whether a shift in time or a filter's lag is a fair part of a sample, if the effect is one, or a skew of a clock over the
    whole recording: a smaller one is how a simulation steps, or a friction or a play that is of another form."""
    lag = candidate.effect.identification.delay
    if not lag:
        return True
    of_time = candidate.effect.declarations[lag].unit == "s"
    late = abs(values[f"{candidate.part}.{lag}"]) * (1.0 if of_time else duration)
    return late > method.selection.least_lag * period


def is_an_event(instants: Sequence[str], values: Mapping[str, float], duration: float, method: Method = STANDARD) -> bool:
    """Return whether what happens at some ``instants`` (free names, none for most effects) does so after the recording has begun."""
    return all(values[name] > method.selection.event_start * duration for name in instants)
