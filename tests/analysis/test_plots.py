"""Figures have the lines they promise, axes with units, and sentences where the record lacks something."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis import plots
from lathesim.analysis.figure_style import common_unit, dress, hold_ticks, label, new_figure, thinned, write_figure
from lathesim.errors import LatheSimError
from lathesim.record import Record
from tests.analysis.small_record import shoulder

RUN = shoulder()


def labels(panel):  # type: ignore[no-untyped-def]
    return [text.get_text() for text in panel.get_legend().get_texts()]


def test_the_path_shows_part_reference_and_actual_path() -> None:
    panel = plots.path_figure(RUN, "Shoulder").axes[0]
    assert labels(panel) == ["cut away", "part", "reference", "actual, feed", "actual, rapid"]
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("Z [mm]", "X, radius [mm]")
    assert panel.get_title(loc="left") == "Shoulder"
    reference = next(line for line in panel.lines if line.get_label() == "reference")
    assert reference.get_ydata().max() == pytest.approx(25.0)


def test_the_largest_contour_error_in_contact_is_marked() -> None:
    panel = plots.contour_error_figure(RUN).axes[0]
    assert [text.get_text() for text in panel.texts] == ["20 µm"]
    marker = next(line for line in panel.lines if line.get_marker() == "o")
    assert abs(marker.get_ydata()[0]) == pytest.approx(20.0)
    assert panel.get_ylabel() == "contour error [µm]"
    assert panel.get_ylim()[1] < 30.0
    assert labels(panel) == ["in contact"]


def test_channels_of_one_kind_share_a_panel() -> None:
    figure = plots.channels_figure(RUN, ["x_axis.position", "z_axis.position", "x_dac.voltage", "contour.contour_error"], "Channels")
    assert [len(panel.lines) for panel in figure.axes] == [2, 1, 1]
    assert [panel.get_ylabel() for panel in figure.axes] == ["position [mm]", "voltage [V]", "contour error [mm]"]
    assert labels(figure.axes[0]) == ["x_axis.position", "z_axis.position"]
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert figure.get_suptitle() == "Channels"


def test_voltages_have_a_panel_each() -> None:
    assert [labels(panel) for panel in plots.voltages_figure(RUN).axes] == [["x_dac.voltage"], ["z_dac.voltage"]]


def test_labels_of_low_panels_do_not_overlap() -> None:
    figure = plots.voltages_figure(RUN)
    figure.canvas.draw()
    boxes = [panel.yaxis.label.get_window_extent() for panel in figure.axes]
    assert boxes[0].y0 > boxes[1].y1


def test_the_overview_leaves_out_what_the_record_lacks() -> None:
    assert len(plots.overview_figure(RUN).axes) == 4
    without = Record(RUN.time, {name: RUN.channels[name] for name in RUN if not name.startswith(("contour", "cutting_force"))})
    assert [panel.get_ylabel() for panel in plots.overview_figure(without).axes] == ["X, radius [mm]", "voltage [V]"]
    rig = Record(RUN.time, {"x_axis.velocity": RUN.channels["x_axis.velocity"]})
    assert [panel.get_ylabel() for panel in plots.overview_figure(rig).axes] == ["velocity [mm/s]"]


@pytest.mark.parametrize("suffix", plots.FORMATS)
def test_figures_are_written(suffix: str, tmp_path: Path) -> None:
    plots.save_figure(plots.overview_figure(RUN, "All"), tmp_path / f"all{suffix}")
    assert (tmp_path / f"all{suffix}").stat().st_size > 3000


REFUSED = {
    "unknown channel": (
        lambda: plots.channels_figure(RUN, ["x_dac.voltge"]),
        "the record has no channel 'x_dac.voltge'. Did you mean 'x_dac.voltage'?",
    ),
    "no path": (
        lambda: plots.path_figure(Record(RUN.time, {})),
        "the path cannot be drawn: the record has no channel 'interpolator.x_reference'.",
    ),
    "no volts": (lambda: plots.voltages_figure(Record(RUN.time, {})), "the voltages cannot be drawn: the record has no channel in volts."),
    "wrong ending": (lambda: plots.save_figure(None, "f.bmp"), "f.bmp: a figure cannot be saved as '.bmp'. Use .png, .svg or .pdf."),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_drawn(kind: str) -> None:
    draw, sentence = REFUSED[kind]
    with pytest.raises(LatheSimError) as refused:
        draw()
    assert str(refused.value) == sentence


def test_thinning_keeps_every_spike() -> None:
    time = np.arange(200_000.0)
    values = np.zeros(200_000)
    values[[1234, 99_999]] = [5.0, -7.0]
    thin_time, thin = thinned(time, values)
    assert len(thin) < 7000
    assert (thin.max(), thin.min()) == (5.0, -7.0)
    assert thin_time[thin.argmax()] == 1234.0


def test_thinning_keeps_a_gap() -> None:
    values = np.zeros(200_000)
    values[99_999] = np.nan
    thin_time, thin = thinned(np.arange(200_000.0), values)
    assert thin_time[np.isnan(thin)].tolist() == [99_999.0]


def test_units_of_a_figure() -> None:
    assert common_unit([np.array([1e-6, np.nan]), np.array([3e-4])], "m") == (1e-6, "um")
    assert label("torque", "N*m") == "torque [N·m]"
    assert label("count", "") == "count"


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
