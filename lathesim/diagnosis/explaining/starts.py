"""Where the fit of a candidate begins: of many values, those from which most is explained beside what the other values can take up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import PERIODS, cycle_of
from lathesim.diagnosis.candidates.screening import in_proportion
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.records.found import Screened
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.noise import whitened
from lathesim.identification.records import Candidate, Fitted, Free, Model, with_start
from lathesim.identification.signal import ROUNDING


def starts(study: Study, model: Model, item: Screened, points: FloatArray | None) -> list[list[Free]]:
    """Return the free values of some fits of a candidate on top of a model, each with where it begins, the best first.

    Values of the lesson begin where the model has them and, as an error that the effect explains may have drawn them away, where the
    lesson gives them. What is left of each beginning is projected off what the model's free values change.
    """
    candidate, fitted, by_output = item.candidate, model.fitted, study.estimation.machine.output_error
    # the error of a simulation has more valleys than that of its equations
    many_points, many, clearly = (40, 6, 0.0) if by_output else (6, 2, 0.7)
    rows, bases = _rows(candidate, item, points, many_points), _bases(fitted)
    most = study.method.alike * float(np.sum(_beside(fitted, fitted.residual[None]) ** 2))
    found: list[_Begun] = []
    for place, base in enumerate(bases):
        left = _left(study, fitted, base, candidate, rows)
        best = np.argsort(left)[: 4 * many]
        found += [_Begun(float(left[row]), place, rows[row]) for row in best if not (place and by_output) or left[row] < most]
        if by_output:  # a run costs more, and shows at once which of the lesson's values are none to begin with
            rows = rows[best]
    return [[*bases[one.base], *candidate_free(study, candidate, one.values)] for one in _best(found, many // len(bases), clearly)]


class _Begun(NamedTuple):
    """A beginning: the power that is left there, which values of the model it stands on, and those of the candidate."""

    left: float
    base: int
    values: FloatArray


def _bases(fitted: Fitted) -> list[list[Free]]:
    """Return the free values of a model where it has them, and with those of the lesson as given where these have moved."""
    at_fit = with_start(fitted)
    known = [one for one in at_fit if one.given]
    if not any(abs(one.start - one.given) > min(one.uncertainty, one.scale) for one in known):
        return [at_fit]
    return [at_fit, [replace(one, start=one.given) if one in known else one for one in at_fit]]


def _best(found: Sequence[_Begun], many: int, clearly: float) -> list[_Begun]:
    """Return the best of the beginnings that differ, so ``many`` on each of the bases; one alone where it leaves less than a share
    ``clearly`` of what the next one does, and there is no other base."""
    bases = {one.base for one in found}
    kept: list[_Begun] = []
    for base in sorted(bases):
        own: list[_Begun] = []
        for one in sorted((one for one in found if one.base == base), key=lambda entry: entry.left):
            if len(own) < many and all(_differ(one, other) for other in own):
                own.append(one)
        kept += own
    kept.sort(key=lambda entry: entry.left)
    if len(bases) == 1 and len(kept) > 1 and kept[0].left < clearly * kept[1].left:
        del kept[1:]
    return kept


def candidate_free(study: Study, candidate: Candidate, start: FloatArray) -> list[Free]:
    """Return the parameters of a candidate as free ones, starting at ``start``.

    The scale of a wavelength is what makes one wave more on the way: a slope over more than that would be one of another wave.
    """
    spread = np.maximum(np.abs(candidate.points).max(axis=0, initial=0.0), np.abs(start)) if len(candidate.points) else np.abs(start)
    spread = np.where(spread > 0.0, spread, candidate.usual)
    free = [
        Free(name, float(value), max(0.3 * float(scale), 1e-12), float(low), float(high))
        for name, value, scale, low, high in zip(candidate.parameters, start, spread, candidate.low, candidate.high, strict=True)
    ]
    free = [
        replace(one, scale=min(one.scale, cycle_of(study.estimation, candidate, one.start))) if Place.of(one.name).port in PERIODS else one
        for one in free
    ]
    # what is known beforehand is free by far less than a recording shows
    known = math.sqrt(ROUNDING)
    free = [replace(one, uncertainty=known * abs(one.low), given=one.low) if one.low == one.high else one for one in free]
    orders = candidate.named(candidate.effect.identification.orders)
    # an order is a whole number
    return [replace(one, uncertainty=0.002, given=round(one.start)) if one.name in orders else one for one in free]


def _rows(candidate: Candidate, item: Screened, points: FloatArray | None, many: int) -> FloatArray:
    """Return the values that are tried (starts, parameters): those of screening and so ``many`` usual ones, with smaller sizes too."""
    usual = candidate.points if points is None or not len(points) else points
    begun = [*item.starts, *usual[:many]]
    scaled = [
        np.where(in_proportion(candidate), candidate.neutral + share * (row - candidate.neutral), row)
        for row in begun
        for share in (1.0, 0.3)
    ]
    return np.asarray(np.clip(np.array(scaled), candidate.low, candidate.high))


def _left(study: Study, fitted: Fitted, base: Sequence[Free], candidate: Candidate, rows: FloatArray) -> FloatArray:
    """Return the whitened power that is left with each start (starts,), beside what the model's free values can take up."""
    sensed = study.estimation.sensed
    # with the names that the fits from here will set: runs that set the same ones are made by the same machine code
    as_now = {name: sensed.given(name) for name in study.estimation.simulated_motion_of([candidate])}
    before = {**as_now, **fitted.constant, **{one.name: one.start for one in base}}
    values = np.hstack([np.tile(list(before.values()), (len(rows), 1)), rows])
    white = _beside(fitted, np.array(sensed.residuals([*before, *candidate.parameters], values)))
    return np.asarray(np.sum(white * white, axis=1))


def _beside(fitted: Fitted, residuals: FloatArray) -> FloatArray:
    """Return residuals (rows, channels, samples) whitened, (rows, values), less what the free values of a fit can take up."""
    white: FloatArray = whitened(fitted.noise, residuals, full_band=True)
    if fitted.sensitivity is not None and len(fitted.free):
        slopes = whitened(fitted.noise, fitted.sensitivity, full_band=True)
        length = np.linalg.norm(slopes, axis=1)
        basis, _ = np.linalg.qr((slopes[length > 0.0] / length[length > 0.0, None]).T)
        white = white - (white @ basis) @ basis.T
    return white


def _differ(one: _Begun, other: _Begun) -> bool:
    apart = 0.3 * np.abs(other.values)
    away = np.abs(one.values - other.values) > apart
    return one.base != other.base or bool(np.any(away))
