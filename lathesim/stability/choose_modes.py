"""How many modes a response has, decided on taps that were not fitted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.stability.modal_fit import ModalModel, NoiseWeights, begin_modes, fit_modes, weights_of_mean, weights_of_residual
from lathesim.stability.stability_thresholds import SHORT
from lathesim.stability.tool_point import Complex, FrequencyResponse, Mode

MOST_MODES = 12
_OUTSIDE = 2
"""Poles outside the band that are tried if the number of modes is given (assumed: one above and one below)."""
NORMAL_95 = 1.959964
_WORTH = 2.0
"""Standard errors by which held-out taps have to be met better before a further mode is believed."""
_CHANCE = 0.3
"""A gain has to exceed this share of the chance scatter of a misfit as well, assumed: filters and windows are not perfect either."""
_KNOWN = 0.7
"""Largest relative width of the intervals of a pole outside the band that counts as a mode (assumed)."""
_NOT_WORTH = 2
_DESCRIBED = 1.5
"""A search ends after so many further modes that brought nothing, once the misfit is about that of the noise."""


@dataclass(frozen=True)
class EstimatedValue:
    """A value with its 95 % interval, SI."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class FoundMode:
    """A mode of the tool point: natural frequency [Hz], damping ratio, stiffness [N/m], each with its interval."""

    frequency: EstimatedValue
    damping: EstimatedValue
    stiffness: EstimatedValue

    @property
    def mode(self) -> Mode:
        """The mode as a tool point takes it."""
        return Mode(self.frequency.value, self.damping.value, self.stiffness.value)

    @property
    def is_known(self) -> bool:
        """Whether damping and stiffness are known to about a third."""
        return all(abs(item.high - item.low) < _KNOWN * abs(item.value) for item in (self.damping, self.stiffness))


@dataclass(frozen=True, eq=False)
class FoundModes:
    """The modes of a response within its band, their model, the text on how their number was decided, and the held-out misfit of each
    number of poles. ``outside`` are poles outside the band: residual terms, which bend the response inside it."""

    modes: tuple[FoundMode, ...]
    outside: tuple[FoundMode, ...]
    model: ModalModel
    decided_on: str
    held_out: tuple[tuple[int, float], ...]


def find_modes(response: FrequencyResponse, count: int | None = None) -> FoundModes:
    """Return the modes of a response; ``count`` fixes their number, else the hits that were not fitted decide.

    Without single hits every second line is held out. Pairs that cancel each other and poles that the data do not determine are removed.
    Raises :class:`RecordingError` if no mode within the band stands out of the noise.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        start, held, text = _count(response, count)
        if start is None and count is None:
            raise RecordingError("no mode stands out of the noise.", remedy="Tap again, harder or with a softer tip.")
        model = _fitted(response, len(start.omega) if start is not None else count or 1, start)
        while out := model.phantoms(response.frequency) or _beyond_given(model, response, count):
            left = model.without(out)
            if not left.inside(response.frequency).any():
                raise RecordingError("no mode stands out of the noise.", remedy="Tap again, harder or with a softer tip.")
            model = _fitted(response, len(left.omega), left)
    inside = model.inside(response.frequency)
    if not inside.any():
        fact = f"no mode lies between {response.frequency[0]:g} and {response.highest:g} Hz."
        raise RecordingError(fact, remedy="Measure up to higher frequencies.")
    if count is not None and np.count_nonzero(inside) < count:
        text += f", of which the data determine {np.count_nonzero(inside)}"
    found = _with_intervals(model)
    return FoundModes(
        tuple(mode for mode, there in zip(found, inside, strict=True) if there),
        tuple(mode for mode, there in zip(found, inside, strict=True) if not there),
        model,
        text,
        held,
    )


def _beyond_given(model: ModalModel, response: FrequencyResponse, count: int | None) -> list[int]:
    """Return the weakest modes within the band beyond the number that is given: a pole from outside may have come in by the last fit."""
    inside = np.flatnonzero(model.inside(response.frequency))
    if count is None or len(inside) <= count:
        return []
    return sorted(inside[np.argsort(_strength(model)[inside])][: len(inside) - count].tolist())


def _strength(model: ModalModel) -> FloatArray:
    """Return the height of each mode's peak over the same constant, (modes,)."""
    return np.asarray(np.abs(model.residue) / (model.damping * model.omega**2))


def _fitted(response: FrequencyResponse, count: int, start: ModalModel | None) -> ModalModel:
    """Return a fit whose weights come from the scatter of the hits, or from its own misfit, in turns."""
    frequency, values, hits = response.frequency, response.receptance_values, response.hits
    model = start or _without_modes(response)
    if hits is not None and len(hits) >= 2:
        shape = None
        for _ in range(3):
            model = fit_modes(frequency, values, weights_of_mean(response, hits, len(hits), shape), count, model)
            shape = model.response(frequency)
        return model
    weights = NoiseWeights(np.full(len(frequency), 1e-3 * float(np.abs(values).max())), np.zeros((0, 0)), np.zeros(0))
    for _ in range(4):
        model = fit_modes(frequency, values, weights, count, model)
        weights = weights_of_residual(response, values - model.response(frequency))
    return model


def _without_modes(response: FrequencyResponse) -> ModalModel:
    """Return a model without modes; terms for modes outside the band cost little, and a band always ends somewhere."""
    rest = 2 if len(response.frequency) > SHORT.first_poles else 0
    return ModalModel(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(rest), response.window_rate)


def _count(response: FrequencyResponse, given: int | None) -> tuple[ModalModel | None, tuple[tuple[int, float], ...], str]:
    """Return the start of the fit with the right number of poles, the held-out misfit of each number tried, and the text on held-out data.

    With a ``given`` number of modes, only the number of poles outside the band is decided.
    """
    if response.hits is not None and len(response.hits) >= SHORT.hits:
        folds = _folds_of_hits(response)
        text = f"each of {len(folds)} hits in turn, which was not fitted"
    else:
        folds = _folds_of_lines(response)
        text = "every second line, which was not fitted"
    found = _Search(folds)
    model: ModalModel | None = None
    best, chosen, since = found.score(None), model, 0
    held = [(0, float(best.mean()))]
    for count in range(given or 1, (MOST_MODES if given is None else given + _OUTSIDE) + 1):
        # the place where a mode begins is looked for once; each fold then fits it to its own data
        first = folds[0]
        model = begin_modes(first.frequency, first.fitted, first.weights, count, model or _without_modes(response))
        score = found.score(model)
        held.append((count, float(score.mean())))
        since += 1
        if given is not None and np.count_nonzero(model.inside(response.frequency)) != given:
            continue
        if not model.phantoms(response.frequency) and (_is_better(best, score, folds) or (given is not None and chosen is None)):
            best, chosen, since = score, model, 0
        elif since >= _NOT_WORTH and best.mean() < _DESCRIBED:
            break
    if given is not None:
        return chosen, (), "the number given"
    if chosen is not None:
        chosen = found.without_the_needless(chosen, best)
    return chosen, tuple(held), text


@dataclass(frozen=True, eq=False)
class _Search:
    """The folds of a response, on which models of some numbers of modes are tried."""

    folds: list[_Fold]

    def score(self, start: ModalModel | None) -> FloatArray:
        """Return the misfit of the data held out in each fold, over what noise leaves; the fit begins at ``start``."""
        row = []
        for fold in self.folds:
            misfit = fold.held
            if start is not None:
                own = fit_modes(fold.frequency, fold.fitted, fold.weights, len(start.omega), start)
                misfit = fold.held - own.response(fold.held_frequency)
            row.append(fold.held_weights.misfit(misfit) / (2.0 * len(fold.held)))
        return np.array(row)

    def without_the_needless(self, model: ModalModel, score: FloatArray) -> ModalModel:
        """Return a model less the modes without which held-out data are met as well."""
        while len(model.omega) > 1:
            tried = []
            for out in _needless(model):
                fewer = model.without([out])
                tried.append((self.score(fewer), fewer))
            best, fewer = min(tried, key=lambda item: float(item[0].mean()))
            if _is_better(best, score, self.folds):
                return model
            model, score = fewer, best
        return model


def _needless(model: ModalModel) -> list[int]:
    """Return the modes that may be needless: the weakest two, and one of the two closest to each other."""
    gaps = np.diff(model.omega) / model.omega[1:]
    return list(dict.fromkeys([*np.argsort(_strength(model))[:2].tolist(), int(np.argmin(gaps)) + 1]))


def _is_better(before: FloatArray, after: FloatArray, folds: list[_Fold]) -> bool:
    """Whether held-out data are met better, beyond what chance would do; ``before`` and ``after`` are misfits of each fold."""
    gain = before - after
    lines = 2.0 * len(folds[0].held)
    chance = math.sqrt(2.0 / lines / len(gain)) * _CHANCE * float(after.mean())
    spread = float(gain.std(ddof=1)) / math.sqrt(len(gain)) if len(gain) > 1 else 0.0
    return float(gain.mean()) > max(_WORTH * spread, chance)


@dataclass(frozen=True, eq=False)
class _Fold:
    frequency: FloatArray
    fitted: Complex
    weights: NoiseWeights
    held_frequency: FloatArray
    held: Complex
    held_weights: NoiseWeights


def _folds_of_hits(response: FrequencyResponse) -> list[_Fold]:
    assert response.hits is not None
    hits = response.hits
    train = weights_of_mean(response, hits, len(hits) - 1)
    single = weights_of_mean(response, hits, 1)
    f = response.frequency
    return [_Fold(f, np.delete(hits, out, axis=0).mean(axis=0), train, f, hits[out], single) for out in range(len(hits))]


def _folds_of_lines(response: FrequencyResponse) -> list[_Fold]:
    values, f = response.receptance_values, response.frequency
    # neighbours differ by little more than the noise: the second difference of four lines tells its size
    rough = np.convolve(values, [1.0, -3.0, 3.0, -1.0], "same") / math.sqrt(20.0)
    rough[:2], rough[-2:] = rough[2], rough[-3]
    weights = weights_of_residual(response, rough)
    floor = NoiseWeights(np.maximum(weights.deviation, 1e-4 * np.abs(values)), weights.directions, weights.share)
    folds = []
    for odd in (0, 1):
        fit, out = np.arange(odd, len(f), 2), np.arange(1 - odd, len(f), 2)
        folds.append(
            _Fold(f[fit], values[fit], _part(floor, fit), f[out], values[out], _part(floor, out))
        )  # fmt: skip
    return folds


def _part(weights: NoiseWeights, lines: Any) -> NoiseWeights:
    return NoiseWeights(weights.deviation[lines], np.zeros((0, 0)), np.zeros(0))


def _with_intervals(model: ModalModel) -> tuple[FoundMode, ...]:
    """Return the modes with 95 % intervals, by the covariance of the logarithms; k = w^2/R."""
    assert model.covariance is not None
    count = len(model.omega)
    c = model.covariance
    found = []
    for at in range(count):
        w, z, r = float(model.omega[at]), float(model.damping[at]), float(model.residue[at])
        i, j, k = at, count + at, 2 * count + at
        stiffness = 4.0 * c[i, i] + c[k, k] - 4.0 * c[i, k]
        found.append(
            FoundMode(
                _interval(w / (2.0 * math.pi), c[i, i]), _interval(z, c[j, j]), _interval(w * w / r if r != 0.0 else math.inf, stiffness)
            )
        )
    return tuple(found)


def _interval(value: float, variance: float) -> EstimatedValue:
    reach = math.exp(min(NORMAL_95 * math.sqrt(max(variance, 0.0)), 50.0))
    ends = sorted((value / reach, value * reach))
    return EstimatedValue(value, ends[0], ends[1])
