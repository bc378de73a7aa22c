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
