"""``lathesim modes FILE``: the modes in a frequency response."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import json_option, read_ends, save_option
from lathesim.cli.writing import CommandResult, sentence, write

if TYPE_CHECKING:
    from lathesim.stability.choose_modes import FoundModes
    from lathesim.stability.tool_point import FrequencyResponse


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--quantity", type=click.Choice(("receptance", "mobility", "accelerance")), help="What the file holds, where it does not say."
)
@click.option("--unit", metavar="UNIT", help="The unit of the response, as g/N, where the file does not say.")
@click.option("--count", type=click.IntRange(1, 40), help="How many modes; else taps that were not fitted decide.")
@click.option("--band", metavar="LOW..HIGH", help="Frequencies [Hz] to look at.")
@json_option("lathesim-modes/1")
@save_option("Draw the response with the fit.")
def modes(file: Path, quantity: str | None, unit: str | None, count: int | None, band: str | None, as_json: bool, save: Path | None) -> int:
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
    result = CommandResult("lathesim-modes/1", _data(found, response), _lines(found, response), lambda: _figure(file.name, found, response))
    return write(result, as_json, save)


def _figure(name: str, found: FoundModes, response: FrequencyResponse) -> Any:
    from lathesim.analysis.stability_figures import response_figure

    return response_figure(
        f"Modes of {name}",
        response.frequency,
        response.receptance_values,
        model=found.model.response(response.frequency),
        coherence=response.coherence,
        modes=[mode.frequency.value for mode in found.modes],
    )


def _data(found: FoundModes, response: FrequencyResponse) -> dict[str, Any]:
    modes = [{"frequency_hz": mode.frequency, "damping": mode.damping, "stiffness_n_per_m": mode.stiffness} for mode in found.modes]
    return {
        "modes": modes,
        "outside_band_hz": [mode.frequency.value for mode in found.outside],
        "decided_on": found.decided_on,
        "held_out_misfit": [{"modes": count, "misfit": misfit} for count, misfit in found.held_out],
        "findings": response.findings,
    }


def _lines(found: FoundModes, response: FrequencyResponse) -> Iterator[str]:
    from lathesim.units import in_unit

    yield from map(sentence, response.findings)
    yield f"{'frequency [Hz]':>26}{'damping [%]':>24}{'stiffness [N/m]':>30}   95 % intervals"
    for mode in found.modes:
        f, z, k = mode.frequency, mode.damping, mode.stiffness
        frequency = f"{f.value:>12.3f} +-{(f.high - f.low) / 2:>10.4f}"
        damping = f"{100 * z.value:>12.4f} +-{100 * (z.high - z.low) / 2:>8.4f}"
        yield f"{frequency}{damping}{k.value:>16.5e} +-{(k.high - k.low) / 2:>10.2e}"
    yield f"\nThe number of modes was decided on {found.decided_on}."
    if found.outside:
        places = ", ".join(f"{mode.frequency.value:.0f}" for mode in found.outside)
        yield f"Modes outside {response.frequency[0]:.3g} to {response.highest:.0f} Hz are a residual term: near {places} Hz."
    usable = [mode for mode in found.modes if mode.stiffness.value > 0.0]
    if len(usable) < len(found.modes):
        yield "A tool point has no negative stiffness: force and response have opposite directions, or are measured at different points."
    if usable:
        yield "\ntool_point:\n  modes:"
    for mode in usable:
        damping = in_unit(mode.damping.value, "%", ".6g")
        yield f"    - {{frequency: {mode.frequency.value:.6g} Hz, damping: {damping}, stiffness: {mode.stiffness.value:.6g} N/m}}"
