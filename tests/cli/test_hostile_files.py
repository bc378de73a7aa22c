"""Files from strangers: values that stand elsewhere, codes for the terminal, depths and numbers without end, plug-ins that lie in wait."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from lathesim.errors import LatheSimError, RecordError
from lathesim.lessons.lesson import load_lesson
from lathesim.live.recording_run import RecordBlocks
from lathesim.record import Channel, Record, load
from lathesim.record_writer import save
from lathesim.recordings.raw_table import read_recording
from lathesim.recordings.stock_readers import stock_readers
from lathesim.stability.response_files import read_response
from tests.cli.command import call, done, refused

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    path = tmp_path / "secret.bin"
    np.arange(10.0).tofile(path)
    return path


def other_values(file: h5py.File, name: str, kind: str, secret: Path) -> None:
    if kind == "external":
        file.create_dataset(name, (10,), "f8", external=[(str(secret), 0, 80)])
    elif kind == "virtual":
        layout = h5py.VirtualLayout((10,), "f8")
        layout[:] = h5py.VirtualSource(str(secret.with_suffix(".h5")), "a", (10,))
        file.create_virtual_dataset(name, layout)
    else:
        file[name] = h5py.ExternalLink(str(secret.with_suffix(".h5")), "a")


@pytest.mark.parametrize("kind", ["external", "virtual", "link"])
def test_values_of_other_files_are_never_read(kind: str, tmp_path: Path, secret: Path) -> None:
    with h5py.File(secret.with_suffix(".h5"), "w") as file:
        file["a"] = np.arange(10.0)
    with h5py.File(tmp_path / "theirs.h5", "w") as file:
        file["time"] = np.arange(10.0)
        other_values(file, "theirs", kind, secret)
    assert list(read_recording(tmp_path / "theirs.h5", stock_readers()).columns) == ["time"]

    path = tmp_path / "run.h5"
    save(Record(np.arange(10.0), {"a.b": Channel("a.b", "m", np.arange(10.0))}, {}), path)
    with h5py.File(path, "a") as file:
        attributes = dict(file["channels/a.b"].attrs)
        del file["channels/a.b"]
        other_values(file, "channels/a.b", kind, secret)
        if kind != "link":
            file["channels/a.b"].attrs.update(attributes)
    for read in (load, RecordBlocks):
        with pytest.raises(RecordError, match=r"'a\.b' refers to values in another file"):
            read(path)

    with h5py.File(tmp_path / "response.mat", "w") as file:
        file["freq"] = np.arange(10.0)
        other_values(file, "H", kind, secret)
    with pytest.raises(LatheSimError):
        read_response(tmp_path / "response.mat")


def test_escape_codes_are_shown_and_not_sent(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "r.csv"
    rows = "".join(f"{0.01 * row},{row}\n" for row in range(50))
    path.write_text(f"time [s],\x1b]0;mine\x07\x1b[31mx\x9b2J [m]\n{rows}", encoding="utf-8")
    assert list(read_recording(path, stock_readers()).columns) == ["time", "\\x1b]0;mine\\x07\\x1b[31mx\\x9b2J"]
    save(Record(np.arange(10.0), {"a\x1b[2J.b": Channel("a\x1b[2J.b", "m\x1b", np.arange(10.0))}, {}), tmp_path / "run.h5")
    assert [(name, channel.unit) for name, channel in load(tmp_path / "run.h5").channels.items()] == [("a\\x1b[2J.b", "m\\x1b")]
    said = refused(capsys, "plot", tmp_path / "run.h5", "\x1b[2J")
    assert "\x1b" not in said.err
    assert "'\\x1b[2J'" in said.err


@pytest.mark.parametrize("command", [("reveal", "deep", "deep"), ("remedy", "23_mend_this_machine", "deep", "--out", "o")])
def test_deeply_nested_json_is_one_sentence(command: tuple[str, ...], capsys: Capture) -> None:
    Path("deep").write_text("[" * 100_000 + "]" * 100_000, encoding="utf-8")
    said = refused(capsys, *command)
    assert said.err.startswith("deep: ")
    assert said.err.count("\n") == 1


def test_many_unknown_keys_cost_what_one_costs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looked_up = []

    def nearest(name: str, names: object) -> str:
        looked_up.append(name)
        return ""

    monkeypatch.setattr("lathesim.lessons.validation.nearest", nearest)
    keys = "".join(f"unknown_{number}: 1\n" for number in range(2000))
    (tmp_path / "many.yaml").write_text(f"lesson: L\nmachine: two_axis_lathe\n{keys}", encoding="utf-8")
    with pytest.raises(LatheSimError, match=r"many\.yaml:3:1: there is no key 'unknown_0' here"):
        load_lesson(tmp_path / "many.yaml")
    assert looked_up == ["unknown_0"]


def test_a_folder_with_plug_ins_of_its_own_is_no_workspace_unasked(tmp_path: Path, capsys: Capture) -> None:
    Path("plugins").mkdir()
    Path("plugins/theirs.py").write_text("raise SystemExit('run')\n", encoding="utf-8")
    said = refused(capsys, "init", ".")
    assert said.err.startswith("plugins has plug-ins of its own (theirs.py), and every command in . will run them from now on.")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plugins"]
    done(capsys, "init", ".", "--yes")
    done(capsys, "init", ".")


def test_check_says_that_it_runs_a_plug_in(capsys: Capture) -> None:
    Path("part.py").write_text("import sys\nprint('mine', file=sys.stderr)\n", encoding="utf-8")
    assert call(capsys, "check", "part.py").err.splitlines()[:2] == ["part.py: a plug-in is code and is run now.", "mine"]
