"""``lathesim tap``, ``modes`` and ``couple``: the response of a tool point, measured or computed, and its modes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import OutputPath, json_option, read_ends, read_range, save_option
from lathesim.cli.writing import CommandResult, Heading, sentence, table, write

if TYPE_CHECKING:
    from lathesim.stability.assembly_file import ToolAssembly
    from lathesim.stability.choose_modes import FoundModes
    from lathesim.stability.tap import TapEstimate
    from lathesim.stability.tool_point import FrequencyResponse


@click.command()
@click.argument("lesson")
@click.option("--recording", type=click.Path(path_type=Path), metavar="FILE.csv", help="Hits that were recorded: time, force and response.")
@click.option("--seed", type=click.IntRange(min=0), help="Another seed of noise and hand.")
@click.option("--hits", type=click.IntRange(1, 50), help="How many hits are to be kept.")
@click.option(
    "--out", type=OutputPath(makes_folder=True), metavar="F.csv|F.mat|F.uff", help="Where the response goes  [default: lathesim_runs/]."
)
@json_option("lathesim-tap/1")
@save_option("Draw the response with its coherence.")
def tap(lesson: str, recording: Path | None, seed: int | None, hits: int | None, out: Path | None, as_json: bool, save: Path | None) -> int:
    """Hit the tool point of LESSON with a hammer and estimate its frequency response along the normal.

    Double hits and overloads are found, left out and said; another hit is then made in their place. 'tap:' under 'tool_point:' says how it
    is tapped. With --recording the hits of a file are evaluated instead; its columns name time, force and displacement, velocity or
    acceleration, with their units. 'lathesim modes' finds the modes in the file that is written.
    """
    from lathesim.lessons.lesson import load_lesson, results_folder
    from lathesim.stability.lesson_settings import recorded_tap, tap_lesson
    from lathesim.stability.response_files import write_response

    loaded = load_lesson(lesson)
    found = recorded_tap(recording) if recording is not None else tap_lesson(loaded, loaded.settings.seed if seed is None else seed, hits)
    place = out or results_folder(loaded, recording) / "tap.csv"
    write_response(found.response, place)
    result = CommandResult("lathesim-tap/1", _data(found, place), _lines(found, place), lambda: _figure(loaded.title, found))
    return write(result, as_json, save)


def _figure(title: str, found: TapEstimate) -> Any:
    from lathesim.analysis.stability_figures import response_figure

    response = found.response
    return response_figure(f"{title}: tap test", response.frequency, response.receptance_values, coherence=response.coherence)


def _data(found: TapEstimate, place: Path) -> dict[str, Any]:
    response = found.response
    return {
        "response": place,
        "lines": len(response.frequency),
        "highest_frequency_hz": response.highest,
        "window_rate_per_s": response.window_rate,
        "hits": [{"hit": hit.number, "peak_n": hit.peak, "kept": not hit.reason, "reason": hit.reason} for hit in found.hits],
        "lowest_coherence": None if response.coherence is None else response.coherence.min(),
        "largest_difference_of_h1_and_h2": abs(found.by_h2 / response.receptance_values - 1.0).max(),
    }


_GOOD_COHERENCE = 0.9
"""Coherence below which a line of a response is called poor, assumed."""


def _lines(found: TapEstimate, place: Path) -> Iterator[str]:
    import numpy as np

    from lathesim.units import in_unit

    response = found.response
    for hit in found.hits:
        yield f"hit {hit.number}: {hit.peak:.0f} N, " + (f"left out: {hit.reason}" if hit.reason else "kept")
    kept = sum(not hit.reason for hit in found.hits)
    yield f"\nResponse of {kept} hits by H1, {response.frequency[0]:.3g} to {response.highest:.0f} Hz in {len(response.frequency)} lines"
    if response.coherence is not None:
        poor = in_unit(float(np.mean(response.coherence < _GOOD_COHERENCE)), "%", ".0f")
        yield f"Coherence: median {np.median(response.coherence):.4f}; below {_GOOD_COHERENCE:g} at {poor} of the lines"
    if response.window_rate:
        yield f"The response had not died out: an exponential window of {response.window_rate:.3g} 1/s is in it, and kept in the file"
    yield f"Response: {place}\nNext: lathesim modes {place}"


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

    The number of modes is decided on taps that were not fitted. If the file holds single hits, as 'lathesim tap' writes them, each hit
    judges in turn. Otherwise every second line judges. What is written can stand under 'tool_point:' of a lesson.
    """
    from lathesim.stability.choose_modes import find_modes
    from lathesim.stability.response_files import read_response
    from lathesim.stability.tool_point import within

    response = read_response(file, quantity, unit)
    if band is not None:
        response = within(response, *read_ends("--band", band), str(file))
    found = find_modes(response, count)
    result = CommandResult(
        "lathesim-modes/1", _modes_data(found, response), _modes_lines(found, response), lambda: _modes_figure(file.name, found, response)
    )
    return write(result, as_json, save)


def _modes_figure(name: str, found: FoundModes, response: FrequencyResponse) -> Any:
    from lathesim.analysis.stability_figures import response_figure

    return response_figure(
        f"Modes of {name}",
        response.frequency,
        response.receptance_values,
        model=found.model.response(response.frequency),
        coherence=response.coherence,
        modes=[mode.frequency.value for mode in found.modes],
    )


def _modes_data(found: FoundModes, response: FrequencyResponse) -> dict[str, Any]:
    return {
        "modes": [{"frequency_hz": mode.frequency, "damping": mode.damping, "stiffness_n_per_m": mode.stiffness} for mode in found.modes],
        "outside_band_hz": [mode.frequency.value for mode in found.outside],
        "decided_on": found.decided_on,
        "held_out_misfit": [{"modes": count, "misfit": misfit} for count, misfit in found.held_out],
        "findings": response.findings,
    }


def _modes_lines(found: FoundModes, response: FrequencyResponse) -> Iterator[str]:
    from lathesim.units import from_si, in_unit

    yield from map(sentence, response.findings)
    yield f"{'frequency [Hz]':>26}{'damping [%]':>24}{'stiffness [N/m]':>30}   95 % intervals"
    for mode in found.modes:
        f, z, k = mode.frequency, mode.damping, mode.stiffness
        frequency = f"{f.value:>12.3f} +-{(f.high - f.low) / 2:>10.4f}"
        damping = f"{from_si(z.value, '%'):>12.4f} +-{from_si((z.high - z.low) / 2, '%'):>8.4f}"
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

    return CommandResult("lathesim-couple/1", _couple_data(loaded, rows), lines(), lambda: _couple_figure(loaded, asked, band is not None))


def _couple_figure(loaded: ToolAssembly, asked: Any, is_uncertain: bool) -> Any:
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


def _couple_data(loaded: ToolAssembly, rows: list[dict[str, Any]]) -> dict[str, Any]:
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

    return CommandResult("lathesim-couple/1", _couple_data(artefact, _rows(tip.frequency, share)), lines())


def _overhangs(loaded: ToolAssembly, lengths: list[float]) -> CommandResult:
    from lathesim.stability.assembly_file import overhangs

    rows = [
        {
            "overhang_m": item.length,
            "peak_hz": item.peak_frequency,
            "peak_m_per_n": item.peak,
            "lowest_real_m_per_n": item.lowest_real,
            "lowest_real_hz": item.lowest_frequency,
        }
        for item in overhangs(loaded, lengths)
    ]

    def lines() -> Iterator[str]:
        yield f"{loaded.title}: the tip over the length of its first part\n"
        yield from table(_LENGTHS, [tuple(row.values()) for row in rows])

    return CommandResult("lathesim-overhang/1", {"model": loaded.model, "rows": rows}, lines())
