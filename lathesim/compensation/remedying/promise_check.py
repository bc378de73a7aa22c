"""What was promised of a remedy held against a recording of the remedied machine."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.compensation.remedying.promise import RECORDED
from lathesim.compensation.remedying.written import ANSWER_FILE, SCHEMA
from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.running.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError
from lathesim.identification.machine.position_loops import loops_of
from lathesim.json_text import parsed_json
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.reading import read_recording


@dataclass(frozen=True)
class Kept:
    """A promise and its result [``unit``]."""

    name: str
    unit: str
    before: float
    low: float
    high: float
    result: float

    @property
    def holds(self) -> bool:
        """Whether the result lies in the promised interval."""
        return self.low <= self.result <= self.high

    @property
    def told(self) -> str:
        """One word for the result."""
        if self.holds:
            return "as promised"
        return "better than promised" if self.result < self.low else "worse than promised: diagnose this recording anew"


def promise_beside(lesson: Lesson) -> dict[str, Any] | None:
    """Return the promise that stands beside a remedied lesson, or none; :class:`LessonError` where the file is something else."""
    file = lesson.path.parent / ANSWER_FILE
    if not file.is_file():
        return None
    try:
        data = parsed_json(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise LessonError("the promise is no JSON file.", place=str(file), remedy="Write it with 'lathesim remedy'.") from None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise LessonError(f"the promise has not the schema {SCHEMA}.", place=str(file), remedy="Write it with 'lathesim remedy'.")
    return data


def kept_promises(lesson: Lesson, recording: Path, registry: Registry, promise: dict[str, Any]) -> list[Kept]:
    """Return each promise that the recording can tell: the deviation of the tables from where the sound machine has them."""
    prepared = prepare(lesson, registry)
    machinery = prepared.machinery
    record = map_recording(read_recording(recording, registry.readers.values()), mapping_of(lesson, machinery)).record
    neutral = {
        f"{part.name}.{name}": value
        for part in machinery.parts
        if issubclass(part.component, (Effect, Remedy))
        for name, value in part.component.neutral.items()
    }
    sound = run(wire(replace(machinery, record=None)), duration=prepared.duration, seed=prepared.case.seed, overrides=neutral)
    found = []
    for loop in loops_of(machinery):
        if loop.table not in record:
            continue
        off = record[loop.table] - np.interp(record.time, sound.time, sound[loop.table])
        results = {"rms_deviation": float(np.sqrt(np.mean(off * off))), "largest_deviation": float(np.max(np.abs(off)))}
        for kind, result in results.items():
            item = promise["promise"].get(f"{RECORDED}{kind} of {loop.table}")
            if isinstance(item, dict) and item.get("low") is not None and item.get("high") is not None:
                found.append(Kept(f"{kind} of {loop.table}", str(item["unit"]), item["before"], item["low"], item["high"], result))
    return found
