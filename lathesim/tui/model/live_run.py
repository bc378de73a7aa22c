"""A run under way: what was simulated so far, how fast it shall go, and its end."""

from __future__ import annotations

import math
import threading
import time as clock
from itertools import count
from pathlib import Path

import numpy as np

from lathesim.engine.run import Attendance, Hints
from lathesim.lessons.kept_run import KeptRun, run_and_keep
from lathesim.lessons.lesson import RUNS_FOLDER, results_folder
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry
from lathesim.record import FloatArray, Record
from lathesim.tui.model.workbench import fault_words
from lathesim.whole_file import write_text

BLOCK_TIME = 0.1
"""Simulated seconds of a block at most: a run at real time is drawn ten times a second."""
_FIRST_ROOM = 4096
_SPEED_KNOWN = 1.0
"""Seconds after which the speed of a run is known."""


def numbered(number: int) -> str:
    """Return the name of a record by its number: ``004.h5``."""
    return f"{number:03d}.h5"


class LiveRun:
    """A case that runs in a thread of its own while screens look on.

    ``pace`` is simulated seconds a second: 1 is real time, 0 as fast as possible; it may be changed while the run goes on.
    :meth:`record` is what was simulated so far; after the end ``kept`` holds the result, or ``fault`` the sentence why there is none.
    ``path`` is the place of the record. If another app takes its number first, the record gets the next free number.
    A ``lesson_text`` is written beside the record.
    """

    def __init__(self, case: Prepared, path: Path, *, lesson_text: str = "", seed: int | None = None, pace: float = 0.0) -> None:
        self.case = case
        self.path = path
        self.seed = seed
        self._lesson_text = lesson_text
        self.kept: KeptRun | None = None
        self.fault = ""
        self._stop = threading.Event()
        self._over = threading.Event()
        self._pace = pace
        self._due_from: tuple[float, float] | None = None
        self._count = 0
        self._begun = math.inf
        expected = round((case.expected_time or 0.0) / case.plan.assembly.sample_period * 1.1) + 2
        self._values: FloatArray = np.empty((len(case.plan.channels) + 1, min(max(expected, _FIRST_ROOM), 4_000_000)))

    @property
    def lesson(self) -> str:
        """The name of the lesson in the student's book; it differs for lessons of one name in several folders."""
        return results_folder(self.case.case.lesson).relative_to(RUNS_FOLDER).as_posix()

    @property
    def is_over(self) -> bool:
        """Whether the run has ended and its result is there."""
        return self._over.is_set()

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self._values[0, self._count - 1]) if self._count else 0.0

    @property
    def share(self) -> float | None:
        """How much of the run is done, 0 to 1; None where its length is unknown."""
        expected = self.case.expected_time
        return min(1.0, self.time / expected) if expected else None

    @property
    def remaining(self) -> float | None:
        """Seconds of the clock until the end; None where the length or the speed of the run is not known, or it takes longer."""
        expected, elapsed = self.case.expected_time, clock.monotonic() - self._begun
        if not expected or elapsed < _SPEED_KNOWN or not 0.0 < self.time < expected or self.is_over:
            return None
        return (expected - self.time) / (self._pace or self.time / elapsed)

    @property
    def pace(self) -> float:
        """Simulated seconds a second; 0 as fast as possible."""
        return self._pace

    @pace.setter
    def pace(self, pace: float) -> None:
        self._pace = pace
        self._due_from = None

    def stop(self) -> None:
        """Ask the run to end; what was simulated is kept."""
        self._stop.set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; False where it did not come in ``timeout`` seconds."""
        return self._over.wait(timeout)

    def record(self) -> Record:
        """Return what was simulated so far as a Record of views, which stay valid; after the end the Record that was kept."""
        if self.kept is not None:
            return self.kept.record
        values, count, plan = self._values, self._count, self.case.plan
        channels = {name: plan.channel(name, values[row + 1, :count]) for row, name in enumerate(plan.channels)}
        return Record(values[0, :count], channels, {"sample_period": plan.assembly.sample_period, "status": "running"})

    def run(self, registry: Registry) -> None:
        """Simulate to the end in this thread, save, measure and judge; never raises for what a person can mend."""
        self._begun = clock.monotonic()
        samples = max(1, round(BLOCK_TIME / self.case.plan.assembly.sample_period))
        further = (self.path.with_name(numbered(number)) for number in count(int(self.path.stem) + 1))
        hints, attended = Hints(often=True, largest_block=samples), Attendance(stop=self._stop, onlooker=self)
        try:
            kept = run_and_keep(self.case, registry, self.path, further=further, seed=self.seed, hints=hints, attended=attended)
            self.path = kept.path
            if self._lesson_text:
                write_text(self.path.with_suffix(".yaml"), self._lesson_text)
            self.kept = kept
        except OSError as error:
            self.fault = f"{self.path}: {error.strerror or error}. The run is not kept."
        except Exception as error:
            self.fault = fault_words(error)
        finally:
            self._over.set()

    def write(self, time: FloatArray, values: FloatArray) -> None:
        """Take a block of the run (the engine calls this) and hold the run back to its pace."""
        end = self._count + len(time)
        if end > self._values.shape[1]:
            larger = np.empty((self._values.shape[0], 2 * end))
            larger[:, : self._count] = self._values[:, : self._count]
            self._values = larger
        self._values[0, self._count : end] = time
        self._values[1:, self._count : end] = values
        self._count = end
        self._keep_pace(float(time[-1]))

    def _keep_pace(self, simulated: float) -> None:
        pace = self._pace
        if pace <= 0.0:
            return
        now = clock.monotonic()
        if self._due_from is None:
            self._due_from = (now, simulated)
        begun, begun_at = self._due_from
        self._stop.wait(max(0.0, begun + (simulated - begun_at) / pace - now))
