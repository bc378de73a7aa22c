"""Columns become channels in SI on an even clock, and everything that was mended is said."""

import re
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError, RecordingError
from lathesim.identification.replay.loading import noise_of_rows
from lathesim.recordings.mapping import BetweenRows, Finding, MappedRecording, RecordingMapping, SignalMapping, map_recording
from lathesim.recordings.raw_table import RawTable
from lathesim.recordings.sample_grid import Threshold, row_noise

TIME = np.arange(1000) * 1e-3
PLACE = 50.0 + 10.0 * np.sin(7.0 * TIME)
ENCODER = SignalMapping("x_encoder.position", "q", "mm", 1.0, 1e-6, "compare", "m", place="lesson.yaml:9:40")
COMMAND = SignalMapping("x_dac.command", "u", "V", 1.0, None, "drive", "V")
VOLTAGE = SignalMapping("x_dac.voltage", "u", "V", -2.0, None, "compare", "V", offset=0.5)


def table(units: dict[str, str] | None = None, **columns: np.ndarray) -> RawTable:
    known = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    return RawTable(known, {name: (units or {}).get(name, "") for name in known}, Path("run.csv"))


def mapped(given: RawTable, *signals: SignalMapping, time: str | None = "t", unit: str = "s", rate: float | None = None) -> MappedRecording:
    mapping = RecordingMapping(time, unit, rate, signals or (ENCODER,), "lesson.yaml:7:18")
    return map_recording(given, mapping)


def test_units_scale_offset_and_resolution() -> None:
    found = mapped(table(t=TIME * 1e3, q=PLACE, u=TIME), ENCODER, VOLTAGE, unit="ms")
    assert found.findings == ()
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE, rtol=1e-15)
    assert np.allclose(found.record["x_dac.voltage"], 0.5 - 2.0 * TIME, rtol=1e-15)
    assert found.record.unit("x_encoder.position") == "m"
    assert found.resolution == {"x_encoder.position": 1e-6}
    assert found.record.meta["sample_period"] == 1e-3
    assert found.record.time[-1] == 999 * 1e-3


def test_a_clock_that_starts_late_starts_at_zero_here() -> None:
    found = mapped(table(t=TIME + 12.5, q=PLACE))
    assert found.record.time[0] == 0.0
    assert found.record.meta["original_start"] == 12.5


def test_milliseconds_since_1970_are_as_even_as_any() -> None:
    """In seconds they are no whole numbers, and a float counts them in quarters of a microsecond."""
    found = mapped(table(t=1717000123456.0 + 1e3 * TIME, q=PLACE), unit="ms")
    assert found.findings == ()
    assert found.record.sample_period == 1e-3
    assert found.record.meta["original_start"] == pytest.approx(1717000123.456, abs=1e-6)


def test_seconds_since_1970_are_as_even_as_any() -> None:
    """A float counts them in quarters of a microsecond, and no single step is the period."""
    count = 30_000
    found = mapped(table(t=1748959507.25 + 1e-3 * np.arange(count), q=np.resize(PLACE, count)))
    assert found.findings == ()
    assert found.record.sample_period == 1e-3
    assert len(found.record) == count


def test_a_rate_instead_of_times() -> None:
    found = mapped(table(q=PLACE), time=None, rate=10.0)
    assert found.record.sample_period == 0.1
    assert found.record.time[-1] == pytest.approx(99.9)


@pytest.mark.parametrize("digits", [4, 6, 10])
def test_rounded_times_give_the_round_period(digits: int) -> None:
    time = np.array([float(f"{moment:.{digits}g}") for moment in np.arange(5000) * 2e-3])
    found = mapped(table(t=time, q=np.resize(PLACE, 5000)))
    assert found.record.sample_period == 2e-3
    assert found.findings == ()


def test_times_with_too_few_digits_are_taken_as_even() -> None:
    time = np.round(TIME, 2)
    found = mapped(table(t=time, q=PLACE))
    assert found.record.sample_period == pytest.approx(1e-3, rel=1e-3)
    fact = "the times have 101 values for 1000 rows"
    assert [(finding.kind, finding.fact, finding.serious) for finding in found.findings] == [("time", fact, False)]


def test_uneven_times_are_interpolated() -> None:
    rng = np.random.default_rng(1)
    time = np.sort(TIME + rng.uniform(-0.3e-3, 0.3e-3, len(TIME)))
    found = mapped(table(t=time, q=50.0 + 10.0 * np.sin(7.0 * time)))
    there = found.record.meta["original_start"] + found.record.time
    assert np.abs(found.record["x_encoder.position"] - 1e-3 * (50.0 + 10.0 * np.sin(7.0 * there))).max() < 1e-6
    assert [finding.kind for finding in found.findings] == ["jitter"]
    assert "interpolated onto an even clock" in found.findings[0].done


def uneven(seed: int = 3, rows: int = 104) -> np.ndarray:
    """Return times of rows 5 to 7 ms apart, of which every tenth comes 45 ms late [s]."""
    steps = np.random.default_rng(seed).uniform(5e-3, 7e-3, rows)
    steps[9::10] = 45e-3
    return np.cumsum(steps) - steps[0]


HELD = SignalMapping("x_dac.command", "u", "V", 1.0, None, "drive", "V", between=BetweenRows(held=True))


def test_an_uneven_log_with_long_gaps_is_used_whole_on_the_lessons_clock() -> None:
    """What moves goes on straight lines, and what is held acts from the sample nearest to its row."""
    time = uneven()
    mapping = RecordingMapping("t", "s", None, (ENCODER, HELD), period=3e-3)
    found = map_recording(table(t=time, q=100.0 * time + 5.0 * time**2, u=np.floor(time / 0.1)), mapping)
    there, record = found.record.time, found.record
    assert record.sample_period == 6e-3  # about as fast as the rows come, and each second decision of the lesson's controllers
    assert len(record) == int(time[-1] / 6e-3) + 1
    assert np.abs(record["x_encoder.position"] - 1e-3 * (100.0 * there + 5.0 * there**2)).max() < 1e-5
    rows = np.searchsorted(time, there + 3e-3, side="right") - 1
    assert np.array_equal(record["x_dac.command"], np.floor(time / 0.1)[rows])
    assert re.match(
        r"time: the rows come unevenly, 5 ms to 45 ms apart; the 104 rows are interpolated onto an even clock of 6 ms; .*"
        r"time: 10 long gaps leave \d+ of \d+ samples without a row, the longest of 45 ms from 0\.\d+ s on; no motion turns there,",
        " ".join(map(str, found.findings)),
    )


def test_the_uneven_log_of_a_servo_is_put_on_its_own_clock() -> None:
    """A bus servo decides every 5 ms and answers a question of the bus about every 20.5 ms: its loop is simulated between the rows."""
    time = np.cumsum(np.random.default_rng(5).uniform(20.1e-3, 20.9e-3, 200))
    found = map_recording(table(t=time, q=30.0 * np.sin(time)), RecordingMapping("t", "s", None, (ENCODER,), period=5e-3))
    there = found.record.meta["original_start"] + found.record.time
    assert found.record.sample_period == pytest.approx(20e-3, rel=1e-9)
    assert np.abs(found.record["x_encoder.position"] - 30e-3 * np.sin(there)).max() < 1e-5


def test_a_log_in_whose_gaps_the_motion_turns_is_refused_with_them() -> None:
    time = uneven()
    turning = np.where(np.arange(1, 105) // 10 % 2 == 0, 0.0, 10.0) + time
    with pytest.raises(RecordingError) as refused:
        mapped(table(t=time, q=turning))
    assert re.fullmatch(
        r"run\.csv: the recording has 10 gaps too long to interpolate, the longest of up to 0\.05\d+ s from [\d.]+ s on\. "
        r"The longest stretch between them has \d+ samples; at least 20 are needed\. Record without gaps\. .*\(numpy\.interp\)\.",
        str(refused.value),
    )


def test_a_blink_of_an_even_clock_is_the_way_of_the_clock_where_it_comes_again_and_again() -> None:
    kept = np.arange(1000) % 13 < 7
    found = mapped(table(t=TIME[kept], q=PLACE[kept], u=np.floor(TIME * 20.0)[kept]), ENCODER, HELD)
    assert len(found.record) >= 994
    assert np.abs(found.record["x_encoder.position"] - 1e-3 * PLACE[: len(found.record)]).max() < 1e-5
    assert set(np.unique(found.record["x_dac.command"])) == set(range(20))


def test_interpolated_readings_have_the_noise_of_their_rows() -> None:
    """Between two readings it is smaller, and a count is no longer to be seen."""
    rng = np.random.default_rng(4)
    time = uneven(rows=2000)
    found = mapped(table(t=time, q=50.0 + 10.0 * np.sin(time) + 0.2 * rng.standard_normal(2000)))
    assert found.marks is not None
    assert row_noise(found.marks, found.taken["x_encoder.position"]) == pytest.approx(0.2e-3, rel=0.1)
    assert row_noise(np.arange(2000.0), np.arange(2000.0) ** 3) == pytest.approx(0.0, abs=1e-3)
    counted = noise_of_rows(mapped(table(t=time, q=np.round(time))))
    assert counted == {"x_encoder.position": pytest.approx(1e-3 / np.sqrt(12.0))}


def test_several_rows_make_a_sample() -> None:
    mapping = RecordingMapping("t", "s", None, (ENCODER,), mean_of=4)
    found = map_recording(table(t=TIME[:999], q=PLACE[:999]), mapping)
    assert found.record.sample_period == pytest.approx(4e-3)
    assert found.record["x_encoder.position"] == pytest.approx(1e-3 * PLACE[:996].reshape(249, 4).mean(axis=1))


def test_a_sample_of_more_rows_than_there_are_is_refused() -> None:
    with pytest.raises(RecordingError, match="100000 rows make a sample, and 1000 rows make 0 of them; at least 20 are needed"):
        map_recording(table(t=TIME, q=PLACE), RecordingMapping("t", "s", None, (ENCODER,), mean_of=100_000))


FORCE = np.where((TIME > 0.2) & (TIME < 0.7), 0.5, 0.0)
CUT = SignalMapping("cutting.depth", "F", "kN", 1.0, None, "drive", "m", place="l.yaml:3:9", threshold=Threshold(60.0, 60.0, 0.01, 1e-3))


def test_a_threshold_tells_when_an_input_is_on() -> None:
    found = mapped(table(t=TIME, F=FORCE), CUT)
    assert np.array_equal(found.record["cutting.depth"], np.where(FORCE > 0.0, 1e-3, 0.0))
    assert found.record.unit("cutting.depth") == "m"
    assert str(found.findings[0]) == ("cutting.depth: 'F' is above 0.06 kN from 0.201 to 0.7 s; the channel is on there and 0 elsewhere.")


def test_a_threshold_that_is_never_reached() -> None:
    with pytest.raises(LatheSimError) as refused:
        mapped(table(t=TIME, F=0.1 * FORCE), CUT)
    assert str(refused.value) == (
        "l.yaml:3:9: 'F' never stays above 0.06 kN; the largest value is 0.05 kN. Write a lower threshold, or a shorter 'lasting'."
    )


def test_short_gaps_are_bridged() -> None:
    kept = np.ones(1000, dtype=bool)
    kept[[100, 101, 500, 501, 502, 503]] = False
    found = mapped(table(t=TIME[kept], q=PLACE[kept]))
    assert len(found.record) == 1000
    assert np.abs(found.record["x_encoder.position"] - 1e-3 * PLACE).max() < 1e-6
    assert found.findings == (Finding("gap", "", "6 samples are missing in gaps of fewer than 5", "interpolated linearly"),)


def test_of_a_recording_with_a_long_gap_the_longest_stretch_is_kept() -> None:
    kept = np.r_[0:300, 320:1000]
    found = mapped(table(t=TIME[kept], q=PLACE[kept]))
    assert len(found.record) == 680
    assert found.record.meta["original_start"] == pytest.approx(0.32)
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE[320:])
    assert found.findings[0].fact == "the recording has a gap too long to interpolate, the longest of up to 0.021 s from 0.299 s on"
    assert found.findings[0].done == "kept is the longest whole stretch, 0.32 to 0.999 s; 320 samples are left out"


def test_cells_without_a_number() -> None:
    spoiled = PLACE.copy()
    spoiled[[10, 11, 12, 700]] = np.nan
    found = mapped(table(t=TIME, q=spoiled, u=TIME), ENCODER, VOLTAGE)
    assert np.abs(found.record["x_encoder.position"] - 1e-3 * PLACE).max() < 1e-6
    assert found.findings == (
        Finding("missing", "x_encoder.position", "4 values are missing, in runs of fewer than 5", "interpolated linearly"),
    )
    spoiled[400:450] = np.inf
    found = mapped(table(t=TIME, q=spoiled, u=TIME), ENCODER, VOLTAGE)
    assert len(found.record) == 550
    assert found.findings[-1].channel == "x_encoder.position"


@pytest.mark.parametrize(("present", "fact"), [(0, "none of the 1000 values is a number"), (400, "600 of 1000 values are missing")])
def test_a_channel_without_numbers_is_serious(present: int, fact: str) -> None:
    values = np.where(np.arange(1000) < present, PLACE, np.nan)
    found = mapped(table(t=TIME, q=values, u=TIME), ENCODER, VOLTAGE)
    assert found.findings == (Finding("missing", "x_encoder.position", fact, "the channel is left empty", True),)
    assert len(found.record) == 1000
    assert np.isnan(found.record["x_encoder.position"]).all()


def test_a_single_sample_far_from_its_neighbours_is_bridged() -> None:
    rng = np.random.default_rng(2)
    clean = PLACE + 1e-3 * rng.standard_normal(1000)
    spoiled = clean.copy()
    spoiled[[333, 777]] = [1e6, 0.0]
    found = mapped(table(t=TIME, q=spoiled))
    assert np.abs(found.record["x_encoder.position"] - 1e-3 * clean).max() < 1e-5
    assert found.findings == (
        Finding("spike", "x_encoder.position", "2 samples stand far from their neighbours, the first at 0.333 s", "interpolated linearly"),
    )


def test_a_ramp_that_turns_round_has_no_spike() -> None:
    ramp = np.concatenate([np.zeros(400), np.arange(0.0, 201.0), np.arange(199.0, -1.0, -1.0), np.zeros(199)])
    assert mapped(table(t=TIME, q=ramp)).findings == ()


def test_a_command_that_kicks_for_one_sample_is_taken_as_it_was() -> None:
    """What was commanded was done, and what is measured beside the kick answers to it; elsewhere a single sample is still bridged."""
    rng = np.random.default_rng(2)
    place, asked = PLACE + 1e-3 * rng.standard_normal(1000), 0.01 * rng.standard_normal(1000)
    asked[100] = 50.0
    place[[102, 777]] = [1e6, 0.0]
    found = mapped(table(t=TIME, q=place, u=asked), ENCODER, COMMAND)
    assert np.array_equal(found.record["x_dac.command"], asked)
    assert found.record["x_encoder.position"][102] == pytest.approx(1e3)
    assert abs(found.record["x_encoder.position"][777] - 1e-3 * PLACE[777]) < 1e-5
    assert [str(finding) for finding in found.findings] == [
        "x_encoder.position: 1 sample stands far from its neighbours, at 0.777 s; interpolated linearly.",
        "x_dac.command: 1 sample stands far from its neighbours, at 0.1 s; taken as commanded.",
    ]
    asked[100] = np.nan
    assert np.isfinite(mapped(table(t=TIME, q=PLACE, u=asked), ENCODER, COMMAND).record["x_dac.command"]).all()


def test_repeated_and_unordered_times() -> None:
    rows = np.arange(1000)
    rows[[400, 401]] = [401, 400]
    rows = np.insert(rows, [600, 800], [599, 799])
    found = mapped(table(t=TIME[rows], q=PLACE[rows]))
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE)
    assert [str(finding) for finding in found.findings] == [
        "time: 1 row is earlier than the row before; the rows are sorted by time.",
        "time: 2 rows repeat the time of the row before; the first of them is used.",
    ]


def test_a_clock_that_starts_anew() -> None:
    rows = np.r_[0:300, 0:700]
    found = mapped(table(t=TIME[rows], q=PLACE[rows]))
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE[:700])
    assert str(found.findings[0]) == "time: the clock starts anew 1 time; kept is the longest stretch, 700 of 1000 rows from row 301 on."


def test_buffers_that_were_written_twice_are_kept_once() -> None:
    rows = np.r_[0:500, 460:900, 850:1000]
    found = mapped(table(t=TIME[rows], q=PLACE[rows]))
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE[:1000])
    told = "time: the clock goes back 2 times and runs on: 90 rows were written twice; each is kept once."
    assert [str(finding) for finding in found.findings] == [told]


def test_another_unit_in_the_file_than_in_the_lesson_is_serious() -> None:
    found = mapped(table({"q": "um", "t": "ms"}, t=TIME, q=PLACE))
    assert [(finding.kind, finding.channel, finding.serious) for finding in found.findings] == [
        ("unit", "x_encoder.position", True),
        ("unit", "time", True),
    ]
    assert found.findings[0].fact == "the unit of 'q' is um in the file and mm in the lesson, a factor of 0.001"
    assert found.findings[0].done == "the lesson's unit is used; write unit: um there if the file is right"


def test_a_label_of_another_kind_is_told_and_the_lesson_counts() -> None:
    found = mapped(table({"q": "V"}, t=TIME, q=PLACE))
    assert [(finding.fact, finding.serious) for finding in found.findings] == [
        ("the file calls 'q' V and the lesson reads it as mm", False),
    ]


def test_a_record_maps_itself_by_its_names() -> None:
    own = table({"time": "s", "x_encoder.position": "m"}, time=TIME, **{"x_encoder.position": 1e-3 * PLACE})
    found = mapped(own)
    assert np.allclose(found.record["x_encoder.position"], 1e-3 * PLACE)
    assert [str(finding) for finding in found.findings] == [
        "x_encoder.position: the file has no column 'q', but one called 'x_encoder.position' in m; it is used.",
        "time: the file has no column 't', but one called 'time' in s; it is used.",
    ]


REFUSED = {
    "missing column": (table(t=TIME, place=PLACE), "lesson.yaml:9:40: run.csv has no column 'q'. It has t, place."),
    "near column": (table(t=TIME, place=PLACE, q_=PLACE), "lesson.yaml:9:40: run.csv has no column 'q'. Did you mean 'q_'?"),
    "missing time": (table(q=PLACE, tt=TIME), "lesson.yaml:7:18: run.csv has no column 't' for the time. Did you mean 'tt'?"),
    "ten samples": (
        table(t=TIME[:10], q=PLACE[:10]),
        "run.csv: the recording has 10 usable samples; at least 20 are needed. Record longer, or map other columns.",
    ),
    "times without a number": (
        table(t=np.full(1000, np.nan), q=PLACE),
        "run.csv: the recording has 0 usable samples; at least 20 are needed. Record longer, or map other columns.",
    ),
    "other lengths": (
        table(t=TIME, q=PLACE[:-1]),
        "run.csv: the columns differ in length: q 999, t 1000. Map columns of one measurement.",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_mapped(kind: str) -> None:
    given, sentence = REFUSED[kind]
    with pytest.raises(LatheSimError) as refused:
        mapped(given)
    assert str(refused.value) == sentence
