"""LabVIEW measurement files: one or more segments, with and without times, with decimal point or comma."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.shared_data import SHARED, needs_shared

HEADER = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{times}
Time_Pref\tRelative
Operator\tnobody
Date\t2024/03/11
Time\t09:12:44,5
***End_of_Header***\t
\t
"""
SEGMENT = """Channels\t2\t\t
Samples\t3\t3\t
Date\t2024/03/11\t2024/03/11\t
Time\t09:12:44\t09:12:44\t
Y_Unit_Label\tN\tV\t
X_Dimension\tTime\tTime\t
X0\t0{decimal}0\t0{decimal}0\t
Delta_X\t0{decimal}25\t0{decimal}25\t
***End_of_Header***\t\t\t
X_Value\tForce\tTacho\tComment
"""


def lvm(tmp_path: Path, times: str, decimal: str, *segments: str) -> RawTable:
    text = HEADER.format(times=times, decimal=decimal)
    for rows in segments:
        text += (SEGMENT.format(decimal=decimal) + rows.replace(" ", "\t")).replace(".", decimal) + "\t\n"
    path = tmp_path / "cut.lvm"
    path.write_text(text.replace("\n", "\r\n"), encoding="utf-8", newline="")
    return read_recording(path, stock_readers())


@pytest.mark.parametrize("decimal", [".", ","])
def test_one_segment_with_times(decimal: str, tmp_path: Path) -> None:
    table = lvm(tmp_path, "One", decimal, "0.0 1.5 -2\n0.25 2.5 3\n0.5 3.5 4\n")
    assert list(table.columns) == ["X_Value", "Force", "Tacho"]
    assert table.units == {"X_Value": "s", "Force": "N", "Tacho": "V"}
    assert table.columns["X_Value"].tolist() == [0.0, 0.25, 0.5]
    assert table.columns["Force"].tolist() == [1.5, 2.5, 3.5]
    assert table.columns["Tacho"].tolist() == [-2.0, 3.0, 4.0]


def test_without_times_they_follow_from_start_and_period(tmp_path: Path) -> None:
    table = lvm(tmp_path, "No", ".", " 1.5 -2\n 2.5 3\n 3.5 4\n")
    assert table.columns["X_Value"].tolist() == [0.0, 0.25, 0.5]
    assert table.columns["Force"].tolist() == [1.5, 2.5, 3.5]


def test_segments_follow_one_another(tmp_path: Path) -> None:
    rows = "0.0 1 2\n0.25 2 3\n0.5 3 4\n"
    table = lvm(tmp_path, "One", ".", rows, rows)
    assert table.columns["X_Value"].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25]
    assert table.columns["Force"].tolist() == [1.0, 2.0, 3.0, 1.0, 2.0, 3.0]
    assert table.notes == ("2 segments whose times start anew were set behind one another",)


def test_each_channel_with_its_own_times(tmp_path: Path) -> None:
    text = HEADER.format(times="Multi", decimal=".") + SEGMENT.format(decimal=".").replace("\tTacho", "\tX_Value\tTacho")
    path = tmp_path / "cut.lvm"
    path.write_text(text + "0\t1\t0.1\t5\n0.25\t2\t0.35\t6\n", encoding="utf-8")
    table = read_recording(path, stock_readers())
    assert list(table.columns) == ["X_Value", "Force", "X_Value_2", "Tacho"]
    assert table.columns["X_Value_2"].tolist() == [0.1, 0.35]
    assert table.units == {"X_Value": "s", "Force": "N", "X_Value_2": "s", "Tacho": "V"}


def test_a_missing_value_is_told(tmp_path: Path) -> None:
    table = lvm(tmp_path, "One", ".", "0 1 2\n0.25  3\n0.5 3 4\n")
    assert np.isnan(table.columns["Force"]).tolist() == [False, True, False]
    assert table.notes == ("Force: 1 of 3 cells hold no number",)


@needs_shared
def test_a_cut_on_a_lathe_with_dynamometer() -> None:
    table = read_recording(SHARED / "data" / "turning_forces" / "f416_a100.lvm", stock_readers())
    assert list(table.columns) == ["X_Value", "Fx", "Fy", "Fz", "Taco"]
    assert table.units["Fz"] == "Volts"
    assert len(table.columns["Fz"]) == 65000
    assert table.columns["X_Value"][-1] == 6.4999
    cut = (table.columns["X_Value"] > 2.0) & (table.columns["X_Value"] < 4.0)
    assert abs(table.columns["Fz"][cut].mean() - 725.6) < 25.0
