"""A lesson that is quick to run: an axis under cascade control that goes out and back a few times, with the recordings it maps."""

from pathlib import Path

from lathesim.identification.replay.experiment import RecordedMachine
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record

REFERENCE, POSITION, VOLTAGE, CURRENT = "x_controller.reference", "x_encoder.position", "x_controller.voltage", "x_drive.current"

PROGRAM = """\
(Out and back at three speeds)
G21 G90 G94 G18
G04 P0.1
G01 X4.0 F1200
X1.0
X13.0 F3000
X2.0
X20.0 F4800
X0.0
G04 P0.1
M02
"""
LESSON = """\
lesson: A small axis
machine: cascade_axis
dialect: linuxcnc
program: small.nc
duration: {duration}
add:
  exercise: {{component: ConstantAccelerationInterpolator, set: {{acceleration: 2 m/s^2}}}}
wires: {{x_controller.reference: exercise.x_reference}}
recordings:
  time: {{column: t, unit: ms}}
  drive: {{x_controller.reference: {{column: asked, unit: mm}}}}
  compare:
    x_encoder.position: {{column: motor, unit: mm, resolution: 50 nm}}
    x_controller.voltage: {{column: voltage, unit: V, scale: 2.0}}
uncertain: {{x_axis.mass: 3 %, x_axis.viscous: 10 %}}
"""


def write_lesson(folder: Path, duration: str = "2.2 s", extra: str = "") -> Path:
    """Write the lesson and its part program into a folder and give the lesson's file."""
    (folder / "small.nc").write_text(PROGRAM, encoding="utf-8")
    path = folder / "small.yaml"
    path.write_text(LESSON.format(duration=duration) + extra, encoding="utf-8")
    return path


def controlled_axis(folder: Path, compare: tuple[str, ...] = (POSITION, VOLTAGE)) -> tuple[RecordedMachine, Record]:
    """Return the machine, of which nothing is uncertain, and a record of the reference and the channels that are compared."""
    prepared = prepare(load_lesson(write_lesson(folder)), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {**{name: run.channels[name] for name in compare}, REFERENCE: asked}, dict(run.meta))
    return RecordedMachine(prepared.machinery, (REFERENCE,), compare, {}, {}), record
