"""Tables of numbers in text, as measuring programs and spreadsheets write them in many countries."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError
from lathesim.recordings import raw_table
from lathesim.recordings.raw_table import RawTable, read_recording, split_unit
from lathesim.recordings.stock_readers import stock_readers
from tests.shared_data import SHARED, needs_shared

TIME = [0.0, 0.5, 1.0]
PLACE = [1.25, -2e-3, 3.0]
UNITS = {"t": "s", "x": "mm"}

WRITTEN = {
    "comma": "t [s],x [mm]\n0,1.25\n0.5,-2e-3\n1,3\n",
    "semicolon, comma, line ends of Windows": "t (s);x (mm)\r\n0,0;1,25\r\n0,5;-2e-3\r\n1,0;3\r\n",
    "tab and comma": "t [s]\tx [mm]\n0\t1,25\n0,5\t-0,002\n1\t3,0\n",
    "units in the second row": "t,x\ns,mm\n0,1.25\n0.5,-2E-3\n1,3\n",
    "units in brackets in the second row": "t;x\n[s];[mm]\n0;1.25\n0.5;-0.002\n1;3\n",
    "blanks around": "t [s] , x [mm]\n 0 , 1.25\n 0.5 ,-2e-3 \n 1 , 3 \n",
    "comment as header": "# drive 3\n# t [s],x [mm]\n0,1.25\n0.5,-0.002\n1,3\n",
    "preamble": "Device;DMM 7\nDate;2024-05-06\n\nt [s];x [mm]\n0;1.25\n0.5;-0.002\n1;3\n",
    "spreadsheet": "sep=;\nt [s];x [mm]\n0;1.25\n0.5;-0.002\n1;3\n",
    "quotes": '"t [s]","x [mm]"\n"0","1.25"\n"0.5","-0.002"\n"1","3"\n',
    "quotes and decimal comma": '"t [s]","x [mm]"\n"0,0","1,25"\n"0,5","-0,002"\n"1,0","3,0"\n',
    "delimiter at the end": "t [s];x [mm];\n0;1.25;\n0.5;-0.002;\n1;3;\n",
    "white space": "t [s]   x [mm]\n0  1.25\n0.5 -0.002\n1   3\n".replace("t [s]", "t").replace("x [mm]", "x"),
    "no last line end": "t [s],x [mm]\n0,1.25\n0.5,-0.002\n1,3",
    "old line ends": "t [s],x [mm]\r0,1.25\r0.5,-0.002\r1,3\r",
    "slash": "t / s;x / mm\n0;1.25\n0.5;-0.002\n1;3\n",
}


def read(path: Path, text: str | bytes, name: str = "run.csv") -> RawTable:
    """Write a file and read it."""
    file = path / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_recording(file, stock_readers())


@pytest.mark.parametrize("kind", WRITTEN)
def test_the_same_table_however_it_is_written(kind: str, tmp_path: Path) -> None:
    table = read(tmp_path, WRITTEN[kind])
    assert list(table.columns) == ["t", "x"]
    assert table.columns["t"].tolist() == TIME
    assert table.columns["x"].tolist() == PLACE
    if kind != "white space":
        assert table.units == UNITS


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    table = read(tmp_path, "Zeit [s];Kühlung [µm]\n0,5;1,5\n1,0;2,5\n".encode(encoding))
    assert table.units == {"Zeit": "s", "Kühlung": "um"}
    assert table.columns["Kühlung"].tolist() == [1.5, 2.5]


def test_a_file_without_names(tmp_path: Path) -> None:
    table = read(tmp_path, "0,1.25\n0.5,3\n")
    assert list(table.columns) == ["column_1", "column_2"]
    assert table.notes == ("the file names no columns; they are column_1, column_2 and so on",)


def test_one_column_alone(tmp_path: Path) -> None:
    assert read(tmp_path, "force [N]\n1,5\n2,5\n").columns["force"].tolist() == [1.5, 2.5]


def test_names_that_come_twice_or_not_at_all(tmp_path: Path) -> None:
    assert list(read(tmp_path, "t,x,x,\n0,1,2,3\n1,2,3,4\n").columns) == ["t", "x", "x_2", "column_4"]


def test_text_cells_become_nan_and_are_counted(tmp_path: Path) -> None:
    table = read(tmp_path, "t,x,state\n0,1,Prep\n1,n/a,Prep\n2,,Layer 1\n3,4,end\n")
    assert np.isnan(table.columns["x"]).tolist() == [False, True, True, False]
    assert table.notes == ("x: 2 of 4 cells hold no number", "left out, no numbers in them: state")


def test_bits_and_spelled_infinities(tmp_path: Path) -> None:
    table = read(tmp_path, "t,on,x\n0,TRUE,nan\n1,False,-inf\n2,true,1\n")
    assert table.columns["on"].tolist() == [1.0, 0.0, 1.0]
    assert np.isnan(table.columns["x"][0])
    assert table.columns["x"][1] == -np.inf


def test_date_and_time_become_seconds(tmp_path: Path) -> None:
    table = read(tmp_path, "when;x\n2025-11-14 23:59:59.250;1\n2025-11-15 00:00:00.500;2\n")
    assert table.columns["when"].tolist() == [0.0, 1.25]
    assert table.units["when"] == "s"


DATED = {
    "labels before their values": "When,2020-03-16 17:04:51,When,2020-03-16 17:04:51\nStep,0.5,Step,0.5\nName,t,Name,x\nUnit,s,Unit,mm\n",
    "a date beside a number": "2020-03-16 17:04:51;1000\na;b;c;d\n-;s;-;mm\n",
    "dates and rates alone": "2020-03-16 17:04:51,0.5,2020-03-16 17:04:51,0.5\nName,t,Name,x\nUnit,s,Unit,mm\n",
}


@pytest.mark.parametrize("kind", DATED)
def test_a_date_in_the_head_makes_no_column_a_time_stamp(kind: str, tmp_path: Path) -> None:
    mark = ";" if ";" in DATED[kind] else ","
    rows = [mark.join(f"{value:g}" for value in (0.5 * row, row, 0.5 * row, -row)) for row in range(30)]
    table = read(tmp_path, DATED[kind] + "\n".join(rows) + "\n")
    assert table.column("column_2")[-30:].tolist() == list(range(30))
    assert table.column("column_4")[-30:].tolist() == [-row for row in range(30)]
    assert [unit for unit in table.units.values() if unit] == ["s", "mm"]
    assert not np.isnan(table.column("column_1")[-30:]).any()


@pytest.mark.parametrize("head", ["Recorded 2024-03-05 12:33:01\nDate,05.03.2024\nt,u,a\n", "t,u,a\n0,0,0,1\n", "by,me\nt,u,a\n"])
def test_a_value_of_a_preamble_names_no_column(head: str, tmp_path: Path) -> None:
    """Names that could be units, as t, u and a, are names where nothing above them is."""
    table = read(tmp_path, head + "".join(f"{0.5 * row:g},{row},{-row}\n" for row in range(30)))
    assert list(table.columns) == ["t", "u", "a"]
    assert not any(table.units.values())


def test_a_column_is_found_by_each_text_above_it_and_by_its_place(tmp_path: Path) -> None:
    table = read(tmp_path, "Time,Analog 1\nms,Speed\n0,1\n0.5,2\n1,3\n")
    assert list(table.columns) == ["ms", "Speed"]
    for name in ("Analog 1", "Speed", "column_2"):
        assert table.column(name).tolist() == [1.0, 2.0, 3.0]


def test_a_row_too_short_counts_as_missing_and_keeps_its_place(tmp_path: Path) -> None:
    table = read(tmp_path, "t,x\n0,1\n1\n2,3\n3,4\n")
    assert np.isnan(table.columns["x"]).tolist() == [False, True, False, False]
    assert table.notes == ("1 rows have another number of cells, the first is line 3; they count as missing",)


def test_a_last_row_cut_off_is_dropped(tmp_path: Path) -> None:
    table = read(tmp_path, "t,x,y\n0,1,2\n1,2,3\n2,3")
    assert table.columns["t"].tolist() == [0.0, 1.0]
    assert table.notes == ("the last row is cut off and was dropped",)


def test_every_digit_is_kept(tmp_path: Path) -> None:
    values = np.random.default_rng(3).standard_normal(500) * 10.0 ** np.arange(500)[::-1].clip(0, 200)
    table = read(tmp_path, "x [m],n [1]\n" + "".join(f"{value!r},{number}\n" for number, value in enumerate(values.tolist())))
    assert np.array_equal(table.columns["x"], values)


def test_pieces_of_a_long_file_join_without_a_seam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "t,x,word\n" + "".join(f"{row},{-row * 0.25},{'a' if row % 7 else ''}\n" for row in range(3000))
    whole = read(tmp_path, text)
    monkeypatch.setattr("lathesim.recordings.number_rows.CHUNK", 1000)
    for ends in ("\n", "\r\n", "\r"):
        pieces = read(tmp_path, text.replace("\n", ends))
        assert np.array_equal(pieces.columns["t"], np.arange(3000.0))
        assert np.array_equal(pieces.columns["x"], whole.columns["x"])


def test_a_file_too_long_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw_table, "MOST_ROWS", 1000)
    with pytest.raises(LatheSimError) as refused:
        read(tmp_path, "t,x\n" + "0.5,1\n" * 2000)
    fact = "the file has 2 000 rows of 2 columns; at most 1 000 rows are read. Keep every n-th row, fewer columns, or a part of the time."
    assert str(refused.value) == f"{tmp_path / 'run.csv'}: {fact}"


@pytest.mark.parametrize("text", ["hello\nworld\n", "a,b\nc,d\n", "\n\n\n", b"\x00\x01\x02\x03\x04\x05" * 50])
def test_what_holds_no_numbers(text: str | bytes, tmp_path: Path) -> None:
    with pytest.raises(LatheSimError, match=r"run\.csv: the file ends in \.csv and holds no table of numbers in text\. Read are \.h5, "):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("time [s]", "time", "s"),
        ("x_axis.position [mm]", "x_axis.position", "mm"),
        ("velocity (filtered)", "velocity (filtered)", ""),
        ("force (kN)", "force", "kN"),
        ("gain [-]", "gain", ""),
        ("speed [m/s²]", "speed", "m/s^2"),
        ("m/s", "m/s", ""),
        ("[s]", "[s]", ""),
    ],
)
def test_units_in_headers(header: str, name: str, unit: str) -> None:
    assert split_unit(header) == (name, unit)


@needs_shared
def test_a_milling_machine_of_three_digits() -> None:
    table = read_recording(SHARED / "data" / "umich_cnc" / "experiment_01.csv", stock_readers())
    assert len(table.columns) == 48
    assert len(table.columns["X1_ActualPosition"]) == 1055
    assert table.columns["X1_ActualPosition"][[0, 2]].tolist() == [198.0, 196.0]
    assert table.notes == ("left out, no numbers in them: Machining_Process, tool_condition",)
