"""Traces of controls and drives: a file of each form is read back as it was written, with its units and its clock."""

from pathlib import Path

import pytest

from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.recordings.trace_files import FILES, SCOPES, Expected, scope_expected


def read(path: Path) -> RawTable:
    return read_recording(path, stock_readers())


def assert_equal(table: RawTable, expected: Expected) -> None:
    assert list(table.columns) == list(expected)
    for name, (unit, values) in expected.items():
        assert table.units[name] == unit
        assert table.columns[name] == pytest.approx(values, rel=1e-12, abs=1e-9, nan_ok=True), name


@pytest.mark.parametrize("form", FILES)
def test_a_trace_is_read_as_it_was_written(form: str, tmp_path: Path) -> None:
    file = FILES[form]
    if file.library:
        pytest.importorskip(file.library)
    file.write(tmp_path / file.name)
    assert_equal(read(tmp_path / file.name), file.expected)


@pytest.mark.parametrize("variant", SCOPES)
def test_every_variant_of_twincat_scope_is_one_table(variant: str, tmp_path: Path) -> None:
    path = tmp_path / "scope.csv"
    SCOPES[variant].write(path)
    symbols = ("MAIN.place", "MAIN.test", "MAIN.fast")
    assert_equal(read(path), scope_expected(*symbols) if variant == "blanks" else scope_expected())


def test_the_comma_of_a_halscope_in_another_language_is_a_point_and_a_signal_may_come_twice(tmp_path: Path) -> None:
    path = tmp_path / "halscope.log"
    row = "ahc.arc-ok +1,00000000000000 joint.3.motor-pos-cmd -16,71899999938447 ahc.arc-ok +1,00000000000000 \n"
    path.write_text("Sampling period is 100000 nSec \n\n" + row * 120, encoding="utf-8")
    table = read(path)
    assert table.notes == ()
    assert {name: values[-1] for name, values in table.columns.items()} == pytest.approx(
        {"time": 0.0119, "ahc.arc-ok": 1.0, "joint.3.motor-pos-cmd": -16.71899999938447, "ahc.arc-ok_2": 1.0}
    )


def test_a_line_of_statistics_may_stand_above_the_head_of_klipper(tmp_path: Path) -> None:
    path = tmp_path / "raw.csv"
    FILES["Klipper accelerometer"].write(path)
    path.write_text("##freq 3200, 12 errors\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    assert_equal(read(path), FILES["Klipper accelerometer"].expected)
