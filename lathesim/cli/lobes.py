"""``lathesim lobes LESSON``: up to which chip width a cut is stable, over the spindle speed."""

from __future__ import annotations

import json
import math
from pathlib import Path

import click


@click.command()
@click.argument("lesson")
@click.option("--method", type=click.Choice(("frequency", "collocation")), default="frequency", show_default=True, help="How to compute.")
@click.option("--speed", "speeds", default="500..8000:301", show_default=True, metavar="LOW..HIGH:N", help="Speeds [rpm].")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-lobes/1) and nothing else.")
@click.option("--save", type=click.Path(path_type=Path), metavar="F.png", help="Draw the lobes.")
def lobes(lesson: str, method: str, speeds: str, as_json: bool, save: Path | None) -> None:
    """Show the limit of the chip width of LESSON's cut over the spindle speed, from its 'tool_point:'."""
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.frequency_limit import smallest_limit, speeds_of
    from lathesim.stability.lobes import cut_of
    from lathesim.stability.lobes import lobes as limits

    loaded = load_lesson(lesson)
    cut = cut_of(loaded)
    asked = read_range("--speed", speeds)
    found = limits(cut, asked, method)
    smallest = smallest_limit(cut.tool, cut.stiffness)
    if save is not None:
        from lathesim.analysis.lobes_figure import lobes_figure
        from lathesim.analysis.plots import save_figure

        save_figure(lobes_figure(loaded.title, asked, [1e3 * point.limit.width for point in found], 1e3 * smallest.width), save)
    if as_json:
        rows = [
            {
                "speed_rpm": point.limit.speed,
                "width_m": _number(point.limit.width),
                "frequency_hz": _number(point.limit.frequency),
                "kind": point.kind,
            }
            for point in found
        ]
        result = {"schema": "lathesim-lobes/1", "method": method, "smallest_width_m": _number(smallest.width), "rows": rows}
        click.echo(json.dumps(result, indent=2))
        return
    click.echo(f"{'speed [rpm]':>12}{'width [mm]':>14}{'chatter [Hz]':>14}  kind")
    for point in found:
        width = f"{1e3 * point.limit.width:.4f}" if math.isfinite(point.limit.width) else "stable"
        frequency = f"{point.limit.frequency:.2f}" if math.isfinite(point.limit.frequency) else "-"
        click.echo(f"{point.limit.speed:>12.0f}{width:>14}{frequency:>14}  {point.kind}")
    if math.isfinite(smallest.width):
        best = ", ".join(f"{speed:.0f}" for speed in speeds_of(smallest, 6))
        click.echo(f"\nStable at every speed below {1e3 * smallest.width:.4f} mm; that is met at {best} rpm ...")
    if save is not None:
        click.echo(f"See {save}")


def read_range(option: str, text: str) -> list[float]:
    """Read ``500..8000:76`` of an option: the ends and how many values, evenly spaced."""
    ends, _, count = text.partition(":")
    low, dots, high = ends.partition("..")
    try:
        first, last, number = float(low), float(high if dots else low), int(count) if count else (2 if dots else 1)
    except ValueError:
        raise click.UsageError(f"{option} {text}: write it as {option} 500..8000:76.") from None
    if not 0.0 < first <= last or not 1 <= number <= 100_000:
        raise click.UsageError(f"{option} {text}: values rise from above 0, and there is at least one.")
    return [first + (last - first) * place / max(1, number - 1) for place in range(number)]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
