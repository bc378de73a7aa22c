"""``lathesim grade LESSON RUN.h5...``: records held against the goals of their lesson, one or a whole class."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import open_registry, plugins_option
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from lathesim.lessons.grading import GoalResult, Grade

RECORD_ENDINGS = (".h5", ".hdf5")


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="[LESSON] RUN.h5...")
@click.option("--json", "form", flag_value="json", help="Write the result as JSON (schema lathesim-grade/1).")
@click.option("--csv", "form", flag_value="csv", help="Write one table for a spreadsheet, the best first.")
@plugins_option
def grade(files: tuple[str, ...], form: str | None, plugin_folders: tuple[Path, ...]) -> int:
    """Hold records against the goals of LESSON; without it each against the lesson it names.

    One record is reported in full, with hints for the goals it misses. Several make one table, the best first. A file that cannot be read
    has its reason in its row, and the exit code is then 1.
    """
    from lathesim.lessons.grading import UNREADABLE, grade_file, ranked, yardstick

    lesson, records = _sorted_out(files)
    registry = open_registry(plugin_folders)
    given = yardstick(lesson, registry) if lesson is not None else None
    grades = ranked([grade_file(path, registry, given) for path in records])
    if form == "csv":
        click.echo(_csv(grades), nl=False)
    else:
        data = {"lesson": given.name if given else None, "records": [_data(item) for item in grades]}
        write(CommandResult("lathesim-grade/1", data, _in_full(grades[0]) if len(grades) == 1 else _lines(grades)), form == "json")
    return int(any(item.result == UNREADABLE for item in grades))


def _sorted_out(files: Sequence[str]) -> tuple[str | None, list[Path]]:
    """Return the lesson, if the first name is one, and the files of records."""
    first_is_record = files[0].lower().endswith(RECORD_ENDINGS)
    records = [Path(name) for name in (files if first_is_record else files[1:])]
    if not records:
        raise click.UsageError(f"no record is named beside '{files[0]}'. Write: lathesim grade LESSON RUN.h5")
    return (None if first_is_record else files[0]), list(dict.fromkeys(records))


def _in_full(graded: Grade) -> Iterator[str]:
    from lathesim.cli.lessons.run_tables import goals_text

    case = f", case {_plain(graded.variant)}" if graded.variant else ""
    yield f"{graded.record}: {graded.lesson or 'no lesson'}{case}"
    yield from map(_plain, graded.notes)
    if graded.goals:
        yield f"\n{goals_text(graded.goals)}\n"
        yield f"{graded.met} of {len(graded.goals)} goals met: {graded.result}."
    for question in graded.questions:
        verdict = "right" if question.right else "not right" if question.answer else "not answered"
        yield _plain(f"{question.question} {question.answer} ({verdict})".replace("  ", " "))
    if graded.questions:
        yield f"{graded.right} of {len(graded.questions)} questions answered right."


def _lines(grades: Sequence[Grade]) -> Iterator[str]:
    from lathesim.analysis.display_unit import text_table
    from lathesim.cli.lessons.run_tables import words
    from lathesim.lessons.grading import REACHED

    names = _goal_columns(grades)
    asks = any(item.questions for item in grades)
    rows = [("record", "lesson", "result", "goals", *["answers"] * asks, *(f"{words(metric)} {limit}" for metric, limit in names), "notes")]
    for item in grades:
        found = {(goal.metric, f"{goal.sense} {goal.limit}"): goal for goal in item.goals}
        cells = [_shown(found.get(name)) for name in names]
        count = f"{item.met} of {len(item.goals)}" if item.goals else "-"
        rows.append((item.record, item.lesson, item.result, count, *[_right(item)] * asks, *cells, _plain(" ".join(item.notes))))
    yield from text_table(rows)
    yield f"\n{sum(item.result == REACHED for item in grades)} of {len(grades)} records meet all goals."


def _right(graded: Grade) -> str:
    return f"{graded.right} of {len(graded.questions)}" if graded.questions else "-"


def _shown(goal: GoalResult | None) -> str:
    return "-" if goal is None or goal.value != goal.value else f"{goal.value:.5g} {goal.unit}".strip() + ("" if goal.met else " !")


def _csv(grades: Sequence[Grade]) -> str:
    import csv
    import io

    from lathesim.lessons.grading import spreadsheet_cell
    from lathesim.units import split_quantity

    names = _goal_columns(grades)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    head = [f"{metric} [{split_quantity(limit.split(maxsplit=2)[2])[1] or 1}] {limit}" for metric, limit in names]
    writer.writerow(["record", "lesson", "variant", "result", "goals_met", "goals", *head, "notes", "answers_right", "questions"])
    for item in grades:
        found = {(goal.metric, f"{goal.sense} {goal.limit}"): goal for goal in item.goals}
        values = [f"{found[name].value:.6g}" if name in found and found[name].value == found[name].value else "" for name in names]
        told = [
            spreadsheet_cell(item.record),
            spreadsheet_cell(item.lesson),
            spreadsheet_cell(item.variant),
            item.result,
            item.met,
            len(item.goals),
        ]
        writer.writerow([*told, *values, spreadsheet_cell(" ".join(item.notes)), item.right, len(item.questions)])
    return text.getvalue()


def _data(graded: Grade) -> dict[str, Any]:
    return {
        "record": graded.record,
        "lesson": graded.lesson,
        "variant": graded.variant or None,
        "status": graded.status,
        "result": graded.result,
        "goals_met": graded.met,
        "goals": [
            {
                "metric": goal.metric,
                "sense": goal.sense,
                "limit": goal.limit,
                "value": goal.value,
                "unit": goal.unit or "1",
                "missed_by": goal.over,
                "met": goal.met,
                "hint": goal.hint if not goal.met else "",
                "reason": goal.reason,
            }
            for goal in graded.goals
        ],
        "notes": graded.notes,
        "questions": graded.questions,
    }


def _goal_columns(grades: Sequence[Grade]) -> list[tuple[str, str]]:
    """Return the goals of all lessons as (metric, limit), each once, in the order in which they come."""
    return list(dict.fromkeys((goal.metric, f"{goal.sense} {goal.limit}") for item in grades for goal in item.goals))


def _plain(text: str) -> str:
    """Return text from a file without characters that would steer the terminal."""
    return "".join(character if character.isprintable() else "?" for character in text)
