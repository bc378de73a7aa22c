"""What a recording could tell, for a person and for programs: a table of effects, a matrix, reasons, and JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit, text_table
from lathesim.diagnosis.isolation.answerable import Answerable, Isolation
from lathesim.diagnosis.records.shown import Shown

TIED, TOLD, UNSEEN = "#", ".", "-"
"""Signs of the matrix of a terminal: the recording is alike with the column, or not; the effect is not seen itself."""


def as_json(found: Isolation) -> dict[str, Any]:
    """Return what a recording could tell for programs; sizes are SI, and what is never seen or told has none."""
    # null where a column is no rival of a row
    behind = [[_finite(value) for value in row] for row in found.behind.tolist()]
    matrix = {"names": [one.name for one in found.effects], "behind": behind}
    return {"effects": [_effect(found, row) for row in range(len(found.effects))], "matrix": matrix}


def _effect(found: Isolation, row: int) -> dict[str, Any]:
    one = found.effects[row]
    tied = [
        {
            "effect": found.effects[column].effect,
            "at": found.effects[column].at,
            "behind": float(found.behind[row, column]),
            "told_from": _finite(found.told_from[row, column]),
        }
        for column in found.tied_with(row)
    ]
    return {
        "effect": one.effect, "at": one.at, "family": one.family, "parameter": one.parameter, "unit": one.unit, "visible": one.is_visible,
        "smallest": _finite(one.smallest), "compared_at": _finite(one.size), "tied_with": tied, "why": one.why,
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def isolation_lines(found: Isolation) -> Iterator[str]:
    """Yield the table of effects, the matrix of those that are tied, and why."""
    rows = [(str(row + 1), one.effect, one.at, _seen_from(one), _ties(found, row)) for row, one in enumerate(found.effects)]
    yield from text_table([("", "effect", "place", "seen from", "cannot be distinguished from"), *rows])
    if tied := sorted({row for pair in found.pairs for row in pair}):
        yield ""
        yield f"Ties, each row at ten times its smallest size ({TIED} like the column, {TOLD} distinct, {UNSEEN} not seen):"
        yield from _matrix_lines(found, tied)
    reasons: dict[str, list[str]] = {}
    for one in found.effects:
        if one.why:
            reasons.setdefault(one.why, []).append(one.name)
    if reasons:
        yield ""
        yield from (f"{reason[0].upper()}{reason[1:]}: {', '.join(names)}." for reason, names in reasons.items())


def _seen_from(one: Answerable) -> str:
    return f"{one.parameter} {shown_with_unit(one.smallest, one.unit, 2)}" if one.is_visible else "never"


def _ties(found: Isolation, row: int) -> str:
    return ", ".join(found.effects[column].name for column in found.tied_with(row)) if found.effects[row].is_visible else ""


def _matrix_lines(found: Isolation, shown: Sequence[int]) -> Iterator[str]:
    """Yield a line for each of some effects, with a sign for each of them as the other explanation."""
    width = max(len(found.effects[row].name) for row in shown)
    yield f"{'':{width + 5}}{' '.join(str((row + 1) % 100).rjust(2) for row in shown)}"
    for row in shown:
        signs = [UNSEEN if not found.effects[row].is_visible else TIED if found.behind[row, column] < 1.0 else TOLD for column in shown]
        signs = [" " if column == row else sign for sign, column in zip(signs, shown, strict=True)]
        yield f"{row + 1:3d}  {found.effects[row].name:{width}}{' '.join(sign.rjust(2) for sign in signs)}"


def isolation_figure(found: Isolation, title: str) -> Any:
    """Draw the matrix: rows are what a machine has, columns what else explains it; dark where the two cannot be told."""
    from lathesim.analysis.figure_style import INK, new_figure

    names = [one.name for one in found.effects]
    size = max(4.0, 0.16 * len(names) + 2.5)
    figure = new_figure(size + 1.5, size)
    axes = figure.subplots()
    shown = np.clip(np.where(np.isnan(found.behind), np.nan, found.behind), 0.0, Shown.far_apart)
    image = axes.imshow(np.ma.masked_invalid(shown), cmap="Blues_r", vmin=0.0, vmax=Shown.far_apart, aspect="equal")
    for row in range(len(names)):
        for column in found.tied_with(row):
            axes.text(column, row, "x", ha="center", va="center", fontsize=5, color="white")
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=5, color=INK)
    axes.set_yticks(range(len(names)), [f"{name}, {_seen_from(one)}" for name, one in zip(names, found.effects, strict=True)], fontsize=5)
    axes.set_title(title, fontsize=9, color=INK, loc="left")
    bar = figure.colorbar(image, ax=axes, shrink=0.6)
    bar.set_label("how far the column stays behind, over what tells them (x: below 1)", fontsize=6)
    return figure
