"""MAT files of both kinds, HDF5 files and records of this program."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from lathesim.errors import LatheSimError
from lathesim.record import Channel, Record
from lathesim.record_writer import save
from lathesim.recordings import raw_table
from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.shared_data import SHARED, needs_shared

TIME = np.linspace(0.0, 1.0, 11)


def read(path: Path) -> RawTable:
    return read_recording(path, stock_readers())


def test_vectors_matrices_structs_and_constants(tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    log = {"force": 2.0 * TIME, "deep": {"speed": np.arange(11, dtype=np.int16)}}
    savemat(path, {"t": TIME, "row": TIME[None], "both": np.stack([TIME, -TIME]), "log": log, "gain": 3.5, "title": "x", "on": TIME > 0.5})
    table = read(path)
    assert sorted(table.columns) == ["both_1", "both_2", "log.deep.speed", "log.force", "on", "row", "t"]
    assert np.array_equal(table.columns["both_2"], -TIME)
    assert np.array_equal(table.columns["log.deep.speed"], np.arange(11.0))
    assert table.columns["on"].tolist() == [0.0] * 6 + [1.0] * 5
    assert table.constants == {"gain": 3.5}
    assert table.notes == ("left out, no columns of numbers: title",)


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_mat_file_of_version_4(order: str, tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    savemat(path, {"t": TIME, "both": np.stack([TIME, -TIME], axis=1), "gain": 3.5, "title": "x"}, format="4")
    if order == ">":
        head = np.array([1000, len(TIME), 1, 0, 2], dtype=">i4").tobytes()
        path.write_bytes(head + b"t\x00" + TIME.astype(">f8").tobytes())
    table = read(path)
    assert np.array_equal(table.columns["t"], TIME)
    if order == "<":
        assert np.array_equal(table.columns["both_2"], -TIME)
        assert (table.constants, table.notes) == ({"gain": 3.5}, ("left out, no columns of numbers: title",))


def test_a_mat_file_that_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    savemat(path, {"t": TIME})
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(LatheSimError, match=r"axis\.mat: the MAT file is damaged or cut off\. Write it again, as version 7\.$"):
        read(path)


def write_mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"] = TIME[None]
        file["log/force"] = 2.0 * TIME[:, None]
        file["title"] = np.frombuffer(b"a\x00b\x00", dtype="<u2")
        file["title"].attrs["MATLAB_class"] = np.bytes_("char")
        file["#refs#/a"] = TIME
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def test_a_mat_file_of_version_7_3(tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    write_mat73(path)
    table = read(path)
    assert sorted(table.columns) == ["log.force", "t"]
    assert np.array_equal(table.columns["log.force"], 2.0 * TIME)


def test_datasets_by_their_path_with_units(tmp_path: Path) -> None:
    path = tmp_path / "rig.hdf5"
    with h5py.File(path, "w") as file:
        file["axis/x/position"] = TIME
        file["axis/x/position"].attrs["units"] = "mm"
        file["daq"] = np.array(list(zip(TIME, -TIME, strict=True)), dtype=[("t", "<f8"), ("u", "<f4")])
        file["elsewhere"] = h5py.ExternalLink("other.h5", "/secret")
    table = read(path)
    assert sorted(table.columns) == ["axis/x/position", "daq.t", "daq.u"]
    assert table.units["axis/x/position"] == "mm"


def test_an_own_record(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    save(Record(TIME, {"x_axis.position": Channel("x_axis.position", "m", TIME**2)}, {"status": "stopped"}), path)
    table = read(path)
    assert list(table.columns) == ["time", "x_axis.position"]
    assert table.units == {"time": "s", "x_axis.position": "m"}
    assert np.array_equal(table.columns["x_axis.position"], TIME**2)
    assert table.notes == ("the run that made it ended as 'stopped'",)


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
def test_too_large_arrays_are_refused_before_they_are_read(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / f"rig{suffix}"
    if suffix == ".mat":
        savemat(path, {"t": TIME})
    else:
        with h5py.File(path, "w") as file:
            file["t"] = TIME
    monkeypatch.setattr(raw_table, "MOST_ROWS", 10)
    with pytest.raises(LatheSimError, match=r"the file has 11 rows of 1 columns; at most 10 rows are read\."):
        read(path)


def test_a_file_without_a_column(tmp_path: Path) -> None:
    path = tmp_path / "axis.mat"
    savemat(path, {"gain": 2.0})
    with pytest.raises(LatheSimError, match=r"the file holds no column of numbers\. It holds single numbers only: gain\."):
        read(path)


@needs_shared
def test_a_linear_axis_and_a_motor_bench() -> None:
    axis = read(SHARED / "data" / "emps" / "DATA_EMPS.mat")
    assert sorted(axis.columns) == ["qg", "qm", "t", "vir"]
    assert len(axis.columns["t"]) == 24841
    assert axis.constants["gtau"] == pytest.approx(35.15065, abs=1e-5)
    bench = read(SHARED / "data" / "hsm150" / "idf_pos_0.06_1.mat")
    assert len(bench.columns["data_4"]) == 20000
    assert bench.constants["Cu"] == 0.0458
