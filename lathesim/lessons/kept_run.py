"""A case that is run and kept: simulated, saved, measured and held against the goals of its lesson, however the run ends."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import cast

from lathesim.analysis.failed_run import nothing_cut, unstable_loop
from lathesim.analysis.metric import Measurements, measure
from lathesim.engine.run import Attendance, Hints
from lathesim.errors import SimulationError
from lathesim.lessons.grading import UNFINISHED, GoalResult, Judgement, judge_run
from lathesim.lessons.lesson import results_folder
from lathesim.lessons.program_path import run_warnings
from lathesim.lessons.simulate import Prepared, run_prepared
from lathesim.plugins import Registry
from lathesim.record import Record
from lathesim.record_writer import save
from lathesim.whole_file import check_place, make_folder, write_new


@dataclass(frozen=True)
class KeptRun:
    """What a run gave: its record and where that stands, what was measured on it, and the goals held against that."""

    case: Prepared
    record: Record
    path: Path
    measurements: Measurements
    judgement: Judgement
    nothing_cut: str
    """A sentence where the run is complete and the tool touched nothing, else empty."""
    failure: str
    """The sentence of what broke, empty where nothing did."""
    warned: tuple[str, ...] = ()
    """What could have been told before the run, see :func:`lathesim.lessons.program_path.run_warnings`."""

    @property
    def goals(self) -> tuple[GoalResult, ...]:
        """The result of each goal."""
        return self.judgement.goals

    @property
    def is_finished(self) -> bool:
        """Whether the run came to its end; only then are its goals judged."""
        return self.judgement.result != UNFINISHED

    @property
    def stopped(self) -> bool:
        """Whether somebody ended the run."""
        return self.record.status.startswith("stopped")


def record_path(case: Prepared, *read: Path | None) -> Path:
    """Return the default place for the record of a case: CASE.h5 in :func:`results_folder`."""
    return results_folder(case.case.lesson, *read) / f"{case.name}.h5"


def run_and_keep(
    case: Prepared,
    registry: Registry,
    path: Path,
    *,
    further: Iterable[Path] | None = None,
    engine: str | None = None,
    seed: int | None = None,
    hints: Hints | None = None,
    attended: Attendance | None = None,
) -> KeptRun:
    """Run a case, save its record at ``path`` and return it measured and judged; see :func:`lathesim.lessons.simulate.run_prepared`.

    With ``further`` places nothing is replaced: the record goes to the first free place of ``path`` and these.

    The place is checked before the run. Raises :class:`WriteError` if it cannot be written. A law that breaks is reported in ``failure``
    with the data up to then kept; :class:`SimulationError` is raised only where there are none.
    """
    make_folder(path.parent)
    check_place(path)
    failure = ""
    try:
        record = run_prepared(case, engine=engine, seed=seed, hints=hints or Hints(often=True), attended=attended)
    except SimulationError as error:
        if error.record is None:
            raise
        record = cast("Record", error.record)
        failure = str(error)
    if further is not None:
        path = write_new(chain((path,), further), lambda part: save(record, part))
    else:
        save(record, path)
    measurements = measure(record, registry.metrics)
    judgement = judge_run(case.case.lesson.settings.goals, measurements, record.status, unstable_loop(record))
    told = nothing_cut(record) if record.status == "complete" else ""
    return KeptRun(case, record, path, measurements, judgement, told, failure, run_warnings(case.case, case.plan))
