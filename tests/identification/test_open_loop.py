"""Replay: parts driven by what was recorded of their inputs give again what was recorded of their outputs, or are to blame."""

import dataclasses

import numpy as np
import pytest

from lathesim.components.sensors import LinearEncoder
from lathesim.effects.backlash_and_screw import Backlash, CumulativePitchError
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.lag import CurrentLoopLag
from lathesim.effects.offset_and_gain import ConverterOffset, ScaleFactorError
from lathesim.effects.spindle_error import Runout
from lathesim.effects.time_shift import ChannelTimeShift
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.replay.open_loop import cut, drive, look, seen, sense, sensed_share
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.one_cut import DEPTH, cut_machine
from tests.diagnosis.pushed_table import FORCE, PERIOD, POSITION, RESOLUTION, Hidden, experiments, machine, pair, recording
from tests.diagnosis.small_case import write_lesson


def sources(assembly: Assembly) -> dict[str, str]:
    return {item.target: item.source for item in assembly.wires if item.source}


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, Record]:
    """An axis under cascade control with a run of it: its loop is closed through the encoder."""
    prepared = prepare(load_lesson(write_lesson(tmp_path_factory.mktemp("lesson"))), load_registry(installed=False))
    return prepared.machinery, run_prepared(prepared)


def test_a_driven_input_takes_what_was_recorded() -> None:
    driven = drive(machine().assembly, {FORCE: np.ones(10)})
    assert sources(driven)[FORCE] == "recorded_x_axis_force.value"
    unit = {part.name: part for part in driven.parts}["recorded_x_axis_force"].component.declarations["value"].unit
    assert unit == "N"


def test_a_recording_enters_before_the_effects_on_its_input() -> None:
    assembly = insert_effect(machine().assembly, ConverterOffset, "x_axis", name="offset")
    driven = sources(drive(assembly, {FORCE: np.ones(10)}))
    assert driven[FORCE] == "offset.outgoing"
    assert driven["offset.incoming"] == "recorded_x_axis_force.value"


def test_an_effect_that_senses_a_driven_input_senses_the_recording() -> None:
    """A runout varies the depth that was recorded, not the one of the lesson."""
    assembly = insert_effect(cut_machine().assembly, Runout, "cutting", name="runout")
    driven = drive(assembly, {DEPTH: np.ones(10)})
    assert sources(driven)[DEPTH] == sources(driven)["runout.depth"] == "recorded_cutting_depth.value"
    constants = {item.target: item.constant for item in driven.wires if not item.source}
    assert constants["cutting.feed"] == pytest.approx(0.3e-3)


def test_a_channel_with_effects_on_it_is_seen_behind_them() -> None:
    assembly = insert_effect(machine().assembly, Backlash, "x_encoder", name="play")
    assert seen(assembly, POSITION) == POSITION
    assembly = insert_effect(machine().assembly, Backlash, "x_axis.position", name="play")
    assert seen(assembly, "x_axis.position") == "play.outgoing"
    assert seen(machine().assembly, "x_axis.position") == "x_axis.position"


def test_a_driven_axis_gives_again_what_was_recorded() -> None:
    experiment = pair(Hidden())[0]
    off = experiment.replayed.one({})[0]
    assert np.sqrt(np.mean(off**2)) < 2.0 * experiment.floors[POSITION]
    assert np.max(np.abs(off)) < 3.0 * RESOLUTION


def test_an_axis_with_a_friction_that_it_does_not_know_does_not() -> None:
    experiment = pair(Hidden(dry=8.0))[0]
    assert np.sqrt(np.mean(experiment.replayed.one({})[0] ** 2)) > 100.0 * experiment.floors[POSITION]


def test_cutting_the_loop_leaves_the_parts_to_compute_their_own(controlled: tuple[Assembly, Record]) -> None:
    assembly, record = controlled
    recorded = {"x_encoder.position": record["x_encoder.position"], "x_controller.voltage": record["x_controller.voltage"]}
    feeding = sources(cut(assembly, recorded))
    fed_by_encoder = [target for target, source in sources(assembly).items() if source == "x_encoder.position"]
    assert fed_by_encoder
    assert {feeding[target] for target in fed_by_encoder} == {"recorded_x_encoder_position.value"}
    assert feeding["x_encoder.measured"] == sources(assembly)["x_encoder.measured"]


def test_each_part_of_a_controlled_axis_replays_its_own_output(controlled: tuple[Assembly, Record]) -> None:
    assembly, record = controlled
    channels = ("x_encoder.position", "x_controller.voltage")
    machinery = cut(assembly, {name: record[name] for name in channels})
    replayed = run(wire(dataclasses.replace(machinery, record=channels, finish="")), duration=float(record.time[-1]))
    settled = len(record) // 50
    for name in channels:
        off = (replayed[name] - record[name])[settled:]
        assert np.sqrt(np.mean(off**2)) < 2e-3 * np.sqrt(np.mean(record[name] ** 2))


def test_an_effect_may_sense_the_recorded_motion_of_its_host() -> None:
    assembly = insert_effect(machine().assembly, CoulombFriction, "x_axis", name="friction")
    motion = {"x_axis.velocity": np.zeros(10), "x_axis.position": np.zeros(10)}
    feeding = sources(sense(assembly, motion))
    assert feeding["friction.flow"] == "motion_x_axis_velocity.value"
    # only effects sense it: the encoder still measures the simulated table
    assert feeding["x_encoder.measured"] == "x_axis.position"


def test_what_an_effect_senses_of_its_own_host_stays_simulated_in_a_cut() -> None:
    assembly = insert_effect(machine().assembly, CoulombFriction, "x_axis", name="friction")
    feeding = sources(cut(assembly, {"x_axis.velocity": np.zeros(10)}))
    assert feeding["friction.flow"] == "x_axis.velocity"


def test_the_step_of_a_replay_shifts_nothing() -> None:
    """Halving the step moves the replay by less than a twentieth of the floor: a shift of half a step would pass for a delay."""
    record = recording(count=1000)
    coarse = experiments(record)[0].replayed
    plan = coarse.plan.assembly
    fine = dataclasses.replace(coarse, plan=wire(dataclasses.replace(plan, step=0.5 * plan.step)))
    assert plan.step == 0.5 * PERIOD
    moved = coarse.one({})[0] - fine.one({})[0]
    assert np.max(np.abs(moved)) < 0.05 * coarse.floors[0]


def test_a_lag_that_the_lesson_declares_is_replayed_as_finely_as_it_needs() -> None:
    """In half a sample a lag of 0.4 samples is no more than a delay; no step is finer than the lesson's own."""
    table = machine()
    lagging = insert_effect(table.assembly, CurrentLoopLag, "x_axis", name="loop", parameters={"time_constant": 0.4 * PERIOD})
    steps = [
        experiments(recording(count=100), of=dataclasses.replace(table, assembly=dataclasses.replace(lagging, step=own * PERIOD)))[0]
        .replayed.plan.assembly.step / PERIOD
        for own in (0.5, 0.25, 0.05)
    ]  # fmt: skip
    assert steps == pytest.approx([0.5, 0.25, 0.2])


def test_a_candidate_senses_as_much_of_the_recorded_motion_as_it_is_told() -> None:
    assembly = insert_effect(machine().assembly, CoulombFriction, "x_axis", name="friction")
    sensing = sense(assembly, {"x_axis.velocity": np.zeros(10)}, {"friction"})
    share = sensed_share("friction.flow")
    part = share.partition(".")[0]
    assert sources(sensing)["friction.flow"] == f"{part}.value"
    assert sources(sensing)[f"{part}.recorded"] == "motion_x_axis_velocity.value"
    assert sources(sensing)[f"{part}.simulated"] == "x_axis.velocity"
    assert wire(sensing).parameters[share] >= 0


def test_a_sensor_is_wrong_where_the_machine_was_and_not_where_the_simulation_drifted_to() -> None:
    """The simulated table rests at zero; the screw's error of 1 % is that of the recorded place."""
    assembly = insert_effect(machine().assembly, CumulativePitchError, "x_encoder", name="screw", parameters={"slope": 0.01})
    motion = {"x_axis.position": 0.1 * np.arange(20.0)}
    looking, shown = look(assembly, {POSITION: seen(assembly, POSITION)}, motion)
    looking = drive(dataclasses.replace(looking, record=(shown[POSITION], "x_axis.position")), {FORCE: np.zeros(20)})
    found = run(wire(looking), duration=19 * PERIOD)
    assert found["x_axis.position"] == pytest.approx(np.zeros(20))
    assert found[shown[POSITION]] == pytest.approx(0.01 * motion["x_axis.position"], abs=RESOLUTION)


def test_a_factor_on_a_reading_is_one_on_the_simulated_place() -> None:
    """Twice the recorded place less once would be all of it: a machine that stands, and a factor of two, would explain everything."""
    assembly = insert_effect(machine().assembly, CumulativePitchError, "x_encoder", name="screw", parameters={"slope": 0.01})
    assembly = insert_effect(assembly, ScaleFactorError, "x_encoder", name="scale", parameters={"factor": 2.0})
    motion = {"x_axis.position": 0.1 * np.arange(20.0)}
    looking, shown = look(assembly, {POSITION: seen(assembly, POSITION)}, motion)
    looking = drive(dataclasses.replace(looking, record=(shown[POSITION],)), {FORCE: np.zeros(20)})
    found = run(wire(looking), duration=19 * PERIOD)
    assert found[shown[POSITION]] == pytest.approx(2.0 * 0.01 * motion["x_axis.position"], abs=2.0 * RESOLUTION)


def test_what_makes_a_reading_late_delays_the_simulated_motion() -> None:
    """The recorded motion is late already: made late once more it would give y - 2 late(y) + late(late(y))."""
    shift = 3.0 * PERIOD
    assembly = insert_effect(machine().assembly, ChannelTimeShift, "x_encoder", name="late", parameters={"shift": shift})
    assembly = insert_effect(assembly, CumulativePitchError, "x_encoder", name="screw", parameters={"slope": 0.01})
    time = np.arange(200) * PERIOD
    pushed = 40.0 * np.sin(2.0 * np.pi * 2.0 * time)
    bare = run(wire(drive(dataclasses.replace(machine().assembly, record=("x_axis.position",)), {FORCE: pushed})), duration=time[-1])
    simulated = bare["x_axis.position"]
    motion = {"x_axis.position": np.interp(time - shift, time, simulated)}
    looking, shown = look(assembly, {POSITION: seen(assembly, POSITION)}, motion)
    found = run(wire(drive(dataclasses.replace(looking, record=(shown[POSITION],)), {FORCE: pushed})), duration=time[-1])
    wanted = np.interp(time - shift, time, simulated + 0.01 * motion["x_axis.position"])
    assert found[shown[POSITION]][10:] == pytest.approx(wanted[10:], abs=2.0 * RESOLUTION)


def test_what_makes_a_second_sensor_late_delays_the_recorded_motion() -> None:
    """The simulated table is slower than the recorded one was, by a load that nobody modelled: how far the scale is behind is recorded."""
    shift, speed = 3.0 * PERIOD, 0.02
    assembly = with_second_sensor(machine().assembly)
    assembly = insert_effect(assembly, ChannelTimeShift, "x_scale", name="late", parameters={"shift": shift})
    time = np.arange(200) * PERIOD
    channels = {name: seen(assembly, name) for name in (POSITION, "x_scale.position")}
    looking, shown = look(assembly, channels, {"x_axis.position": speed * time})
    outputs = (shown[POSITION], shown["x_scale.position"])
    found = run(wire(drive(dataclasses.replace(looking, record=outputs), {FORCE: np.zeros(200)})), duration=time[-1])
    behind = found[outputs[1]] - found[outputs[0]]
    assert behind[10:] == pytest.approx(np.full(190, -speed * shift), abs=2.0 * RESOLUTION)


def with_second_sensor(assembly: Assembly) -> Assembly:
    scale = Part("x_scale", LinearEncoder, {"resolution": RESOLUTION})
    return dataclasses.replace(
        assembly, parts=(*assembly.parts, scale), wires=(*assembly.wires, Wire("x_scale.measured", "x_axis.position"))
    )
