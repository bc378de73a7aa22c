"""The plots a run leaves beside its record: path, contour error, voltages, surface of the part, waves around it."""

from __future__ import annotations

from pathlib import Path

from lathesim.analysis.figures.plots import channels_figure, contour_error_figure, path_figure, save_figure, voltages_figure
from lathesim.analysis.part.surface import surface_figure
from lathesim.analysis.part.waves import waves_figure
from lathesim.errors import RecordError
from lathesim.record import Record

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
