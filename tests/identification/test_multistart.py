"""Parameters come back from recordings they did not make, with honest errors, and what is not in the recording is said to be missing."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError
from lathesim.identification.estimation.multistart import FitQuestion, ParameterFit, ask_fit, fit_parameters, free_parameters
from lathesim.identification.replay.experiment import build_experiments
from lathesim.identification.replay.loading import at_period
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry
from lathesim.record import Record
from lathesim.record_writer import save
from tests.diagnosis.driven_axis import MASS, VISCOUS, write_recording
from tests.diagnosis.small_case import controlled_axis
from tests.shared_data import SHARED, needs_shared


def fitted(registry: Registry, files: tuple[Path, Path], *names: str, starts: int = 2, closed: bool = False) -> ParameterFit:
    question = ask_fit(load_lesson(files[0]), files[1], registry, names, closed=closed)
    return fit_parameters(question, starts=starts)


def test_mass_and_friction_of_an_axis(registry: Registry, tmp_path: Path) -> None:
    found = fitted(registry, write_recording(tmp_path), "x_axis.mass", "x_axis.viscous", starts=4)
    for item, true in zip(found.parameters, (MASS, VISCOUS), strict=True):
        assert abs(item.value / true - 1.0) < 1e-3
        assert abs(item.value - true) < 4.0 * item.error
        assert item.error < 1e-3 * true
        assert item.determined
    assert found.agreeing == 4
    assert found.undetermined == ()
    channel = found.channels[0]
    assert channel.after < 1.2 * channel.floor < channel.before


def test_a_log_of_every_second_decision_is_held_against_the_loop_at_its_own_rate(tmp_path: Path) -> None:
    """Sampled as the recorder does, the loop would be another one, and the gain that fits another gain."""
    machine, record = controlled_axis(tmp_path)
    channels = {name: dataclasses.replace(channel, values=channel.values[::2]) for name, channel in record.channels.items()}
    slow = Record(record.time[::2], channels)
    assembly, name = at_period(machine.assembly, slow.sample_period), "x_controller.velocity_gain"
    off = {}
    for decisions in (1, 2):
        closed = dataclasses.replace(machine, assembly=assembly, decisions=decisions, replay=False)
        (experiment,) = build_experiments(closed, [("slow", slow)], ())
        (free,) = free_parameters(experiment, [name])
        off[decisions] = abs(fit_parameters(FitQuestion(experiment, (free,)), starts=1).values[name] / free.given - 1.0)
    assert off[2] < 0.01 < off[1]


HELD = """
lesson: A joint that is pushed with less than it takes to break away
machine: torque_spindle
sample_period: 15 ms
step: 0.5 ms
set: {spindle.inertia: 0.1 kg*m^2, spindle.viscous: 0.001 N*m*s/rad, spindle_encoder.resolution: 1e-5 rad}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: torque, unit: N*m, held: true}}
  compare: {spindle_encoder.angle: {column: angle, unit: rad}}
insert:
  - {effect: PreslidingFriction, at: spindle, level: 1 N*m, distance: 3e-4 rad, bristle_damping: 9 N*m*s/rad}
"""


def test_a_friction_that_holds_feels_the_simulated_motion(registry: Registry, tmp_path: Path) -> None:
    """A joint on bristles (LuGre) gives way by a milliradian: fed with the recorded motion, their force would leave the joint free."""
    friction, stiffness, damping, fine, period = 0.9, 2600.0, 9.0, 150, 0.015
    time = period * np.arange(134)
    torque = np.where((time > 0.5) & (time < 1.0), 0.8, 0.0)
    angle, speed, bristle, angles = 0.0, 0.0, 0.0, []
    for pull in torque:
        angles.append(round(angle / 1e-5) * 1e-5)
        for _ in range(fine):
            bending = speed - stiffness * abs(speed) / friction * bristle
            speed += period / fine * (pull - stiffness * bristle - damping * bending) / 0.1
            bristle += period / fine * bending
            angle += period / fine * speed
    columns = np.column_stack([time, torque, angles])
    np.savetxt(tmp_path / "log.csv", columns, delimiter=",", header="t,torque,angle", comments="")
    (tmp_path / "lesson.yaml").write_text(HELD, encoding="utf-8")
    found = fitted(registry, (tmp_path / "lesson.yaml", tmp_path / "log.csv"), "spindle_presliding_friction.level")
    (level,) = found.parameters
    assert level.value == pytest.approx(friction, rel=0.05)
    assert found.channels[0].after < 3e-4


def test_errors_cover_the_truth(registry: Registry, tmp_path: Path) -> None:
    pulls = []
    for seed in range(8):
        found = fitted(registry, write_recording(tmp_path, seed=seed, count=1500), "x_axis.mass", "x_axis.viscous", starts=1)
        pulls += [(item.value - true) / item.error for item, true in zip(found.parameters, (MASS, VISCOUS), strict=True)]
    assert 0.6 < float(np.sqrt(np.mean(np.square(pulls)))) < 1.6


def test_only_a_product_is_determined(registry: Registry, tmp_path: Path) -> None:
    found = fitted(registry, write_recording(tmp_path), "x_drive.conductance", "x_drive.effort_constant", "x_axis.mass", "x_axis.viscous")
    assert "The recording determines only a combination of x_drive.conductance and x_drive.effort_constant." in found.undetermined
    assert not any(item.determined for item in found.parameters)


def test_two_drags_on_one_axis_are_one(registry: Registry, tmp_path: Path) -> None:
    found = fitted(registry, write_recording(tmp_path), "x_axis.viscous", "x_drive.back_emf", "x_axis.mass")
    assert found.undetermined == ("The recording determines only a combination of x_axis.viscous and x_drive.back_emf.",)
    assert [item.determined for item in found.parameters] == [False, False, True]


def test_two_values_that_go_together_are_named(registry: Registry, tmp_path: Path) -> None:
    found = fitted(registry, write_recording(tmp_path), "x_axis.mass", "x_axis.viscous", "x_drive.conductance")
    assert found.undetermined == ("The recording determines only a combination of x_axis.mass, x_axis.viscous and x_drive.conductance.",)


def test_a_value_that_is_zero_at_first(registry: Registry, tmp_path: Path) -> None:
    found = fitted(registry, write_recording(tmp_path), "x_axis.speed", "x_axis.travel", "x_axis.mass", "x_axis.viscous")
    assert abs(found.values["x_axis.speed"]) < 1e-4
    assert abs(found.values["x_axis.travel"]) < 1e-6
    assert abs(found.values["x_axis.mass"] / MASS - 1.0) < 1e-3


def test_bounds_are_kept(registry: Registry, tmp_path: Path) -> None:
    files = write_recording(tmp_path)
    text = files[0].read_text(encoding="utf-8").replace("x_drive.back_emf: 0 V*s/m", "x_drive.back_emf: 1 V*s/m")
    files[0].write_text(text.replace("300 N*s/m", f"{VISCOUS + 20.0} N*s/m"), encoding="utf-8")
    found = fitted(registry, files, "x_drive.back_emf", "x_axis.mass", starts=1)
    assert found.values["x_drive.back_emf"] == 0.0


REFUSED = {
    "x_axis.mas": "--free: no compared channel depends on a parameter 'x_axis.mas'. Did you mean 'x_axis.mass'?",
    "x_axis.force": "--free: x_axis.force is an input, and parameters and states are fitted.",
    "x_scale.resolution": "--free: no compared channel depends on x_scale.resolution. Compare more channels, or leave it out.",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_fitted(name: str, registry: Registry, tmp_path: Path) -> None:
    with pytest.raises(LatheSimError) as refused:
        fitted(registry, write_recording(tmp_path), name)
    assert str(refused.value).startswith(REFUSED[name])


PROGRAM = """\
(Four passes of different feed, depth and speed)
N10 G90 G95 G71 G18
N20 G97 S1200 M03
N30 G00 X17.0 Z13.0
N40 G01 Z25.0 F0.2
N50 X19.0
N60 G00 Z13.0
N65 S900
N70 X16.5
N80 G01 Z25.0 F0.1
N90 X19.0
N100 G00 Z13.0
N105 S1500
N110 X15.0
N120 G01 Z25.0 F0.15
N130 X19.0
N135 G00 Z13.0
N136 S700
N137 X14.2
N138 G01 Z25.0 F0.3
N139 X19.0
N140 G00 Z0.0
N150 X0.0 M05
N160 M30
"""
LATHE = """\
lesson: Axes and force of a lathe
machine: two_axis_lathe
program: passes.nc
recordings:
  time: {column: time, unit: s}
  drive: {x_axis.voltage: {column: x_dac.voltage, unit: V}, z_axis.voltage: {column: z_dac.voltage, unit: V}}
  compare:
    x_encoder.position: {column: x_encoder.position, unit: m, resolution: 1 um}
    z_encoder.position: {column: z_encoder.position, unit: m, resolution: 1 um}
    dynamometer_adc.reading: {column: dynamometer_adc.reading, unit: N}
"""
EIGHT = [f"{axis}_axis.{item}" for axis in "xz" for item in ("gain", "time_constant")]
EIGHT += ["cutting_force.cutting_pressure", *(f"cutting_force.cutting_{item}_exponent" for item in ("feed", "depth", "speed"))]


def write_lathe(folder: Path, registry: Registry) -> tuple[Path, Path]:
    """Record the closed loop of the lathe: converters of 8 and 12 bits, encoders of 1 um, and noise before they round."""
    (folder / "passes.nc").write_text(PROGRAM, encoding="utf-8")
    (folder / "lathe.yaml").write_text(LATHE, encoding="utf-8")
    run = run_prepared(prepare(load_lesson(folder / "lathe.yaml"), registry, None, {"dynamometer.noise": "3 mV"}), engine="compiled")
    kept = ("x_dac.voltage", "z_dac.voltage", "dynamometer_adc.reading")
    rng = np.random.default_rng(3)
    record: Record = dataclasses.replace(run, channels={name: run.channels[name] for name in kept})
    for axis in "xz":
        measured = np.round((run[f"{axis}_axis.position"] + 0.5e-6 * rng.standard_normal(len(run))) / 1e-6) * 1e-6
        record = record.with_channel(f"{axis}_encoder.position", "m", measured)
    save(record, folder / "run.h5")
    return folder / "lathe.yaml", folder / "run.h5"


@pytest.mark.slow
def test_eight_parameters_of_axes_and_force_from_one_recording(registry: Registry, tmp_path: Path) -> None:
    lesson, recording = write_lathe(tmp_path, registry)
    question = ask_fit(load_lesson(lesson), recording, registry, EIGHT)
    fit_parameters(question, starts=1)  # compiles, where nobody has yet
    found = fit_parameters(question, starts=4)
    assert found.runs <= 4 * 160  # the seconds that they take depend on the machine
    assert found.agreeing == 4
    assert found.undetermined == ()
    for item in found.parameters:
        assert abs(item.value - item.given) < 3.0 * item.error < 0.021 * abs(item.given), item
        assert abs(item.value / item.given - 1.0) < 0.01, item


@needs_shared
@pytest.mark.slow
def test_a_real_axis(registry: Registry, tmp_path: Path) -> None:
    text = (Path(__file__).parents[1] / "diagnosis" / "lessons" / "emps.yaml").read_text(encoding="utf-8")
    lesson = tmp_path / "emps.yaml"
    lesson.write_text(
        text + "insert: [{effect: CoulombFriction, at: x_axis, level: 15 N}, {effect: ForceOffset, at: x_axis}]\n", encoding="utf-8"
    )
    names = ("x_axis.mass", "x_axis.viscous", "x_axis_coulomb_friction.level", "x_axis_force_offset.offset")
    found = fitted(registry, (lesson, SHARED / "data" / "emps" / "DATA_EMPS.mat"), *names, starts=4)
    assert found.agreeing == 4
    assert found.values["x_axis.mass"] == pytest.approx(95.1089, rel=0.01)
    assert found.values["x_axis_force_offset.offset"] == pytest.approx(-3.1648, rel=0.03)
    friction = found.values["x_axis.viscous"] * 0.1 + found.values["x_axis_coulomb_friction.level"]
    assert friction == pytest.approx(203.5034 * 0.1 + 20.3935, rel=0.02)
