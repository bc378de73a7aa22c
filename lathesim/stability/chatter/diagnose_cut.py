"""A recorded cut to its diagnosis: what the vibration is, when it could be told, which second cut decides, and which speeds are worth
trying."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lathesim.stability.chatter.first_sign import first_sign
from lathesim.stability.chatter.judge import Judged, judge, judge_line
from lathesim.stability.chatter.recorded_cut import RecordedCut
from lathesim.stability.chatter.signal_lines import Vibration, vibration, within_band
from lathesim.stability.chatter.thresholds import GROWTH, LINES

_CHATTER = ("hopf", "flip")


@dataclass(frozen=True, eq=False)
class CutDiagnosis:
    """What a vibration is, the vibration itself, what it cannot be, the cut that decides between what is left, speeds [rpm] worth trying,
    when
    chatter could be told [s] and the amplitude there over the largest."""

    judged: Judged
    vibration: Vibration
    cannot_be: tuple[str, ...]
    second_cut: str
    speeds: tuple[float, ...]
    told_at: float = math.nan
    told_share: float = math.nan
    findings: tuple[str, ...] = field(default=())


def diagnose_cut(
    cut: RecordedCut, modes: tuple[float, ...] = (), other: RecordedCut | None = None, band: tuple[float, float] | None = None
) -> CutDiagnosis:
    """Return the diagnosis of a cut; ``modes`` are natural frequencies [Hz] of its tool point, ``other`` is a cut at another speed.

    With a ``band`` [Hz] only what is in it is judged.
    """
    found = vibration(cut.values, cut.rate, cut.turning)
    if band is not None:
        found = within_band(found, *band)
    quiet = None
    if len(cut.before) * cut.turning / cut.rate >= LINES.fewest_turns and np.ptp(cut.before) > 0.0:
        quiet = vibration(cut.before, cut.rate, cut.turning)
    judged = judge(found, modes, quiet) if band is None else judge_line(found, modes)
    if other is not None:
        judged = _with_second(judged, found, vibration(other.values, other.rate, other.turning))
    told_at, told_share = _told(cut, judged, found)
    return CutDiagnosis(
        judged,
        found,
        _cannot_be(judged, found),
        _second_cut(judged, found),
        _speeds(judged, found, modes),
        told_at,
        told_share,
        cut.findings,
    )


def _with_second(judged: Judged, first: Vibration, second: Vibration) -> Judged:
    """Return the judgement after a second cut at another speed: what moves with the speed is forced or segmentation, what stays is not."""
    line = judged.line
    ratio = second.turning / first.turning
    if line is None or abs(ratio - 1.0) < 2.0 * LINES.moved or judged.kind in ("stable", "entry"):
        return judged
    reach = max(LINES.moved * line.frequency, line.width * line.resolution, 2.0 * line.resolution)
    moved = any(abs(item.frequency - ratio * line.frequency) < reach for item in second.lines)
    stayed = any(abs(item.frequency - line.frequency) < 4.0 * reach and item.share > 1e-3 for item in second.lines)
    if moved and not stayed and judged.kind in ("hopf", "segmentation"):
        told = f"at {60 * second.turning:.0f} rpm the line is at {ratio * line.frequency:.1f} Hz: it moves with the speed"
        return Judged("segmentation", line, judged.mode, (*judged.reasons, told))
    if stayed and not moved and judged.kind in ("hopf", "segmentation"):
        told = f"at {60 * second.turning:.0f} rpm the line stays near {line.frequency:.1f} Hz: it belongs to a mode"
        return Judged("hopf" if not line.is_wide else "segmentation", line, judged.mode, (*judged.reasons, told))
    return judged


def _told(cut: RecordedCut, judged: Judged, found: Vibration) -> tuple[float, float]:
    """Return from which time on [s] chatter could be told, and how large it was then over its largest; nan for what is no chatter."""
    if judged.kind not in _CHATTER or judged.line is None:
        return math.nan, math.nan
    mean = abs(float(np.mean(cut.values))) if found.modulation > 0.0 else 0.0
    sign = first_sign(found.values, cut.rate, found.turning, mean)
    return (sign.time, sign.share) if sign is not None else (len(cut.values) / cut.rate, 1.0)


def _cannot_be(judged: Judged, found: Vibration) -> tuple[str, ...]:
    """Return what the deciding line cannot be, each with its reason."""
    line = judged.line
    if line is None:
        return ()
    said = []
    part = abs(line.order - round(line.order))
    if judged.kind not in ("forced", "entry"):
        if line.is_wide:
            said.append(f"forced vibration: a line {line.width * line.resolution:.0f} Hz wide is no order of the spindle")
        elif part > LINES.not_whole:
            said.append(f"forced vibration: order {line.order:.2f} is no whole number")
    if judged.kind != "mains" and line.is_wide:
        said.append("mains hum: that is narrow")
    elif judged.kind != "mains":
        said.append(f"mains hum: {line.frequency:.1f} Hz is no steady multiple of 50 or 60 Hz")
    if judged.kind not in _CHATTER and judged.runner_up not in _CHATTER:
        said.append("chatter that has set in: that is narrow and grows" if line.is_wide else "chatter: that is at no whole order and grows")
    elif line.is_wide and judged.kind not in _CHATTER:
        said.append("chatter that has set in: that would be one narrow line")
    if judged.kind in ("hopf", "flip") and line.late >= GROWTH.grew:
        said.append("segmentation: that is there in full from the first turn on")
    return tuple(said)


def _second_cut(judged: Judged, found: Vibration) -> str:
    line = judged.line
    speed = 60.0 * found.turning
    if judged.kind == "stable" or line is None:
        return ""
    faster = 1.1 * speed
    if judged.kind in ("hopf", "flip", "segmentation"):
        moved, stays = 1.1 * line.frequency, line.frequency
        return (
            f"The same cut at {faster:.0f} rpm: a line that moves to {moved:.0f} Hz goes with the chip or the spindle, one that stays near "
            f"{stays:.0f} Hz belongs to a mode. Half the width at {speed:.0f} rpm: chatter then vanishes, the others halve."
        )
    if judged.kind == "forced":
        return f"The same cut at {faster:.0f} rpm: forced vibration moves by 10 %, and is large where an order meets a mode."
    if judged.kind == "mains":
        return "The machine with the spindle stopped: hum stays."
    return f"The same cut at {faster:.0f} rpm: a resonance stays at {line.frequency:.0f} Hz."


def _speeds(judged: Judged, found: Vibration, modes: Sequence[float]) -> tuple[float, ...]:
    """Return speeds [rpm] at which a whole number of vibrations of the mode fits into a turn, from half to twice the present speed.

    At them the waves of two turns are in step, so that the chip keeps its thickness: the gaps between the lobes.
    """
    if judged.kind not in _CHATTER or judged.line is None:
        return ()
    natural = modes[judged.mode - 1] if judged.mode else judged.line.frequency / 1.02
    speed = 60.0 * found.turning
    found_speeds = [60.0 * natural / count for count in range(1, 200)]
    near = [value for value in found_speeds if 0.5 * speed <= value <= 2.0 * speed]
    return tuple(sorted(near, key=lambda value: abs(math.log(value / speed)))[:4])
