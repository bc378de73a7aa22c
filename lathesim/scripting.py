"""What ``import lathesim as ls`` offers in Python: the functions that the commands call, for a script or a notebook.

Errors are :class:`lathesim.errors.LatheSimError`, whose text is the message of the command.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.metric import Measured
from lathesim.analysis.metric import measure as measured
from lathesim.diagnosis.comparison.compare import Comparison, load_recording
from lathesim.diagnosis.comparison.compare import compare as compared
from lathesim.diagnosis.diagnose import ask
from lathesim.diagnosis.diagnose import diagnose as answered
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.errors import LessonError, RecordError
from lathesim.identification.execution import Deadline
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.lessons.sweep_executors import run_here
from lathesim.lessons.sweep_runs import Members
from lathesim.lessons.sweep_table import default_metrics, grid, read_range, values_at
from lathesim.live.stepped_machine import SteppedMachine, axes_of
from lathesim.plugins import Registry
from lathesim.record import FloatArray, Record, frame, load
from lathesim.record_writer import save
from lathesim.units import quantity
from lathesim.workspace import load_with_workspace

__all__ = ["Lesson", "Machine", "Record", "Swept", "compare", "diagnose", "lesson", "load", "measure", "save", "sweep"]

LessonName = Lesson | str | Path
"""A lesson, its file, its name (``01_contour_error``) or its number (``01``)."""


def lesson(name: str | Path) -> Lesson:
    """Return a lesson by its file, its name (``"01_contour_error"``) or its number (``"01"``).

    ``lesson.variants`` names its cases and ``lesson.text`` is its YAML. ``lesson.run(variant="I")`` simulates one and returns its record.
    Raises :class:`lathesim.errors.LessonError` where there is no such lesson, with the nearest name, or where its file is at fault.
    """
    return load_lesson(name)


def measure(record: Record, *names: str) -> dict[str, Measured]:
    """Return the metrics of a record by name, each with ``value`` and SI ``unit``: those named, or all that it has.

    Raises :class:`lathesim.errors.RecordError` where a named metric has no value, with the reason.
    """
    registry = _registry()
    found = measured(record, {name: registry.metric(name) for name in names} if names else registry.metrics)
    for name in names:
        if name not in found.values:
            raise RecordError(found.skipped[name], place=name)
    return found.values


def compare(lesson: LessonName, recording: str | Path, *, variant: str | None = None) -> Comparison:
    """Return how far a recording and the simulation of a lesson are apart; nothing but the start of the motion is fitted.

    The lesson says in ``recordings:`` what the columns of the file mean. The result holds, each with the worst first:

    - ``channels``: error (``rms``, in ``unit``) and noise (``floor``) of each channel, as it was ``recorded`` and ``simulated``;
    - ``suspects``: the parts in which the error arises when every part gets its recorded inputs;
    - ``explained_by``: the variables on which the error depends, with the share that each explains.

    The command is ``lathesim compare LESSON RECORDING``.
    """
    loaded, registry = _loaded(lesson), _registry()
    return compared(loaded.name, *load_recording(loaded, Path(recording), registry, variant))


def diagnose(
    lesson: LessonName,
    recording: str | Path,
    *,
    validate: str | Path | None = None,
    before: str | Path | None = None,
    variant: str | None = None,
    effects: Sequence[str] = (),
    at_most: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Return the physics that a lesson left out, found in a recording.

    Example::

        answer = ls.diagnose("case_1/lesson.yaml", "case_1/recording.csv", validate="case_1/validate.csv")
        print(answer.sentence)

    The lesson says in ``recordings:`` what the columns of the file mean, and in ``uncertain:`` how sure its values are.

    - ``recording``: the file to which effects, such as friction, are fitted.
    - ``validate``: the file that judges them. By default, the second half of ``recording`` judges.
    - ``before``: a recording from before the machine changed. The answer then names the change.
    - ``effects``: names of the effects to try. By default, all are tried.
    - ``at_most``: a limit of the time, such as "2 min". Without one, an answer takes about a minute.
    - ``progress``: a function that is called with a line of text at each step.

    The answer holds:

    - ``sentence``: the answer in one sentence;
    - ``verdict``: "named", "tied", "parameters_only", "no_mismatch", "unknown" or "recording_fault";
    - ``effects``: the effects found, each with ``effect``, ``at``, ``parameters`` (size and 95 % interval in SI) and ``probability``;
    - ``complete``: whether the search came to its end.

    The command ``lathesim diagnose LESSON RECORDING`` also writes a report.
    """
    deadline = Deadline() if at_most is None else Deadline.after(quantity(at_most, "s"))
    loaded, registry = _loaded(lesson), _registry()
    candidates: Any = [registry.effect(name) for name in effects] if effects else list(registry.effects.values())
    case = load_case(loaded, [Path(file) for file in (recording, validate, before) if file is not None], registry, variant=variant)
    question = ask(loaded.title, case.machine, case.recordings, candidates, changed=before is not None)
    return answered(replace(question, ends=deadline), progress)


@dataclass(frozen=True, eq=False)
class Swept:
    """The runs of a sweep as columns: ``columns`` (runs,) by name, first the varied parameters, then the metrics.

    ``units`` gives the unit of each column. A metric that a run does not have is NaN, and ``status`` (runs,) says why.
    """

    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    status: tuple[str, ...]

    def __getitem__(self, name: str) -> FloatArray:
        return self.columns[name]

    def to_pandas(self) -> Any:
        """Return the runs as a ``pandas.DataFrame``, with the units in ``attrs["units"]``."""
        return frame({**self.columns, "status": list(self.status)}, self.units)


def sweep(
    lesson: LessonName,
    vary: Mapping[str, str],
    metrics: Sequence[str] = (),
    *,
    variant: str | None = None,
    set: Mapping[str, str | float] | None = None,
    threads: int = 0,
) -> Swept:
    """Return a lesson run over all combinations of ranges of its parameters, measured by ``metrics`` (those of its goals by default).

    ``vary`` gives for ``part.parameter`` a range with the number of values, or a list: ``{"x_dac.bits": "8,10,12"}`` or
    ``{"x_controller.proportional+z_controller.proportional": "0.1..0.8 V/mm:8"}``. A ``+`` joins parameters that take the same value.
    ``set`` changes further values, and ``threads`` limits the runs at a time. Metrics are in SI, parameters in the unit that is written.
    The command ``lathesim sweep`` also writes a table that can be continued.
    """
    registry = _registry()
    prepared = prepare(_loaded(lesson), registry, variant, set)
    ranges = [read_range(f"{name}={spread}", prepared) for name, spread in vary.items()]
    points = grid(ranges)
    wanted = {name: registry.metric(name) for name in metrics or default_metrics(prepared)}
    if not wanted:
        raise LessonError("the lesson has no goals.", place=prepared.name, remedy="Name a metric, as in metrics=['max_contour_error'].")
    members = Members(prepared, tuple(name for item in ranges for name in item.names), wanted)
    jobs = [(number, values_at(ranges, point)) for number, point in enumerate(points)]
    made = sorted(run_here(members, jobs, threads), key=lambda member: member.number)
    columns = {item.label: np.array([item.shown[point[place]] for point in points]) for place, item in enumerate(ranges)}
    columns |= {name: np.array([member.metrics[place] for member in made]) for place, name in enumerate(wanted)}
    units = {item.label: item.unit for item in ranges} | {name: metric.unit for name, metric in wanted.items()}
    return Swept(columns, units, tuple(member.status for member in made))


class Machine(SteppedMachine):
    """The simulated machine of a lesson, moved step by step by set-points.

    ``axes`` gives each axis the input that follows it: ``{"x": "x_controller.reference"}``. For names alone, as ``["x", "z"]``, the inputs
    are found. ``advance(set_points)`` takes an array (periods, axes) in the SI units ``axis_units``, and returns one (channels, periods).
    ``signals`` lists the channels with their units, and ``period`` is the sample period [s]. States and time go on from call to call.
    """

    def __init__(
        self,
        lesson: LessonName,
        axes: Mapping[str, str] | Sequence[str],
        *,
        variant: str | None = None,
        set: Mapping[str, str | float] | None = None,
        seed: int | None = None,
        record: Sequence[str] | None = None,
    ) -> None:
        prepared = prepare(_loaded(lesson), _registry(), variant, set)
        super().__init__(prepared, axes_of(prepared, list(axes), axes if isinstance(axes, Mapping) else {}), seed=seed, record=record)


def _loaded(lesson: LessonName) -> Lesson:
    return lesson if isinstance(lesson, Lesson) else load_lesson(lesson)


def _registry() -> Registry:
    """Return the registry with the plug-ins of the workspace; each one at fault is a warning."""
    registry = load_with_workspace()
    for problem in registry.problems:
        warnings.warn(f"Left out: {problem}", stacklevel=3)
    return registry
