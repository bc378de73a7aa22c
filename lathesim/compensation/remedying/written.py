"""What is written of a remedy: the lesson, the answer as JSON, the table in the units of common controls."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from lathesim.compensation.remedying.bench import Line
from lathesim.compensation.remedying.remedy import Answer
from lathesim.whole_file import make_folder, write_text

SCHEMA = "lathesim-remedy/1"
ANSWER_FILE = "remedy.json"


def write_lesson(answer: Answer, folder: Path) -> list[Path]:
    """Write the lesson with its remedies (and without the effects, which the machine has by itself), its tables, and the answer."""
    make_folder(folder)
    bench = answer.bench
    units = {line.name: bench.units(line.name) for line in answer.lines} if bench is not None else {}
    text = answer.diagnosed.text(answer.lines, units, folder, with_effects=False)
    lesson = folder / "lesson.yaml"
    write_text(lesson, text)
    return [lesson, *[folder / f"{line.name}_{name}.csv" for line in answer.lines for name in line.tables]]


def as_json(answer: Answer, lesson: str, files: list[str], wall_time: float) -> dict[str, Any]:
    """Return the answer as JSON of schema lathesim-remedy/1."""
    return {
        "schema": SCHEMA,
        "lesson": lesson,
        "nothing_to_mend": answer.nothing or None,
        "remedies": [
            {
                "remedy": line.remedy,
                "at": line.at,
                "answers": list(line.answers),
                "share": line.share,
                "parameters": {name: {"value": value, "unit": answer.bench.units(line.name)[name]} for name, value in line.values.items()},
                "tables": [f"{line.name}_{name}.csv" for name in line.tables],
                "limits": list(_class(answer, line).limits),
                "cannot": _class(answer, line).cannot,
            }
            for line in answer.lines
            if answer.bench is not None
        ],
        "not_mended": [{"effect": item.effect, "at": item.at, "why": item.why} for item in answer.not_mended],
        "loop_gains_per_s": [
            {
                "controller": item.controller,
                "gain": _number(item.gain),
                "largest": _number(item.largest),
                "largest_without_effect": _number(item.largest_without) if item.largest_without is not None else None,
            }
            for item in answer.gains
        ],
        "cautions": list(answer.cautions),
        "better_in_share_of_draws": answer.better_in if answer.lines else None,
        "promise": {
            size.name: {
                "unit": size.unit,
                "before": _number(size.before),
                "after": _number(size.after),
                "low": _number(size.low),
                "high": _number(size.high),
                "removed_share": _number(size.removed),
            }
            for size in answer.promise
        },
        "files": files,
        "wall_time_s": round(wall_time, 2),
    }


def _class(answer: Answer, line: Line) -> Any:
    return answer.diagnosed.registry.remedies[line.remedy]


def _number(value: float) -> float | None:
    return float(f"{value:.8g}") if math.isfinite(value) else None


def write_answer(data: dict[str, Any], folder: Path) -> Path:
    """Write the answer beside the lesson, where compare and conceal --again find it."""
    file = folder / ANSWER_FILE
    write_text(file, json.dumps(data, indent=2) + "\n")
    return file
