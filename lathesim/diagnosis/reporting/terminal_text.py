"""The answer of a diagnosis as lines of text for a person at a terminal: six lines, the tables, and then all that is left to say."""

from __future__ import annotations

from collections.abc import Sequence

from lathesim.analysis.display_unit import text_table
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import Diagnosis, with_unit
from lathesim.diagnosis.reporting.answer_tables import GAIN, Rows, before_text, channel_rows, effect_rows, value_rows
from lathesim.diagnosis.reporting.html_report import insert_lines
from lathesim.diagnosis.reporting.number_text import plain, takes_part
from lathesim.diagnosis.reporting.remarks import what_is_left
from lathesim.diagnosis.reporting.summary import summary_lines

_EFFECT_HEAD = ("effect", "place", "size (95 % interval)", "gain")


def answer_lines(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the lines of an answer."""
    lines = [*summary_lines(diagnosis, method), *_tables(diagnosis)]
    lines += _section("What is left:", what_is_left(diagnosis))
    lines += _section("What this recording cannot tell:", diagnosis.not_told)
    lines += _section("About the recording:", [line for line in diagnosis.findings if line not in diagnosis.sentence])
    if diagnosis.discovered:
        lines += ["", f"A formula for what is left: {diagnosis.discovered}"]
    if diagnosis.insert:
        lines += ["", "Paste into the lesson:", insert_lines(diagnosis.insert), *_beside(diagnosis)]
    if not diagnosis.complete:
        lines += ["", "The search was stopped; this is what was known until then."]
        lines += [f"Not tried: {_first_of(diagnosis.untried)}. Give it more time, and ask again."] * bool(diagnosis.untried)
    return [plain(line) for line in lines]


def _tables(diagnosis: Diagnosis) -> list[str]:
    lines: list[str] = []
    if diagnosis.effects:
        lines += ["", *([] if diagnosis.names else [f"{takes_part(diagnosis)}:"])]
        lines += _table(_EFFECT_HEAD, effect_rows(diagnosis, diagnosis.effects))
        lines += [f"{effect.effect}: {effect.doc}" for effect in diagnosis.effects if effect.doc]
        lines += [GAIN]
    if diagnosis.verdict == "parameters_only" and diagnosis.baseline:
        lines += ["", *_table(("value of the lesson", "given", "fitted", "95 % interval"), value_rows(diagnosis))]
    if diagnosis.fit:
        lines += ["", *_table(("held-out error (rms) of", "before", "after", "noise"), channel_rows(diagnosis)), before_text(diagnosis)]
    return lines


def _table(head: tuple[str, ...], rows: Rows) -> list[str]:
    return text_table([tuple(plain(cell) for cell in row) for row in (head, *rows)])


def _section(title: str, sentences: Sequence[str]) -> list[str]:
    return ["", title, *(f"- {sentence}" for sentence in sentences)] if sentences else []


def _first_of(names: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    more = names[6:]
    return ", ".join(names[:6]) + (f" and {len(more)} more" if more else "")


def _beside(diagnosis: Diagnosis) -> list[str]:
    """Report which values of the lesson are others beside what is to be pasted: without them it leaves more."""
    moved = [(name, item) for name, item in diagnosis.baseline.items() if not item.low <= item.given <= item.high]
    told = [f"{name} = {with_unit(f'{item.refit_with:.4g}', item.unit)} (given {item.given:.4g})" for name, item in moved]
    return [f"That is with {', '.join(told)}, as in lesson_explained.yaml."] if told else []
