"""What the app shows of a lesson's tool point: its response, as tapped, measured or put together, with the modes that were fitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.tool_point.choose_modes import FoundModes, find_modes
from lathesim.stability.tool_point.frequency_response import FrequencyResponse
from lathesim.stability.tool_point.tap_lesson import tap_lesson

_SHOWN = 1.6
"""The response is shown up to so many times the highest mode."""


@dataclass(frozen=True, eq=False)
class ToolPointSeen:
    """Frequencies [Hz], the real part of the response and of the fitted modes [m/N], all (lines,), the command that does the same, and
    what is said of it."""

    frequency: FloatArray
    real: FloatArray
    fitted: FloatArray
    command: str
    words: str


def tool_point_seen(lesson: Lesson) -> ToolPointSeen:
    """Return the tool point of a lesson: modes are tapped with a hammer, a response is read, an assembly is coupled.

    Raises :class:`LessonError` where the lesson has none, and :class:`RecordingError` where nothing stands out of the noise.
    """
    response, command, begun, count = _response(lesson)
    found = find_modes(response, count)
    highest = max(item.frequency.value for item in found.modes)
    shown = response.frequency <= _SHOWN * highest
    frequency = response.frequency[shown]
    return ToolPointSeen(
        frequency,
        response.receptance_values.real[shown],
        found.model.response(frequency).real,
        command,
        f"{begun}\n{_words(found)}",
    )


def _response(lesson: Lesson) -> tuple[FrequencyResponse, str, str, int | None]:
    """Return the response of a tool point, the command that gives it, how it was found, and the number of modes where it is known."""
    entry = lesson.settings.tool_point
    if entry is not None and entry.assembly is not None:
        from lathesim.stability.assembly.assembly_file import load_assembly
        from lathesim.stability.assembly.tip_response import tip_response

        path = lesson.path.parent / entry.assembly
        loaded = load_assembly(path)
        tip = tip_response(loaded)
        size = np.abs(tip.receptance_values)
        # a computed response has no noise, and its peaks are its modes
        peaks = int(np.count_nonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])))
        parts = "1 part" if len(loaded.beams) == 1 else f"{len(loaded.beams)} parts put together"
        return tip, f"lathesim couple {entry.assembly}", f"{loaded.title}: {parts}.", max(1, peaks)
    if entry is not None and entry.response is not None:
        from lathesim.stability.tool_point.read_response import read_response

        measured = read_response(lesson.path.parent / entry.response.file, entry.response.quantity, entry.response.unit)
        return (
            measured,
            f"lathesim modes {entry.response.file}",
            f"Measured from {measured.frequency[0]:.3g} to {measured.highest:.0f} Hz.",
            None,
        )
    tapped = tap_lesson(lesson, lesson.settings.seed)
    out = [f"hit {hit.number}: {hit.reason}" for hit in tapped.hits if hit.reason]
    kept = sum(not hit.reason for hit in tapped.hits)
    said = f"Tapped {len(tapped.hits)} times, {kept} hits kept." + (f" Left out: {'; '.join(out)}." if out else "")
    return tapped.response, f"lathesim tap {lesson.path.stem} --out tap.csv", said, None


def _words(found: FoundModes) -> str:
    rows = []
    for number, item in enumerate(found.modes, 1):
        f, z, k = item.frequency, item.damping, item.stiffness
        reach = [50.0 * (estimate.high - estimate.low) / abs(estimate.value) for estimate in (f, z, k)]
        rows.append(
            f"mode {number}: {f.value:.2f} Hz (+-{reach[0]:.2g} %), damping {100.0 * z.value:.3f} % (+-{reach[1]:.2g} %), "
            f"stiffness {k.value:.4g} N/m (+-{reach[2]:.2g} %)"
        )
    lowest = float(np.min(found.model.response(np.linspace(1.0, 1.6 * found.modes[-1].frequency.value, 4000)).real))
    rows.append(f"The lowest real part, {1e6 * lowest:.3g} um/N, sets the smallest limit.")
    return "\n".join(rows)
