"""``lathesim circle LESSON``: the circular test after ISO 230-4."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import ChosenLesson, json_option, of_case, save_option
from lathesim.cli.progress import working
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from lathesim.analysis.circular_test import Ellipse
    from lathesim.compensation.circular_runs import CircularTest


@click.command()
@click.argument("lesson")
@save_option("Draw both directions, magnified.")
@click.option("--no-contributions", is_flag=True, help="Do not leave out one effect after the other.")
@json_option("lathesim-circle/1")
@of_case
def circle(chosen: ChosenLesson, save: Path | None, no_contributions: bool, as_json: bool) -> int:
    """Run the circle of LESSON in both directions and report its roundness, and the share of each effect of the lesson.

    The circular deviation G is the width of the ring that holds the path. The hysteresis H is the largest difference between the
    directions. The radial deviation F is measured from the programmed circle. The report also gives the ellipse, and the spikes where an
    axis reverses. Unequal gains of the axes cause a slanted ellipse that turns with the direction. Axes that are not square cause a slanted
    ellipse that stays. A wrong scale causes an ellipse along its axis.
    """
    from lathesim.analysis.circular_test import ellipse
    from lathesim.compensation.circular_runs import circular_test

    title = f"{chosen.loaded.title}{f', {chosen.variant}' if chosen.variant else ''}"
    prepared = chosen.prepared
    with working(shown=not as_json) as tell:
        test = circular_test(prepared, contributions=not no_contributions, tell=tell)

    def figure() -> Any:
        from lathesim.analysis.path_figures import circle_figure

        return circle_figure(title, test.ways)

    ellipses = {name: ellipse(way) for name, way in test.ways}
    data = {"lesson": chosen.lesson, "variant": chosen.variant, **_data(test, ellipses)}
    return write(CommandResult("lathesim-circle/1", data, _lines(test, ellipses), figure), as_json, save)


def _data(test: CircularTest, ellipses: dict[str, Ellipse]) -> dict[str, Any]:
    from lathesim.analysis.circular_test import quadrant_peaks

    return {
        "circular_deviation_m": test.deviation,
        "hysteresis_m": test.hysteresis,
        "largest_radial_deviation_m": test.largest,
        "smallest_radial_deviation_m": test.smallest,
        "ellipses": {name: {"size_m": found.size, "longest_rad": found.longest} for name, found in ellipses.items()},
        "quadrants_m": {name: quadrant_peaks(way) for name, way in test.ways},
        "without": [
            {"effect": item.effect, "part": item.at, "circular_deviation_m": item.deviation, "hysteresis_m": item.hysteresis}
            for item in test.contributions
        ],
    }


def _lines(test: CircularTest, ellipses: dict[str, Ellipse]) -> Iterator[str]:
    from lathesim.analysis.circular_test import quadrant_peaks
    from lathesim.analysis.display_unit import shown_with_unit

    def shown(value: float) -> str:
        return shown_with_unit(value, "m")

    yield f"circular deviation G   {shown(test.deviation)}"
    yield f"hysteresis H           {shown(test.hysteresis) if test.hysteresis is not None else 'one direction only'}"
    yield f"radial deviation F     {shown(test.smallest)} to {shown(test.largest)}"
    for name, found in ellipses.items():
        longest = f", longest at {math.degrees(found.longest):.0f} deg from +X to +Z" if found.size > 0.0 else ""
        yield f"ellipse, {name}: {shown(found.size)}{longest}"
    for name, way in test.ways:
        peaks = zip(("+X", "+Z", "-X", "-Z"), quadrant_peaks(way), strict=True)
        yield f"quadrants, {name}: {', '.join(f'{place} {shown(peak)}' for place, peak in peaks)}"
    for item in test.contributions:
        other = f", H {shown(item.hysteresis)}" if item.hysteresis is not None else ""
        yield f"without {item.effect} ({item.at}): G {shown(item.deviation)}{other}"
