"""What a diagnosis leaves behind: its report, the lesson with what was found in it, and a discovered candidate as a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import Diagnosis, as_json
from lathesim.diagnosis.reporting.html_report import report_html
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.summary import headline, summary_lines
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson
from lathesim.whole_file import WholeFiles, make_folder


def refitted_values(diagnosis: Diagnosis) -> Mapping[str, str]:
    """Return the values of the lesson as they were fitted beside what was found, as a lesson's ``set:`` takes them."""
    return {name: f"{item.refit_with:.6g} {item.unit}".removesuffix(" 1") for name, item in diagnosis.baseline.items()}


def answer_json(diagnosis: Diagnosis, method: Method = STANDARD) -> dict[str, Any]:
    """Return a diagnosis as JSON of its schema, with the answer in a sentence and in lines."""
    return {
        **as_json(diagnosis),
        "sentence": plain(headline(diagnosis, method)),
        "summary": [plain(line) for line in summary_lines(diagnosis, method=method)],
    }


def write_answer(diagnosis: Diagnosis, lesson: Lesson, folder: Path, method: Method = STANDARD) -> list[Path]:
    """Write the report and, if an effect was found, the lesson with it, all or none; return the files, the report first."""
    make_folder(folder)
    with WholeFiles() as whole:
        files = [whole.write_text(report_place(folder), report_html(diagnosis, method=method))]
        if diagnosis.lines.plugin:
            files.append(whole.write_text(folder / "discovered_term.py", diagnosis.lines.plugin))
        if diagnosis.lines.insert:
            side = {"side": {**lesson.source.data.get("side", {}), **diagnosis.lines.side}} if diagnosis.lines.side else None
            explained = changed_lesson(lesson, diagnosis.lines.insert, refitted_values(diagnosis), folder, further=side)
            files.append(whole.write_text(folder / f"{lesson.name}_explained.yaml", explained))
    return files


def report_place(folder: Path) -> Path:
    """Return the path of the report of a diagnosis in a folder."""
    return folder / "report.html"
