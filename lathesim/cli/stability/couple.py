"""``lathesim couple ASSEMBLY.yaml``: the receptance of the tip of parts put together."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import json_option, read_range, save_option
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.stability.assembly_file import ToolAssembly

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
@json_option("lathesim-couple/1")
@save_option("Draw the tip over frequency.")
def couple(assembly: Path, frequency: str, overhang: str | None, inverse: Path | None, as_json: bool, save: Path | None) -> int:
    """Show the receptance of the tip of the beams in ASSEMBLY.yaml, the first part at the tip.

    The last part is free at its far end, or fixed to the 'base:' of the file. Joints with 'uncertain:' give a band. With --inverse the file
    is an artefact, and TIP.json holds what was measured at its tip, all four terms, as --json writes them. The result can be the base of
    another assembly.
    """
    import numpy as np

    from lathesim.stability.assembly_file import load_assembly

    loaded = load_assembly(assembly)
    if inverse is not None:
        return write(_inverse(loaded, inverse), as_json)
    asked = np.array(read_range("--frequency", frequency))
    if overhang is not None:
        return write(_overhangs(loaded, [1e-3 * length for length in read_range("--overhang", overhang)]), as_json)
    return write(_tip(loaded, asked, gap=save is not None), as_json, save)


_TERMS = (Heading("f [Hz]", 10, ".1f"), Heading("Re H [m/N]", 16, ".5e"), Heading("Im H [m/N]", 16, ".5e"))
_SIZE, _BAND = Heading("|H| [m/N]", 16, ".5e"), Heading("95 % of |H|", 28)
_LENGTHS = (
    Heading("length [mm]", 12, ".1f", si=True), Heading("peak [Hz]", 12, ".1f"), Heading("|H| [um/N]", 12, ".4f", si=True),
    Heading("min Re H [um/N]", 18, ".4f", si=True), Heading("at [Hz]", 10, ".1f"),
)  # fmt: skip


def _tip(loaded: ToolAssembly, asked: Any, *, gap: bool) -> CommandResult:
    """Return the tip over frequency; a ``gap`` stands before the name of its figure."""
    import numpy as np

    from lathesim.stability.assembly_file import is_uncertain, tip_draws

    tips = loaded.tip(asked)
    rows, band = _rows(asked, tips), None
    if is_uncertain(loaded):
        band = np.quantile(np.abs(tip_draws(loaded, asked)), [0.025, 0.975], axis=0)
        for row, low, high in zip(rows, band[0].tolist(), band[1].tolist(), strict=True):
            row |= {"low_m_per_n": low, "high_m_per_n": high}

    def lines() -> Iterator[str]:
        yield f"{loaded.title}: displacement over force at the tip, model {loaded.model}\n"
        shown = []
        for place, value in enumerate(asked):
            h = complex(tips[place, 0, 0])
            told = () if band is None else (f"{band[0, place]:>14.4e} {band[1, place]:>13.4e}",)
            shown.append((value, h.real, h.imag, abs(h), *told))
        yield from table((*_TERMS, _SIZE, *([] if band is None else [_BAND])), shown)
        if gap:
            yield ""

    return CommandResult("lathesim-couple/1", _data(loaded, rows), lines(), lambda: _figure(loaded, asked, band is not None))


def _figure(loaded: ToolAssembly, asked: Any, is_uncertain: bool) -> Any:
    import numpy as np

    from lathesim.analysis.stability_figures import response_figure
    from lathesim.stability.assembly_file import tip_draws

    # a peak is narrower than the lines of a table are apart
    fine = np.union1d(asked, np.linspace(asked[0], asked[-1], _LINES_OF_FIGURE))
    around = None
    if is_uncertain:
        some = np.union1d(asked, fine[:: _LINES_OF_FIGURE // _LINES_OF_BAND])
        ends = np.quantile(np.abs(tip_draws(loaded, some)), [0.025, 0.975], axis=0)
        around = np.stack([np.exp(np.interp(fine, some, np.log(end))) for end in ends])
    return response_figure(loaded.title, fine, loaded.tip(fine)[:, 0, 0], band=around)


def _data(loaded: ToolAssembly, rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {"model": loaded.model, "units": _UNITS, "rows": rows}


def _rows(frequency: Any, receptance: Any) -> list[dict[str, Any]]:
    return [
        {"frequency_hz": value, "receptance": [[[item.real, item.imag] for item in row] for row in matrix]}
        for value, matrix in zip(frequency, receptance, strict=True)
    ]


def _inverse(artefact: ToolAssembly, measured: Path) -> CommandResult:
    from lathesim.stability.assembly_file import base_share, read_base

    tip = read_base(measured)
    share = base_share(artefact, tip.frequency, tip.receptance)

    def lines() -> Iterator[str]:
        yield f"{artefact.title}: what it is fixed to, displacement over force\n"
        yield from table(_TERMS, [(value, m[0, 0].real, m[0, 0].imag) for value, m in zip(tip.frequency, share, strict=True)])

    return CommandResult("lathesim-couple/1", _data(artefact, _rows(tip.frequency, share)), lines())


def _overhangs(loaded: ToolAssembly, lengths: list[float]) -> CommandResult:
    from lathesim.stability.assembly_file import overhangs

    found = overhangs(loaded, lengths)
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

    def lines() -> Iterator[str]:
        yield f"{loaded.title}: the tip over the length of its first part\n"
        yield from table(_LENGTHS, [tuple(row.values()) for row in rows])

    return CommandResult("lathesim-overhang/1", {"model": loaded.model, "rows": rows}, lines())
