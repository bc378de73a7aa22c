"""Text with one value a line: a name, date, time and value, as a monitor of EPICS prints it."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers

NAMES = ("rig:Enc", "rig:Axis-Pos")


def moment(seconds: float) -> str:
    return str(np.datetime64("2020-12-09T15:05:41", "us") + np.timedelta64(round(1e6 * seconds), "us")).replace("T", " ")


def events(rows: int = 60) -> list[tuple[str, float, float]]:
    """Return name, time [s] and value: the encoder each 10 ms, the axis each 20 ms and 5 ms beside, then at rest."""
    encoder = [(NAMES[0], 0.01 * row, 0.5 * row) for row in range(rows)]
    axis = [(NAMES[1], 0.01 * row + 0.005, 2.0 * row + 1.0) for row in range(0, rows // 2, 2)]
    return sorted(encoder + axis, key=lambda event: event[1])


def read(folder: Path, lines: list[str], name: str = "pvs.log") -> RawTable:
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_recording(path, stock_readers())


WRITTEN = {
    "blanks": lambda rows: [f"{name}   {moment(time)} {value:.8g}  " for name, time, value in rows],
    "states of alarms": lambda rows: [f"{name} {moment(time)} {value:.8g} HIHI MAJOR" for name, time, value in rows],
    "commas": lambda rows: [
        "name,date,time,value",
        *(f"{name},{moment(time).replace(' ', ',')},{value:.8g}" for name, time, value in rows),
    ],
    "stamp in a cell": lambda rows: [f"{name};{moment(time).replace(' ', 'T')}Z;{value:.8g}" for name, time, value in rows],
}


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_value_a_line_becomes_a_column_for_each_name(kind: str, tmp_path: Path) -> None:
    table = read(tmp_path, WRITTEN[kind](events()))
    assert list(table.columns) == ["time", *NAMES]
    assert table.units["time"] == "s"
    assert table.columns["time"] == pytest.approx(0.01 * np.arange(60))
    assert table.columns[NAMES[0]] == pytest.approx(0.5 * np.arange(60))
    # before its first value a name is not known, then it moves on a straight line, and where nothing more came it had not changed
    axis = table.columns[NAMES[1]]
    assert np.isnan(axis[0])
    assert axis[1:29] == pytest.approx(2.0 * np.arange(1, 29))
    assert axis[29:] == pytest.approx(57.0)


def test_a_set_point_that_changed_once_is_a_step(tmp_path: Path) -> None:
    rows = sorted([*events(), ("rig:Set", 0.0, 1.0), ("rig:Set", 0.3, 5.0)], key=lambda event: event[1])
    assert read(tmp_path, WRITTEN["blanks"](rows)).columns["rig:Set"].tolist() == [1.0] * 30 + [5.0] * 30


def test_a_name_that_is_not_there_is_told(tmp_path: Path) -> None:
    table = read(tmp_path, ["rig:X *** Not connected (PV not found)", *WRITTEN["blanks"](events())])
    assert table.notes == (
        "the file has one value per line; the rows are the 60 moments of rig:Enc",
        "rig:Axis-Pos: 15 values, put on these rows",
        "1 line holds no number and was left out",
    )


def test_a_table_with_a_name_in_each_row_stays_a_table(tmp_path: Path) -> None:
    lines = ["part,when,x,y", *(f"A,{moment(0.01 * row)},{row},{2 * row}" for row in range(30))]
    assert list(read(tmp_path, lines, "run.csv").columns) == ["when", "x", "y"]
