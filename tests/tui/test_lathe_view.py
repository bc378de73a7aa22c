"""The half section in characters: three moments of Example 1, the stock that is cut, and what the dots mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.analysis.failed_run import RawStock
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.tui.drawing.canvas import ACTUAL, BRAILLE, CENTRE, CHUCK, CUT, EDGE, axis_ticks, braille_codes, even_axis, trace
from lathesim.tui.drawing.curves import envelope
from lathesim.tui.drawing.lathe_picture import CarvedStock, LatheScene, ToolMotion, View, draw
from tests.tui.lathe_moments import GOLDENS, MOMENTS, pictures

BAR = RawStock("stock", 0.010, 0.040, 0.0, "x", "z", free_end=-1.0, edge_length=0.005)


@pytest.fixture(scope="module")
def drawn() -> dict[str, str]:
    return pictures()


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_moment_of_example_1_looks_as_it_did(drawn: dict[str, str], moment: str) -> None:
    """``python -m tests.tui.pictures`` draws the goldens again; look at them before they are kept."""
    assert drawn[moment] == (GOLDENS / f"{moment}.txt").read_text(encoding="utf-8")


def test_the_carved_stock_is_that_of_the_stock_part() -> None:
    """The volume that the stock part says was taken off is that of the picture, to a cell's width."""
    case = prepare(load_lesson("01_contour_error"), load_registry(), "I")
    record = run_prepared(case)
    motion, stock = ToolMotion.of(record), RawStock.of(record)
    assert motion is not None
    assert stock is not None
    radius = CarvedStock(stock).cut(motion.x, motion.z, len(motion))
    volume = np.pi * np.sum(stock.stock_radius**2 - radius**2) * stock.stock_length / len(radius)
    assert volume == pytest.approx(record["stock.removed_volume"][-1], rel=2e-3)


def test_going_back_gives_the_raw_stock_again() -> None:
    carved = CarvedStock(BAR)
    x, z = np.full(5, 0.008), np.linspace(0.0, 0.02, 5)
    carved.cut(x, z, 5)
    assert carved.radius.min() == 0.008
    assert (carved.cut(x, z, 0) == BAR.stock_radius).all()


def test_a_wrong_rapid_return_digs_in() -> None:
    carved = CarvedStock(BAR)
    radius = carved.cut(np.array([0.012, 0.006]), np.array([0.030, 0.010]), 2)
    assert radius.min() < 0.0075


def test_facing_takes_what_stands_towards_the_free_end() -> None:
    carved = CarvedStock(BAR)
    radius = carved.cut(np.array([0.012, 0.0]), np.array([0.001, 0.001]), 2)
    assert (radius[:40] == 0.0).all()
    assert (radius[60:] == BAR.stock_radius).all()


def test_a_dot_is_as_wide_as_it_is_high_and_the_gain_moves_the_actual_path() -> None:
    scene = LatheScene(BAR, np.array([0.008, 0.008]), np.array([0.0, 0.04]))
    motion = ToolMotion(np.full(2, 0.0081), np.array([0.0, 0.04]), np.full(2, 0.008), np.array([0.0, 0.04]))
    plain, magnified = draw(scene, motion, 2, 60, 20), draw(scene, motion, 2, 60, 20, View(gain=20.0))
    rows = [int(np.flatnonzero(np.isin(picture.layer, (ACTUAL, CUT)).any(axis=1))[0]) for picture in (plain, magnified)]
    moved = round(0.0001 * 19 / (4.0 * plain.dot))
    assert rows[0] - rows[1] == pytest.approx(moved, abs=1)


def test_the_stock_stands_in_its_chuck_at_the_end_that_is_not_free_above_the_centre_line() -> None:
    path = np.array([0.011, 0.011]), np.array([0.0, 0.04])
    for free_end, (near, far) in ((-1.0, (-1, 0)), (1.0, (0, -1))):
        picture = draw(LatheScene(replace(BAR, free_end=free_end), *path), None, 0, 60, 16)
        held = np.flatnonzero((picture.layer == CHUCK).any(axis=0))
        turned = np.flatnonzero(picture.material.any(axis=0))
        assert abs(held[far] - turned[near]) == 1
        assert (picture.layer == CENTRE)[-2].any()
        assert not (picture.layer == EDGE).any()  # the raw surface falls between two rows
    assert not (draw(LatheScene(None, *path), None, 0, 60, 16).layer == CENTRE).any()


def test_braille_dots_stand_where_they_are_set() -> None:
    dots = np.zeros((4, 2), dtype=bool)
    trace(dots, [0, 0], [0, 3])
    assert chr(BRAILLE + int(braille_codes(dots)[0, 0])) == "⡇"


@pytest.mark.parametrize("count", [2920, 999, 601, 600])
def test_a_thinned_curve_loses_no_peak(count: int) -> None:
    time = np.arange(count, dtype=float)
    for place in (0, 1, count // 2, count - 2, count - 1):
        values = np.zeros(count)
        values[place] = 1.0
        shown_time, shown = envelope(time, values, 300)
        assert shown.max() == 1.0
        assert shown_time[[0, -1]].tolist() == [0.0, count - 1.0]
        assert (np.diff(shown_time) > 0.0).all()


@pytest.mark.parametrize(("low", "high", "rows"), [(-355.0, 17.0, 8), (0.0, 1.2, 10), (-1e-3, 1e-3, 9), (5.0, 5.0001, 8), (0.0, 50.0, 40)])
def test_the_marks_of_an_axis_lie_evenly_in_the_middle_of_rows(low: float, high: float, rows: int) -> None:
    bottom, top, ticks = even_axis(low, high, rows)
    assert bottom <= low
    assert top >= high
    assert top - bottom <= 1.7 * (high - low)
    scale = (top - bottom) / rows
    places = (np.array(ticks) - bottom) / scale - 0.5
    assert places == pytest.approx(np.round(places), abs=1e-6)
    assert len(set(np.round(np.diff(places)))) <= 1


def test_the_labels_of_an_axis_have_as_few_decimals_as_tell_them_apart() -> None:
    assert axis_ticks(-0.25, 1.42, 4) == ([0.0, 0.5, 1.0], ["0.0", "0.5", "1.0"])
    assert axis_ticks(0.0, 1000.0, 5)[1] == ["0", "500", "1000"]
    assert axis_ticks(1.0, 1.0, 5) == ([], [])
