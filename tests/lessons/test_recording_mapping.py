"""A lesson says what the columns of a recording mean; its faults are told with the place in the lesson."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from lathesim.errors import LatheSimError
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.schema import ColumnEntry
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record_writer import save
from lathesim.recordings.mapping import RecordingMapping, SignalMapping, map_recording
from lathesim.recordings.raw_table import read_recording
from lathesim.recordings.sample_grid import Threshold
from lathesim.recordings.stock_readers import stock_readers
from tests.lessons.small_machine import small_registry, write_lesson

RECORDINGS = """\
recordings:
  time: {column: t, unit: ms}
  drive:
    table.force: {column: f, unit: kN, scale: 2}
  compare:
    ruler.reading: {column: q, unit: mm, resolution: 1 um}
"""
PUSHED = """\
recordings:
  time: {column: t, unit: s}
  drive: {x_axis.force: {column: push, unit: N}}
  compare: {x_encoder.position: {column: q, unit: m}}
"""


def mapping(folder: Path, body: str) -> RecordingMapping:
    prepared = prepare(load_lesson(write_lesson(folder, body)), small_registry())
    return mapping_of(prepared.case.lesson, prepared.machinery)


def test_units_come_from_the_machine(tmp_path: Path) -> None:
    path = tmp_path / "lesson.yaml"
    assert mapping(tmp_path, RECORDINGS) == RecordingMapping(
        "t",
        "ms",
        None,
        (
            SignalMapping("table.force", "f", "kN", 2.0, None, "drive", "N", also=("push.force",), place=f"{path}:7:27"),
            SignalMapping("ruler.reading", "q", "mm", 1.0, 1e-6, "compare", "m", place=f"{path}:9:29"),
        ),
        f"{path}:5:18",
        period=5e-3,
    )


@pytest.mark.parametrize(
    ("machine", "driven", "moves", "assumed"),
    [
        ("torque_spindle", "spindle.torque: {column: u, unit: N*m}", True, True),
        ("torque_spindle", "spindle.torque: {column: u, unit: N*m, held: true}", False, False),
        ("voltage_axis", "x_drive.voltage: {column: u, unit: V}", False, False),
        ("voltage_axis", "x_axis.force: {column: u, unit: N}", True, True),
        ("voltage_axis", "x_drive.voltage: {column: u, unit: V, held: false}", True, False),
        ("voltage_axis", "x_dac.command: {column: u, unit: V}", False, False),
        ("cascade_axis", "x_controller.reference: {column: u, unit: m}", False, False),
        ("led_axis", "x_axis.reference: {column: u, unit: m}", False, False),
        ("force_axis", "x_axis.force: {column: u, unit: N, above: 3 N, value: 2 N}", False, False),
    ],
)
def test_what_was_measured_moves_between_rows_and_what_was_commanded_is_held(
    machine: str, driven: str, moves: bool, assumed: bool, tmp_path: Path
) -> None:
    seen = "spindle.angle: {column: q, unit: rad}" if "spindle" in machine else "x_axis.position: {column: q, unit: m}"
    path = tmp_path / "driven.yaml"
    path.write_text(
        f"lesson: Driven\nmachine: {machine}\nduration: 1 s\nrecordings:\n  time: {{column: t, unit: s}}\n"
        f"  drive: {{{driven}}}\n  compare: {{{seen}}}\n",
        encoding="utf-8",
    )
    lesson = load_lesson(path)
    first = mapping_of(lesson, assemble(lesson, load_registry(installed=False))).signals[0]
    assert (first.between.moves, first.between.assumed) == (moves, assumed)


def test_the_unit_of_a_pure_number_needs_no_quotes() -> None:
    assert [ColumnEntry.model_validate({"column": "feed", "unit": unit}).unit for unit in (1, "1", "mm")] == ["1", "1", "mm"]
    with pytest.raises(ValidationError, match="the number 2 stands here, and a text is expected"):
        ColumnEntry.model_validate({"column": "feed", "unit": 2})


def test_a_rate_instead_of_a_time_column(tmp_path: Path) -> None:
    assert mapping(tmp_path, RECORDINGS.replace("column: t, unit: ms", "rate: 2 kHz")).rate == 2000.0


SWITCHED = RECORDINGS.replace("{column: f, unit: kN, scale: 2}", "{column: q, unit: mm, above: 60 um, lasting: 20 ms, value: 1 kN}")


def test_a_threshold_in_the_unit_of_the_column_and_a_value_in_that_of_the_input(tmp_path: Path) -> None:
    force = mapping(tmp_path, SWITCHED).signals[0]
    assert (force.unit, force.si_unit, force.also) == ("mm", "N", ("push.force",))
    assert force.threshold == Threshold(above=pytest.approx(60e-6), until_below=pytest.approx(60e-6), lasting=0.02, value=1000.0)


WRONG_SWITCH = {
    "no value": (", value: 1 kN", "", "'above' without 'value'. Write both, as in above: 60 N, value: 1 mm."),
    "no level": ("above: 60 um, lasting: 20 ms, ", "", "'value' without 'above'. Write both, as in above: 60 N, value: 1 mm."),
    "a level of another kind": ("above: 60 um", "above: 60 N", "'60 N' is given in N, but mm is wanted. Use a unit like mm."),
    "a value of another kind": ("value: 1 kN", "value: 1 mm", "'1 mm' is given in mm, but N is wanted. Use a unit like N."),
    "a value of nothing": ("value: 1 kN", "value: 0 N", "the value is 0, on as well as off. Write what the input is while it is on."),
    "a resolution": ("value: 1 kN", "value: 1 kN, resolution: 1 N", "an input that is only on or off has no resolution. Leave it out."),
}


@pytest.mark.parametrize("kind", WRONG_SWITCH)
def test_a_threshold_that_is_none(kind: str, tmp_path: Path) -> None:
    old, new, sentence = WRONG_SWITCH[kind]
    with pytest.raises(LatheSimError) as refused:
        mapping(tmp_path, SWITCHED.replace(old, new))
    assert str(refused.value).startswith(f"{tmp_path / 'lesson.yaml'}:7:")
    assert sentence in str(refused.value)


WRONG = {
    "no mapping": (
        "",
        ": the lesson does not say what the columns of a recording mean. Add recordings: {time: {column: t, unit: s}, "
        "drive: {x_controller.reference: {column: r, unit: m}}, compare: {...}}.",
    ),
    "nothing compared": (
        RECORDINGS.partition("  compare")[0],
        ":4:1: the lesson compares nothing with the recording. Add compare: {x_encoder.position: {...}}.",
    ),
    "scale of zero": (RECORDINGS.replace("scale: 2", "scale: 0"), ":7:47: the scale is 0. Leave it out, or write another number."),
    "rate of zero": (RECORDINGS.replace("column: t, unit: ms", "rate: 0 Hz"), ":5:16: the rate is 0 Hz. Write a rate above 0 Hz."),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_mapping_that_maps_nothing(kind: str, tmp_path: Path) -> None:
    body, sentence = WRONG[kind]
    with pytest.raises(LatheSimError) as refused:
        mapping(tmp_path, body)
    assert str(refused.value) == f"{tmp_path / 'lesson.yaml'}{sentence}"


def test_a_missing_column_is_told_with_its_place_in_the_lesson(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t [ms],f [kN],qq [mm]\n" + "".join(f"{row},1,{row}\n" for row in range(50)), encoding="utf-8")
    with pytest.raises(LatheSimError) as refused:
        map_recording(read_recording(tmp_path / "run.csv", stock_readers()), mapping(tmp_path, RECORDINGS))
    assert str(refused.value) == f"{tmp_path / 'lesson.yaml'}:9:29: run.csv has no column 'q'. Did you mean 'qq'?"


def test_the_record_of_a_run_maps_itself(tmp_path: Path) -> None:
    prepared = prepare(load_lesson(write_lesson(tmp_path, RECORDINGS)), small_registry())
    run = run_prepared(prepared)
    save(run, tmp_path / "run.h5")
    mapped = map_recording(read_recording(tmp_path / "run.h5", stock_readers()), mapping_of(prepared.case.lesson, prepared.machinery))
    assert np.allclose(mapped.record["table.force"], run["push.force"], rtol=1e-14)
    assert np.allclose(mapped.record["ruler.reading"], run["ruler.reading"], rtol=1e-14)
    assert [finding.kind for finding in mapped.findings] == ["mapping", "mapping", "mapping"]


def test_a_lesson_that_only_a_recording_drives_says_how_to_see_it(tmp_path: Path) -> None:
    text = f"lesson: A table that is pushed\nmachine: force_axis\nsample_period: 2 ms\nstep: 1 ms\n{PUSHED}"
    (tmp_path / "pushed.yaml").write_text(text, encoding="utf-8")
    prepared = prepare(load_lesson(tmp_path / "pushed.yaml"), load_registry(installed=False))
    with pytest.raises(LatheSimError) as refused:
        run_prepared(prepared)
    assert str(refused.value) == (
        "pushed: a recording drives this lesson (x_axis.force), and none is given. "
        "Name one, as in 'lathesim run LESSON --recording FILE'; without one it needs a 'duration:'."
    )


def test_a_column_of_counts_has_the_size_of_its_encoder_or_of_the_lesson(tmp_path: Path) -> None:
    """The ruler of the small machine measures exactly, so the lesson says what a count is worth; an encoder says it itself."""
    counted = RECORDINGS.replace("unit: mm, resolution: 1 um", "unit: counts, resolution: 2 um, scale: -1")
    assert mapping(tmp_path, counted).signals[1] == SignalMapping(
        "ruler.reading", "q", "m", -2e-6, 2e-6, "compare", "m", place=f"{tmp_path / 'lesson.yaml'}:9:29"
    )
    with pytest.raises(LatheSimError, match=r"nothing says what one of the counts of ruler\.reading is worth\. Add the size of one count"):
        mapping(tmp_path, RECORDINGS.replace("unit: mm, resolution: 1 um", "unit: counts"))
    path = tmp_path / "axis.yaml"
    path.write_text(
        "lesson: Pushed\nmachine: force_axis\n" + PUSHED.replace("column: q, unit: m", "column: q, unit: counts"), encoding="utf-8"
    )
    registry = load_registry()
    prepared = prepare(load_lesson(path), registry)
    found = mapping_of(prepared.case.lesson, prepared.machinery).signals[1]
    assert (found.unit, found.scale, found.resolution) == ("m", pytest.approx(5e-8), pytest.approx(5e-8))
