"""``lathesim chatter RECORDING``: what the vibration of a recorded cut is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import grouped, json_option, open_registry, option, read_ends, save_option
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.stability.diagnose_cut import CutDiagnosis, RecordedCut


_LINES = 8
"""Lines of the spectrum that are shown."""
_COLUMNS = (
    Heading("line [Hz]", 10, ".2f"), Heading("order", 9, ".3f"), Heading("share", 9, ".1%"), Heading("wide [Hz]", 11, ".1f"),
    Heading("late/early", 12, ".2f"),
)  # fmt: skip


@dataclass(frozen=True)
class CutFileOptions:
    """The file of a recorded cut, and what it does not say."""

    recording: Path
    channel: str | None = option("The column with force, acceleration or sound  [default: the one that vibrates most].", metavar="NAME")
    speed: float | None = option("Speed of the spindle.", type=click.FloatRange(min=0.0, min_open=True), metavar="RPM")
    tacho: str | None = option("The column with a pulse a turn, or the angle of the spindle [rad].", metavar="NAME")
    rate: float | None = option(
        "Samples a second, where no column is the time.", type=click.FloatRange(min=0.0, min_open=True), metavar="HZ"
    )


@dataclass(frozen=True)
class BesideOptions:
    """What a cut is judged beside: modes, a second cut, a band."""

    lesson: str | None = option("A lesson whose 'tool_point:' gives the modes.", metavar="LESSON")
    second: Path | None = option("The same cut at another speed.", metavar="FILE")
    second_speed: float | None = option("Its speed.", type=click.FloatRange(min=0.0, min_open=True), metavar="RPM")
    band: str | None = option("Judge only what is between these frequencies [Hz].", metavar="LOW..HIGH")


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@grouped(file=CutFileOptions)
@grouped(beside=BesideOptions)
@json_option("lathesim-chatter/1")
@save_option("Draw the spectrum with its lines.")
def chatter(file: CutFileOptions, beside: BesideOptions, as_json: bool, save: Path | None) -> int:
    """Name the vibration in RECORDING: chatter, forced vibration, segmentation of the chip, mains hum, or a resonance rung by
    entry.

    It is recognised by order, width and growth of its lines, and by the modes of --lesson. Where one cut does not decide, a second one is
    proposed; --second takes it into account.
    """
    from lathesim.stability.diagnose_cut import diagnose_cut, recorded_cut

    readers = open_registry(()).readers
    cut = recorded_cut(file.recording, readers, channel=file.channel, speed=file.speed, rate=file.rate, tacho=file.tacho)
    other = None
    if beside.second is not None:
        other = recorded_cut(beside.second, readers, channel=file.channel, speed=beside.second_speed, rate=file.rate, tacho=file.tacho)
    found = diagnose_cut(cut, _modes(beside.lesson), other, None if beside.band is None else read_ends("--band", beside.band))
    result = CommandResult("lathesim-chatter/1", _data(cut, found), _lines(cut, found), lambda: _figure(file.recording, cut, found))
    return write(result, as_json, save)


def _modes(lesson: str | None) -> tuple[float, ...]:
    if lesson is None:
        return ()
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.lesson_settings import cut_of, natural_frequencies

    return natural_frequencies(cut_of(load_lesson(lesson)))


def _figure(recording: Path, cut: RecordedCut, found: CutDiagnosis) -> Any:
    from lathesim.analysis.stability_figures import vibration_figure
    from lathesim.stability.judge import WORDS

    lines = [(line.frequency, line.share) for line in found.vibration.lines]
    decided = found.judged.line.frequency if found.judged.line is not None else math.nan
    title = f"{recording.name}, {cut.name}: {WORDS[found.judged.kind]}"
    return vibration_figure(title, found.vibration.values, cut.rate, found.vibration.turning, lines, decided)


def _data(cut: RecordedCut, found: CutDiagnosis) -> dict[str, Any]:
    judged = found.judged
    return {
        "channel": cut.name,
        "speed_rpm": 60.0 * found.vibration.turning,
        "kind": judged.kind,
        "could_also_be": judged.runner_up or None,
        "frequency_hz": None if judged.line is None else judged.line.frequency,
        "order": None if judged.line is None else judged.line.order,
        "mode": judged.mode or None,
        "reasons": judged.reasons,
        "cannot_be": found.cannot_be,
        "second_cut": found.second_cut,
        "speeds_worth_trying_rpm": found.speeds,
        "told_at_s": found.told_at,
        "amplitude_when_told": found.told_share,
        "lines": [
            {
                "frequency_hz": line.frequency,
                "order": line.order,
                "share": line.share,
                "width_hz": line.width * line.resolution,
                "growth_per_s": line.rate,
                "late_over_early": line.late,
            }
            for line in found.vibration.lines
        ],
        "findings": found.findings,
    }


def _lines(cut: RecordedCut, found: CutDiagnosis) -> Iterator[str]:
    from lathesim.stability.judge import WORDS
    from lathesim.units import in_unit

    judged, vibration = found.judged, found.vibration
    yield from (f"{sentence}." for sentence in found.findings)
    yield f"{cut.name} at {60.0 * vibration.turning:.1f} rpm: {WORDS[judged.kind]}"
    yield from (f"  - {reason}" for reason in judged.reasons)
    if judged.runner_up:
        yield f"It could also be {WORDS[judged.runner_up]}."
    if vibration.lines:
        yield ""
        shown = vibration.lines[:_LINES]
        yield from table(_COLUMNS, [(line.frequency, line.order, line.share, line.width * line.resolution, line.late) for line in shown])
    yield from (f"It cannot be {sentence}." for sentence in found.cannot_be)
    if math.isfinite(found.told_at):
        share = in_unit(found.told_share, "%", ".0f")
        yield f"It could be recognised {found.told_at:.2f} s after the beginning, at {share} of its largest amplitude."
    if found.speeds:
        yield "Speeds worth trying: " + ", ".join(f"{speed:.0f}" for speed in found.speeds) + " rpm."
    if found.second_cut:
        yield f"Which second cut decides: {found.second_cut}"
