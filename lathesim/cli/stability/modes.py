"""``lathesim modes FILE``: the modes in a frequency response."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath

if TYPE_CHECKING:
    from lathesim.stability.choose_modes import Estimate, FoundModes
    from lathesim.stability.tool_point import FrequencyResponse


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--quantity", type=click.Choice(("receptance", "mobility", "accelerance")), help="What the file holds, where it does not say."
)
@click.option("--unit", metavar="UNIT", help="The unit of the response, as g/N, where the file does not say.")
@click.option("--count", type=click.IntRange(1, 40), help="How many modes; else taps that were not fitted decide.")
@click.option("--band", metavar="LOW..HIGH", help="Frequencies [Hz] to look at.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-modes/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the response with the fit.")
def modes(
    file: Path, quantity: str | None, unit: str | None, count: int | None, band: str | None, as_json: bool, save: Path | None
) -> None:
    """Find the modes in the frequency response in FILE (CSV, MAT or UFF 58), each with a 95 % interval.

    Their number is decided on taps that were not fitted: each hit in turn where the file holds the single hits ('lathesim tap' writes
    them), every second line otherwise. What is written can stand under 'tool_point:' of a lesson.
    """
    from lathesim.stability.choose_modes import find_modes
    from lathesim.stability.response_files import read_response
    from lathesim.stability.tool_point import within

    response = read_response(file, quantity, unit)
    if band is not None:
        response = within(response, *read_ends("--band", band), str(file))
    found = find_modes(response, count)
    if save is not None:
        from lathesim.analysis.plots import save_figure
        from lathesim.analysis.stability_figures import response_figure

        figure = response_figure(
            f"Modes of {file.name}",
            response.frequency,
            response.receptance_values,
            model=found.model.response(response.frequency),
            coherence=response.coherence,
            modes=[mode.frequency.value for mode in found.modes],
        )
        save_figure(figure, save)
    if as_json:
        click.echo(json.dumps(_as_json(found, response), indent=2))
        return
    _tell(found, response)
    if save is not None:
        click.echo(f"See {save}")


def read_ends(option: str, text: str) -> tuple[float, float]:
    """Read ``50..2000`` of an option."""
    low, dots, high = text.partition("..")
    try:
        first, last = float(low), float(high)
    except ValueError:
        raise click.UsageError(f"{option} {text}: write it as {option} 50..2000.") from None
    if not dots or not 0.0 <= first < last:
        raise click.UsageError(f"{option} {text}: the ends rise from 0 on.")
    return first, last


def _as_json(found: FoundModes, response: FrequencyResponse) -> dict[str, Any]:
    return {
        "schema": "lathesim-modes/1",
        "modes": [
            {"frequency_hz": _estimate(mode.frequency), "damping": _estimate(mode.damping), "stiffness_n_per_m": _estimate(mode.stiffness)}
            for mode in found.modes
        ],
        "outside_band_hz": [mode.frequency.value for mode in found.outside],
        "decided_on": found.decided_on,
        "held_out_misfit": [{"modes": count, "misfit": misfit} for count, misfit in found.held_out],
        "findings": list(response.findings),
    }


def _estimate(estimate: Estimate) -> dict[str, float]:
    return {"value": estimate.value, "low": estimate.low, "high": estimate.high}


def _tell(found: FoundModes, response: FrequencyResponse) -> None:
    for sentence in response.findings:
        click.echo(f"{sentence[0].upper()}{sentence[1:]}.")
    click.echo(f"{'frequency [Hz]':>26}{'damping [%]':>24}{'stiffness [N/m]':>30}   95 % intervals")
    for mode in found.modes:
        f, z, k = mode.frequency, mode.damping, mode.stiffness
        click.echo(
            f"{f.value:>12.3f} +-{(f.high - f.low) / 2:>10.4f}{100 * z.value:>12.4f} +-{100 * (z.high - z.low) / 2:>8.4f}"
            f"{k.value:>16.5e} +-{(k.high - k.low) / 2:>10.2e}"
        )
    click.echo(f"\nThe number of modes was decided on {found.decided_on}.")
    if found.outside:
        places = ", ".join(f"{mode.frequency.value:.0f}" for mode in found.outside)
        click.echo(f"Modes outside {response.frequency[0]:.3g} to {response.highest:.0f} Hz are a residual term: near {places} Hz.")
    usable = [mode for mode in found.modes if mode.stiffness.value > 0.0]
    if len(usable) < len(found.modes):
        click.echo(
            "A tool point has no negative stiffness: force and response have opposite directions, or are measured at different points."
        )
    if usable:
        click.echo("\ntool_point:\n  modes:")
    for mode in usable:
        click.echo(
            f"    - {{frequency: {mode.frequency.value:.6g} Hz, damping: {100 * mode.damping.value:.6g} %, "
            f"stiffness: {mode.stiffness.value:.6g} N/m}}"
        )
