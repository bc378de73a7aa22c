"""Whether a trial's effect is to be believed, and which of several believable ones is taken.

An effect is believed when (a) the likelihood of the estimation recording rises by more than its parameters and what chance does among as
many candidates can explain, (b) the validation recording agrees, (c) it removes a share of the error that is worth a name, and (d) it moves
a channel by more than the floor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.diagnosis.method import Settings
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial

_EQUAL = 1.0
"""Nats within which two candidates are equals; of equals the one that comes first in the catalogue, the commoner one, is taken."""
EQUAL_SHARE = 0.01
"""The same as a share of what they gain: a trial's fit is rough."""
_LAST = 1000
_NEXT_TO_NOTHING, _HARDLY_MORE = 0.02, 1.5
"""Share of the error that an effect with two values less may leave, and by how much more that may be than what the other one leaves."""
_NEARLY_AS_MUCH = 0.75
"""Share of what that one gains that it must gain."""
_LEAST_LAG = 0.2
"""Share of a sample by which a channel must be late."""
_AT_THE_START = 0.01
"""Share of the recording before which nothing is an event of it: what is different from its first samples on is where a sensor has its
zero."""
TIE_SHARE = 0.03
"""Share of what the better of two candidates gains within which they cannot be told apart, as a model is never quite right."""


def simplest(good: Sequence[Trial], settings: Settings) -> Trial:
    """Return the trial that is taken of good ones, the best first: of those that cannot be told from the best one with the fewest values
    that it takes, as a model is never quite right; of equals among these the one that comes first in the catalogue, at the sensor where
    it belongs."""
    reached = merit(good[0], settings)
    width = max(_EQUAL, TIE_SHARE * reached)
    near = [
        trial
        for trial in good
        if (reached - merit(trial, settings) < width and _removes_as_much(trial, good[0])) or _leaves_hardly_more(trial, good[0], settings)
    ]
    fewest = min(len(trial.candidate.parameters) - len(trial.candidate.spare) for trial in near)
    simple = [trial for trial in near if len(trial.candidate.parameters) - len(trial.candidate.spare) == fewest]
    equals = [trial for trial in simple if merit(simple[0], settings) - merit(trial, settings) < max(_EQUAL, EQUAL_SHARE * reached)]
    return min(equals, key=lambda trial: (trial.candidate.effect.catalogue or _LAST, _out_of_place(trial.candidate)))


def _out_of_place(candidate: Candidate) -> bool:
    """Return whether an effect that sits between two sensors is told at the first."""
    return candidate.effect.between_sensors and not candidate.second


def _leaves_hardly_more(trial: Trial, other: Trial, settings: Settings) -> bool:
    """Return whether a trial leaves next to nothing, hardly more than another one, with far fewer values: what rocks far above all
    frequencies of the motion is a plain spring. Each does so in the channel where it does most; which gains far less does so in another
    one."""
    left, of_other = 1.0 - trial.share_of_all, 1.0 - other.share_of_all
    fewer = len(trial.candidate.parameters) + 1 < len(other.candidate.parameters)
    alike = merit(trial, settings) > _NEARLY_AS_MUCH * merit(other, settings)
    return alike and fewer and left < _NEXT_TO_NOTHING and left < _HARDLY_MORE * of_other


def _removes_as_much(trial: Trial, other: Trial) -> bool:
    return abs(trial.share_of_all - other.share_of_all) < TIE_SHARE


def replaces(trial: Trial, simple: Candidate, settings: Settings) -> bool:
    """Return whether a refined form is so much better than a simple one that this one has to go."""
    more = max(len(trial.candidate.parameters) - len(simple.parameters), 1)
    return trial.share_of_all > settings.share_of_all or 1.0 - trial.share_of_rest < settings.left_by_refined / more


def merit(trial: Trial, settings: Settings) -> float:
    """Return what a trial is chosen by: its gain on both recordings, less its parameters' due [nats]."""
    agreed = min(trial.full_band_gain, trial.full_band_validation_gain) + 0.5 * trial.full_band_gain
    return agreed - settings.per_parameter * len(trial.candidate.parameters)


def believable(trial: Trial, settings: Settings, null_maximum: float) -> bool:
    """Return whether a trial's effect is to be believed."""
    return trial.moves > _due_move(trial, settings) and credible_if_it_moves(trial, settings, null_maximum)


def credible_if_it_moves(trial: Trial, settings: Settings, null_maximum: float) -> bool:
    """Return whether a trial's effect is to be believed, however little it moves: beside what is not found yet that may be next to
    nothing."""
    due = settings.margin + settings.per_parameter * len(trial.candidate.parameters) + null_maximum
    much = trial.share_of_all > settings.share_of_all and trial.share_of_rest > settings.share_of_rest
    worth = much or trial.share_of_rest > settings.nearly_all_of_rest or trial.restores_plausibility
    agreed = trial.validation_gain > max(settings.validation_margin, settings.validation_share * trial.gain)
    judged = trial.gain > due and agreed
    worth = worth and trial.closed_loop_degradation < settings.most_degradation
    if trial.candidate.effect.told_of_one:
        # what may be another one on each recording takes a part of any wander
        worth = worth and trial.share_of_rest > settings.nearly_all_of_rest
    if trial.implausible and not settings.despite_implausible_values:
        # values that are wrong beyond belief leave an error that any wave takes a part of
        worth = worth and trial.share_of_rest > settings.nearly_all_of_rest
    if trial.becomes_implausible:
        # a little of the error is no reason to make the machine another one
        worth = worth and much
    if not (judged and worth):
        return False
    return math.isinf(settings.largest_size) or of_usual_size(trial.candidate, trial.model.fitted.by_name, settings)


def _due_move(trial: Trial, settings: Settings) -> float:
    agreed = trial.share_of_rest > settings.most_of_rest and trial.validation_gain > settings.as_much * trial.gain
    return settings.small_move if trial.share_of_all > settings.almost_all or agreed else settings.smallest_move


def of_usual_size(candidate: Candidate, values: Mapping[str, float], settings: Settings) -> bool:
    """Return whether an effect's size is not far beyond what is met on machines: whatever it then explains, it is not that effect."""
    if math.isinf(settings.largest_size):
        return True
    products = [(size, other) for size, others in candidate.effect.only_products.items() for other in others]
    apart = {item for pair in products for item in pair}
    for name, neutral, least, points in zip(candidate.parameters, candidate.neutral, candidate.least, candidate.points.T, strict=True):
        item = name.partition(".")[2]
        if item in apart:
            continue
        if item in candidate.effect.neutral:
            usual, size, most = float(np.abs(points - neutral).max(initial=0.0)), abs(values[name] - neutral), settings.largest_size
        else:
            usual, size, most = float(points.max(initial=0.0)), abs(values[name]), settings.largest_shape
            if item in candidate.effect.nuisance or points.min(initial=1.0) <= 0.0:
                continue
            if size < least / settings.smallest_shape:
                return False
        if usual > 0.0 and size >= max(most * usual, settings.possible.get(name, 0.0)):
            return False
    return all(_is_usual_product(candidate, values, settings, size, other) for size, other in products)


def _is_usual_product(candidate: Candidate, values: Mapping[str, float], settings: Settings, size: str, other: str) -> bool:
    """Return whether the product of two parameters is not far beyond what is met; each by itself may be anything."""
    names = [f"{candidate.part}.{item}" for item in (size, other)]
    if not set(names) <= set(candidate.parameters):
        return True
    usual = float(np.prod([candidate.usual[candidate.parameters.index(name)] for name in names]))
    return abs(float(np.prod([values[name] for name in names]))) < settings.largest_size * usual


def is_of_a_clock(candidate: Candidate, values: Mapping[str, float], period: float, duration: float) -> bool:
    """Return whether a shift in time or a filter's lag is a fair part of a sample, if the effect is one, or a skew of a clock over the
    whole recording: a smaller one is how a simulation steps, or a friction or a play that is of another form."""
    lag = candidate.effect.late_by
    if not lag:
        return True
    of_time = candidate.effect.declarations[lag].unit == "s"
    late = abs(values[f"{candidate.part}.{lag}"]) * (1.0 if of_time else duration)
    return late > _LEAST_LAG * period


def is_an_event(instants: Sequence[str], values: Mapping[str, float], duration: float) -> bool:
    """Return whether what happens at some ``instants`` (free names, none for most effects) does so after the recording has begun."""
    return all(values[name] > _AT_THE_START * duration for name in instants)
