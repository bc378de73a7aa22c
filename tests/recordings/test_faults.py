"""Each fault of a recording is found where it was planted, named with its channel, and not seen where nothing is wrong."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lathesim.recordings.mapping import RecordingMapping, SignalMapping, map_recording
from lathesim.recordings.raw_table import Finding, RawTable, read_recording
from lathesim.recordings.recorded_channel import known_factor
from lathesim.recordings.recording_faults import recording_faults
from lathesim.recordings.stock_readers import stock_readers
from tests.shared_data import SHARED, needs_shared

PERIOD = 1e-3
UNITS = {
    "x_controller.reference": "m", "x_encoder.position": "m", "x_scale.position": "m", "x_controller.voltage": "V",
    "x_tachometer.speed": "m/s",
    "cutting.feed": "m", "cutting.depth": "m", "dynamometer.main": "N", "dynamometer.thrust": "N", "dynamometer.feed": "N",
    "x_drive.current": "A", "spindle_controller.reference": "rad/s", "spindle_encoder.angle": "rad",
}  # fmt: skip
DRIVEN = ("x_controller.reference", "cutting.feed", "cutting.depth", "spindle_controller.reference")
Columns = dict[str, np.ndarray]


def axis(seed: int = 0, count: int = 12000) -> Columns:
    """A servo axis: a reference with dwells, a lagging position, encoder and scale with noise and rounding, the command made from them."""
    rng = np.random.default_rng(seed)
    targets = np.repeat(rng.uniform(-0.05, 0.05, count // 1000 + 1), 1000)[:count]
    targets[: count // 12] = 0.0
    reference, position, speed = np.zeros(count), np.zeros(count), np.zeros(count)
    for now in range(1, count):
        reference[now] = reference[now - 1] + np.clip(targets[now] - reference[now - 1], -6e-5, 6e-5)
        speed[now] = speed[now - 1] + PERIOD * 80.0 * (40.0 * (reference[now] - position[now - 1]) - speed[now - 1])
        position[now] = position[now - 1] + PERIOD * speed[now]
    encoder = np.round((position + 2e-7 * rng.standard_normal(count)) / 1e-7) * 1e-7
    scale = np.round((position + 3e-6 * np.sin(position / 8e-4) + 2e-7 * rng.standard_normal(count)) / 1e-7) * 1e-7
    measured_speed = np.diff(encoder, prepend=encoder[0]) / PERIOD
    voltage = np.clip(60.0 * (40.0 * (reference - encoder) - measured_speed), -10.0, 10.0)
    tachometer = speed + 1e-4 * rng.standard_normal(count)
    return dict(zip(UNITS, (reference, encoder, scale, voltage, tachometer), strict=False))


def cut(seed: int = 0) -> Columns:
    """Passes of turning with air between them, measured by a dynamometer of three components."""
    rng = np.random.default_rng(seed)
    passes = np.repeat(np.arange(8), 1000)
    feed, depth = rng.uniform(5e-5, 4e-4, 8)[passes], rng.uniform(5e-4, 2e-3, 8)[passes]
    inside = (np.arange(8000) % 1000 > 200) & (np.arange(8000) % 1000 < 800)
    force = 2e9 * feed * depth * inside
    sensed = {
        f"dynamometer.{name}": share * force + rng.standard_normal(8000) for name, share in (("main", 1.0), ("thrust", 0.4), ("feed", 0.3))
    }
    return {"cutting.feed": feed * inside, "cutting.depth": depth * inside, **sensed}


def found(columns: Columns) -> list[Finding]:
    signals = tuple(
        SignalMapping(name, name, UNITS[name], 1.0, None, "drive" if name in DRIVEN else "compare", UNITS[name]) for name in columns
    )
    table = RawTable(columns, dict.fromkeys(columns, ""), Path("run.csv"))
    mapping = RecordingMapping(None, "s", 1.0 / PERIOD, signals)
    mapped = map_recording(table, mapping)
    assert mapped.findings == ()
    return recording_faults(mapped.record, mapping)


def with_values(columns: Columns, name: str, values: np.ndarray) -> Columns:
    return {**columns, name: values}


def exchanged(columns: Columns, one: str, other: str) -> Columns:
    return {**columns, one: columns[other], other: columns[one]}


def held(values: np.ndarray, begin: int, end: int) -> np.ndarray:
    return np.where((np.arange(len(values)) >= begin) & (np.arange(len(values)) < end), values[begin], values)


def given_again(values: np.ndarray, begins: tuple[int, ...], length: int) -> np.ndarray:
    found = values.copy()
    for begin in begins:
        found[begin : begin + length] = values[begin - length : begin]
    return found


def converted(values: np.ndarray, bits: int, count: float) -> np.ndarray:
    return np.clip(np.round(values / count), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1) * count


def late(values: np.ndarray, samples: int) -> np.ndarray:
    return np.concatenate([np.full(samples, values[0]), values[:-samples]])


ENCODER, SCALE, VOLTAGE, TACHOMETER, REFERENCE = (
    "x_encoder.position", "x_scale.position", "x_controller.voltage", "x_tachometer.speed", "x_controller.reference",
)  # fmt: skip
AXIS = axis()
CUT = cut()
MAIN, THRUST = "dynamometer.main", "dynamometer.thrust"
SECOND_PASS = np.sort(np.median(CUT[MAIN].reshape(8, 1000), axis=1))[-2]
"""Force of the second strongest pass: its noise is cut off there [N]."""
ONE_FORCE = {name: CUT[name] for name in ("cutting.feed", "cutting.depth", MAIN)}
FIRST_OF_MANY = float(np.median(CUT[MAIN][CUT[MAIN] > 50.0]))
"""A force that half of the cut is beyond: where it is cut off there hardly any noise grazes it [N]."""
CURRENT = 6.0 * np.sin(2.0 * np.pi * 0.4 * np.arange(12000) * PERIOD) + 0.01 * np.random.default_rng(5).standard_normal(12000)
NO_SPEED = {name: values for name, values in AXIS.items() if name != TACHOMETER}

PLANTED: dict[str, tuple[Callable[[], Columns], str, str]] = {
    "millimetres as metres": (lambda: with_values(AXIS, ENCODER, 1e3 * AXIS[ENCODER]), "unit", ENCODER),
    "inches": (lambda: with_values(AXIS, SCALE, AXIS[SCALE] / 25.4), "unit", SCALE),
    "reference as a diameter": (lambda: with_values(AXIS, REFERENCE, 2.0 * AXIS[REFERENCE]), "unit", REFERENCE),
    "speed in mm/s": (lambda: with_values(AXIS, TACHOMETER, 1e3 * AXIS[TACHOMETER]), "unit", TACHOMETER),
    "sign": (lambda: with_values(AXIS, ENCODER, -AXIS[ENCODER]), "sign", ENCODER),
    "columns swapped": (lambda: exchanged(NO_SPEED, ENCODER, VOLTAGE), "swapped", f"{ENCODER}, {VOLTAGE}"),
    "reference and encoder swapped": (
        lambda: exchanged({name: AXIS[name] for name in (REFERENCE, ENCODER)}, REFERENCE, ENCODER), "swapped", f"{REFERENCE}, {ENCODER}",
    ),
    "feed and depth swapped": (lambda: exchanged(CUT, "cutting.feed", "cutting.depth"), "swapped", "cutting.feed, cutting.depth"),
    "force in kN as N": (lambda: with_values(ONE_FORCE, MAIN, 1e-3 * CUT[MAIN]), "unit", MAIN),
    "one component amplified": (lambda: with_values(CUT, THRUST, 1e3 * CUT[THRUST]), "unit", THRUST),
    "frozen encoder": (lambda: with_values(AXIS, ENCODER, held(AXIS[ENCODER], 4100, 5300)), "frozen", ENCODER),
    "frozen speed": (lambda: with_values(AXIS, TACHOMETER, held(AXIS[TACHOMETER], 4100, 5300)), "frozen", TACHOMETER),
    "frozen force": (lambda: with_values(CUT, "dynamometer.main", held(CUT["dynamometer.main"], 3400, 3700)), "frozen", "dynamometer.main"),
    "clipped": (lambda: with_values(AXIS, ENCODER, np.clip(AXIS[ENCODER], -0.02, 0.02)), "clipped", ENCODER),
    "clipped force": (lambda: with_values(CUT, MAIN, np.minimum(CUT[MAIN], SECOND_PASS)), "clipped", MAIN),
    "force beyond its range": (lambda: with_values(CUT, MAIN, np.minimum(CUT[MAIN], 0.7 * FIRST_OF_MANY)), "clipped", MAIN),
    "current beyond its converter": (
        lambda: {**AXIS, "x_drive.current": converted(CURRENT, 12, 2e-3)}, "clipped", "x_drive.current",
    ),
    "stretch of a scale given again": (
        lambda: with_values(AXIS, SCALE, given_again(AXIS[SCALE], (1120, 3130, 5140), 50)), "repeated", SCALE,
    ),
    "rows dropped": (lambda: {name: np.delete(values, np.r_[3120:3160, 7050:7090]) for name, values in AXIS.items()}, "dropped", "time"),
    "rows dropped of a single place": (
        lambda: {name: np.delete(AXIS[name], np.r_[7050:7090]) for name in (ENCODER, VOLTAGE)}, "dropped", "time",
    ),
    "block written twice": (
        lambda: {name: np.concatenate([values[:5400], values[5100:]]) for name, values in AXIS.items()}, "repeated", "",
    ),
    "counter of 12 bits": (lambda: with_values(AXIS, SCALE, (AXIS[SCALE] + 0.5) % 4.096e-2), "wrapped", SCALE),
    "encoder late": (lambda: with_values(NO_SPEED, ENCODER, late(AXIS[ENCODER], 40)), "shift", VOLTAGE),
    "speed over a field bus": (lambda: with_values(AXIS, TACHOMETER, np.repeat(AXIS[TACHOMETER][::8], 8)), "slow", TACHOMETER),
    "constant column": (lambda: with_values(AXIS, SCALE, np.full(12000, 0.12)), "constant", SCALE),
}  # fmt: skip


@pytest.mark.parametrize("fault", PLANTED)
def test_a_planted_fault_is_named(fault: str) -> None:
    make, kind, channel = PLANTED[fault]
    serious = [(finding.kind, finding.channel) for finding in found(make()) if finding.serious]
    assert (kind, channel) in serious


@pytest.mark.parametrize("seed", range(4))
def test_a_sound_recording_has_no_fault(seed: int) -> None:
    assert found(axis(seed)) == []
    assert found(cut(seed)) == []


def test_sentences_say_what_was_seen() -> None:
    inches = found(PLANTED["inches"][0]())[0]
    assert inches.fact.endswith("times x_controller.reference throughout, as a mix-up of inches and millimetres leaves")
    assert inches.done == "check its unit and scale in the lesson"
    assert "x_scale.position: it does not move: 0.12 m in all 12000 samples." in map(str, found(PLANTED["constant column"][0]()))
    frozen = next(finding for finding in found(PLANTED["frozen encoder"][0]()) if finding.kind == "frozen")
    assert frozen.fact.endswith("m from 4.1 to 5.299 s")


def test_a_log_in_which_every_row_stands_twice_is_no_slow_channel() -> None:
    """All of its sensors are as slow; and a scale that moves steadily takes its counts in turn."""
    twice = {name: np.repeat(values, 2) for name, values in AXIS.items()}
    steady = with_values(NO_SPEED, SCALE, np.floor(np.arange(12000) / 5.0) * 1e-6)
    for columns in (twice, steady):
        assert "slow" not in [finding.kind for finding in found(columns)]
    (slow,) = [finding for finding in found(PLANTED["speed over a field bus"][0]()) if finding.kind == "slow"]
    assert slow.fact == "it changes in every 8th row only, each 8 ms, and other channels do between"


def test_an_axis_at_rest_has_no_fault() -> None:
    still = {name: values[:900] for name, values in AXIS.items()} | {VOLTAGE: np.zeros(900), ENCODER: np.zeros(900), SCALE: np.zeros(900)}
    assert [finding for finding in found(still) if finding.serious] == []


def test_a_command_that_repeats_itself_while_a_table_sticks_within_one_count_is_no_fault() -> None:
    """The tachometer is as noisy as ever; a command that stays where it is while its reference goes on is a fault."""
    paused = np.concatenate([np.arange(8180), np.full(200, 8180), np.arange(8180, 11800)])
    sticking = {name: AXIS[name][paused] for name in (REFERENCE, ENCODER, VOLTAGE)} | {TACHOMETER: AXIS[TACHOMETER]}
    assert [finding for finding in found(sticking) if finding.serious] == []
    counts = np.round(AXIS[SCALE][paused] / 1e-7) + np.random.default_rng(2).integers(0, 2, 12000)
    assert [finding for finding in found({**sticking, SCALE: 1e-7 * counts}) if finding.serious] == []
    (frozen,) = [finding for finding in found(with_values(sticking, REFERENCE, AXIS[REFERENCE])) if finding.serious]
    assert (frozen.kind, frozen.channel) == ("frozen", VOLTAGE)


def test_a_saturated_command_and_a_dwell_are_no_fault() -> None:
    limited = with_values(NO_SPEED, VOLTAGE, np.clip(AXIS[VOLTAGE], -1.0, 1.0))
    assert [finding for finding in found(limited) if finding.serious] == []


def test_a_force_at_its_limit_that_is_read_with_noise_is_no_fault() -> None:
    noise = np.random.default_rng(3).standard_normal(8000)
    assert found(with_values(CUT, MAIN, np.minimum(CUT[MAIN], SECOND_PASS) + noise)) == []


def test_a_current_that_stands_at_a_limit_of_its_drive_is_no_fault() -> None:
    """It is no number of a converter, and one side of it is enough."""
    limited = np.clip(CURRENT, -4.0, 4.094) + 2e-3 * np.random.default_rng(6).standard_normal(12000)
    assert [finding for finding in found({**AXIS, "x_drive.current": limited}) if finding.serious] == []


def test_a_cut_that_begins_and_ends_without_noise_is_no_fault() -> None:
    noiseless = {name: np.where(np.abs(values) < 10.0, 0.0, values) if "dynamometer" in name else values for name, values in CUT.items()}
    assert found(noiseless) == []


def test_a_time_offset_between_two_sensors_is_told_with_its_value() -> None:
    shifted = with_values({name: AXIS[name] for name in (REFERENCE, ENCODER, SCALE)}, SCALE, late(AXIS[SCALE], 12))
    assert [(finding.kind, finding.channel, finding.serious) for finding in found(shifted)] == [("shift", SCALE, False)]
    assert found(shifted)[0].fact.endswith("s (12.0 samples) after x_encoder.position")


def test_two_staircases_of_one_motion_that_are_never_a_count_apart_are_in_time() -> None:
    """A slow motion without noise: their rates are as alike a few samples apart, and one stands while the other goes on by half a count."""
    for size in (2e-2, 2e-3, 2e-4):
        place = size * np.sin(2.0 * np.pi * 0.05 * np.arange(12000) * PERIOD)
        coarse, fine = (np.round(place / count) * count for count in (1e-6, 5e-7))
        assert found({ENCODER: coarse, SCALE: fine}) == []


def test_a_clock_that_runs_slower_is_told_in_ppm() -> None:
    time = np.arange(12000.0)
    skewed = with_values(
        {name: AXIS[name] for name in (REFERENCE, ENCODER, SCALE)}, SCALE, np.interp(time * (1.0 - 4e-4), time, AXIS[SCALE])
    )
    skew = next(finding for finding in found(skewed) if finding.kind == "skew")
    assert skew.fact in {f"its clock runs {ppm} ppm slower than that of x_encoder.position" for ppm in range(380, 421)}


@pytest.mark.parametrize(
    ("ratio", "name"),
    [(25.41, "inches and millimetres"), (1e-3, "a lost or doubled milli"), (0.1592, "turns and radians"), (1.1, ""), (0.0, ""), (3.0, "")],
)
def test_known_factors(ratio: float, name: str) -> None:
    assert known_factor(ratio) == name


def signals(*entries: tuple[str, str, str, str]) -> tuple[SignalMapping, ...]:
    return tuple(
        SignalMapping(target, column, unit, 1.0, None, role, si) for target, column, unit, si in entries for role in [_role(target)]
    )


def _role(target: str):  # type: ignore[no-untyped-def]
    return "drive" if target.endswith(("reference", "torque")) else "compare"


def mill(axis_name: str) -> tuple[tuple[str, str, str, str], ...]:
    low = axis_name.lower()
    return (
        (f"{low}_controller.reference", f"{axis_name}1_CommandPosition", "mm", "m"),
        (f"{low}_encoder.position", f"{axis_name}1_ActualPosition", "mm", "m"),
        (f"{low}_axis.velocity", f"{axis_name}1_ActualVelocity", "mm/s", "m/s"),
        (f"{low}_drive.current", f"{axis_name}1_CurrentFeedback", "A", "A"),
    )


REAL = {
    "emps/DATA_EMPS.mat": ("t", None, signals(
        ("x_controller.reference", "qg", "m", "m"), ("x_encoder.position", "qm", "m", "m"), ("x_controller.voltage", "vir", "V", "V"))),
    "hsm150/idf_pos_0.06_1.mat": ("data_1", None, signals(
        ("spindle.torque", "data_5", "N*m", "N*m"), ("spindle_encoder.angle", "data_3", "rad", "rad"),
        ("tachometer.speed", "data_4", "rad/s", "rad/s"), ("drive.current", "data_7", "A", "A"))),
    "turning_forces/f416_a100.lvm": ("X_Value", None, signals(
        ("dynamometer.main", "Fz", "N", "N"), ("dynamometer.thrust", "Fx", "N", "N"), ("dynamometer.feed", "Fy", "N", "N"))),
    "umich_cnc/experiment_06.csv": (None, 10.0, signals(*mill("X"), *mill("Y"))),
    "umich_cnc/experiment_11.csv": (None, 10.0, signals(*mill("X"), *mill("Y"))),
}  # fmt: skip


@needs_shared
@pytest.mark.parametrize("name", REAL)
def test_recordings_of_real_machines_have_no_fault(name: str) -> None:
    time, rate, mapped_signals = REAL[name]
    mapping = RecordingMapping(time, "s", rate, mapped_signals)
    record = map_recording(read_recording(SHARED / "data" / name, stock_readers()), mapping).record
    assert recording_faults(record, mapping) == []


@needs_shared
def test_a_current_that_was_never_recorded_and_a_spindle_counter_that_ran_over() -> None:
    mapping = RecordingMapping(None, "s", 10.0, signals(*mill("Z"), *mill("S")))
    record = map_recording(read_recording(SHARED / "data" / "umich_cnc" / "experiment_01.csv", stock_readers()), mapping).record
    assert [(finding.kind, finding.channel) for finding in recording_faults(record, mapping)] == [
        ("constant", "z_drive.current"), ("wrapped", "s_controller.reference"), ("wrapped", "s_encoder.position"),
    ]  # fmt: skip


def test_a_speed_that_is_commanded_in_steps_is_not_frozen() -> None:
    """The spindle droops in each cut while the command stands; a command that misses the step of the motion is frozen."""
    time = np.arange(12000) * PERIOD
    after = np.clip(time - 6.0, 0.0, None)
    speed = 94.0 + 32.0 * (1.0 - np.exp(-after / 0.2)) - 4.0 * (time % 3.0 > 1.5)
    spindle = {"spindle_controller.reference": np.where(time > 6.0, 126.0, 94.0), "spindle_encoder.angle": np.cumsum(speed) * PERIOD}
    assert [finding for finding in found(spindle) if finding.serious] == []
    late_step = with_values(spindle, "spindle_controller.reference", np.where(time > 6.5, 126.0, 94.0))
    assert [finding.kind for finding in found(late_step) if finding.serious] == ["frozen"]
