"""Records come back from their file as they were, whole or not at all."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import RecordError, WriteError
from lathesim.record import Channel, Record, is_record, load
from lathesim.record_writer import LARGEST_BLOCK, RecordWriter, _Disk, save


def record(samples: int = 50) -> Record:
    time = np.arange(samples) * 0.005
    position = Channel("x_axis.position", "m", np.sin(time), "position of the table", ("displacement", "reading"))
    channels = [position, Channel("x_dac.voltage", "V", time * np.nan, "µ")]
    return Record(time, {channel.name: channel for channel in channels}, {"seed": 3, "lesson": "a text\nof two lines", "step": 0.5})


@pytest.mark.parametrize("samples", [0, 1, 50, LARGEST_BLOCK + 7])
def test_a_record_comes_back_as_it_was(samples: int, tmp_path: Path) -> None:
    ours = record(samples)
    save(ours, tmp_path / "run.h5")
    found = load(tmp_path / "run.h5")
    assert is_record(tmp_path / "run.h5")
    assert found.meta == ours.meta
    assert np.array_equal(found.time, ours.time)
    assert list(found) == list(ours)
    for name, channel in ours.channels.items():
        other = found.channels[name]
        assert (other.unit, other.description, other.roles) == (channel.unit, channel.description, channel.roles)
        assert np.array_equal(other.values, channel.values, equal_nan=True)


def test_a_channel_is_found_by_the_role_that_its_part_declares_else_by_its_name() -> None:
    names = {"drive.feed": (), "chuck.turning": ("spindle_speed",), "spindle.spindle_speed": ()}
    kept = Record(np.arange(3.0), {name: Channel(name, "1", np.zeros(3), roles=roles) for name, roles in names.items()})
    assert kept.by_role("spindle_speed") == ["chuck.turning", "spindle.spindle_speed"]
    assert kept.by_role("feed") == ["drive.feed"]
    assert kept.by_role("speed") == []


def test_a_file_without_roles_is_read_as_one_of_a_stock_machine(tmp_path: Path) -> None:
    save(Record(np.arange(3.0), {"load.torque": Channel("load.torque", "N*m", np.ones(3))}), tmp_path / "old.h5")
    assert load(tmp_path / "old.h5").by_role("cutting_torque") == ["load.torque"]


@pytest.mark.parametrize("compress", [True, False])
def test_blocks_of_any_size_join(compress: bool, tmp_path: Path) -> None:
    ours = record(100)
    with RecordWriter(tmp_path / "run.h5", ours.channels.values(), block=16, compress=compress) as writer:
        for begin, end in ((0, 1), (1, 1), (1, 40), (40, 100)):
            writer.write(ours.time[begin:end], [channel.values[begin:end] for channel in ours.channels.values()])
        writer.finish({"status": "complete"})
    found = load(tmp_path / "run.h5")
    assert np.array_equal(found["x_axis.position"], ours["x_axis.position"])
    assert found.status == "complete"


def test_what_is_left_unfinished_replaces_nothing(tmp_path: Path) -> None:
    save(record(10), tmp_path / "run.h5")
    with RecordWriter(tmp_path / "run.h5", record(20).channels.values()) as writer:
        writer.write(np.zeros(20), np.zeros((2, 20)))
    assert len(load(tmp_path / "run.h5")) == 10
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


def test_a_full_disk_is_told_and_replaces_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save(record(10), tmp_path / "run.h5")

    def refuse(disk: _Disk, position: int, rest: memoryview) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(_Disk, "_write_whole", refuse)
    with pytest.raises(RecordError, match="the disk is full"):
        save(record(3000), tmp_path / "run.h5")
    monkeypatch.undo()
    assert len(load(tmp_path / "run.h5")) == 10
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


def test_a_truncated_record_is_refused(tmp_path: Path) -> None:
    save(record(), tmp_path / "run.h5")
    whole = (tmp_path / "run.h5").read_bytes()
    (tmp_path / "run.h5").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordError, match="the file is truncated"):
        load(tmp_path / "run.h5")


def test_what_grows_opens_up_to_its_last_block_wherever_its_writer_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every write to the disk is the last one once: what stands there then is what a killed process leaves."""
    place = tmp_path / "r.h5"
    ours, killed = record(6000), tmp_path / "killed.h5"
    lengths = []
    whole = _Disk._write_whole

    def write_and_look(disk: _Disk, position: int, rest: memoryview) -> None:
        whole(disk, position, rest)
        if place.exists():
            killed.write_bytes(place.read_bytes())
            found = load(killed)
            assert np.array_equal(found["x_axis.position"], ours["x_axis.position"][: len(found)])
            lengths.append(len(found))
            assert found.status in ("cut off", "complete")

    monkeypatch.setattr(_Disk, "_write_whole", write_and_look)
    with RecordWriter(place, ours.channels.values(), growing=True) as writer:
        for begin in range(0, 6000, 1500):
            end = begin + 1500
            writer.write(ours.time[begin:end], [channel.values[begin:end] for channel in ours.channels.values()])
            assert len(load(place)) == end
        writer.finish({"status": "complete"})
    assert load(place).status == "complete"
    assert lengths == sorted(lengths)
    assert set(lengths) == {1500, 3000, 4500, 6000}


def test_what_grows_and_finds_the_disk_full_keeps_what_came_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = record(3000)
    values = [channel.values for channel in ours.channels.values()]
    whole, left = _Disk._write_whole, [60]

    def refuse(disk: _Disk, position: int, rest: memoryview) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        whole(disk, position, rest)

    monkeypatch.setattr(_Disk, "_write_whole", refuse)
    written = 0
    with (
        pytest.raises(WriteError, match="the disk is full") as told,
        RecordWriter(tmp_path / "r.h5", ours.channels.values(), growing=True) as writer,
    ):
        for begin in range(0, 3000, 100):
            writer.write(ours.time[begin : begin + 100], [row[begin : begin + 100] for row in values])
            written += 100
    assert f"The first {written} samples are kept." in str(told.value)
    assert len(load(tmp_path / "r.h5")) == written
