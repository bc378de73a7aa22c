"""``lathesim chatter RECORDING``: what the vibration of a recorded cut is."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath

if TYPE_CHECKING:
    from lathesim.stability.diagnose_cut import CutDiagnosis
    from lathesim.stability.recorded_cut import RecordedCut


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--channel", metavar="NAME", help="The column with force, acceleration or sound  [default: the one that vibrates most].")
@click.option("--speed", type=click.FloatRange(min=0.0, min_open=True), metavar="RPM", help="Speed of the spindle.")
@click.option("--tacho", metavar="NAME", help="The column with a pulse a turn, or the angle of the spindle [rad].")
@click.option("--rate", type=click.FloatRange(min=0.0, min_open=True), metavar="HZ", help="Samples a second, where no column is the time.")
@click.option("--lesson", metavar="LESSON", help="A lesson whose 'tool_point:' gives the modes.")
@click.option("--second", type=click.Path(path_type=Path), metavar="FILE", help="The same cut at another speed.")
@click.option("--second-speed", type=click.FloatRange(min=0.0, min_open=True), metavar="RPM", help="Its speed.")
@click.option("--band", metavar="LOW..HIGH", help="Judge only what is between these frequencies [Hz].")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-chatter/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the spectrum with its lines.")
def chatter(
    recording: Path,
    channel: str | None,
    speed: float | None,
    tacho: str | None,
    rate: float | None,
    lesson: str | None,
    second: Path | None,
    second_speed: float | None,
    band: str | None,
    as_json: bool,
    save: Path | None,
) -> None:
    """Name the vibration in RECORDING: chatter, forced vibration, segmentation of the chip, mains hum, or a resonance rung by
    entry.

    It is told by order, width and growth of its lines, and by the modes of --lesson. Where one cut does not decide, a second one is
    proposed; --second takes it into account.
    """
    from lathesim.cli.registry import open_registry
    from lathesim.cli.stability.modes import read_ends
    from lathesim.stability.diagnose_cut import diagnose_cut
    from lathesim.stability.recorded_cut import recorded_cut

    readers = open_registry(()).readers
    cut = recorded_cut(recording, readers, channel=channel, speed=speed, rate=rate, tacho=tacho)
    other = None
    if second is not None:
        other = recorded_cut(second, readers, channel=channel, speed=second_speed, rate=rate, tacho=tacho)
    found = diagnose_cut(cut, _modes(lesson), other, None if band is None else read_ends("--band", band))
    if save is not None:
        _draw(recording, cut, found, save)
    if as_json:
        click.echo(json.dumps(_as_json(cut, found), indent=2))
        return
    _tell(cut, found)
    if save is not None:
        click.echo(f"See {save}")


def _modes(lesson: str | None) -> tuple[float, ...]:
    if lesson is None:
        return ()
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.lesson_cut import cut_of, natural_frequencies

    return natural_frequencies(cut_of(load_lesson(lesson)))


def _draw(recording: Path, cut: RecordedCut, found: CutDiagnosis, save: Path) -> None:
    from lathesim.analysis.plots import save_figure
    from lathesim.analysis.stability_figures import vibration_figure
    from lathesim.stability.judge import WORDS

    lines = [(line.frequency, line.share) for line in found.vibration.lines]
    decided = found.judged.line.frequency if found.judged.line is not None else math.nan
    title = f"{recording.name}, {cut.name}: {WORDS[found.judged.kind]}"
    save_figure(vibration_figure(title, found.vibration.values, cut.rate, found.vibration.turning, lines, decided), save)


def _as_json(cut: RecordedCut, found: CutDiagnosis) -> dict[str, Any]:
    judged = found.judged
    return {
        "schema": "lathesim-chatter/1",
        "channel": cut.name,
        "speed_rpm": 60.0 * found.vibration.turning,
        "kind": judged.kind,
        "could_also_be": judged.runner_up or None,
        "frequency_hz": None if judged.line is None else judged.line.frequency,
        "order": None if judged.line is None else judged.line.order,
        "mode": judged.mode or None,
        "reasons": list(judged.reasons),
        "cannot_be": list(found.cannot_be),
        "second_cut": found.second_cut,
        "speeds_worth_trying_rpm": list(found.speeds),
        "told_at_s": found.told_at if math.isfinite(found.told_at) else None,
        "amplitude_when_told": found.told_share if math.isfinite(found.told_share) else None,
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
        "findings": list(found.findings),
    }


def _tell(cut: RecordedCut, found: CutDiagnosis) -> None:
    from lathesim.stability.judge import WORDS

    judged = found.judged
    for sentence in found.findings:
        click.echo(f"{sentence}.")
    click.echo(f"{cut.name} at {60.0 * found.vibration.turning:.1f} rpm: {WORDS[judged.kind]}")
    for reason in judged.reasons:
        click.echo(f"  - {reason}")
    if judged.runner_up:
        click.echo(f"It could also be {WORDS[judged.runner_up]}.")
    if found.vibration.lines:
        click.echo(f"\n{'line [Hz]':>10}{'order':>9}{'share':>9}{'wide [Hz]':>11}{'late/early':>12}")
    for line in found.vibration.lines[:8]:
        click.echo(
            f"{line.frequency:>10.2f}{line.order:>9.3f}{100 * line.share:>8.1f}%{line.width * line.resolution:>11.1f}{line.late:>12.2f}"
        )
    for sentence in found.cannot_be:
        click.echo(f"It cannot be {sentence}.")
    if math.isfinite(found.told_at):
        click.echo(
            f"It could be told {found.told_at:.2f} s after the beginning, at {100 * found.told_share:.0f} % of its largest amplitude."
        )
    if found.speeds:
        click.echo("Speeds worth trying: " + ", ".join(f"{speed:.0f}" for speed in found.speeds) + " rpm.")
    if found.second_cut:
        click.echo(f"Which second cut decides: {found.second_cut}")
