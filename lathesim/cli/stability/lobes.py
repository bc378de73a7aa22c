"""``lathesim lobes LESSON``: up to which chip width a cut is stable, over the spindle speed."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath

if TYPE_CHECKING:
    from lathesim.stability.lesson_cut import Cut
    from lathesim.stability.lobes import StabilityMap
    from lathesim.stability.uncertain_cut import Band


@click.command()
@click.argument("lesson")
@click.option(
    "--method",
    type=click.Choice(("frequency", "collocation", "time")),
    default=None,
    help="How to compute  [default: frequency where it can].",
)
@click.option("--speed", "speeds", default="500..8000:301", show_default=True, metavar="LOW..HIGH:N", help="Speeds [rpm].")
@click.option("--cuts", "tried", type=click.Path(path_type=Path), metavar="CUTS.csv", help="Show the cuts that were tried.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-lobes/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the lobes.")
def lobes(lesson: str, method: str | None, speeds: str, tried: Path | None, as_json: bool, save: Path | None) -> None:
    """Show the limit of the chip width of LESSON's cut over the spindle speed, from its 'tool_point:'.

    The three methods share no code. 'frequency' takes any modes, a measured response as it is, and process damping. 'collocation' takes
    interrupted cuts and milling too. 'time' runs the cut in the engine. What the lesson calls uncertain gives a band.
    """
    from lathesim.cli.run_progress import progress_bar
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.lesson_cut import cut_of
    from lathesim.stability.lobes import stability_map
    from lathesim.stability.uncertain_cut import CLOSE, spreads_of

    loaded = load_lesson(lesson)
    cut = cut_of(loaded)
    asked = read_range("--speed", speeds)
    spreads = spreads_of(loaded, cut)
    chosen = method or ("collocation" if cut.share < 1.0 or cut.milling is not None else "frequency")
    with progress_bar(f"{loaded.name}, {len(asked)} speeds", float(len(asked)), shown=not as_json and chosen != "frequency") as bar:
        found = stability_map(cut, asked, chosen, None if bar is None else lambda done, _: bar(float(done)))
    band = _band(cut, spreads, asked)
    edges = None if band is None else band.edges
    cuts = _tried(tried)
    if save is not None:
        _draw(loaded.title, found, cut, edges, cuts, save)
    if as_json:
        click.echo(json.dumps(_as_json(found, cut, band, cuts), indent=2))
        return
    _table(found, cut, edges)
    if band is not None:
        more = "" if band.apart <= CLOSE else "; more draws are not made, so take the edges for rough"
        click.echo(
            f"95 % of {band.draws} draws lie in the band, and its edges from two halves agree within {100.0 * band.apart:.2g} %{more}."
        )
    elif spreads:
        click.echo("No band: what is uncertain is followed for uninterrupted turning only.")
    if save is not None:
        click.echo(f"See {save}")


def _band(cut: Cut, spreads: Any, speeds: list[float]) -> Band | None:
    from lathesim.stability.uncertain_cut import band

    return band(cut, spreads, speeds) if spreads and cut.share == 1.0 and cut.milling is None else None


def _tried(path: Path | None) -> list[tuple[float, float, bool | None]]:
    if path is None:
        return []
    from lathesim.stability.tried_cuts import read_cuts

    return [(cut.speed, cut.width, cut.stable) for cut in read_cuts(path)]


def _draw(title: str, found: StabilityMap, cut: Cut, edges: Any, cuts: list[tuple[float, float, bool | None]], save: Path) -> None:
    from lathesim.analysis.plots import save_figure
    from lathesim.analysis.stability_figures import lobes_figure

    figure = lobes_figure(
        title,
        [point.limit.speed for point in found.points],
        [1e3 * point.limit.width for point in found.points],
        1e3 * found.smallest.width,
        band=None if edges is None else (1e3 * edges[0], 1e3 * edges[2]),
        flips=[point.kind == "flip" for point in found.points],
        cuts=[(speed, 1e3 * width, stable) for speed, width, stable in cuts],
        chosen=None if cut.chosen is None else (cut.chosen[0], 1e3 * cut.chosen[1]),
    )
    save_figure(figure, save)


def _as_json(found: StabilityMap, cut: Cut, band: Band | None, cuts: list[tuple[float, float, bool | None]]) -> dict[str, Any]:
    rows = []
    for place, point in enumerate(found.points):
        row: dict[str, Any] = {
            "speed_rpm": point.limit.speed,
            "width_m": _number(point.limit.width),
            "frequency_hz": _number(point.limit.frequency),
            "lobe": point.limit.lobe if math.isfinite(point.limit.width) else None,
            "kind": point.kind,
        }
        if band is not None:
            row |= {"low_m": _number(float(band.edges[0][place])), "high_m": _number(float(band.edges[2][place]))}
        rows.append(row)
    result: dict[str, Any] = {
        "schema": "lathesim-lobes/1",
        "method": found.method,
        "smallest_width_m": _number(found.smallest.width),
        "smallest_frequency_hz": _number(found.smallest.frequency),
        "rows": rows,
        "findings": list(found.findings),
    }
    if band is not None:
        result["band"] = {"draws": band.draws, "edges_agree_within": _number(band.apart)}
    if cut.chosen is not None:
        result["chosen"] = {"speed_rpm": cut.chosen[0], "width_m": cut.chosen[1]}
    if cuts:
        result["cuts"] = [{"speed_rpm": speed, "width_m": width, "stable": stable} for speed, width, stable in cuts]
    return result


def _table(found: StabilityMap, cut: Cut, edges: Any) -> None:
    from lathesim.stability.frequency_limit import speeds_of

    for sentence in found.findings:
        click.echo(f"{sentence[0].upper()}{sentence[1:].rstrip('.')}.")
    click.echo(
        f"{'speed [rpm]':>12}{'width [mm]':>14}" + (f"{'95 %':>20}" if edges is not None else "") + f"{'chatter [Hz]':>14}{'lobe':>6}  kind"
    )
    for place, point in enumerate(found.points):
        finite = math.isfinite(point.limit.width)
        width = f"{1e3 * point.limit.width:.4f}" if finite else "stable"
        frequency = f"{point.limit.frequency:.2f}" if math.isfinite(point.limit.frequency) else "-"
        bounds = "" if edges is None else f"{_shown(edges[0][place])}..{_shown(edges[2][place])}".rjust(20)
        lobe = str(point.limit.lobe) if finite else "-"
        click.echo(f"{point.limit.speed:>12.0f}{width:>14}{bounds}{frequency:>14}{lobe:>6}  {point.kind}")
    if math.isfinite(found.smallest.width):
        told = ""
        if math.isfinite(found.smallest.speed) and cut.process_damping == 0.0:
            told = "; that is met at " + ", ".join(f"{speed:.0f}" for speed in speeds_of(found.smallest, 6)) + " rpm ..."
        click.echo(f"\nStable at every speed below {1e3 * found.smallest.width:.4f} mm{told}")
    elif any(math.isfinite(point.limit.width) for point in found.points):
        lowest = min(found.points, key=lambda point: point.limit.width).limit
        click.echo(f"\nThe lowest limit shown is {1e3 * lowest.width:.4f} mm at {lowest.speed:.0f} rpm")


def _shown(width: float) -> str:
    return f"{1e3 * width:.3f}" if math.isfinite(width) else "stable"


def read_range(option: str, text: str) -> list[float]:
    """Read ``500..8000:76`` of an option: the ends and how many values, evenly spaced."""
    ends, _, count = text.partition(":")
    low, dots, high = ends.partition("..")
    try:
        first, last, number = float(low), float(high if dots else low), int(count) if count else (2 if dots else 1)
    except ValueError:
        raise click.UsageError(f"{option} {text}: write it as {option} 500..8000:76.") from None
    if not 0.0 < first <= last < math.inf or not 1 <= number <= 100_000:
        raise click.UsageError(f"{option} {text}: values rise from above 0, and there is at least one.")
    return [first + (last - first) * place / max(1, number - 1) for place in range(number)]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
