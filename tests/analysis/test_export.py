"""A record written for other programs comes back bit for bit."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from lathesim.analysis.export import csv_header, export, mat_names
from lathesim.errors import LatheSimError
from lathesim.record import Channel, Record
from lathesim.recordings.raw_table import read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.analysis.small_record import shoulder


def odd_record() -> Record:
    rng = np.random.default_rng(5)
    values = rng.standard_normal(400) * 10.0 ** rng.integers(-300, 300, 400)
    values[[3, 7, 11, 13]] = [0.0, -0.0, np.nan, 5e-324]
    return shoulder().between(0.0, 1.995).with_channel("x_axis.jerk", "m/s^3", values).with_channel("cutting.engaged", "1", np.ones(400))


@pytest.mark.parametrize("suffix", [".csv", ".mat"])
def test_every_bit_comes_back(suffix: str, tmp_path: Path) -> None:
    record = odd_record()
    export(record, tmp_path / f"run{suffix}")
    table = read_recording(tmp_path / f"run{suffix}", stock_readers())
    assert set(table.columns) == {"time", *record.channels}
    assert table.columns["time"].tobytes() == record.time.tobytes()
    for name, channel in record.channels.items():
        assert table.columns[name].tobytes() == channel.values.tobytes(), name
        assert table.units[name] == channel.unit


def test_the_first_line_names_channels_with_units(tmp_path: Path) -> None:
    record = Record(np.array([0.0, 0.1]), {"x_axis.position": Channel("x_axis.position", "m", np.array([1.0, 2.5]))})
    export(record, tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text(encoding="utf-8") == "time [s],x_axis.position [m]\n0.0,1.0\n0.1,2.5\n"
    assert csv_header(record) == "time [s],x_axis.position [m]"


def test_names_and_units_in_matlab(tmp_path: Path) -> None:
    export(shoulder(), tmp_path / "run.mat")
    content = loadmat(tmp_path / "run.mat", squeeze_me=True)
    assert content["x_axis_position"].shape == (801,)
    assert str(content["units"]["x_axis_velocity"]) == "m/s"
    assert str(content["names"]["x_axis_velocity"]) == "x_axis.velocity"


def test_matlab_names_are_legal_and_unique() -> None:
    names = ["a.b", "a_b", "9.lives", "end", "x." + 80 * "y", "x." + 81 * "y", "units"]
    legal = list(mat_names(names).values())
    assert legal[:4] == ["a_b", "a_b_2", "c_9_lives", "c_end"]
    assert len(set(legal)) == len(names)
    assert max(map(len, legal)) <= 63


def test_what_cannot_be_exported(tmp_path: Path) -> None:
    with pytest.raises(LatheSimError, match=r"run\.xls: a record cannot be exported as '\.xls'\. Use \.csv or \.mat\.$"):
        export(shoulder(), tmp_path / "run.xls")
    with pytest.raises(LatheSimError, match=r"there is no folder '.*nowhere'\. Make it, or choose another place\.$"):
        export(shoulder(), tmp_path / "nowhere" / "run.csv")


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.csv").write_text("old", encoding="utf-8")
    monkeypatch.setattr("lathesim.analysis.export._write_csv", _fail)
    with pytest.raises(LatheSimError, match=r"run\.csv: the disk is full\. Make room, or choose another folder; nothing was replaced\.$"):
        export(shoulder(), tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text(encoding="utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


def _fail(record: Record, path: Path) -> None:
    path.write_text("half", encoding="utf-8")
    raise OSError(28, "No space left on device")
