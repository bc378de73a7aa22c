"""``lathesim look``: what a recording of unknown kind holds, the machine that it fits, and a lesson to begin with."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import OutputPath, grouped, json_option, open_registry, option, plugins_option
from lathesim.cli.writing import CommandResult, Heading, sentence, table, write

if TYPE_CHECKING:
    from lathesim.lessons.proposed_lesson import ProposedLesson
    from lathesim.plugins import Registry

SCHEMA = "lathesim-look/1"
_GAP = 1.5
"""Periods between two rows from which on a row is missing."""
_MOST_COLUMNS = 60
"""Columns of which a person sees the ranges; the JSON has all."""


@dataclass(frozen=True)
class LookOptions:
    """What is known of the recording, and where the lesson goes."""

    lesson: Path | None = option("Write a lesson with the mapping, to look at and to fill in.", type=OutputPath(), metavar="L.yaml")
    axis: str | None = option("The axis that is meant, where the file has several.", metavar="NAME")
    rate: str | None = option("Rows per second, for a file without a clock.", metavar="QUANTITY")


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@json_option(SCHEMA)
@plugins_option
@grouped(looking=LookOptions)
def look(recording: Path, as_json: bool, plugin_folders: tuple[Path, ...], looking: LookOptions) -> int:
    """Show what RECORDING is: its columns with units and ranges, its clock and gaps, and the machine and mapping that fit it.

    With --lesson it writes these as a lesson. On a terminal it asks at most one question then: for the clock, the axis, or what a current
    makes. Elsewhere it asks nothing, and lists what it assumed.
    """
    from lathesim.lessons.proposed_lesson import ProposedLesson
    from lathesim.recordings.raw_table import read_recording, reader_of
    from lathesim.units import quantity

    registry = open_registry(plugin_folders)
    reader = reader_of(recording, registry.readers)
    rate = quantity(looking.rate, "Hz") if looking.rate is not None else None
    proposal = ProposedLesson(read_recording(recording, registry.readers), looking.axis, rate)
    if looking.lesson is not None and not as_json and sys.stdin.isatty() and (question := proposal.question) is not None:
        answer = click.prompt(question.text, default=question.default, type=str if question.field == "axis" else float)
        given: dict[str, Any] = {question.field: answer}
        proposal = replace(proposal, **given)
    if looking.lesson is not None:
        _write_lesson(proposal, recording, looking.lesson, registry)
    data = {"recording": recording, "kind": reader.name, **_found(proposal), "lesson": looking.lesson}
    return write(CommandResult(SCHEMA, data, _lines(data, proposal)), as_json)


def _found(proposal: ProposedLesson) -> dict[str, Any]:
    """Return what was found, for programs."""
    import numpy as np

    columns = [
        {
            "name": name, "unit": proposal.table.units[name], "rows": len(values), "missing": int(np.isnan(values).sum()),
            "smallest": np.nanmin(values) if np.isfinite(values).any() else None,
            "largest": np.nanmax(values) if np.isfinite(values).any() else None,
        }
        for name, values in proposal.table.columns.items()
    ]  # fmt: skip
    clock = None
    if proposal.clock is not None:
        grid, findings = proposal.clock
        marks = grid.marks if grid.marks is not None else np.arange(grid.length)
        apart = np.diff(marks)[np.diff(marks) > _GAP] * grid.period
        clock = {
            "column": proposal.time, "period": grid.period, "duration": (grid.length - 1) * grid.period, "even": grid.even,
            "gaps": len(apart), "longest_gap": apart.max(initial=0.0), "findings": [str(finding) for finding in findings],
        }  # fmt: skip
    chosen = proposal.chosen
    return {
        "columns": columns, "clock": clock, "notes": proposal.table.notes, "machine": chosen[0].machine if chosen else None,
        "mapping": proposal.meanings, "assumed": list(proposal.assumed()), "axes": list(proposal.fitting),
    }  # fmt: skip


def _lines(data: dict[str, Any], proposal: ProposedLesson) -> Iterator[str]:
    columns = data["columns"]
    yield f"{data['recording']}: {data['kind']}, {len(columns)} columns, {max(item['rows'] for item in columns)} rows."
    clock = data["clock"]
    if clock is None:
        yield "It has no clock."
    else:
        yield f"Its clock is '{clock['column']}': {1.0 / clock['period']:.6g} Hz, {clock['duration']:.6g} s."
        yield sentence(f"{clock['gaps']} gaps, the longest of {clock['longest_gap']:.6g} s" if clock["gaps"] else "no gaps")
        yield from map(sentence, clock["findings"])
    width = max(len(item["name"]) for item in columns[:_MOST_COLUMNS]) + 2
    headings = [Heading("column", -width), Heading("unit", -8), Heading("smallest", 14, ".6g"), Heading("largest", 14, ".6g")]
    yield ""
    shown = ([*(item[key] if item[key] is not None else "-" for key in ("name", "unit", "smallest", "largest"))] for item in columns)
    yield from (line.rstrip() for line in table(headings, list(shown)[:_MOST_COLUMNS]))
    if len(columns) > _MOST_COLUMNS:
        yield f"and {len(columns) - _MOST_COLUMNS} more; --json lists them all."
    yield ""
    yield from (f"Note: {note}." for note in data["notes"])
    if data["machine"] is None:
        yield "No machine fits: nothing in the file drives a motion that it shows, for 100 rows at least."
        return
    yield f"Machine: {data['machine']}."
    for item in data["mapping"]:
        scale = f", times {item.scale:g}" if item.scale != 1.0 else ""
        held = ", held until the next row" if item.held else ""
        yield f"  {item.role:8}{item.target or 'time':24} '{item.column}' in {item.unit}{scale}{held}"
    yield from (f"Assumed: {text}." for text in data["assumed"])
    if data["lesson"] is None:
        yield f"Next: lathesim look {data['recording']} --lesson L.yaml"
    else:
        yield f"Next: look at each line of {data['lesson']}, then lathesim diagnose {data['lesson']} {data['recording']}"


def _write_lesson(proposal: ProposedLesson, recording: Path, path: Path, registry: Registry) -> None:
    """Write the lesson, once it is known that it can be prepared."""
    from lathesim.lessons.changed_lesson import lesson_text
    from lathesim.lessons.lesson import lesson_from_text
    from lathesim.lessons.simulate import check_lesson
    from lathesim.whole_file import write_text

    head = [f"Proposed by lathesim look from {recording.name}. Look at each line, and put what you know of the machine under set:.",
            *(f"Assumed: {text}." for text in proposal.assumed())]  # fmt: skip
    text = lesson_text(proposal.lesson(f"What is in {recording.name}"), head)
    check_lesson(lesson_from_text(text, path), registry)
    write_text(path, text)
