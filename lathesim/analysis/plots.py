"""Figures of records: path, contour error, channels over time. The only user of matplotlib.

Each function gives a matplotlib Figure; :func:`save_figure` writes it. Units are those a machinist reads, with X as a radius.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.analysis.figure_style import (
    ALERT,
    CONTACT,
    CYCLE,
    INK,
    MATERIAL,
    MEASURED,
    QUIET,
    REFERENCE,
    SIMULATED,
    STOCK,
    common_unit,
    dress,
    label,
    legend,
    new_figure,
    shade,
    thinned,
    write_figure,
)
from lathesim.analysis.metric import CONTACT as CONTACT_CHANNELS
from lathesim.analysis.metric import CONTOUR_ERROR, CUTTING_FORCE, find_channel
from lathesim.analysis.turned_part import part_shape, surface_figure, waves_figure
from lathesim.component import ON
from lathesim.errors import RecordError
from lathesim.record import Record
from lathesim.whole_file import whole_file

_TOGETHER, _APART = 4, 20.0
"""Lines of a panel at most, and how many times as large as the smallest the largest of them is at most."""

FORMATS = (".png", ".svg", ".pdf")
_LABEL = 16
"""Letters of a quantity that fit beside a low panel."""
_PATH = ("interpolator.x_reference", "interpolator.z_reference", "x_axis.position", "z_axis.position")


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of the name. Raises :class:`RecordError` where it cannot be written."""
    place = Path(path)
    if place.suffix.lower() not in FORMATS:
        raise RecordError(f"a figure cannot be saved as '{place.suffix}'.", place=str(place), remedy="Use .png, .svg or .pdf.")
    with whole_file(place) as part:
        write_figure(figure, part, place.suffix.lower()[1:])


def path_figure(record: Record, title: str = "") -> Any:
    """Draw the path in the plane of Z and X (a radius): reference, actual path, and the part before and after."""
    figure = new_figure(8.0, 4.2)
    draw_path(figure.subplots(), record, title or "Tool path")
    return figure


def draw_path(panel: Any, record: Record, title: str = "") -> None:
    """Draw the path into a panel. Raises :class:`RecordError` where the record holds no path."""
    missing = [name for name in _PATH if name not in record]
    if missing:
        raise RecordError(f"the path cannot be drawn: the record has no channel '{missing[0]}'.")
    x_reference, z_reference, x, z = (record[name] * 1e3 for name in _PATH)
    shape = part_shape(record)
    if shape is not None:
        panel.fill_between(shape.z * 1e3, shape.radius * 1e3, shape.stock_radius * 1e3, color=STOCK, linewidth=0, label="cut away")
        panel.fill_between(shape.z * 1e3, 0.0, shape.radius * 1e3, color=MATERIAL, linewidth=0, label="part")
        panel.plot(shape.z * 1e3, shape.radius * 1e3, color=QUIET, linewidth=0.8)
    panel.plot(z_reference, x_reference, color=REFERENCE, linewidth=1.0, linestyle=(0, (4, 2)), label="reference")
    feeding = find_channel(record, "cutting_block")
    if feeding is None:
        panel.plot(z, x, color=SIMULATED, linewidth=1.3, label="actual")
    else:
        cutting = record[feeding] > ON
        panel.plot(np.where(cutting, z, np.nan), np.where(cutting, x, np.nan), color=SIMULATED, linewidth=1.5, label="actual, feed")
        moving = ~cutting | ~np.roll(cutting, 1)
        panel.plot(np.where(moving, z, np.nan), np.where(moving, x, np.nan), color=MEASURED, linewidth=1.0, label="actual, rapid")
    panel.axhline(0.0, color=QUIET, linewidth=0.8, linestyle=(0, (8, 2, 2, 2)))
    panel.set_aspect("equal", adjustable="datalim")
    dress(panel, label("X, radius", "mm"), label("Z", "mm"))
    panel.set_title(title, loc="left", pad=20.0, fontsize=10, color=INK, fontweight="bold")  # above the legend, which is wide here
    legend(panel)


def contour_error_figure(record: Record, title: str = "") -> Any:
    """Draw the contour error over time, contact shaded, the largest error in contact marked."""
    figure = new_figure(8.0, 3.2)
    draw_contour_error(figure.subplots(), record, title or "Contour error")
    return figure


def draw_contour_error(panel: Any, record: Record, title: str = "") -> None:
    """Draw the contour error into a panel."""
    name = find_channel(record, *CONTOUR_ERROR)
    if name is None:
        raise RecordError("the contour error cannot be drawn: the record has no channel 'contour.contour_error'.")
    error, time = record[name], record.time
    contact = find_channel(record, *CONTACT_CHANNELS)
    shown = error
    if contact is not None and (record[contact] > ON).any():
        touching = record[contact] > ON
        shade(panel, time, touching, CONTACT, "in contact")
        shown = error[touching]
        peak = int(np.flatnonzero(touching)[np.abs(shown).argmax()])
    else:
        peak = int(np.abs(error).argmax()) if len(error) else -1
    factor, unit = common_unit([shown * 10.0], record.unit(name))
    panel.plot(*thinned(time, error / factor), color=SIMULATED, linewidth=1.1)
    dress(panel, label("contour error", unit), label("time", "s"), title)
    if peak >= 0:
        bound = 1.35 * float(np.abs(shown).max()) / factor or 1.0
        panel.set_ylim(-bound, bound)
        panel.plot([time[peak]], [error[peak] / factor], marker="o", markersize=5, color=ALERT, linestyle="none", zorder=5)
        right = time[peak] > 0.5 * (time[0] + time[-1])
        panel.annotate(
            shown_with_unit(abs(float(error[peak])), record.unit(name), 3).replace("um", "µm"),
            (time[peak], error[peak] / factor),
            xytext=(-8 if right else 8, 5 if error[peak] > 0 else -11),
            textcoords="offset points",
            ha="right" if right else "left",
            fontsize=9,
            color=ALERT,
        )
    legend(panel)


def channels_figure(record: Record, names: Sequence[str], title: str = "") -> Any:
    """Draw channels over time, one panel a unit and size, so that signals of one kind can be compared.

    Raises :class:`RecordError` with the nearest name for a channel that is not there.
    """
    panels = grouped(record, names)
    figure = new_figure(8.0, 0.9 + 1.9 * len(panels))
    drawn = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    contact = find_channel(record, *CONTACT_CHANNELS)
    colors = {name: CYCLE[number % len(CYCLE)] for number, name in enumerate(names)}
    for panel, members in zip(drawn, panels, strict=True):
        if contact is not None:
            shade(panel, record.time, record[contact] > ON)
        _draw_group(panel, record, members, colors)
    if title:
        figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    drawn[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    return figure


def grouped(record: Record, names: Sequence[str]) -> list[list[str]]:
    """Put channels of one unit and comparable size (within a factor of 20) into one panel, at most four; the order is kept."""
    groups: list[list[str]] = []
    sizes: list[float] = []
    for name in names:
        values = record[name]
        finite = values[np.isfinite(values)]
        size = float(np.abs(finite).max()) if len(finite) else 0.0
        for number, group in enumerate(groups):
            alike = record.unit(group[0]) == record.unit(name) and len(group) < _TOGETHER
            if alike and (min(size, sizes[number]) * _APART >= max(size, sizes[number])):
                group.append(name)
                break
        else:
            groups.append([name])
            sizes.append(size)
    return groups


def _draw_group(panel: Any, record: Record, names: Sequence[str], colors: Mapping[str, str]) -> None:
    factor, unit = common_unit([record[name] for name in names], record.unit(names[0]))
    stepped = all(record.unit(name) == "V" for name in names)
    for name in names:
        time, values = thinned(record.time, record[name] / factor)
        panel.plot(time, values, color=colors[name], linewidth=1.0, label=name, drawstyle="steps-post" if stepped else "default")
    items = {record.channels[name].port.replace("_", " ") for name in names}
    quantity = items.pop() if len(items) == 1 else ""
    dress(panel, label(quantity if len(quantity) <= _LABEL else "", unit).strip() or quantity)
    legend(panel)


def voltages_figure(record: Record, title: str = "") -> Any:
    """Draw the voltages that the converters give to the drives, a panel each."""
    names = [name for name in record if name.endswith("_dac.voltage")] or [name for name in record if record.unit(name) == "V"]
    if not names:
        raise RecordError("the voltages cannot be drawn: the record has no channel in volts.")
    figure = new_figure(8.0, 0.9 + 1.6 * len(names))
    drawn = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for number, (panel, name) in enumerate(zip(drawn, names, strict=True)):
        _draw_group(panel, record, [name], {name: CYCLE[number % len(CYCLE)]})
    drawn[0].set_title(title or "Voltages", fontsize=10, color=INK, loc="left", fontweight="bold", pad=6)
    drawn[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    return figure


def overview_figure(record: Record, title: str = "") -> Any:
    """Draw what matters of a run on one page: path, contour error, axis voltages, cutting force; what the record lacks is left out."""
    path = all(name in record for name in _PATH)
    strips: list[list[str]] = [[name for name in ("x_dac.voltage", "z_dac.voltage") if name in record]]
    strips += [[name for name in (find_channel(record, *CUTTING_FORCE),) if name]]
    strips = [names for names in strips if names]
    contour = find_channel(record, *CONTOUR_ERROR) is not None
    if not path and not contour and not strips:
        return channels_figure(record, list(record)[:8], title)
    heights = [2.4] * path + [1.3] * contour + [1.1] * len(strips)
    figure = new_figure(8.0, 1.0 + 1.35 * sum(heights))
    panels = list(np.atleast_1d(figure.subplots(len(heights), 1, gridspec_kw={"height_ratios": heights})))
    if title:
        figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    rest = list(panels)
    if path:
        draw_path(rest.pop(0), record, "Tool path")
    timed = rest
    if contour:
        draw_contour_error(rest[0], record, "Contour error")
        rest[0].set_xlabel("")
        rest = rest[1:]
    for panel, names in zip(rest, strips, strict=True):
        _draw_group(panel, record, names, {name: CYCLE[number] for number, name in enumerate(names)})
    for panel in timed[1:]:
        panel.sharex(timed[0])
    if timed:
        timed[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    return figure


_FIGURES = (
    ("path", path_figure),
    ("contour_error", contour_error_figure),
    ("voltages", voltages_figure),
    ("surface", surface_figure),
    ("waves", waves_figure),
)


def save_run_plots(record: Record, beside: Path, title: str) -> list[Path]:
    """Draw what the record has the channels for, next to the record's file ``beside``, and give the files.

    A machine with none of these channels (a rig that is no lathe) gets one figure of its first channels. Raises :class:`RecordError`
    where a file cannot be written.
    """
    figures = {}
    for name, draw in _FIGURES:
        try:
            figures[name] = draw(record, title)
        except RecordError:
            continue
    if not figures:
        figures["channels"] = channels_figure(record, list(record)[:8], title)
    files = []
    for name, figure in figures.items():
        path = beside.with_name(f"{beside.stem}_{name}.png")
        save_figure(figure, path)
        files.append(path)
    return files
