"""Which effects a recording cannot tell from one that a machine has: rivals fitted to what it does, and how far behind they stay.

For an effect of some size the rivals that promise most are those whose changes of the channels, scaled, are nearest to its own:

    share = (d_a . d_b)^2 / (|d_a|^2 |d_b|^2)        in whitened numbers, beside what the model's values take up

Each of these is fitted to the change, with the values of the model free, as a diagnosis fits a rival; the gain of the true effect over it
is held against the limit below which a diagnosis calls two explanations tied.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS
from lathesim.diagnosis.candidates.screening import in_proportion
from lathesim.diagnosis.candidates.starting_points import frequency_points
from lathesim.diagnosis.explaining.chance import unresolved
from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.explaining.plausible import is_usual
from lathesim.diagnosis.explaining.rounds import is_finer
from lathesim.diagnosis.explaining.search import is_the_other_sensor
from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.diagnosis.explaining.trial import FIRST_STEPS
from lathesim.diagnosis.isolation.visible import ChannelChange, Looking
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.estimation.least_squares import ROUGH, Begun, fit_each
from lathesim.identification.execution import together
from lathesim.identification.noise import whitened
from lathesim.identification.records import QUARTER_TURNS, Candidate, is_full_band, with_start


@dataclass(frozen=True, eq=False)
class FittedRival:
    """A rival of an effect, fitted to what that does, with all values of that fit: by how much it stays behind, below what it is a tie, and
    what the effect explains [nats]."""

    candidate: Candidate
    behind: float
    limit: float
    explained: float
    values: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_tied(self) -> bool:
        """Whether the recording cannot tell it from the effect."""
        return self.behind < self.limit


def rivals_of(looking: Looking, truths: Sequence[ChannelChange], others: Sequence[ChannelChange]) -> list[list[FittedRival]]:
    """Return for each of some changes that effects make the rivals of that effect, each fitted to the change, the nearest first.

    ``others`` are changes that all candidates make.
    """
    candidates = {change.candidate.part: change.candidate for change in others}
    resonances = frequency_points(looking.study.estimation, list(candidates.values()), method=looking.study.method)
    shaped = [(candidates[part], values) for part, points in resonances.items() for values in points]
    swinging = [change for change in looking.changes(shaped, judged=False) if change is not None]
    # of 129 rivals that promise 0.4 and more 14 were tied, the least with 0.84
    begun = alike(looking, truths, others, 0.7, swinging)
    return list(together(lambda pair: _fitted_to(looking, *pair), zip(truths, begun, strict=True)))


def alike(
    looking: Looking, truths: Sequence[ChannelChange], others: Sequence[ChannelChange], least: float, more: Sequence[ChannelChange] = ()
) -> list[list[tuple[Candidate, FloatArray]]]:
    """Return for each change the six candidates that promise most to do the same, a share of at ``least``, with the values from which each
    is fitted to it. The ``others`` are tried with the shape of an effect too, ``more`` as they are."""
    shaped = [(change.candidate, values) for truth in truths for change in others for values in _as_shaped(truth, change)]
    many = [*others, *more, *(change for change in looking.changes(shaped, judged=False) if change is not None)]
    if not (truths and many):
        return [[] for _ in truths]
    white, sizes = _white(looking, many)
    found = []
    for truth, own, size in zip(truths, *_white(looking, truths), strict=True):
        along = white @ own
        factors = along * size / sizes
        promised = [one for one in zip(many, factors.tolist(), np.square(along).tolist(), strict=True) if one[2] > least]
        found.append(_best_of_each([one for one in promised if _is_rival(one[0].candidate, truth.candidate)])[:6])
    return found


def _best_of_each(promised: Sequence[tuple[ChannelChange, float, float]]) -> list[tuple[Candidate, FloatArray]]:
    """Return each candidate with the values that promise most, the best first; of changes, their scale and the share they promise."""
    found: dict[str, tuple[Candidate, FloatArray]] = {}
    for change, factor, _ in sorted(promised, key=lambda one: -one[2]):
        values = _scaled(change, factor)
        if values is not None:
            found.setdefault(change.candidate.part, (change.candidate, values))
    return list(found.values())


def _white(looking: Looking, changes: Sequence[ChannelChange]) -> tuple[FloatArray, FloatArray]:
    """Return what the model leaves of changes, whitened and of length one, (changes, numbers), to rank them, and their lengths."""
    rows, sizes = [], []
    for change in changes:
        row = whitened(looking.fitted.noise, change.left[None], full_band=True)[0]
        sizes.append(max(float(np.linalg.norm(row)), 1e-300))
        rows.append((row / sizes[-1]).astype(np.float32))
    return np.array(rows), np.array(sizes)


def _is_rival(candidate: Candidate, truth: Candidate) -> bool:
    """Return whether a candidate is another explanation than an effect, and no finer form of it."""
    other = candidate.part != truth.part and not is_finer(candidate, [truth])
    return other and not is_the_other_sensor(candidate, truth)


def _as_shaped(truth: ChannelChange, change: ChannelChange) -> list[FloatArray]:
    """Return the values of a change with the period, the frequency or the instant of an effect, where both have one, at phases two phases a
    quarter of a turn apart; nothing where they share none."""
    candidate, own = change.candidate, truth.by_name
    period = next((value for name, value in own.items() if name in PERIODS), None)
    values, shared = change.values.copy(), False
    for place, name in enumerate(candidate.parameters):
        item = Place.of(name).port
        as_there = period if item in PERIODS else own.get(item)
        if item not in candidate.effect.neutral and as_there is not None:
            values[place], shared = as_there, True
    if not shared or not _is_rival(candidate, truth.candidate):
        return []
    turned = np.isin(candidate.parameters, candidate.named(candidate.effect.identification.phases))
    return [np.clip(values + turned * turn, candidate.low, candidate.high) for turn in (QUARTER_TURNS[:2] if turned.any() else (0.0,))]


def _scaled(change: ChannelChange, factor: float) -> FloatArray | None:
    """Return the values of a change with its sizes so many times as large; none where these may not be negative and would be. A wave of
    negative size is one half a turn on."""
    candidate = change.candidate
    turned = np.isin(candidate.parameters, candidate.named(candidate.effect.identification.phases)) * (np.pi if factor < 0.0 else 0.0)
    factor = abs(factor) if turned.any() else factor
    values = np.where(in_proportion(candidate), candidate.neutral + factor * (change.values - candidate.neutral), change.values + turned)
    return np.clip(values, candidate.low, candidate.high) if factor > 0.0 or bool((candidate.low < 0.0).any()) else None


def _fitted_to(looking: Looking, truth: ChannelChange, begun: Sequence[tuple[Candidate, FloatArray]]) -> list[FittedRival]:
    """Return candidates fitted to a change beside the values of the model, as far as their sizes are believed, the nearest first."""
    if not begun:
        return []
    study, fitted = looking.study, looking.fitted
    sensed, wide = study.estimation.sensed, is_full_band((truth.candidate,))
    changed = replace(sensed, recorded=sensed.recorded + looking.as_recorded(truth.run))
    slopes = dict(zip(fitted.names, fitted.sensitivity, strict=True)) if fitted.sensitivity is not None else {}
    begins = []
    for one in begun:
        free = [*with_start(fitted), *candidate_free(study, *one)]
        own = {item.name for item in free}
        begins.append(Begun(free, {name: value for name, value in looking.idle.items() if name not in own}, slopes))
    fits = fit_each(
        changed, begins, rounds=1, iterations=FIRST_STEPS, noise=fitted.noise, full_band=wide, tolerance=ROUGH, slopes="kept"
    )  # fmt: skip
    found = []
    for (candidate, _), made in zip(begun, fits, strict=True):
        behind = gain(fitted, made, full_band=wide or is_full_band((candidate,)))
        if is_usual(study, candidate, made.by_name):
            explained = truth.gain.nats
            found.append(FittedRival(candidate, behind.nats, unresolved(behind, explained, study.method), explained, made.by_name))
    return sorted(found, key=lambda one: one.behind / one.limit)
