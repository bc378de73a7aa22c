"""Recordings damaged at random are read, or refused in one sentence; no other exception, no warning, no hang."""

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from lathesim.errors import LatheSimError
from lathesim.record import Channel, Record, load
from lathesim.record_writer import save
from lathesim.recordings.mapping import RecordingMapping, SignalMapping, map_recording
from lathesim.recordings.raw_table import RawTable, read_recording
from lathesim.recordings.recording_faults import recording_faults
from lathesim.recordings.stock_readers import stock_readers
from tests.recordings.forked_trial import trial_in_a_fork

TIME = np.arange(60) * 1e-3
PLACE, VOLTAGE = np.sin(9.0 * TIME), np.cos(9.0 * TIME)
LABVIEW_HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
    "Multi_Headings\tNo\nX_Columns\tOne\n"
    "Time_Pref\tAbsolute\nDate\t2020/01/01\nTime\t12:00:00\n***End_of_Header***\t\n\nChannels\t2\t\t\nSamples\t60\t60\t\n"
    "Date\t2020/01/01\t2020/01/01\t\nTime\t12:00:00\t12:00:00\t\nX_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.001\t0.001\t\n"
    "***End_of_Header***\t\t\t\nX_Value\tForce\tVolt\tComment\n"
)


def write_rows(path: Path, head: str, mark: str, comma: str) -> None:
    lines = [mark.join(f"{value:.6g}".replace(".", comma) for value in row) for row in zip(TIME, PLACE, VOLTAGE, strict=True)]
    path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")


def write_mat4(path: Path) -> None:
    savemat(path, {"t": TIME, "q": PLACE, "u": VOLTAGE}, format="4")


def write_events(path: Path) -> None:
    """Write one value a line, with the name and the moment of each."""
    rows = [(name, row, values[row]) for row in range(len(TIME)) for name, values in (("q", PLACE), ("u", VOLTAGE))]
    path.write_text("".join(f"{name} 2020-12-09 15:05:41.{1000 * row:06d} {value:.6g}\n" for name, row, value in rows), encoding="utf-8")


def write_mat(path: Path, *, packed: bool) -> None:
    savemat(path, {"t": TIME, "q": PLACE, "log": {"u": VOLTAGE}, "units": {"t": "s"}}, do_compression=packed)


def write_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["t"] = TIME
        file["g/q"] = PLACE
        file["g/q"].attrs["unit"] = "mm"
        file.create_dataset("z", data=VOLTAGE, chunks=(20,), compression="gzip", fletcher32=True)
        file["daq"] = np.array(list(zip(TIME, -TIME, strict=True)), dtype=[("t", "<f8"), ("u", "<f4")])


def write_mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["log/force"] = TIME[None], PLACE[:, None]
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_record(path: Path) -> None:
    save(Record(TIME, {"x.place": Channel("x.place", "m", PLACE)}, {"status": "complete"}), path)


TEXTS: dict[str, Callable[[Path], None]] = {
    "comma.csv": lambda path: write_rows(path, "t [s],q [mm],u [V]\n", ",", "."),
    "semicolon.txt": lambda path: write_rows(path, "t;q;u\n", ";", ","),
    "labview.lvm": lambda path: write_rows(path, LABVIEW_HEAD, "\t", "."),
    "events.log": write_events,
}
BINARY: dict[str, Callable[[Path], None]] = {
    "other.h5": write_hdf5,
    "seven_three.mat": write_mat73,
    "own.h5": write_record,
    "four.mat": write_mat4,
    "plain.mat": lambda path: write_mat(path, packed=False),
    "packed.mat": lambda path: write_mat(path, packed=True),
}
WORDS = (b"1e999", b"nan", b"-", b",", b"\n", b"\t", b"1e308", b'"', b";", b"\r", b"\x00", b"9" * 21)


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Return the bytes with one to sixteen places changed, cut out, filled, put in or cut off; the head is hit more often."""
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        if not data:
            break
        begin = chance.randrange(len(data) if chance.random() < 0.6 else min(len(data), 2048))
        end = min(len(data), begin + chance.randrange(1, 64))
        match chance.randrange(8):
            case 0:
                data[begin] = chance.randrange(256)
            case 1:
                data[begin] ^= 1 << chance.randrange(8)
            case 2:
                del data[begin:end]
            case 3:
                data[begin:begin] = chance.randbytes(chance.randrange(1, 20))
            case 4:
                del data[begin:]
            case 5:
                data[begin:end] = bytes(end - begin)
            case 6:
                data[begin:end] = b"\xff" * (end - begin)
            case _:
                data[begin:begin] = chance.choice(WORDS)
    return bytes(data)


def mapped(table: RawTable) -> None:
    """Map the columns of a table as a lesson would, the first one as the time."""
    time, *others = table.columns
    signals = [SignalMapping(f"x.{name}", name, "mm", 1.0, None, "drive" if name == others[-1] else "compare", "m") for name in others]
    if signals:
        mapping = RecordingMapping(time, "s", None, tuple(signals))
        recording_faults(map_recording(table, mapping).record, mapping)


def damage(folder: Path, kinds: dict[str, Callable[[Path], None]], number: int, seed: int) -> Counter[str]:
    """Read so many damaged files; return how many were mapped and how many were refused. Anything else is raised with its number."""
    sources = {}
    for name, write in kinds.items():
        write(folder / name)
        sources[name] = (folder / name).read_bytes()
        mapped(read_recording(folder / name, stock_readers()))
    ended: Counter[str] = Counter()
    for case in range(number):
        chance = random.Random(1_000_003 * seed + case)
        name = chance.choice(list(sources))
        path = folder / name
        path.write_bytes(damaged(sources[name], chance))
        try:
            mapped(read_recording(path, stock_readers()))
            ended["mapped"] += 1
        except LatheSimError as error:
            assert len(str(error).splitlines()) == 1
            ended["refused"] += 1
        except Exception as error:
            raise AssertionError(f"case {case} of seed {seed}, {name}: {error!r}") from error
    return ended


def test_damaged_recordings_make_no_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lathesim.recordings.binary_files.refuse_deadly_file", trial_in_a_fork)
    ended = damage(tmp_path, TEXTS, 150, 5) + damage(tmp_path, BINARY, 6, 6)
    assert ended["mapped"] > 25 and ended["refused"] > 25


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_five_thousand_damaged_recordings_make_no_fault(tmp_path: Path) -> None:
    ended = damage(tmp_path, TEXTS, 4000, 1) + damage(tmp_path, BINARY, 1000, 2)
    assert ended["mapped"] > 500 and ended["refused"] > 500


@pytest.mark.slow
def test_a_record_whose_texts_never_end_is_refused(tmp_path: Path) -> None:
    """An empty free space in the heap of the texts, over which the HDF5 library steps for ever."""
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "a text of variable length"
    content = bytearray(path.read_bytes())
    begin = content.index(b"GCOL") + 16
    content[begin : begin + 16] = bytes(16)
    path.write_bytes(content)
    with pytest.raises(LatheSimError, match=r"run\.h5: the file is not HDF5, or it is damaged\."):
        load(path)
    with pytest.raises(LatheSimError, match=r"run\.h5: the HDF5 file is damaged or cut off\. Write it again\."):
        read_recording(path, stock_readers())


def test_huge_values_and_times_are_missing_values(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("t,q\n" + "".join(f"{0.001 * row},{1e300 if row == 20 else row}\n" for row in range(60)), encoding="utf-8")
    table = read_recording(path, stock_readers())
    record = map_recording(table, RecordingMapping("t", "s", None, (SignalMapping("x.q", "q", "km", 1.0, None, "compare", "m"),))).record
    assert record.channels["x.q"].values[20] == pytest.approx(20e3)
