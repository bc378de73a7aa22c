"""``lathesim couple ASSEMBLY.yaml``: the receptance of the tip of parts put together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath

if TYPE_CHECKING:
    from lathesim.stability.assembly_file import Assembly

_LINES_OF_FIGURE, _LINES_OF_BAND = 800, 200
_UNITS = {"receptance": [["m/N", "1/N"], ["1/N", "1/(N*m)"]]}
"""Of the four terms: displacement and rotation of the tip over a force and over a moment."""


@click.command()
@click.argument("assembly", type=click.Path(path_type=Path), metavar="ASSEMBLY.yaml")
@click.option("--frequency", default="100..5000:50", show_default=True, metavar="LOW..HIGH:N", help="Frequencies [Hz].")
@click.option("--overhang", metavar="LOW..HIGH:N", help="Scan the length of the first part [mm].")
@click.option(
    "--inverse", type=click.Path(path_type=Path), metavar="TIP.json", help="Take the parts off a measured tip: what they were fixed to."
)
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-couple/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the tip over frequency.")
def couple(assembly: Path, frequency: str, overhang: str | None, inverse: Path | None, as_json: bool, save: Path | None) -> None:
    """Show the receptance of the tip of the beams in ASSEMBLY.yaml, the first part at the tip.

    The last part is free at its far end, or fixed to the 'base:' of the file. Joints with 'uncertain:' give a band. With --inverse the file
    is an artefact, and TIP.json holds what was measured at its tip, all four terms, as --json writes them. The result can be the base of
    another assembly.
    """
    import numpy as np

    from lathesim.cli.stability.lobes import read_range
    from lathesim.stability.assembly_file import load_assembly

    loaded = load_assembly(assembly)
    if inverse is not None:
        _inverse(loaded, inverse, as_json)
        return
    asked = np.array(read_range("--frequency", frequency))
    if overhang is not None:
        _overhangs(loaded, [1e-3 * length for length in read_range("--overhang", overhang)], as_json)
        return
    _tip(loaded, asked, as_json, save)


def _tip(loaded: Assembly, asked: Any, as_json: bool, save: Path | None) -> None:
    import numpy as np

    from lathesim.stability.assembly_file import is_uncertain, tip_draws

    tips = loaded.tip(asked)
    band = None
    if is_uncertain(loaded):
        band = np.quantile(np.abs(tip_draws(loaded, asked)), [0.025, 0.975], axis=0)
    if save is not None:
        from lathesim.analysis.plots import save_figure
        from lathesim.analysis.stability_figures import response_figure

        # a peak is narrower than the lines of a table are apart
        fine = np.union1d(asked, np.linspace(asked[0], asked[-1], _LINES_OF_FIGURE))
        around = None
        if band is not None:
            some = np.union1d(asked, fine[:: _LINES_OF_FIGURE // _LINES_OF_BAND])
            ends = np.quantile(np.abs(tip_draws(loaded, some)), [0.025, 0.975], axis=0)
            around = np.stack([np.exp(np.interp(fine, some, np.log(end))) for end in ends])
        save_figure(response_figure(loaded.title, fine, loaded.tip(fine)[:, 0, 0], band=around), save)
    if as_json:
        rows = _rows(asked, tips)
        if band is not None:
            for row, low, high in zip(rows, band[0].tolist(), band[1].tolist(), strict=True):
                row |= {"low_m_per_n": low, "high_m_per_n": high}
        click.echo(json.dumps({"schema": "lathesim-couple/1", "model": loaded.model, "units": _UNITS, "rows": rows}, indent=2))
        return
    click.echo(f"{loaded.title}: displacement over force at the tip, model {loaded.model}\n")
    click.echo(
        f"{'f [Hz]':>10}{'Re H [m/N]':>16}{'Im H [m/N]':>16}{'|H| [m/N]':>16}" + (f"{'95 % of |H|':>28}" if band is not None else "")
    )
    for place, value in enumerate(asked):
        h = complex(tips[place, 0, 0])
        told = f"{band[0, place]:>14.4e} {band[1, place]:>13.4e}" if band is not None else ""
        click.echo(f"{value:>10.1f}{h.real:>16.5e}{h.imag:>16.5e}{abs(h):>16.5e}{told}")
    if save is not None:
        click.echo(f"\nSee {save}")


def _rows(frequency: Any, receptance: Any) -> list[dict[str, Any]]:
    return [
        {"frequency_hz": float(value), "receptance": [[[float(item.real), float(item.imag)] for item in row] for row in matrix]}
        for value, matrix in zip(frequency, receptance, strict=True)
    ]


def _inverse(artefact: Assembly, measured: Path, as_json: bool) -> None:
    from lathesim.stability.assembly_file import base_share, read_base

    tip = read_base(measured)
    share = base_share(artefact, tip.frequency, tip.receptance)
    if as_json:
        rows = _rows(tip.frequency, share)
        click.echo(json.dumps({"schema": "lathesim-couple/1", "model": artefact.model, "units": _UNITS, "rows": rows}, indent=2))
        return
    click.echo(f"{artefact.title}: what it is fixed to, displacement over force\n\n{'f [Hz]':>10}{'Re H [m/N]':>16}{'Im H [m/N]':>16}")
    for value, matrix in zip(tip.frequency, share, strict=True):
        click.echo(f"{value:>10.1f}{matrix[0, 0].real:>16.5e}{matrix[0, 0].imag:>16.5e}")


def _overhangs(loaded: Assembly, lengths: list[float], as_json: bool) -> None:
    from lathesim.stability.assembly_file import overhangs

    found = overhangs(loaded, lengths)
    if as_json:
        rows = [
            {
                "overhang_m": item.length,
                "peak_hz": item.peak_frequency,
                "peak_m_per_n": item.peak,
                "lowest_real_m_per_n": item.lowest_real,
                "lowest_real_hz": item.lowest_frequency,
            }
            for item in found
        ]
        click.echo(json.dumps({"schema": "lathesim-overhang/1", "model": loaded.model, "rows": rows}, indent=2))
        return
    click.echo(f"{loaded.title}: the tip over the length of its first part\n")
    click.echo(f"{'length [mm]':>12}{'peak [Hz]':>12}{'|H| [um/N]':>12}{'min Re H [um/N]':>18}{'at [Hz]':>10}")
    for item in found:
        click.echo(
            f"{1e3 * item.length:>12.1f}{item.peak_frequency:>12.1f}{1e6 * item.peak:>12.4f}"
            f"{1e6 * item.lowest_real:>18.4f}{item.lowest_frequency:>10.1f}"
        )
