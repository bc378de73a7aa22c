"""What a diagnosis leaves behind: its report, the lesson with what was found in it, and a discovered candidate as a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.reporting.html_report import write_report
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson


def refitted_values(diagnosis: Diagnosis) -> Mapping[str, str]:
    """Return the values of the lesson as they were fitted beside what was found, as a lesson's ``set:`` takes them."""
    return {name: f"{item.refit_with:.6g} {item.unit}".removesuffix(" 1") for name, item in diagnosis.baseline.items()}


def write_answer(diagnosis: Diagnosis, lesson: Lesson, folder: Path, method: Method = STANDARD) -> list[Path]:
    """Write the report and, where something was found, the lesson with it in; return the files, the report first."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [write_report(diagnosis, folder / "report.html", method=method)]
    if diagnosis.plugin:
        files.append(folder / "discovered_term.py")
        files[-1].write_text(diagnosis.plugin, encoding="utf-8")
    if diagnosis.insert:
        files.append(folder / f"{lesson.name}_explained.yaml")
        files[-1].write_text(changed_lesson(lesson, diagnosis.insert, refitted_values(diagnosis), folder), encoding="utf-8")
    return files
