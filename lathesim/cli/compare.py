"""``lathesim compare LESSON RECORDING``: how far simulation and recording are apart, where, and on what it depends."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.case_options import variant_option
from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.diagnosis.compare import Comparison

_NEAREST = 4
"""Parts of a chain that are told."""


@click.command()
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@variant_option
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-compare/1) and nothing else.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="Where the figure goes [default: lathesim_runs/LESSON/].")
@click.option("--no-plots", is_flag=True, help="Draw no figure.")
@plugins_option
def compare(
    lesson: str, recording: Path, variant: str | None, as_json: bool, out: Path | None, no_plots: bool, plugin_folders: tuple[Path, ...]
) -> None:
    """Hold RECORDING against the simulation of LESSON.

    The lesson says in 'recordings:' what the columns mean. Told are the residual of each channel over the floor (what the recording cannot
    resolve), the parts where the mismatch sits when every part gets what was recorded of its inputs, what the mismatch depends on, and the
    lines of the residual in Hz and along the way of the parts. Nothing is fitted but the start.
    """
    import json
    import os

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from lathesim.diagnosis.compare import as_json as json_of
    from lathesim.diagnosis.compare import compare as compared
    from lathesim.diagnosis.compare import load_recording
    from lathesim.lessons.lesson import load_lesson

    registry = open_registry(plugin_folders)
    loaded = load_lesson(lesson)
    comparison = compared(loaded.name, *load_recording(loaded, recording, registry, variant))
    figure = None if no_plots else _drawn(comparison, (out or Path("lathesim_runs") / loaded.name) / f"{recording.stem}_compared.png")
    if as_json:
        click.echo(json.dumps({**json_of(comparison), "figure": str(figure) if figure else None}, indent=2))
        return
    for line in comparison_lines(comparison):
        click.echo(line)
    if figure is not None:
        click.echo(f"\nSee {figure}")


def _drawn(comparison: Comparison, path: Path) -> Path:
    from lathesim.analysis.plots import save_figure
    from lathesim.diagnosis.compare_figure import compare_figure
    from lathesim.errors import RecordError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordError(
            f"the folder cannot be made: {error.strerror}.", place=str(path.parent), remedy="Choose another with --out."
        ) from None
    save_figure(compare_figure(comparison), path)
    return path


def comparison_lines(comparison: Comparison) -> list[str]:
    """Give a comparison as a person reads it."""
    lines = [f"Recording: {text}" for text in comparison.findings]
    lines += [""] * bool(lines)
    lines += _table(_channel_rows(comparison))
    lines += ["", "Every part with the inputs that were recorded:", *_table(_replay_rows(comparison))]
    lines += ["", *_where(comparison)]
    if comparison.adds_up:
        lines.append("Each part leaves next to nothing. Run by itself, with no recording to hold it, the simulation adds that up.")
    if comparison.explained_by:
        lines += ["", "What is missing depends on (learned on one half, scored on the other):"]
        lines += [f"  {_bar(item.share)} {item.share:4.0%}  {item.variable}" for item in comparison.explained_by]
    found = _line_rows(comparison)
    return lines + (["", "Lines of the residual:", *_table(found)] if len(found) > 1 else [])


def _where(comparison: Comparison) -> list[str]:
    """Say where the mismatch sits, and how much that means."""
    from lathesim.diagnosis.compare import OFF

    sits = " and in ".join(comparison.suspects)
    if comparison.faults:
        return ["The recording itself is at fault; until that is mended the rest says little of the machine."]
    if not sits:
        return ["No part is off by itself."]
    if comparison.within_floors:
        within = f"Nothing is wrong that this shows: the lesson's own simulation is within {OFF:g} floors."
        return [f"{within} What little is left sits in {sits}."]
    because = "a load that nobody measured, or another of its uncertain values, may be all of it."
    return [f"The mismatch sits in {sits}. Values are as the lesson has them: {because}"]


def _channel_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    from lathesim.analysis.display_unit import shown_with_unit

    rows: list[tuple[str, ...]] = [("channel", "residual, rms", "floor", "over floor", "worst")]
    for item in comparison.channels:
        shown = [shown_with_unit(value, item.unit, 3) for value in (item.rms, item.floor)]
        rows.append((item.channel, *shown, f"{item.over_floor:.3g}", f"{item.worst[0]:.4g} to {item.worst[1]:.4g} s"))
    return rows


def _replay_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    from lathesim.analysis.display_unit import shown_with_unit

    rows: list[tuple[str, ...]] = [("channel", "made by", "missing at", "rms", "of what acts there")]
    for item in comparison.replayed:
        share = f"{item.share:.2%}" if item.share == item.share else "-"
        rows.append((item.channel, _chain(item.parts), item.at, shown_with_unit(item.missing, item.unit, 3), share))
    return rows


def _chain(parts: Sequence[str]) -> str:
    """Give the parts that make a channel, the nearest first; of a whole machine only these."""
    more = len(parts) - _NEAREST
    shown = " <- ".join(parts[:_NEAREST] if more > 1 else parts)
    return f"{shown} <- {more} more" if more > 1 else shown


def _line_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.diagnosis.compare_figure import line_text

    units = {item.channel: item.unit for item in comparison.channels}
    rows: list[tuple[str, ...]] = [("channel", "line", "fixed in", "amplitude", "share")]
    for item in comparison.spectra:
        for line in item.lines:
            fixed = "time (Hz)" if line.variable == "time" else line.variable
            size = shown_with_unit(line.amplitude, units[item.channel], 3)
            rows.append((item.channel, line_text(line), fixed, size, f"{line.share:.0%}"))
    return rows


def _bar(share: float) -> str:
    return f"{'#' * round(20 * min(1.0, share)):<20}"


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [lines[0], "  ".join("-" * width for width in widths), *lines[1:]]
