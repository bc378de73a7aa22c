"""``lathesim run --recording``: a lesson led by a recording, as ``compare`` simulates it, with the record and the JSON of any run."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.comparison.compare import compare, load_recording
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from lathesim.record import load
from tests.cli.command import call, done, json_of

SLIDE = """\
lesson: A slide that a recorded reference leads
machine: cascade_axis
sample_period: 1 ms
step: 0.25 ms
recordings:
  time: {column: t, unit: s}
  drive: {x_controller.reference: {column: r, unit: mm}}
  compare: {x_encoder.position: {column: q, unit: mm}}
"""
START = 30.0
"""Place at which the recording begins [mm]."""


@pytest.fixture(autouse=True)
def in_a_folder_with_a_lesson_and_a_recording() -> None:
    Path("slide.yaml").write_text(SLIDE, encoding="utf-8")
    time = np.arange(0.0, 1.0, 2e-3)
    reference = START + 5.0 * (1.0 - np.cos(2.0 * np.pi * time))
    place = START + 5.0 * (1.0 - np.cos(2.0 * np.pi * np.maximum(time - 0.01, 0.0)))
    rows = [f"{t:.3f},{r:.6f},{q:.6f}\n" for t, r, q in zip(time, reference, place, strict=True)]
    Path("push.csv").write_text("t,r,q\n" + "".join(rows), encoding="utf-8")


def test_the_run_is_the_simulation_that_compare_holds_beside_the_recording(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "run", "slide.yaml", "--recording", "push.csv", "--plain", "--out", "slide.h5")
    assert (said.code, said.err) == (0, "")
    assert said.out.endswith("1 record and 1 plot in .\n")
    run = load("slide.h5")
    registry = load_registry(installed=False)
    recording = Path("push.csv")
    compared = compare("slide", *load_recording(load_lesson("slide.yaml"), recording, registry)).channels[0]
    # the recording holds every second decision of the controller, and the run all of them
    assert len(run) == 999
    assert run.sample_period == pytest.approx(1e-3)
    assert run["x_encoder.position"][0] == pytest.approx(1e-3 * START, abs=1e-5)
    # compare fits the start, the run takes what the recording shows of it
    assert run["x_encoder.position"][100::2] == pytest.approx(compared.simulated[50:], abs=2e-6)
    assert run.meta["recording"] == "push.csv"
    assert run.status == "complete"


def test_the_json_names_the_recording_and_what_was_found_in_it(capsys: pytest.CaptureFixture[str]) -> None:
    rows = Path("push.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    Path("gap.csv").write_text("".join(row for row in rows if not row.startswith("0.200")), encoding="utf-8")
    asked = ("run", "slide.yaml", "--recording", "gap.csv", "--plain", "--no-plots")
    result = json_of(capsys, *asked, "--json")
    assert (result["schema"], result["recording"], result["status"]) == ("lathesim-run/1", "gap.csv", "complete")
    assert result["metrics"]["cycle_time"]["value"] == pytest.approx(0.998)
    assert len(result["recording_findings"]) > 0
    said = call(capsys, *asked).out
    assert [f"Recording: {text}" for text in result["recording_findings"]] == said.splitlines()[: len(result["recording_findings"])]


def test_what_is_set_from_outside_counts(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("run", "slide.yaml", "--recording", "push.csv", "--plain", "--no-plots", "--out", "slide.h5")
    done(capsys, *asked, "--set", "x_axis.travel=28 mm")
    assert load("slide.h5")["x_encoder.position"][0] == pytest.approx(0.028, abs=1e-5)


def test_an_effect_that_was_found_runs_with_its_recording(capsys: pytest.CaptureFixture[str]) -> None:
    Path("explained.yaml").write_text(SLIDE + "insert: [{effect: CoulombFriction, at: x_axis, level: 20 N}]\n", encoding="utf-8")
    places = []
    for lesson in ("slide", "explained"):
        done(capsys, "run", f"{lesson}.yaml", "--recording", "push.csv", "--plain", "--no-plots", "--out", f"{lesson}.h5")
        places.append(load(f"{lesson}.h5")["x_axis.position"])
    assert 1e-6 < np.max(np.abs(places[1] - places[0])) < 1e-3


NO_DRIVE = SLIDE.replace("  drive: {x_controller.reference: {column: r, unit: mm}}\n", "")
REFUSED = {
    "none given": (
        ("slide.yaml",),
        "slide: a recording drives this lesson (x_controller.reference), and none is given. "
        "Name one, as in 'lathesim run LESSON --recording FILE'; without one it needs a 'duration:'.",
    ),
    "nothing that ends it": (("still.yaml",), "the run has no end. Give a duration, or name the output that ends it."),
    "no such file": (("slide.yaml", "--recording", "pull.csv"), "pull.csv: there is no such file."),
    "no mapping": (("10_feed_and_roughness", "--variant", "start", "--recording", "push.csv"), "the lesson does not say what the columns"),
    "nothing driven": (
        ("still.yaml", "--recording", "push.csv"),
        "still.yaml:5:1: the recording drives nothing in this lesson. "
        "Run it without --recording, or add drive: {x_controller.reference: {...}}.",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("still.yaml").write_text(NO_DRIVE, encoding="utf-8")
    arguments, sentence = REFUSED[kind]
    said = call(capsys, "run", *arguments, "--plain", "--no-plots")
    assert (said.code, said.out) == (1, "")
    assert sentence in said.err
    assert said.err.count("\n") == 1
