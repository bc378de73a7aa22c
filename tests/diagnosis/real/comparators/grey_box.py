"""Grey box with BIC: structured least squares, one effect after the other as long as the criterion falls, and back again.

Source: G. Schwarz, Annals of Statistics 6 (1978). ``careful`` takes an effect only where the held-out error falls with it too, by at least
a tenth, as an engineer would. Left out: declared doubts of the values, the colour of what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.diagnosis.real.cases import Case
from tests.diagnosis.real.comparators.candidates import Candidate, candidates
from tests.diagnosis.real.comparators.equations import Array, Equation, equations

MOST = 4
HELD_OUT = 0.9
"""Ratio of held-out errors that an effect has to reach."""
ROW = 0.6
"""Rows of lateness from which it has a name: what is held from row to row is half a row late."""


@dataclass(frozen=True)
class Term:
    """A candidate with its shape and the columns that it has in the fitted and in the held-out equation."""

    candidate: Candidate
    shape: float
    fitted: Array
    held_out: Array


@dataclass(frozen=True)
class Model:
    """Terms with the coefficients of least squares, those of the lesson first."""

    terms: tuple[Term, ...]
    coefficients: Array
    criterion: float
    held_out: float
    """Root mean square of the held-out equation."""


def answer(case: Case, *, careful: bool) -> dict[str, Any]:
    """Return the answer in the words of the program."""
    effects, off, errors = [], False, {}
    for fitted, held_out in equations(case):
        models = selected(fitted, held_out, careful=careful)
        first, last = models[0], models[-1]
        errors[f"{fitted.kind} at {fitted.part}"] = [first.held_out, last.held_out]
        effects += [_told(term, last, number, fitted) for number, term in enumerate(last.terms)]
        effects += _late(fitted, held_out, last, careful=careful)
        off |= _values_off(fitted, last)
    verdict = "named" if effects else ("parameters_only" if off else "no_mismatch")
    return {"verdict": verdict, "effects": effects, "errors": errors}


def selected(fitted: Equation, held_out: Equation, *, careful: bool) -> list[Model]:
    """Return the models on the way, from that of the lesson to the chosen one."""
    models = [_solved((), fitted, held_out)]
    grids = [_grid(candidate, fitted) for candidate in candidates(fitted)]
    while len(models[-1].terms) < MOST:
        now = models[-1]
        rest = fitted.values - _matrix(now.terms, fitted) @ now.coefficients
        trials = []
        for candidate, columns in grids:
            if candidate not in [term.candidate for term in now.terms]:
                shape = _best_shape(candidate, columns, rest)
                term = Term(candidate, shape, candidate.columns(fitted, shape), candidate.columns(held_out, shape))
                trial = _solved((*now.terms, term), fitted, held_out)
                trials += [trial] if not candidate.whole or abs(trial.coefficients[-1] - 1.0) < 0.5 else []
        trials = [one for one in trials if one.criterion < now.criterion and (not careful or one.held_out < HELD_OUT * now.held_out)]
        if not trials:
            return models
        models.append(_pruned(min(trials, key=lambda one: one.criterion), fitted, held_out))
        if len(models[-1].terms) <= len(now.terms):
            return models
    return models


def _grid(candidate: Candidate, equation: Equation) -> tuple[Candidate, list[Array]]:
    """Return a basis of what each shape adds to the columns of the lesson."""
    base = np.linalg.qr(_matrix((), equation))[0]
    every = [candidate.columns(equation, shape) for shape in candidate.shapes]
    return candidate, [np.linalg.qr(columns - base @ (base.T @ columns))[0] for columns in every]


def _best_shape(candidate: Candidate, columns: Sequence[Array], rest: Array) -> float:
    gains = [float(np.sum((basis.T @ rest) ** 2)) for basis in columns]
    return candidate.shapes[int(np.argmax(gains))]


def _matrix(terms: Sequence[Term], equation: Equation) -> Array:
    return np.column_stack([column for column, _, _ in equation.given.values()] + [term.fitted for term in terms])


def _solved(terms: tuple[Term, ...], fitted: Equation, held_out: Equation) -> Model:
    matrix, count = _matrix(terms, fitted), len(fitted.values)
    coefficients = np.linalg.lstsq(matrix, fitted.values, rcond=None)[0]
    rest = float(np.sum((fitted.values - matrix @ coefficients) ** 2))
    free = matrix.shape[1] + sum(len(term.candidate.shapes) > 1 for term in terms)
    other = np.column_stack([column for column, _, _ in held_out.given.values()] + [term.held_out for term in terms])
    missed = held_out.values - other @ coefficients
    missed -= np.mean(missed) if held_out.kind == "difference" else 0.0  # a sensor's zero is another one in each recording
    return Model(terms, coefficients, count * np.log(rest / count) + free * np.log(count), float(np.sqrt(np.mean(missed**2))))


def _pruned(model: Model, fitted: Equation, held_out: Equation) -> Model:
    while model.terms:
        fewer = [_solved(tuple(one for one in model.terms if one is not term), fitted, held_out) for term in model.terms]
        best = min(fewer, key=lambda one: one.criterion)
        if best.criterion >= model.criterion:
            break
        model = best
    return model


def _told(term: Term, model: Model, number: int, equation: Equation) -> dict[str, Any]:
    begin = len(equation.given) + sum(one.fitted.shape[1] for one in model.terms[:number])
    size, shape = term.candidate.sizes
    sizes = {size: float(np.linalg.norm(model.coefficients[begin : begin + term.fitted.shape[1]])), shape: term.shape}
    if term.fitted.shape[1] == 1:
        sizes[size] = float(model.coefficients[begin])
    parameters = {name: {"value": value, "unit": ""} for name, value in sizes.items() if name}
    return {"effect": term.candidate.effect, "at": term.candidate.at, "parameters": parameters, "tied_with": []}


def _late(fitted: Equation, held_out: Equation, model: Model, *, careful: bool) -> list[dict[str, Any]]:
    """Return the lateness of an equation as an effect where it is more than half a row, and gains as much as any other effect has to."""
    shift = dict(zip(fitted.given, model.coefficients.tolist(), strict=False)).get("late", 0.0)
    if abs(shift) < ROW * fitted.period:
        return []
    without = _solved(
        model.terms, *(replace(one, given={key: own for key, own in one.given.items() if key != "late"}) for one in (fitted, held_out))
    )
    if without.criterion < model.criterion or (careful and model.held_out > HELD_OUT * without.held_out):
        return []
    return [{"effect": "ChannelTimeShift", "at": fitted.part, "parameters": {"shift": {"value": shift, "unit": "s"}}, "tied_with": []}]


def _values_off(equation: Equation, model: Model) -> bool:
    """Return whether a value of the lesson is off by more than two of its declared doubts."""
    return any(
        abs(found / value - 1.0) > 2.0 * doubt
        for found, (_, value, doubt) in zip(model.coefficients, equation.given.values(), strict=False)
        if value and np.isfinite(doubt)
    )
