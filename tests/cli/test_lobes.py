"""``lathesim lobes``: the map of a lesson by both methods, as a table, as JSON and as a figure; what cannot be is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import call, done, json_of

LESSON = "18_stability_lobes"
TEXT = (
    "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\ntool_point: {cutting_stiffness: 700 N/mm^2, interrupted: 0.5, modes: [%s]}\n"
)


def test_both_methods_give_the_same_map(capsys: pytest.CaptureFixture[str]) -> None:
    maps = []
    for method in ("frequency", "collocation"):
        said = json_of(capsys, "lobes", LESSON, "--method", method, "--speed", "2000..6000:5", "--json")
        maps.append([row["width_m"] for row in said["rows"]])
    assert maps[0] == pytest.approx(maps[1], rel=1e-5)
    assert maps[0][0] == pytest.approx(1.2291e-3, rel=1e-4)


def test_the_table_names_the_width_that_is_always_stable(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "lobes", LESSON, "--speed", "500..8000:11", "--save", "lobes.png")
    assert "Stable at every speed below 0.9150 mm; that is met at 8652, 3748, 2392" in said.out
    assert Path("lobes.png").stat().st_size > 10_000


def test_a_lesson_without_a_tool_point_and_one_that_cannot_be_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert "the lesson has no tool point" in call(capsys, "lobes", "01_contour_error").err
    Path("mine.yaml").write_text(TEXT % "{frequency: 100 Hz, damping: -5 %, stiffness: 1e6 N/m}", encoding="utf-8")
    assert "damping ratio -0.05" in call(capsys, "lobes", "mine.yaml").err
    Path("mine.yaml").write_text(TEXT % "{frequency: 100 Hz, damping: 5 %, stiffness: 1e6 N/m}", encoding="utf-8")
    assert "Use the method 'collocation'" in call(capsys, "lobes", "mine.yaml", "--method", "frequency").err
    assert call(capsys, "lobes", LESSON, "--speed", "0..5:2").code == 2
