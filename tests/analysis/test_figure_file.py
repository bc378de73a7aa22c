"""A PNG drawn the short way is the picture that matplotlib draws."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.analysis import plots
from lathesim.analysis.figure_style import dress, hold_ticks, new_figure, write_figure
from tests.analysis.small_record import shoulder


def pixels(path: Path) -> np.ndarray:
    from matplotlib.image import imread

    return np.asarray(imread(path))[:, :, :3]


def test_a_png_is_the_picture_that_matplotlib_saves(tmp_path: Path) -> None:
    figure = plots.contour_error_figure(shoulder())
    write_figure(figure, tmp_path / "short.png", "png")
    assert figure.get_dpi() == 100
    usual = plots.contour_error_figure(shoulder())
    hold_ticks(usual)
    usual.savefig(tmp_path / "usual.png", dpi=150)
    assert np.array_equal(pixels(tmp_path / "short.png"), pixels(tmp_path / "usual.png"))


def test_ticks_stay_where_they_are_and_those_of_other_axes_are_left_alone() -> None:
    figure = new_figure()
    plain, logarithmic = figure.subplots(2, 1)
    for panel in (plain, logarithmic):
        panel.plot([1.0, 2000.0], [0.001, 0.002])
        dress(panel)
    logarithmic.set_xscale("log")
    before = [text.get_text() for text in plain.get_xticklabels() if 0.0 <= text.get_position()[0] <= 2000.0]
    hold_ticks(figure)
    assert [text.get_text() for text in plain.get_xticklabels()] == before
    assert type(logarithmic.xaxis.get_major_locator()).__name__ == "LogLocator"
