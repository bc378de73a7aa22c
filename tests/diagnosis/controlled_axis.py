"""An axis under cascade control as a small lesson has it, with a run of it as its recording."""

from __future__ import annotations

from pathlib import Path

from lathesim.identification.replay.experiment import Machine
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.small_case import write_lesson

REFERENCE, POSITION, VOLTAGE, CURRENT = "x_controller.reference", "x_encoder.position", "x_controller.voltage", "x_drive.current"


def controlled_axis(folder: Path, compare: tuple[str, ...] = (POSITION, VOLTAGE)) -> tuple[Machine, Record]:
    """Return the machine, of which nothing is uncertain, and a record of the reference and the channels that are compared."""
    prepared = prepare(load_lesson(write_lesson(folder)), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {**{name: run.channels[name] for name in compare}, REFERENCE: asked}, dict(run.meta))
    return Machine(prepared.machinery, (REFERENCE,), compare, {}, {}), record
