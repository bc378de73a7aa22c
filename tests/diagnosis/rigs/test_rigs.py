"""The rigs are sound machines, their descriptions are the same machine, and their scoring counts what it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis import preparation
from lathesim.diagnosis.candidates.starting_points import limit_points
from lathesim.diagnosis.diagnose import ask
from lathesim.diagnosis.explanations.of_recording import of_channels
from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.effects.drive_errors import CurrentLimit
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import transferred
from lathesim.identification.replay.experiment import baseline_free, build_experiments
from lathesim.identification.replay.loading import load_case, read_for
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from tests.diagnosis.rigs.cases import COUNTS, schedule, write_case
from tests.diagnosis.rigs.machines import RIGS
from tests.diagnosis.rigs.scoring import Answer, marks, table, wilson


def test_half_of_the_rigs_are_held_out() -> None:
    assert sum(rig.calibrating for rig in RIGS) == len(RIGS) / 2 == 5
    assert len({rig.name for rig in RIGS}) == len(RIGS)


def test_a_seed_fixes_the_cases() -> None:
    first, again, other = schedule(1), schedule(1), schedule(2)
    assert first == again
    assert [case.seed for case in first] != [case.seed for case in other]
    driven = sum(rig.kind != "spindle" for rig in RIGS)  # nothing commands a spindle of an open loop
    assert len(first) == len(RIGS) * (sum(COUNTS.values()) - COUNTS["input"]) + driven * COUNTS["input"]
    assert len({case.name for case in first}) == len(first)


@pytest.mark.parametrize("rig", [rig.name for rig in RIGS])
def test_every_description_of_a_rig_is_a_lesson(rig: str, tmp_path: Path) -> None:
    case = next(case for case in schedule(1, {"sound": 1}) if case.rig.name == rig)
    folders = write_case(case, tmp_path)
    assert len(folders) == len(case.rig.descriptions) >= 2
    recording = np.genfromtxt(folders[0] / "fit.csv", delimiter=",", names=True)
    assert np.isfinite(recording["q"]).all() and np.ptp(recording["q"]) > 100.0 * case.rig.physics.encoder
    registry = load_registry()
    for folder in folders:
        prepared = prepare(load_lesson(folder / "lesson.yaml"), registry)
        columns = {signal.column for signal in mapping_of(prepared.case.lesson, prepared.machinery).signals}
        assert columns <= set(recording.dtype.names or ())


def answered(kind: str, told: dict[str, object], **truth: object) -> Answer:
    known = {"kind": kind, "rig": "a", "description": "table", "calibrating": True, "case": "a", "keys": [], "beside": [], "fault": ""}
    return Answer(known | truth, told, 1.0)


def test_a_name_counts_exactly_or_in_a_tie_and_nothing_beside_it() -> None:
    friction = {"effect": "CoulombFriction", "at": "x_axis", "tied_with": ["PreslidingFriction"]}
    play = {"effect": "Backlash", "at": "x_scale", "tied_with": []}
    right = {"coulomb": ["CoulombFriction"]}
    exact = answered("single", {"verdict": "named", "effects": [friction]}, right=right)
    assert list(marks(exact).values()) == [True, True]
    tied = answered("single", {"verdict": "tied", "effects": [friction]}, right={"bristles": ["PreslidingFriction"]})
    assert list(marks(tied).values()) == [True, False]
    assert list(marks(answered("single", {"verdict": "named", "effects": [friction, play]}, right=right)).values()) == [False, False]
    assert list(marks(answered("single", {"verdict": "unknown", "effects": [friction]}, right=right)).values()) == [False, False]


def test_the_table_has_a_column_for_each_half_and_description() -> None:
    quiet = answered("sound", {"verdict": "no_mismatch"})
    doubted = answered("sound", {"verdict": "unknown"}, calibrating=False, description="motor")
    rows = table([quiet, doubted]).splitlines()
    assert rows[0] == "| asked | calibration, table side | held out, motor side |"
    assert rows[2].startswith("| sound called sound | 1/1 (21 to 100 %) | 0/1 (0 to 79 %) |")


def test_the_interval_of_a_share() -> None:
    """E. B. Wilson's interval; 8 of 10 as in Brown, Cai, DasGupta, Statistical Science 16 (2001)."""
    assert wilson(8, 10) == pytest.approx((0.490, 0.943), abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)


def own_run_of(folder: Path, axis: str) -> dict[str, np.ndarray]:
    """Return what a lesson makes of its own simulation with the recording's input: channel without its axis -> values."""
    prepared = prepare(load_lesson(folder / "lesson.yaml"), load_registry())
    machine, recorded = read_for(prepared, folder / "fit.csv", load_registry())
    (experiment,) = build_experiments(machine, [("fit.csv", recorded.record)], ())
    run = experiment.own.outputs([], np.zeros((1, 0)))[0]
    names = [name.removeprefix(f"{axis}_").replace("drive.", "axis.") for name in machine.compare]
    return dict(zip(names, run, strict=True))


@pytest.mark.parametrize("rig", ["gear_pid_1k"])
def test_descriptions_of_a_rig_are_the_same_machine(rig: str, tmp_path: Path) -> None:
    """Written from the table's side and from the motor's, a closed loop runs to the same counts and currents."""
    case = next(case for case in schedule(1, {"sound": 1}) if case.rig.name == rig)
    table_side, motor_side = (own_run_of(folder, "x") for folder in write_case(case, tmp_path)[:2])
    assert list(table_side) == list(motor_side)
    for name, values in table_side.items():
        moved = float(np.std(values))
        apart = float(np.sqrt(np.mean((values - motor_side[name]) ** 2)))
        assert apart < 0.02 * moved, name


@pytest.mark.parametrize("rig", ["gear_pid_1k"])
def test_the_same_force_is_missing_in_every_description(rig: str, tmp_path: Path) -> None:
    """Behind the encoder a force is missing on the table, whether the part that moves is the table or the motor with all behind it."""
    case = next(case for case in schedule(1, {"single": 12}) if case.rig.name == rig and case.keys == ("gravity",))
    forces = []
    for folder in write_case(case, tmp_path)[:2]:
        prepared = prepare(load_lesson(folder / "lesson.yaml"), load_registry())
        machine, recorded = read_for(prepared, folder / "fit.csv", load_registry())
        (experiment,) = build_experiments(machine, [("fit.csv", recorded.record)], ())
        fitted = fit(experiment.sensed, experiment.start_states(experiment.sensed.plan), {}, rounds=1)
        forces.append(missing_signal(experiment, fitted, machine.compare.index("x_encoder.position")))
    assert [(force.at.partition(".")[0], force.unit) for force in forces] == [("x_axis", "N")] * 2
    apart, size = (float(np.sqrt(np.mean(values**2))) for values in (forces[0].values - forces[1].values, forces[0].values))
    assert apart < 0.02 * size


def test_a_limit_of_the_current_is_looked_for_below_what_the_command_grows_to(tmp_path: Path) -> None:
    """Behind a drive that gives no more current the loop asks for thirty times what flows."""
    case = next(case for case in schedule(13, {"single": 12}) if case.rig.name == "belt_pid_500" and case.keys == ("saturation",))
    folder = write_case(case, tmp_path)[0]
    prepared = prepare(load_lesson(folder / "lesson.yaml"), load_registry())
    machine, recorded = read_for(prepared, folder / "fit.csv", load_registry())
    (experiment,) = build_experiments(machine, [("fit.csv", recorded.record)], (CurrentLimit,))
    (points,) = limit_points(experiment, experiment.candidates).values()
    physics = case.rig.physics
    level = 0.75 * case.rig.torque / physics.torque_constant * physics.resistance / physics.amplifier
    assert float(np.min(np.abs(np.log(points / level)))) < np.log(1.3)
    assert float(points.max()) > 10.0 * level


@pytest.mark.slow
def test_a_current_that_answers_to_an_unknown_load_does_not_go_with_the_speed(tmp_path: Path) -> None:
    case = next(case for case in schedule(4421, {"sound": 1}) if case.rig.name == "screw_tacho_2k")
    folder = write_case(case, tmp_path)[0]
    loaded = load_case(load_lesson(folder / "lesson.yaml"), [folder / "fit.csv", folder / "validate.csv"], load_registry())
    here, there = preparation.prepare(ask("a sound axis", loaded.machine, loaded.recordings, ())).experiments
    fitted = fit(here.sensed, [*baseline_free(here.machine), *here.start_states(here.sensed.plan)])
    _, found = of_channels(here, fitted, there, transferred(there, fitted, ()))["x_drive.current"]
    assert found.without_lines < 10.0
