"""Where a mismatch sits: the missing force and the parts that are suspected."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.components.sensors import AngularEncoder
from lathesim.components.spindles import EmpiricalSpindle
from lathesim.diagnosis.location import compared, largest_windows, missing_signal, one_way, passed_through, places
from lathesim.diagnosis.records.diagnosis import Evidence, MissingSignal
from lathesim.diagnosis.reporting.evidence import suspected, unheld
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.identification.replay.loading import load_case
from lathesim.identification.replay.validation_split import parted
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from lathesim.record import Channel, Record
from tests.diagnosis.driven_axis import write_recording
from tests.diagnosis.one_cut import FORCE as CUT_FORCE
from tests.diagnosis.one_cut import cut_machine, cut_record
from tests.diagnosis.pushed_table import FORCE, PERIOD, POSITION, Hidden, as_record, baseline, baselines, experiments, machine, pair
from tests.diagnosis.test_loaded_servo import write_case

SPRING = Hidden(law=lambda v, q, t: 400.0 * q)


@pytest.mark.parametrize("channel", ["x_axis.velocity", POSITION])
@pytest.mark.parametrize(("speeds", "alone"), [((0.1, 0.0, 0.06, 0.0), True), ((0.1, 0.0, -0.06, 0.0), False)], ids=["one way", "back too"])
def test_a_part_that_stops_suddenly_does_not_come_back(channel: str, speeds: tuple[float, ...], alone: bool) -> None:
    speed = np.repeat(speeds, 100)
    shown = ("m/s", speed) if channel != POSITION else ("m", PERIOD * np.cumsum(speed))
    log = as_record({FORCE: ("N", np.zeros(len(speed))), channel: shown})
    (experiment,) = experiments(log, of=replace(machine(), compare=(channel,)))
    assert one_way(experiment, "x_axis") == alone


def test_the_lesson_alone_counts_with_the_values_that_leave_clearly_less() -> None:
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0].by_name
    heavy = {**fitted, "x_axis.mass": 1.5 * fitted["x_axis.mass"]}
    light = {**fitted, "x_axis.mass": 0.5 * fitted["x_axis.mass"]}
    held = compared(experiment, [heavy, fitted], light).fit[POSITION]
    assert held == compared(experiment, [fitted, heavy], light).fit[POSITION]
    assert held.before == pytest.approx(compared(experiment, [light], fitted).fit[POSITION].after)
    assert held.after > 10.0 * held.before


def test_a_place_that_no_loop_spring_or_friction_brings_back_is_not_held(tmp_path: Path) -> None:
    pushed = pair(Hidden())[0]
    assert unheld(pushed, baselines(Hidden())[0].by_name, {POSITION: 1e-4}) == {POSITION}
    assert unheld(pushed, {}, {}) == set()
    write_case(tmp_path, (0.0, 0.0))
    case = load_case(load_lesson(str(tmp_path / "lesson.yaml")), [tmp_path / "log.csv"], load_registry(installed=False))
    (servo,) = build_experiments(case.machine, [("log", case.recordings[0].record)], ())
    assert unheld(servo, {}, {"encoder.angle": 0.1}) == set()


def test_the_missing_force_is_what_was_left_out() -> None:
    experiment, fitted = pair(SPRING)[0], baselines(SPRING)[0]
    missing = missing_signal(experiment, fitted, 0)
    assert (missing.at, missing.unit) == ("x_axis.disturbance", "N")
    hidden = 400.0 * experiment.record[POSITION]
    inside = slice(200, -200)
    likeness = np.corrcoef(missing.values[inside], hidden[inside])[0, 1]
    assert likeness > 0.8
    assert np.std(missing.values[inside]) == pytest.approx(np.std(hidden[inside]), rel=0.4)


def test_the_speed_of_a_braked_body_shows_no_mean_of_the_missing_force() -> None:
    """Noise of 0.1 mm/s in the speed of a body that brakes within 0.5 s is no constant force."""
    speed = "x_axis.velocity"
    table = replace(machine(viscous=80.0), compare=(speed,), resolution={speed: 1e-5})
    noise = 1e-4 * np.random.default_rng(5).standard_normal(2000)
    quiet = as_record({FORCE: ("N", np.zeros(2000)), speed: ("m/s", noise)})
    (experiment,) = experiments(quiet, of=table)
    missing = missing_signal(experiment, fit(experiment.sensed, baseline(experiment)), 0)
    assert (missing.at, missing.unit) == ("x_axis.disturbance", "N")
    assert abs(np.mean(missing.values)) < 0.1 * np.std(missing.values)


def test_the_place_is_the_channel_that_is_off_and_what_it_passes_through() -> None:
    experiment, fitted = pair(Hidden(dry=8.0))[0], baselines(Hidden(dry=8.0))[0]
    (place,) = places(experiment, fitted)
    assert place.channel == POSITION
    assert place.over_floor > 50.0
    assert place.parts == ("x_encoder", "x_axis")
    windows = largest_windows(missing_signal(experiment, fitted, 0).values, PERIOD)
    assert 0 < len(windows) <= 5
    assert all(0.0 <= begin < end <= 4.0 for begin, end in windows)
    assert passed_through(experiment.sensed.plan, "x_axis.position") == ("x_axis",)


def current_too(folder: Path) -> tuple[list[Experiment], list[Fitted]]:
    """Return the halves of a recording of an axis whose current was recorded beside its place, and the lesson's values fitted to each.

    The lesson's drive answers to the speed (a back electromotive force), so a push of the axis moves the current too.
    """
    lesson, file = write_recording(folder)
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    current = 1.3 * rows[:, 1] + 0.01 * np.random.default_rng(3).standard_normal(len(rows))
    np.savetxt(file, np.column_stack([rows, current]), delimiter=",", header="t [s],u [V],q [m],i [A]", comments="", fmt="%.12g")
    text = lesson.read_text(encoding="utf-8").replace("x_drive.back_emf: 0 V*s/m", "x_drive.back_emf: 4 V*s/m")
    text = text.replace("resolution: 1 um}}", "resolution: 1 um}, x_drive.current: {column: i, unit: A}}")
    lesson.write_text(text + "uncertain: {x_axis.mass: 20 %, x_axis.viscous: 20 %}\n", encoding="utf-8")
    case = load_case(load_lesson(lesson), [file], load_registry(installed=False))
    first, second, _ = parted(case.machine, file.name, case.recordings[0].record, ())
    return [first, second], [fit(experiment.sensed, baseline(experiment)) for experiment in (first, second)]


@pytest.fixture(scope="module")
def axis_with_current(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Experiment], list[Fitted]]:
    return current_too(tmp_path_factory.mktemp("current"))


def test_one_missing_force_is_told_once(axis_with_current: tuple[list[Experiment], list[Fitted]]) -> None:
    """The place tells what pushed the axis; a current that is off is off by itself, and no second force at the axis."""
    (experiment, _), (fitted, _) = axis_with_current
    assert experiment.machine.compare == ("x_encoder.position", "x_drive.current")
    assert [missing_signal(experiment, fitted, row).at for row in (0, 1)] == ["x_axis.disturbance", "x_drive.current"]
    assert missing_signal(experiment, fitted, 1).unit == "A"


def test_what_is_missing_at_a_spindle_without_an_inertia_is_an_angular_acceleration() -> None:
    count, period = 800, 2e-3
    voltage = np.sin(2.0 * np.pi * 1.5 * period * np.arange(count))
    parts = (Part("spindle", EmpiricalSpindle), Part("encoder", AngularEncoder, {"resolution": 1e-4}))
    wires = (Wire("spindle.voltage", constant=0.0), Wire("encoder.measured", "spindle.angle"))
    spindle = RecordedMachine(Assembly(parts, wires, period, period), ("spindle.voltage",), ("encoder.angle",), {}, {})
    angle = np.cumsum(np.sin(np.arange(count) / 90.0))
    channels = {name: Channel(name, unit, values) for name, unit, values in
                (("spindle.voltage", "V", voltage), ("encoder.angle", "rad", np.round(angle, 4)))}  # fmt: skip
    record = Record(np.arange(count) * period, channels, {"sample_period": period})
    (experiment,) = experiments(record, of=spindle, effects=())
    missing = missing_signal(experiment, fit(experiment.sensed, experiment.start_states(experiment.sensed.plan), rounds=0), 0)
    assert (missing.at, missing.unit) == ("spindle.torque", "rad/s^2")


def shown(*shares: float) -> Evidence:
    signal = np.zeros(3)
    places = (("x_axis.disturbance", "N"), ("x_drive.current", "A"))
    return Evidence(missing=tuple(MissingSignal(*at, *(signal,) * 4, share, share) for at, share in zip(places, shares, strict=True)))


@pytest.mark.parametrize(
    ("shares", "off", "parts"),
    [
        ((0.15, 0.016), (POSITION, "x_drive.current"), ["x_axis", "x_drive"]),
        ((0.15, 0.016), (POSITION,), ["x_axis"]),
        ((0.15, 0.014), (POSITION, "x_drive.current"), ["x_axis"]),
        ((0.007, 0.478), (POSITION, "x_drive.current"), ["x_drive"]),
        ((0.3, 0.5), (POSITION, "x_drive.current"), ["x_drive", "x_axis"]),
        ((float("nan"), 0.5), (POSITION, "x_drive.current"), ["x_drive"]),
        ((0.3, 0.5), (), []),
    ],
    ids=[
        "a tenth",
        "the other under its floor",
        "less than a tenth",
        "the drive",
        "the drive more",
        "nothing acts",
        "all under their floors",
    ],
)
def test_suspected_is_where_much_is_missing(
    shares: tuple[float, float], off: tuple[str, ...], parts: list[str], axis_with_current: tuple[list[Experiment], list[Fitted]]
) -> None:
    assert suspected(axis_with_current[0][0], shown(*shares), off) == parts


def test_with_a_sensor_what_it_reads_is_suspected_and_first_where_all_its_readings_are_off() -> None:
    (experiment,) = experiments(cut_record(), of=cut_machine(), effects=())
    signal = np.zeros(3)
    one = MissingSignal(CUT_FORCE, "N", signal, signal, signal, signal, 0.1, 0.1)
    assert suspected(experiment, Evidence(missing=(one,)), [CUT_FORCE]) == ["dynamometer", "cutting"]
    three = replace(experiment, machine=replace(experiment.machine, compare=(CUT_FORCE, "dynamometer.thrust")))
    both = Evidence(missing=(one, replace(one, at="dynamometer.thrust")))
    assert list(dict.fromkeys(suspected(three, both, [CUT_FORCE, "dynamometer.thrust"]))) == ["cutting", "dynamometer"]
