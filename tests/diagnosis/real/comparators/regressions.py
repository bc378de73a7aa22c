"""Sparse and symbolic regression on the same equations: SINDy with its thresholds, and ``adcd`` on what it can express.

SINDy keeps terms of the library of `candidates`, waves at their strongest period; thresholds are those of the comparator of the suite.
``adcd`` 3.0.0 (M. A. Erdita, Anomaly-Driven Correction Discovery, package index, 2026) is asked in an interpreter where it is installed,
for an additive correction of one variable in two rounds: speed for a force, command for a drive, position for a difference of sensors. It
knows no time, no direction, no memory and no second channel. Its formula is the effect whose columns explain nine tenths of it; else it has
no name.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from tests.diagnosis.real.cases import Case
from tests.diagnosis.real.comparators.candidates import Candidate, candidates
from tests.diagnosis.real.comparators.equations import Array, Equation, equations
from tests.diagnosis.real.comparators.sindy import Residual, sparse_terms

EXPLAINED = 0.9
POINTS = 200
SECONDS = 300.0
SCRIPT = """
import json, sys
import numpy as np, sympy, adcd
given = json.load(open(sys.argv[1]))
x, observed, classical = (np.array(given[key]) for key in ("x", "observed", "classical"))
asked = dict(limit_variable="x", correction_mode="additive", max_iterations=2, verbose=False)
found = adcd.fit(X={"x": x}, y_obs=observed, y_classical=classical, **asked)
values = {sympy.Symbol(name): value for name, value in found.best_theta.items()}
formula = sympy.sympify(found.best_expr, locals={name: sympy.Symbol(name) for name in [*found.best_theta, "x"]}).subs(values)
shown = sympy.lambdify(sympy.Symbol("x"), formula, "numpy")(x)
json.dump({"formula": str(sympy.N(formula, 4)), "values": np.broadcast_to(shown, x.shape).tolist()}, open(sys.argv[2], "w"))
"""


def sindy(case: Case) -> dict[str, Any]:
    """Return the terms that survive in most draws of blocks, in the words of the program."""
    residuals, names = [], {}
    for fitted, _ in equations(case):
        start = sum(value * column for column, value, _ in fitted.given.values())
        baseline = [(column, doubt * abs(value) if np.isfinite(doubt) else np.inf) for column, value, doubt in fitted.given.values()]
        rest = fitted.values - start
        terms = {}
        for candidate in candidates(fitted):
            terms[candidate.name] = candidate.columns(fitted, best_shape(candidate, fitted, rest))
            names[candidate.name] = candidate
        residuals.append(Residual(rest, baseline, terms))
    effects = [
        {"effect": names[name].effect, "at": names[name].at, "parameters": {}, "tied_with": []} for name, _ in sparse_terms(residuals)
    ]
    return {"verdict": "named" if effects else "no_mismatch", "effects": effects}


def best_shape(candidate: Candidate, equation: Equation, values: Array) -> float:
    """Return the shape whose columns explain most of some values beside those of the lesson."""
    basis = np.linalg.qr(np.column_stack([column for column, _, _ in equation.given.values()]))[0]

    def missed(shape: float) -> float:
        columns = np.column_stack([basis, candidate.columns(equation, shape)])
        return float(np.sum((values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]) ** 2))

    return min(candidate.shapes, key=missed) if len(candidate.shapes) > 1 else candidate.shapes[0]


def adcd(case: Case, python: Path, folder: Path) -> dict[str, Any]:
    """Return the corrections that ``adcd`` finds, by the names of the effects that they are."""
    effects, formulas, helps = [], [], False
    for fitted, _ in equations(case):
        matrix = np.column_stack([column for column, _, _ in fitted.given.values()])
        classical = matrix @ np.linalg.lstsq(matrix, fitted.values, rcond=None)[0]
        moved = {"force": fitted.velocity, "drive": fitted.command, "difference": fitted.position}[fitted.kind]
        chosen = np.linspace(0, len(fitted.values) - 1, min(POINTS, len(fitted.values))).astype(int)
        asked = {"x": fitted.smooth(moved)[chosen], "observed": fitted.values[chosen], "classical": classical[chosen]}
        scale = {name: float(np.std(values)) or 1.0 for name, values in (("x", asked["x"]), ("y", fitted.values - classical))}
        question, told = folder / "question.json", folder / "told.json"
        told.unlink(missing_ok=True)
        texts = {"x": asked["x"] / scale["x"], "observed": asked["observed"] / scale["y"], "classical": asked["classical"] / scale["y"]}
        question.write_text(json.dumps({name: values.tolist() for name, values in texts.items()}), encoding="utf-8")
        words = [str(python), "-c", SCRIPT, str(question), str(told)]
        subprocess.run(words, capture_output=True, timeout=SECONDS, check=False)
        if told.is_file():
            answer = json.loads(told.read_text(encoding="utf-8"))
            formulas.append(f"{fitted.kind}: {answer['formula']}")
            found = scale["y"] * np.array(answer["values"], dtype=float)
            if _helps(found, asked["observed"] - asked["classical"]):
                helps = True
                effects += _nearest(found, fitted, chosen)
    return {"verdict": "named" if effects else ("unknown" if helps else "no_mismatch"), "effects": effects, "formulas": formulas}


def _helps(values: Array, rest: Array) -> bool:
    """Return whether a formula explains a tenth of what the lesson leaves."""
    return bool(np.all(np.isfinite(values)) and np.any(values) and np.sum((rest - values) ** 2) < EXPLAINED * np.sum(rest**2))


def _nearest(values: Array, equation: Equation, chosen: Any) -> list[dict[str, Any]]:
    """Return the effect whose columns explain nine tenths of a formula, if there is one."""
    best, name = EXPLAINED, None
    for candidate in candidates(equation):
        for shape in candidate.shapes:
            columns = candidate.columns(equation, shape)[chosen]
            left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
            share = 1.0 - float(np.sum(left**2) / np.sum(values**2))
            if share > best:
                best, name = share, candidate
    return [] if name is None else [{"effect": name.effect, "at": name.at, "parameters": {}, "tied_with": []}]
