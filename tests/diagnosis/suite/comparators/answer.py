"""Answers of the comparators in the words of the program under test, so that one score serves all."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.diagnosis.suite import lessons
from tests.diagnosis.suite.comparators.candidates import box_of, candidates_of
from tests.diagnosis.suite.comparators.libraries import residuals_of
from tests.diagnosis.suite.comparators.raw_bic import Candidate, Fit, select
from tests.diagnosis.suite.comparators.read_case import Case, read_case
from tests.diagnosis.suite.comparators.sindy import sparse_terms
from tests.diagnosis.suite.runner import Job

OUTSIDE = "other"
"""Key of library terms that stand for nothing in the catalogue."""
_SAME = {"speed_hump": "speed_effect", "drift": "charge_leak", "leak": "charge_leak"}


@dataclass(frozen=True)
class Given:
    """An effect as a comparator gives it: its key, its parameters as (value, standard error), and keys that are as good."""

    key: str
    parameters: Mapping[str, tuple[float, float]]
    ties: tuple[str, ...] = ()


def raw_bic(case: Case) -> dict[str, Any]:
    """Answer with the grey box of the raw criterion."""
    chosen = select(box_of(case, case.fitted), candidates_of(case))
    effects = [Given(one.key, _parameters(chosen.model, one), chosen.ties.get(one.key, ())) for one in chosen.model.candidates]
    box = box_of(case, case.held_out)
    sizes = [np.sqrt(np.mean((box.observed - box.run(fit.values)) ** 2, axis=1)) for fit in (chosen.baseline, chosen.model)]
    told = _answer(effects)
    outputs = lessons.outputs(case.template)
    told["fit"] = {
        outputs[channel]: {"before": _finite(before), "after": _finite(after), "recording": "validate.csv"}
        for channel, before, after in zip(case.channels, *sizes, strict=True)
    }
    return told


def sindy(case: Case) -> dict[str, Any]:
    """Answer with the terms that sparse regression keeps. It gives coefficients of its library, no simulation and no parameters."""
    terms = sparse_terms(residuals_of(case))
    keys = {key for key, _ in terms}
    # a friction that differs between the directions, or that rises after a reversal, is one effect, though two terms of the library
    pairs = (("coulomb", "bristles"), ("spindle_coulomb", "spindle_asymmetric"))
    one = {level: both for level, both in pairs if {level, both} <= keys}
    given = [Given(one.get(key, key), {}, ties) for key, ties in terms if key not in {*one.values(), OUTSIDE}]
    return _answer(given, outside=OUTSIDE in keys)


COMPARATORS: dict[str, Callable[[Case], dict[str, Any]]] = {"raw BIC": raw_bic, "SINDy on three residuals": sindy}


def answer_file_of(name: str, job: Job) -> None:
    """Ask a comparator about the case of a job and keep the answer, as the runner does with the program's."""
    answer = ask(name, Path(job.folder), poor=job.poor)
    Path(job.answer).write_text(json.dumps(answer, indent=1), encoding="utf-8")


def ask(name: str, folder: Path, *, poor: bool = False) -> dict[str, Any]:
    """Ask a comparator about a case, and about the second recording of a poor one; what it cannot answer is no name."""
    told = _asked(name, folder, "fit.csv", "validate.csv")
    if poor:
        told["second"] = _asked(name, folder, "resolve.csv", "resolve_validate.csv")
    return told


def _asked(name: str, folder: Path, fitted: str, held_out: str) -> dict[str, Any]:
    began, computed = time.perf_counter(), time.process_time()
    error, answer = "", {"verdict": "unknown", "effects": []}
    try:
        with np.errstate(all="ignore"):
            answer = COMPARATORS[name](read_case(folder, fitted, held_out))
    except (ValueError, np.linalg.LinAlgError) as met:
        # recordings at fault are not made for an equation
        error = str(met)
    seconds, computed = time.perf_counter() - began, time.process_time() - computed
    return {"seconds": seconds, "computed_seconds": computed, "exit_code": 0, "error": error, "answer": answer}


def _answer(effects: list[Given], *, outside: bool = False) -> dict[str, Any]:
    named = []
    for one in effects:
        name = lessons.NAMES[_SAME.get(one.key, one.key)]
        ties = [lessons.NAMES[_SAME.get(key, key)].effect for key in one.ties]
        ties = [tie for tie in dict.fromkeys(ties) if tie != name.effect]
        named.append(
            {
                "effect": name.effect, "at": name.at, "family": name.family, "probability": 1.0 / (1 + len(ties)), "tied_with": ties,
                "parameters": {
                    key: {"value": value, "low": value - 1.96 * error, "high": value + 1.96 * error}
                    for key, (value, error) in one.parameters.items()
                },
            }
        )  # fmt: skip
    verdict = ("unknown" if outside else "no_mismatch") if not named else ("tied" if named[0]["tied_with"] else "named")
    return {"verdict": verdict, "effects": named, "adequate": not outside}


def _parameters(model: Fit, one: Candidate) -> dict[str, tuple[float, float]]:
    """Return the catalogue's parameters with their standard errors; two own ones are sine and cosine of an amplitude."""
    found = {}
    for name, own in one.told.items():
        values = [model.values[item] for item in own]
        errors = [model.errors.get(item, 0.0) for item in own]
        if len(own) == 1:
            found[name] = (values[0], errors[0])
            continue
        size = math.hypot(*values) or 1e-300
        found[name] = (size, math.hypot(*[value * error / size for value, error in zip(values, errors, strict=True)]))
    return found


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
