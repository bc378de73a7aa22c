"""What LinuxCNC's halsampler prints."""

from pathlib import Path

import numpy as np

from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers


def read(tmp_path: Path, text: str) -> RawTable:
    path = tmp_path / "axis.txt"
    path.write_text(text, encoding="utf-8")
    return read_recording(path, stock_readers())


def test_numbers_and_bits(tmp_path: Path) -> None:
    table = read(tmp_path, "1.250000 -3 TRUE \n1.500000 -2 FALSE \n1.750000 -1 TRUE \n")
    assert list(table.columns) == ["column_1", "column_2", "column_3"]
    assert table.columns["column_1"].tolist() == [1.25, 1.5, 1.75]
    assert table.columns["column_3"].tolist() == [1.0, 0.0, 1.0]


def test_the_number_of_the_sample_shows_an_overrun(tmp_path: Path) -> None:
    table = read(tmp_path, "100 0.5 1 \n101 0.6 1 \noverrun\n105 0.7 0 \n106 0.8 0 \n107 0.9 0 \n")
    assert table.columns["sample"].tolist() == [100.0, 101.0, 105.0, 106.0, 107.0]
    assert table.columns["column_2"].tolist() == [0.5, 0.6, 0.7, 0.8, 0.9]
    assert table.notes == ("3 samples are missing by their numbers (overrun)",)


def test_an_overrun_without_numbers_is_a_missing_row(tmp_path: Path) -> None:
    table = read(tmp_path, "0.5 1 \n0.6 1 \noverrun\n0.7 0 \n0.8 0 \n")
    assert np.isnan(table.columns["column_1"]).tolist() == [False, False, True, False, False]
    assert table.notes == ("1 rows have another number of cells, the first is line 3; they count as missing",)
