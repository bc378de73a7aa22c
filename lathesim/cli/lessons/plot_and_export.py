"""``lathesim plot RUN.h5`` and ``lathesim export RUN.h5 FILE``: figures of a record, and the record for other programs."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import OutputPath

if TYPE_CHECKING:
    from lathesim.record import Record


@click.command()
@click.argument("run", type=click.Path(path_type=Path), metavar="RUN.h5")
@click.argument("channels", nargs=-1, metavar="[CHANNEL ...]")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Where the figure goes (.png, .svg or .pdf).")
def plot(run: Path, channels: tuple[str, ...], save: Path | None) -> int:
    """Plot channels of the record RUN.h5 over time; without a CHANNEL the path, the contour error and the voltages.

    A part's name alone stands for all its channels. Without --save the figures are left beside the record, and opened where there is a
    screen.
    """
    from lathesim.analysis.plots import channels_figure, overview_figure, save_figure, save_run_plots
    from lathesim.lessons.grading import lesson_title
    from lathesim.record import load

    record = load(run)
    case = str(record.meta.get("variant", ""))
    title = f"{lesson_title(record) or run.stem}{f', case {case}' if case else ''}"
    if channels:
        files = [save or run.with_name(f"{run.stem}_channels.png")]
        save_figure(channels_figure(record, _named(record, channels), title), files[0])
    elif save is not None:
        files = [save]
        save_figure(overview_figure(record, title), save)
    else:
        files = save_run_plots(record, run, title)
    for file in files:
        click.echo(str(file))
        if save is None and _has_screen():
            click.launch(str(file))
    return 0


def _named(record: Record, wanted: tuple[str, ...]) -> list[str]:
    """Return the channels asked for; a part's name stands for all of its channels."""
    from lathesim.engine.assembly import Place

    names: list[str] = []
    for name in wanted:
        names += [channel for channel in record if Place.of(channel).part == name] or [record.channel(name).name]
    return list(dict.fromkeys(names))


def _has_screen() -> bool:
    """Return whether someone sits before a screen on which a figure can be opened."""
    drawn = sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return drawn and sys.stdout.isatty()


@click.command(name="export")
@click.argument("run", type=click.Path(path_type=Path), metavar="RUN.h5")
@click.argument("file", type=OutputPath(), metavar="F.csv|F.mat")
@click.argument("channels", nargs=-1, metavar="[CHANNEL ...]")
def export(run: Path, file: Path, channels: tuple[str, ...]) -> int:
    """Write the record RUN.h5 as CSV or MAT file; some CHANNELs only, where they are named.

    The CSV has the header "time [s],x_axis.position [m],..." and every digit; it is also read back as a recording.
    """
    from lathesim.analysis.export import export as write
    from lathesim.record import Record, load

    record = load(run)
    if channels:
        record = Record(record.time, {name: record.channel(name) for name in channels}, record.meta)
    write(record, file)
    click.echo(f"{file}: {len(record)} instants of {len(record.channels)} channels.")
    return 0
