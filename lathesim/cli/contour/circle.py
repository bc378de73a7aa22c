"""``lathesim circle LESSON``: the circular test after ISO 230-4."""

from __future__ import annotations

import json
import math
from pathlib import Path

import click

from lathesim.cli.case_options import read_settings, set_option, variant_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry, plugins_option


@click.command()
@click.argument("lesson")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw both directions, magnified.")
@click.option("--no-contributions", is_flag=True, help="Do not leave out one effect after the other.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-circle/1) and nothing else.")
@variant_option
@set_option
@plugins_option
def circle(
    lesson: str,
    save: Path | None,
    no_contributions: bool,
    as_json: bool,
    variant: str | None,
    settings: tuple[str, ...],
    plugin_folders: tuple[Path, ...],
) -> None:
    """Run the circle of LESSON in both directions and report its roundness, and the share of each effect of the lesson.

    The report gives the circular deviation G (two concentric circles hold the path), the hysteresis H (largest difference between the
    directions), the radial deviation F from the programmed circle, the ellipse, and the spikes at the quadrants, where an axis reverses.
    Unequal gains of the axes cause a slanted ellipse that turns with the direction. Axes that are not square cause a slanted ellipse that
    stays. A wrong scale causes an ellipse along its axis.
    """
    from lathesim.analysis.circular_test import ellipse, quadrant_peaks
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.cli.working import working
    from lathesim.compensation.circular_runs import circular_test
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare

    loaded = load_lesson(lesson)
    prepared = prepare(loaded, open_registry(plugin_folders), variant, read_settings(settings))
    with working(shown=not as_json) as tell:
        test = circular_test(prepared, contributions=not no_contributions, tell=tell)
    if save is not None:
        from lathesim.analysis.path_figures import circle_figure
        from lathesim.analysis.plots import save_figure

        save_figure(circle_figure(f"{loaded.title}{f', {variant}' if variant else ''}", test.ways), save)
    ellipses = {name: ellipse(way) for name, way in test.ways}
    if as_json:
        result = {
            "schema": "lathesim-circle/1",
            "lesson": lesson,
            "variant": variant,
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
        click.echo(json.dumps(result, indent=2))
        return
    click.echo(f"circular deviation G   {shown_with_unit(test.deviation, 'm')}")
    click.echo(f"hysteresis H           {shown_with_unit(test.hysteresis, 'm') if test.hysteresis is not None else 'one direction only'}")
    click.echo(f"radial deviation F     {shown_with_unit(test.smallest, 'm')} to {shown_with_unit(test.largest, 'm')}")
    for name, found in ellipses.items():
        longest = f", longest at {math.degrees(found.longest):.0f} deg from +X to +Z" if found.size > 0.0 else ""
        click.echo(f"ellipse, {name}: {shown_with_unit(found.size, 'm')}{longest}")
    for name, way in test.ways:
        peaks = ", ".join(
            f"{place} {shown_with_unit(peak, 'm')}" for place, peak in zip(("+X", "+Z", "-X", "-Z"), quadrant_peaks(way), strict=True)
        )
        click.echo(f"quadrants, {name}: {peaks}")
    for item in test.contributions:
        other = f", H {shown_with_unit(item.hysteresis, 'm')}" if item.hysteresis is not None else ""
        click.echo(f"without {item.effect} ({item.at}): G {shown_with_unit(item.deviation, 'm')}{other}")
    if save is not None:
        click.echo(f"See {save}")
