"""What each part of compensation is worth: ``python -m tests.compensation.ablations``.

Each line leaves one thing out and is to be visibly worse: the margin of a size that is uncertain, the exact foot point, the model of the
loop that a friction pulse leads by, the filter of the learning. The friction of a concealed axis is 20 N; the first remedy is sized from a
diagnosis that is 5 N too high and not sure of it.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import tempfile
from pathlib import Path

from lathesim.analysis.metric import stock_metrics
from lathesim.cli.main import run_command_line
from lathesim.compensation.lap_response import learning_filter
from lathesim.compensation.laps import course_of
from lathesim.compensation.learn import learn
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import load_registry

AXIS = "22_what_is_wrong_with_this_machine"
HIDDEN = "CoulombFriction:level=20 N@x_axis"


def friction(value: float, low: float, high: float) -> dict[str, object]:
    """Return a diagnosis that names friction with its interval [N]."""
    level = {"value": value, "unit": "N", "low": low, "high": high}
    return {
        "schema": "lathesim-diagnosis/1",
        "verdict": "named",
        "effects": [{"effect": "CoulombFriction", "at": "x_axis", "parameters": {"level": level}}],
        "insert": [{"effect": "CoulombFriction", "at": "x_axis", "level": f"{value} N"}],
        "adequate": True,
    }


def left(folder: Path, found: dict[str, object], *options: str, change: tuple[str, str] = ("", "")) -> float:
    """Return the share of the deviation that a remedy leaves on the concealed machine."""
    folder.mkdir()
    (folder / "diagnosis.json").write_text(json.dumps(found))
    with contextlib.redirect_stdout(io.StringIO()):
        run_command_line(["conceal", AXIS, "--effect", HIDDEN, "--seed", "3", "--out", str(folder / "case")])
        files = [str(folder / "case" / "lesson.yaml"), str(folder / "diagnosis.json")]
        run_command_line(["remedy", *files, "--out", str(folder / "out"), *options])
        lesson = folder / "out" / "lesson.yaml"
        if change[0]:
            lesson.write_text(re.sub(*change, lesson.read_text()))
        again = ["conceal", "--again", str(folder / "case_answer.json"), "--lesson", str(lesson), "--out", str(folder / "again")]
        run_command_line(again)
    result = json.loads((folder / "again" / "result.json").read_text())
    return 1.0 - float(result["rms_deviation"]["x_scale.position"]["removed_share"])


def largest(variant: str) -> float:
    """Return the largest distance from the butterfly [mm] with the coupling of a variant."""
    record = simulate(load_lesson("08_contour_control"), load_registry(), variant)
    return 1e3 * float(stock_metrics()["max_path_error"].measure(record))


def learned(filtered: bool) -> float:
    """Return the tracking error of the last lap over that of the first, on a machine that is a sample later than its model."""
    lesson, registry = load_lesson("09_learning"), load_registry()
    course, model = (course_of(prepare(lesson, registry, variant), "voltage") for variant in ("late", "fine"))
    laps = learn(course, learning_filter(model, filtered=filtered), 20).laps
    return laps[-1].rms / laps[0].rms


def ablations(folder: Path) -> list[tuple[str, str, float, float]]:
    """Return what is left out, what is measured, and its size with and without."""
    unsure, sure = friction(25.0, 15.0, 35.0), friction(20.0, 19.9, 20.1)
    without_model = left(folder / "no_model", sure, change=(r"  (lag|inner): .*", r"  \1: 0 s"))
    return [
        (
            "the margin",
            "share of the deviation left",
            left(folder / "margin", unsure),
            left(folder / "no_margin", unsure, "--without-margin"),
        ),
        ("the exact foot point (tangent)", "largest distance from the path [mm]", largest("foot_point"), largest("tangent")),
        ("the lead of the friction pulse", "share of the deviation left", left(folder / "model", sure), without_model),
        ("the filter of the learning", "last lap's error over the first's", learned(True), learned(False)),
    ]


def main() -> None:
    """Print the table."""
    print(f"{'without':<34}{'measured':<38}{'with':>10}{'without':>10}")
    with tempfile.TemporaryDirectory() as folder:
        for name, size, whole, less in ablations(Path(folder)):
            print(f"{name:<34}{size:<38}{whole:>10.4g}{less:>10.4g}")


if __name__ == "__main__":
    main()
