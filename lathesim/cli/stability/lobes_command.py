"""``lathesim lobes LESSON``: up to which chip width a cut is stable, over the spindle speed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import json_option, read_range, save_option
from lathesim.cli.writing import CommandResult, Heading, sentence, table, write

if TYPE_CHECKING:
    from lathesim.stability.belief import TriedCut
    from lathesim.stability.lesson_settings import Cut
    from lathesim.stability.lobes import StabilityMap
    from lathesim.stability.uncertain_cut import LimitBand


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
@json_option("lathesim-lobes/1")
@save_option("Draw the lobes.")
def lobes(lesson: str, method: str | None, speeds: str, tried: Path | None, as_json: bool, save: Path | None) -> int:
    """Show the limit of the chip width of LESSON's cut over the spindle speed, from its 'tool_point:'.

    The three methods share no code. 'frequency' takes any modes, a measured response as it is, and process damping. 'collocation' takes
    interrupted cuts and milling too. 'time' runs the cut in the engine. What the lesson calls uncertain gives a band.
    """
    from lathesim.cli.progress import progress_bar
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.lesson_settings import cut_of
    from lathesim.stability.lobes import stability_map
    from lathesim.stability.uncertain_cut import spreads_of

    loaded = load_lesson(lesson)
    cut = cut_of(loaded)
    asked = read_range("--speed", speeds)
    spreads = spreads_of(loaded, cut)
    chosen = method or ("collocation" if cut.share < 1.0 or cut.milling is not None else "frequency")
    with progress_bar(f"{loaded.name}, {len(asked)} speeds", float(len(asked)), shown=not as_json and chosen != "frequency") as bar:
        found = stability_map(cut, asked, chosen, None if bar is None else lambda done, _: bar(float(done)))
    band = _band(cut, spreads, asked)
    cuts = _tried(tried)
    lines = _lines(found, cut, band, bool(spreads))
    result = CommandResult("lathesim-lobes/1", _data(found, cut, band, cuts), lines, lambda: _figure(loaded.title, found, cut, band, cuts))
    return write(result, as_json, save)


def _band(cut: Cut, spreads: Any, speeds: list[float]) -> LimitBand | None:
    from lathesim.stability.uncertain_cut import band

    return band(cut, spreads, speeds) if spreads and cut.share == 1.0 and cut.milling is None else None


def _tried(path: Path | None) -> tuple[TriedCut, ...]:
    from lathesim.stability.belief import read_cuts

    return () if path is None else read_cuts(path)


def _figure(title: str, found: StabilityMap, cut: Cut, band: LimitBand | None, cuts: tuple[TriedCut, ...]) -> Any:
    from lathesim.analysis.stability_figures import lobes_figure
    from lathesim.units import from_si

    millimetres = from_si(1.0, "mm")
    return lobes_figure(
        title,
        [point.limit.speed for point in found.points],
        [millimetres * point.limit.width for point in found.points],
        millimetres * found.smallest.width,
        band=None if band is None else (millimetres * band.edges[0], millimetres * band.edges[2]),
        flips=[point.kind == "flip" for point in found.points],
        cuts=[(tried.speed, millimetres * tried.width, tried.stable) for tried in cuts],
        chosen=None if cut.chosen is None else (cut.chosen[0], millimetres * cut.chosen[1]),
    )


def _data(found: StabilityMap, cut: Cut, band: LimitBand | None, cuts: tuple[TriedCut, ...]) -> dict[str, Any]:
    rows = [
        {
            "speed_rpm": point.limit.speed,
            "width_m": point.limit.width,
            "frequency_hz": point.limit.frequency,
            "lobe": point.limit.lobe if math.isfinite(point.limit.width) else None,
            "kind": point.kind,
        }
        for point in found.points
    ]
    if band is not None:
        for row, low, high in zip(rows, band.edges[0], band.edges[2], strict=True):
            row |= {"low_m": low, "high_m": high}
    result: dict[str, Any] = {
        "method": found.method,
        "smallest_width_m": found.smallest.width,
        "smallest_frequency_hz": found.smallest.frequency,
        "rows": rows,
        "findings": found.findings,
    }
    if band is not None:
        result["band"] = {"draws": band.draws, "edges_agree_within": band.apart}
    if cut.chosen is not None:
        result["chosen"] = {"speed_rpm": cut.chosen[0], "width_m": cut.chosen[1]}
    if cuts:
        result["cuts"] = [{"speed_rpm": tried.speed, "width_m": tried.width, "stable": tried.stable} for tried in cuts]
    return result


_EDGE = Heading("[mm]", 1, ".3f", si=True, missing="stable")
_SPEED, _WIDTH, _BAND = (
    Heading("speed [rpm]", 12, ".0f"),
    Heading("width [mm]", 14, ".4f", si=True, missing="stable"),
    Heading("95 %", 20),
)
_BEHIND = (Heading("chatter [Hz]", 14, ".2f", missing="-"), Heading("lobe", 6), Heading("  kind", -1))


def _lines(found: StabilityMap, cut: Cut, band: LimitBand | None, is_uncertain: bool) -> Iterator[str]:
    from lathesim.stability.frequency_limit import speeds_of
    from lathesim.stability.uncertain_cut import CLOSE
    from lathesim.units import in_unit

    yield from map(sentence, found.findings)
    bounds = [()] * len(found.points) if band is None else [(f"{_EDGE.cell(low)}..{_EDGE.cell(high)}",) for low, _, high in band.edges.T]
    rows = []
    for point, between in zip(found.points, bounds, strict=True):
        limit = point.limit
        lobe = str(limit.lobe) if math.isfinite(limit.width) else "-"
        rows.append((limit.speed, limit.width, *between, limit.frequency, lobe, f"  {point.kind}"))
    yield from table((_SPEED, _WIDTH, *([] if band is None else [_BAND]), *_BEHIND), rows)
    if math.isfinite(found.smallest.width):
        told = ""
        if math.isfinite(found.smallest.speed) and cut.process_damping == 0.0:
            told = "; that is met at " + ", ".join(f"{speed:.0f}" for speed in speeds_of(found.smallest, 6)) + " rpm ..."
        yield f"\nStable at every speed below {in_unit(found.smallest.width, 'mm', '.4f')}{told}"
    elif any(math.isfinite(point.limit.width) for point in found.points):
        lowest = min(found.points, key=lambda point: point.limit.width).limit
        yield f"\nThe lowest limit shown is {in_unit(lowest.width, 'mm', '.4f')} at {lowest.speed:.0f} rpm"
    if band is not None:
        more = "" if band.apart <= CLOSE else "; more draws are not made, so take the edges for rough"
        agreed = in_unit(band.apart, "%", ".2g")
        yield f"95 % of {band.draws} draws lie in the band, and its edges from two halves agree within {agreed}{more}."
    elif is_uncertain:
        yield "No band: what is uncertain is followed for uninterrupted turning only."
