"""From a lesson and its recordings to experiments: what is read, split, kept, and where a replay starts."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.component import Component, Output, State
from lathesim.components.axes import AnalyticalAxis, ForceAxis
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.lag import MotorInductance
from lathesim.engine.assembly import Part
from lathesim.errors import LatheSimError, LessonError, RecordingError
from lathesim.identification.estimation import estimates as parameters
from lathesim.identification.estimation.estimates import Estimates, estimates
from lathesim.identification.estimation.multistart import ask_fit
from lathesim.identification.replay.experiment import build_experiments, own_error, quickly_transformed
from lathesim.identification.replay.loading import Recorded, at_period, coarser_than_decided, load_case
from lathesim.identification.replay.measured_motion import start_from, velocity_of
from lathesim.identification.replay.open_loop import sensed_share
from lathesim.identification.replay.validation_split import dealt_out, halves, halves_miss_a_switch, is_one_stroke, parted, switches
from lathesim.lessons.lesson import load_lesson, load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry
from lathesim.record import Channel, Record
from lathesim.recordings.raw_table import Finding
from tests.diagnosis.one_cut import CUT, DEPTH, cut_machine, cut_record
from tests.diagnosis.pushed_table import (
    FORCE,
    LESSON,
    MASS,
    POSITION,
    VISCOUS,
    Hidden,
    as_record,
    experiments,
    machine,
    recording,
    write_case,
)
from tests.diagnosis.small_case import controlled_axis


def test_a_case_is_what_the_lesson_says_of_its_recordings(registry: Registry, tmp_path: Path) -> None:
    lesson, first, second = write_case(tmp_path)
    case = load_case(load_lesson(lesson), [first, second], registry)
    assert (case.machine.drive, case.machine.compare) == ((FORCE,), (POSITION,))
    assert case.machine.uncertain == pytest.approx({"x_axis.mass": 0.05 * MASS, "x_axis.viscous": 0.1 * VISCOUS})
    assert case.machine.resolution == {POSITION: 1e-6}
    assert [one.name for one in case.recordings] == ["fit.csv", "check.csv"]
    assert case.recordings[0].record[POSITION] == pytest.approx(recording()[POSITION], abs=1e-9)
    assert case.recordings[0].faults == ()


def test_the_machine_is_sampled_as_the_recording_is() -> None:
    assembly = at_period(machine().assembly, 5e-3)
    assert assembly.sample_period == 5e-3
    assert assembly.step == pytest.approx(1e-3)
    assert at_period(machine().assembly, 2.5e-3).step == pytest.approx(2.5e-3 / 3.0)


def test_a_recording_at_another_rate_sets_the_rate(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1)[::2]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    assert load_case(load_lesson(lesson), [first], registry).machine.assembly.sample_period == pytest.approx(4e-3)


def test_a_recording_that_lasts_more_steps_than_can_be_simulated_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    lesson.write_text(lesson.read_text(encoding="utf-8").replace("time: {column: t, unit: s}", "time: {rate: 1 mHz}"), encoding="utf-8")
    with pytest.raises(RecordingError, match=r"lasts 2e\+06 s, which are .* steps of .* s; the limit is 1e\+09"):
        load_case(load_lesson(lesson), [first], registry)
    with pytest.raises(RecordingError, match="the limit is"):
        ask_fit(load_lesson(lesson), first, registry, ["x_axis.mass"])


def test_a_recording_in_which_nothing_moves_is_refused(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1) * [1.0, 0.0, 0.0]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    with pytest.raises(RecordingError, match=r"nothing that is compared moves in it: x_encoder\.position"):
        load_case(load_lesson(lesson), [first], registry)
    with pytest.raises(RecordingError, match="nothing that is compared moves"):
        ask_fit(load_lesson(lesson), first, registry, ["x_axis.mass"])


def test_a_servo_that_decides_more_often_than_it_was_logged_cannot_be_replayed(registry: Registry) -> None:
    """Unless what it commanded was logged too, or the log holds every so many-th decision."""
    template = Path(__file__).parents[2] / "lesson_configs" / "machines" / "cascade_axis.yaml"
    assembly = check_machine(load_machine(template), registry).assembly
    (finding,) = coarser_than_decided(2.5 * assembly.sample_period, assembly, [])
    assert finding.serious
    assert "x_controller decides every" in finding.fact
    assert coarser_than_decided(assembly.sample_period, assembly, []) == []
    (known,) = coarser_than_decided(2.5 * assembly.sample_period, assembly, ["x_controller.voltage"])
    assert not known.serious
    assert "a slower loop than the real one" in known.done
    (between,) = coarser_than_decided(4.0 * assembly.sample_period, assembly, [])
    assert not between.serious
    assert "simulated at the controller's rate" in between.done


def test_a_share_of_nothing_is_no_uncertainty(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, lesson=LESSON.replace("200 N*s/m}", "200 N*s/m}").replace("viscous: 200", "viscous: 0"))
    text = lesson.read_text(encoding="utf-8").replace("x_axis.viscous: 200 N*s/m", "x_axis.viscous: 0 N*s/m")
    lesson.write_text(text, encoding="utf-8")
    with pytest.raises(LessonError, match=r"x_axis.viscous is 0, and a share of it is no uncertainty"):
        load_case(load_lesson(lesson), [first], registry)


def test_an_uncertainty_may_be_a_quantity(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path, lesson=LESSON.replace("x_axis.mass: 5 %", "x_axis.mass: 500 g"))
    assert load_case(load_lesson(lesson), [first], registry).machine.uncertain["x_axis.mass"] == pytest.approx(0.5)


@pytest.mark.parametrize("missing", ["seen", "push"])
def test_a_column_that_is_not_there_is_named(missing: str, registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    first.write_text(first.read_text(encoding="utf-8").replace(f"{missing} [", "other ["), encoding="utf-8")
    with pytest.raises(LatheSimError, match=missing):
        load_case(load_lesson(lesson), [first], registry)


def test_serious_findings_are_faults() -> None:
    findings = (Finding("gap", "", "two rows are missing", "bridged"), Finding("frozen", POSITION, "it stands still", "", serious=True))
    assert Recorded("a.csv", recording(count=200), findings).faults == (findings[1],)


def test_a_frozen_sensor_is_a_fault_of_the_recording(registry: Registry, tmp_path: Path) -> None:
    lesson, first, _ = write_case(tmp_path)
    rows = np.loadtxt(first, delimiter=",", skiprows=1)
    rows[:, 2] = rows[0, 2]
    np.savetxt(first, rows, delimiter=",", header="t [s],push [N],seen [mm]", comments="", fmt="%.10g")
    (recorded,) = load_case(load_lesson(lesson), [first], registry).recordings
    assert [fault.channel for fault in recorded.faults] == [POSITION]


@pytest.mark.parametrize(
    ("samples", "kept"), [(30_000, 30_000), (29_999, 29_700), (28_772, 28_672), (17_001, 16_875), (11, 11)],
    ids=["as it is", "11 as a factor", "7 as a factor", "of 3 and 5", "few"],
)  # fmt: skip
def test_the_last_samples_beyond_a_quick_length_are_spared(samples: int, kept: int) -> None:
    record = Record(0.001 * np.arange(samples), {"x": Channel("x", "m", np.arange(samples) * 1.0)}, {"sample_period": 0.001})
    shorter = quickly_transformed(record)
    assert len(shorter) == kept
    assert shorter["x"].tolist() == list(range(kept))
    assert shorter.sample_period == 0.001


def test_a_winding_senses_the_simulated_motion_and_a_friction_the_recorded_one(tmp_path: Path) -> None:
    """What a winding adds of a velocity cancels what its drive takes away: the counts of an encoder would not."""
    machine, record = controlled_axis(tmp_path)
    (experiment,) = build_experiments(machine, [("run.csv", record)], (CoulombFriction, MotorInductance))
    friction, winding = sorted(experiment.candidates, key=lambda candidate: candidate.name)
    assert (friction.effect, winding.effect) == (CoulombFriction, MotorInductance)
    assert sensed_share(f"{friction.part}.flow") in experiment.sensed.plan.parameters
    assert sensed_share(f"{winding.part}.flow") not in experiment.sensed.plan.parameters


PLACE, SPEED, PERIOD = np.linspace(0.02, 0.05, 100), np.linspace(0.01, 0.03, 100), 0.01


def test_a_place_and_a_speed_start_as_they_were_recorded() -> None:
    part, steady = Part("x_axis", ForceAxis), np.concatenate([np.full(3, SPEED[0]), SPEED])
    motion = {"x_axis.position": PLACE, "x_axis.velocity": steady}
    assert start_from(part, "travel", motion, PERIOD) == (0.02, pytest.approx(0.01 * np.std(PLACE), rel=1e-6))
    assert start_from(part, "speed", motion, PERIOD) == (0.01, pytest.approx(0.01 * np.std(steady), rel=1e-6))


@pytest.mark.parametrize("period", [0.01, 0.001, 0.00025])
def test_a_speed_that_changes_from_the_first_row_on_is_no_surer_than_the_end_of_a_smoothed_place(period: float) -> None:
    """A slow log of an actuator began with a step: its start was three times as fast, and a friction made up for it."""
    pushed = 0.03 - 2.0 * (period * np.arange(100)) ** 2
    found = start_from(Part("x_axis", ForceAxis), "speed", {"x_axis.velocity": velocity_of(pushed, period)}, period)
    assert found is not None
    assert found[1] > abs(found[0]) > 0.0


def test_the_speed_of_a_table_tells_that_of_its_motor() -> None:
    """A lathe at rest was begun at 5 rad/s, which made up for a drift of the replay."""
    part = Part("x_axis", AnalyticalAxis, {"gear": 0.5, "lead": 8e-4})
    found = start_from(part, "motor_speed", {"x_axis.velocity": SPEED}, PERIOD)
    assert found == (pytest.approx(0.01 / 4e-4), pytest.approx((SPEED[2] - SPEED[0]) / 4e-4, rel=1e-6))


def test_what_no_recorded_output_shows_is_not_told() -> None:
    assert start_from(Part("x_axis", AnalyticalAxis), "motor_speed", {"x_axis.position": PLACE}, PERIOD) is None
    assert start_from(Part("x_axis", AnalyticalAxis), "travel", {}, PERIOD) is None


class SoftTable(Component):
    """A table on a spring behind its motor: its speed tells neither that of the motor nor that of the spring."""

    ports = {"flow": "velocity"}
    motor_speed = State("rad/s", doc="speed of the motor")
    stretch_speed = State("rad/s", doc="speed of the spring")
    velocity = Output("m/s", doc="speed of the table")

    @staticmethod
    def derivative(motor_speed: float) -> tuple[float, float]:
        return -motor_speed, 0.0

    @staticmethod
    def output(motor_speed: float, stretch_speed: float) -> float:
        return 1e-3 * (motor_speed + stretch_speed)


def test_an_output_that_mixes_two_states_tells_neither() -> None:
    assert start_from(Part("table", SoftTable), "motor_speed", {"table.velocity": SPEED}, PERIOD) is None


def test_halves_begin_at_zero_and_share_nothing() -> None:
    record = recording(count=401)
    first, second = halves(record)
    assert (len(first), len(second)) == (200, 201)
    assert first.time[0] == second.time[0] == 0.0
    assert np.array_equal(np.concatenate([first[POSITION], second[POSITION]]), record[POSITION])
    assert second.sample_period == record.sample_period


def test_a_single_entry_lies_in_one_half_only() -> None:
    record = cut_record()
    rise, fall = switches(record, (DEPTH,))
    assert (rise.tolist(), fall.tolist()) == ([CUT.start], [CUT.stop])
    assert halves_miss_a_switch(record, (DEPTH,))


def test_four_cuts_have_entries_and_exits_in_both_halves() -> None:
    depth = np.where(np.arange(2000) % 500 < 250, 0.0, 1e-3)
    assert not halves_miss_a_switch(as_record({DEPTH: ("m", depth)}), (DEPTH,))


def test_a_step_between_two_levels_is_no_switch() -> None:
    assert switches(as_record({FORCE: ("N", np.repeat([5.0, 6.0], 500))}), (FORCE,)) == []


def test_no_sample_counts_in_both_and_each_side_sees_every_part_of_the_entry() -> None:
    to_fit, to_judge = dealt_out(cut_record(), (DEPTH,))
    assert not np.any((to_fit > 0.0) & (to_judge > 0.0))
    assert np.sum(to_fit) > 0.3 * len(to_fit) and np.sum(to_judge) > 0.3 * len(to_judge)
    for begin, end in ((0, 20), (20, 40), (40, 80)):
        entry = slice(CUT.start + begin, CUT.start + end)
        assert to_fit[entry].max() == to_judge[entry].max() == 1.0


def test_one_cut_is_dealt_out_and_a_motion_is_halved() -> None:
    fitted, judge, whole = parted(cut_machine(), "cut.csv", cut_record(), ())
    assert judge.name == "cut.csv, every other stretch of one run"
    assert fitted.record is judge.record is whole.record
    assert whole.weights is None
    pushed = np.where(np.arange(2000) < 700, 0.0, 40.0)
    record = as_record({FORCE: ("N", pushed), POSITION: ("m", np.cumsum(np.cumsum(pushed)) * 1e-9)})
    assert parted(machine(), "push.csv", record, ())[1].name == "push.csv, second half"


def moving_at(speed: np.ndarray) -> Record:
    """Return a recording of a table that moves at a speed [m/s], one value every millisecond."""
    return as_record({FORCE: ("N", np.gradient(speed) * 1e3), POSITION: ("m", np.cumsum(speed) * 1e-3)})


def test_one_stroke_is_fitted_whole_and_judges_itself_and_a_second_one_is_not() -> None:
    rest, stroke = np.zeros(100), np.concatenate([np.linspace(0.0, 0.6, 400), np.linspace(0.6, 0.0, 400)])
    alone = moving_at(np.concatenate([rest, stroke, rest]))
    fitted, judge, whole = parted(machine(), "stroke.csv", alone, ())
    assert fitted is judge is whole
    assert (judge.name, judge.machine.output_error, len(judge.record)) == ("stroke.csv", True, 1000)
    plateau = [np.linspace(0.0, 0.6, 100), np.full(600, 0.6), np.linspace(0.6, 0.0, 100), rest]
    for other in ([stroke, rest, stroke, rest], [stroke, -stroke, rest], [np.linspace(0.0, 0.6, 1000)], plateau):
        assert not is_one_stroke(machine(), moving_at(np.concatenate([rest, *other])))


def test_the_right_machine_leaves_next_to_nothing() -> None:
    (experiment,) = experiments(recording(Hidden()))
    right, wrong = ({"x_axis.mass": factor * MASS, "x_axis.viscous": VISCOUS} for factor in (1.0, 1.1))
    samples = experiment.own.samples
    assert own_error(experiment, right) < 10.0 * samples
    assert own_error(experiment, wrong) > 1e4 * samples


@pytest.mark.parametrize(("error_of_recorded", "taken"), [(1.0, "recorded"), (1.5, "simulated")])
def test_values_come_from_the_recorded_motion_where_its_simulation_is_as_good(
    error_of_recorded: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A replay that feels its own motion jumps where a value moves a little, and its slopes tell more than is there."""
    fitted = SimpleNamespace(constant={"felt": 0.0})
    model: Any = SimpleNamespace(fitted=fitted, candidates=(), validation_fit=SimpleNamespace(by_name={}))
    experiment: Any = SimpleNamespace(feeds_back=True, simulated_motion_of=lambda candidates: {"felt": 0.0})
    monkeypatch.setattr(parameters, "replace", lambda item, **changes: SimpleNamespace(**{**vars(item), **changes}))

    def by_motion(model: Any, *others: Any) -> Estimates:
        return Estimates({}, 1.0 if "felt" in model.fitted.constant else 2.0)

    monkeypatch.setattr(parameters, "_estimates", by_motion)
    errors = iter((1.0, error_of_recorded))
    monkeypatch.setattr(parameters, "own_error", lambda experiment, values, **_: next(errors))
    assert estimates(model, experiment, experiment, None).inflation == {"simulated": 1.0, "recorded": 2.0}[taken]
