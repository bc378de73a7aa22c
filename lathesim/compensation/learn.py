"""``learn``: laps with corrections that each lap's errors improve, stopped where nothing is left to learn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.compensation.lap_response import Filter
from lathesim.compensation.laps import Course, Lap
from lathesim.engine.assembly import FloatArray, Place
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.part_values import table_text
from lathesim.lessons.simulate import Prepared
from lathesim.units import in_unit
from lathesim.whole_file import WholeFiles, make_folder

Tell = Callable[[str], None]
_PARTS = 12.0
"""Square of a level over the variance of what rounding to it adds."""
_WORST_OF = 4.0
"""Standard deviations that the largest of some thousand samples lies away."""
_NO_BETTER = 0.97
"""Share of the error of the lap before to which a lap must bring it."""
_DIVERGED = 3.0
"""Times the first lap's error from which on the learning diverges."""


@dataclass(frozen=True)
class Learning:
    """The laps (the first without correction), the best of them, its corrections, the filter, and why it stopped.

    ``floor`` is the tracking error [m] that rounding by converter and encoder leaves, whatever is learned.
    """

    laps: tuple[Lap, ...]
    best: int
    corrections: FloatArray
    filter: Filter
    floor: float
    why: str
    never: float = 0.0
    """Root mean square of what the low-pass never learns [m]."""

    @property
    def predicted(self) -> list[float]:
        """The upper bound of each lap's error [m]:  bound * error of the previous lap + error that is never learned + 2 floor.

        The floor counts twice: rounding acts in the lap itself and in the errors of the previous lap.
        """
        return [self.filter.bound * lap.rms + self.never + 2.0 * self.floor for lap in self.laps[:-1]]

    @property
    def contractions(self) -> list[float]:
        """The error of each lap over that of the lap before."""
        return [after.rms / before.rms for before, after in zip(self.laps, self.laps[1:], strict=False)]


def learn(course: Course, chosen: Filter, laps: int, *, on: str = "axis", tell: Tell = lambda text: None) -> Learning:
    """Run up to ``laps`` laps with corrections after the first; ``on`` is "axis", or "contour" to learn from the part across the path.

    It stops where a lap is no better and the floor is near, or where it diverges; the best lap's corrections are kept.
    """
    corrections = np.zeros((len(course.loops), course.samples))
    level, count = course.floors()
    floor = float(np.hypot(level * chosen.answer, count) * np.sqrt(len(course.loops) / _PARTS))
    done = [course.lap(corrections)]
    kept = [corrections]
    why = f"all {laps} laps are run"
    for number in range(1, laps + 1):
        errors = done[-1].errors
        if on == "contour":
            errors = course.across(errors, kept[-1])
        corrections = chosen.applied(kept[-1], errors)
        lap = course.lap(corrections)
        tell(f"lap {number} of {laps}: largest distance from the path {in_unit(lap.largest, 'mm')}")
        done.append(lap)
        kept.append(corrections)
        if not np.isfinite(lap.rms) or lap.rms > _DIVERGED * done[0].rms or lap.rms > _DIVERGED * min(item.rms for item in done):
            why = f"lap {number} is worse than the first by far: the learning diverges"
            break
        if lap.rms > _NO_BETTER * done[-2].rms:
            why = _no_better(number, lap, floor, level, count)
            break
    measure = [lap.largest if on == "contour" else lap.rms for lap in done]
    best = int(np.nanargmin(measure))
    never = float(np.sqrt(np.mean(np.sum(chosen.left_out(done[0].errors) ** 2, axis=0))))
    return Learning(tuple(done), best, kept[best], chosen, floor, why, never)


def _no_better(number: int, lap: Lap, floor: float, level: float, count: float) -> str:
    told = f"lap {number} is no better than the one before"
    if lap.rms > 10.0 * _WORST_OF * max(floor, 1e-15):
        return f"{told}, though the floor of converter and encoder is far below: what is left is not the same in each lap"
    what = f"one level of the converter is {in_unit(level, 'mV', '.3g')}" if level > 0.0 else ""
    fine = f"one count of the encoder {in_unit(count, 'um', '.3g')}" if count > 0.0 else ""
    cause = " and ".join(text for text in (what, fine) if text)
    return f"{told}: {cause}, which alone leaves a tracking error of {in_unit(floor, 'um', '.3g')}" if cause else told


def write_learned(prepared: Prepared, course: Course, learning: Learning, folder: Path) -> list[Path]:
    """Write the lesson with the learned corrections and its tables, all or none, and return the files."""
    make_folder(folder)
    contents: dict[Path, str] = {}
    tables, insert = {}, []
    for place, (loop, table) in enumerate(zip(course.loops, course.tables, strict=True)):
        part = Place.of(table).part
        file = folder / f"{part}.csv"
        unit = next(item for item in course.machinery.parts if item.name == part).component.declarations["samples"].unit
        contents[file] = table_text(("correction",), learning.corrections[place][:, None], unit)
        controller = next(item for item in course.machinery.parts if item.name == loop.controller)
        port = controller.component.ports["reading" if course.what == "voltage" else "drive"]
        insert.append({"remedy": "LearnedCorrection", "at": f"{loop.controller}.{port}", "name": part})
        tables[table] = file.name
    case = prepared.case
    lesson = case.lesson
    values = {name: str(given.value) for name, given in case.set.items() if given.place.startswith("--set")}
    before = dict(lesson.source.data.get("tables", {}))
    text = changed_lesson(lesson, insert, values, folder, variant=case.variant, further={"tables": {**before, **tables}})
    with WholeFiles() as whole:
        for file, content in [*contents.items(), (folder / "lesson.yaml", text)]:
            whole.write_text(file, content)
    return [folder / "lesson.yaml", *contents]
