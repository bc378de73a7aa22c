"""The answer of a diagnosis as lines of text for a person at a terminal: six lines, the tables, and then all that is left to say."""

from __future__ import annotations

from collections.abc import Sequence

from lathesim.analysis.display_unit import text_table
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.shown import Shown
from lathesim.diagnosis.reporting.answer_tables import Rows, before_text, channel_rows, effect_rows, value_rows
from lathesim.diagnosis.reporting.html_report import insert_lines
from lathesim.diagnosis.reporting.number_text import plain, quantity_text
from lathesim.diagnosis.reporting.remarks import not_answered
from lathesim.diagnosis.reporting.summary import most_moved, moved_values, shown_values, summary_lines


def answer_lines(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the lines of an answer."""
    lines = [*summary_lines(diagnosis, method), *_tables(diagnosis)]
    lines += _section("What is left:", diagnosis.rest.left)
    lines += _section("What this recording cannot tell:", (*diagnosis.rest.not_told, *not_answered(diagnosis)))
    lines += _section("About the recording:", [line for line in diagnosis.question.findings if line not in diagnosis.sentence])
    if diagnosis.rest.discovered:
        lines += ["", f"A formula for what is left: {diagnosis.rest.discovered}"]
    if diagnosis.lines.insert:
        lines += ["", "Paste into the lesson:", insert_lines(diagnosis.lines.insert, diagnosis.lines.side), *_beside(diagnosis)]
    if diagnosis.search.untried:
        names, more = diagnosis.search.untried[: Shown.most_rows], len(diagnosis.search.untried) - Shown.most_rows
        lines += ["", f"Not tried: {', '.join(names)}{f' and {more} more' if more > 0 else ''}."]
    return [plain(line) for line in lines]


def _tables(diagnosis: Diagnosis) -> list[str]:
    lines: list[str] = []
    if diagnosis.effects:
        lines += ["", *_table(("effect", "place", "size (95 % interval)", "probability"), effect_rows(diagnosis))]
        lines += [f"{effect.effect}: {effect.doc}" for effect in diagnosis.effects if effect.doc]
    if shown_values(diagnosis):
        lines += ["", *_table(("value of the lesson", "given", "fitted", "95 % interval"), value_rows(diagnosis))]
    if diagnosis.fit:
        lines += ["", *_table(("RMS error of", "before", "after", "noise"), channel_rows(diagnosis)), before_text(diagnosis)]
    return lines


def _table(head: tuple[str, ...], rows: Rows) -> list[str]:
    return text_table([tuple(plain(cell) for cell in row) for row in (head, *rows)])


def _section(title: str, sentences: Sequence[str]) -> list[str]:
    return ["", title, *(f"- {sentence}" for sentence in sentences)] if sentences else []


def _beside(diagnosis: Diagnosis) -> list[str]:
    """Return the values of the lesson beside what is to be pasted, where some are clearly others: without all of them it leaves more."""
    if not moved_values(diagnosis):
        return []
    values = [f"{name} = {quantity_text(item.refit_with, item.unit)}" for name, item in most_moved(diagnosis.baseline.items())]
    return [f"Use these lines with {', '.join(values)}."]
