"""A replay knows what converters rounded, and how fast a feed drive went between the counts of its encoder."""

from dataclasses import replace

import numpy as np
import pytest

from lathesim.components.axes import EmpiricalAxis
from lathesim.components.converters import ADConverter, DAConverter
from lathesim.components.sensors import LinearEncoder, Tachometer
from lathesim.components.servo_controllers import SpindleController
from lathesim.components.spindles import EmpiricalSpindle
from lathesim.diagnosis.location.missing_force import passed_through
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.replay import experiment as problem
from lathesim.identification.replay.converter_rounding import plain_replay
from lathesim.identification.replay.experiment import Experiment, Machine
from lathesim.identification.replay.measured_motion import counted_motion
from lathesim.identification.replay.open_loop import drive
from lathesim.record import Record

PERIOD, SAMPLES = 5e-3, 2000
REFERENCE, SPEED = "controller.reference", "spindle.speed"


def spindle() -> Assembly:
    """Return a spindle whose speed is read in steps of 20 rpm."""
    parts = (
        Part("tachometer", Tachometer),
        Part("adc", ADConverter.with_units({"signal": "rad/s"}), {"bits": 10.0}),
        Part("controller", SpindleController),
        Part("dac", DAConverter, {"bits": 12.0}),
        Part("spindle", EmpiricalSpindle),
    )
    fed = {
        "tachometer.speed": SPEED, "adc.voltage": "tachometer.voltage", "adc.sensor_gain": "tachometer.gain",
        "controller.measured": "adc.reading", "dac.command": "controller.voltage", "spindle.voltage": "dac.voltage",
    }  # fmt: skip
    wires = (Wire(REFERENCE, constant=0.0), *[Wire(target, source) for target, source in fed.items()])
    return Assembly(parts, wires, PERIOD, 0.5 * PERIOD, record=(SPEED,))


def test_what_a_converter_rounds_does_not_add_up_in_an_integral(monkeypatch: pytest.MonkeyPatch) -> None:
    time = PERIOD * np.arange(SAMPLES)
    asked = 100.0 + 10.0 * np.sign(np.sin(0.9 * time)) + 3.0 * np.sin(2.3 * time)
    made = run(wire(drive(spindle(), {REFERENCE: asked})), duration=(SAMPLES - 1) * PERIOD)
    record = Record(time, {}, {}).with_channel(SPEED, "rad/s", made[SPEED]).with_channel(REFERENCE, "rad/s", asked)
    experiment = Experiment(Machine(spindle(), (REFERENCE,), (SPEED,), {}, {}), record, "run", (), spindle())
    parts = passed_through(experiment.sensed.plan, experiment.sensed.channels[0])
    assert {"adc", "dac", "controller"} <= set(parts)
    assert not any(name.startswith(("rounding_", "rounded_")) for name in parts)
    step = 20.0 / 1023.0 / Tachometer.declarations["gain"].default
    assert np.std(experiment.sensed.one({})[0]) < 0.1 * step
    monkeypatch.setattr(problem, "plain_replay", lambda *given, **_: {})
    assert np.std(replace(experiment).sensed.one({})[0]) > step


def test_nothing_is_run_where_no_sensor_is_rounded() -> None:
    parts = tuple(part for part in spindle().parts if part.name in ("dac", "spindle"))
    wires = (Wire("dac.command", constant=1.0), Wire("spindle.voltage", "dac.voltage"))
    assert plain_replay(Assembly(parts, wires, PERIOD, PERIOD), [], 10, [SPEED]) == {}


def test_a_feed_that_swings_between_two_voltages_is_known_from_them() -> None:
    """Steps of 78 mV make 1.5 mm/s of this drive; the encoder's count of 1 um is 0.2 mm/s a sample."""
    volts = 0.08 + 0.078 * np.sign(np.sin(2.0 * np.pi * 11.0 * PERIOD * np.arange(SAMPLES)))
    parts = (Part("x_axis", EmpiricalAxis, {"disturbance_gain": 0.0}), Part("x_encoder", LinearEncoder, {"resolution": 1e-6}))
    wires = (Wire("x_axis.voltage", constant=0.0), Wire("x_encoder.measured", "x_axis.position"))
    outputs = ("x_encoder.position", "x_axis.position", "x_axis.velocity")
    bare = Assembly(parts, wires, PERIOD, 0.5 * PERIOD, record=outputs)
    made = run(wire(drive(bare, {"x_axis.voltage": volts})), duration=(SAMPLES - 1) * PERIOD)
    recorded = {"x_encoder.position": made["x_encoder.position"]}
    plainly = {name: 1.02 * made[name] for name in outputs[1:]}  # the gain of the lesson is a little off
    alone, beside = (counted_motion(bare, recorded, modelled)["x_axis.velocity"] for modelled in (None, plainly))
    off = [float(np.std((speed - made["x_axis.velocity"])[200:-200])) for speed in (alone, beside)]
    assert off[1] < 0.1 * off[0]


def test_a_command_that_follows_from_what_a_converter_read_is_no_fault_of_the_recording() -> None:
    """What the converter made of the noise before it went into the command, and was not recorded: here half of it."""
    time = PERIOD * np.arange(SAMPLES)
    asked, command = np.full(SAMPLES, 100.0), "dac.voltage"
    rng = np.random.default_rng(1)
    record = Record(time, {}, {}).with_channel(SPEED, "rad/s", asked).with_channel(REFERENCE, "rad/s", asked)
    record = record.with_channel(command, "V", 3.83 + 0.05 * rng.standard_normal(SAMPLES))
    machine = Machine(spindle(), (REFERENCE,), (SPEED, command), {}, {})
    assert contradicted(Experiment(machine, record, "run", (), spindle()), {}) == ""
    direct = tuple(part for part in spindle().parts if part.name not in ("tachometer", "adc"))
    wires = [item for item in spindle().wires if item.target.partition(".")[0] not in ("tachometer", "adc", "controller")]
    wires += [Wire(REFERENCE, constant=0.0), Wire("controller.measured", SPEED)]
    without = replace(spindle(), parts=direct, wires=tuple(wires))
    assert f"of {command} does not follow" in contradicted(Experiment(replace(machine, assembly=without), record, "run", (), without), {})
