"""Outputs: what cannot be written is refused before the work, what is no regular file is never replaced, results are printed first."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import click
import pytest

from lathesim.cli.main import group, stock_commands
from lathesim.cli.options import OutputPath
from lathesim.errors import WriteError
from lathesim.manual.chapters import chapter
from lathesim.whole_file import WholeFiles, write_text
from tests.cli.command import call, done, environment, refused
from tests.diagnosis.small_case import write_lesson

Capture = pytest.CaptureFixture[str]
INPUTS = ("--program", "--recording", "--validate", "--before", "--again", "--drive", "--guess", "--map", "--play", "--limits", "--plugins")
INPUTS_TOO = ("--cuts", "--inverse", "--prior", "--second")
"""Options that name a file which is read."""


def options() -> list[click.Parameter]:
    context = click.Context(group)
    commands = [group.get_command(context, name) for name in stock_commands()]
    return [option for command in commands if command is not None for option in command.params]


def test_every_option_that_names_an_output_looks_first() -> None:
    paths = [option for option in options() if isinstance(option, click.Option) and isinstance(option.type, click.Path)]
    assert {option.opts[0] for option in paths if not isinstance(option.type, OutputPath)} <= {*INPUTS, *INPUTS_TOO}
    assert len([option for option in paths if isinstance(option.type, OutputPath)]) >= 30


@pytest.mark.parametrize("kind", ["fifo", "device", "link", "dangling link", "folder", "below a file", "no folder"])
def test_what_is_no_place_for_a_file_is_refused_and_stays(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "out.csv"
    (tmp_path / "elsewhere").write_text("mine", encoding="utf-8")
    if kind == "fifo":
        os.mkfifo(place)
    elif kind == "device":
        if sys.platform != "linux" or os.geteuid() != 0:
            pytest.skip("only root makes a device")
        os.mknod(place, 0o600 | stat.S_IFCHR, os.makedev(1, 3))
    elif kind == "link":
        place.symlink_to(tmp_path / "elsewhere")
    elif kind == "dangling link":
        place.symlink_to(tmp_path / "nowhere")
    elif kind == "folder":
        place.mkdir()
    else:
        place = tmp_path / ("elsewhere" if kind == "below a file" else "new") / "out.csv"
    before = sorted(path.name for path in tmp_path.iterdir())
    with pytest.raises(WriteError):
        OutputPath().convert(str(place), None, None)
    with pytest.raises(WriteError):
        write_text(place, "text")
    assert sorted(path.name for path in tmp_path.iterdir()) == before
    assert (tmp_path / "elsewhere").read_text(encoding="utf-8") == "mine"


def test_a_command_refuses_it_with_one_sentence(capsys: Capture, tmp_path: Path) -> None:
    (tmp_path / "r.h5").symlink_to("/dev/null")
    said = refused(capsys, "run", "01_contour_error", "--variant", "I", "--out", tmp_path / "r.h5")
    assert said.err == f"{tmp_path}/r.h5: this is a link, and it is not replaced. Give the name of a file.\n"


def test_files_that_belong_together_come_all_or_none(tmp_path: Path) -> None:
    with pytest.raises(WriteError, match="this is a folder"), WholeFiles() as whole:
        whole.write_text(tmp_path / "answer.json", "a")
        (tmp_path / "seal.json").mkdir()
        whole.write_text(tmp_path / "seal.json", "b")
    assert [path.name for path in tmp_path.iterdir()] == ["seal.json"]


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("elsewhere")


def test_a_diagnosis_looks_first_and_tells_before_it_writes(
    capsys: Capture, tmp_path: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lesson = write_lesson(elsewhere, duration="0.3 s")
    done(capsys, "conceal", lesson, "--effect", "none", "--seed", "1", "--out", "case")
    (tmp_path / "report.html").mkdir()
    searched = []

    def search(question: object, tell: object) -> object:
        searched.append(question)
        raise AssertionError("not before it was looked at where the report goes")

    monkeypatch.setattr("lathesim.diagnosis.diagnose.diagnose", search)
    said = call(capsys, "diagnose", "case/lesson.yaml", "case/recording.csv", "--out", ".")
    assert (said.code, searched) == (1, [])
    assert said.err == "report.html: this is a folder. Give the name of a file.\n"


def test_a_case_is_published_whole_or_not_at_all(capsys: Capture, tmp_path: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lesson = write_lesson(elsewhere, duration="0.3 s")

    def full(whole: WholeFiles, path: Path, text: str) -> Path:
        if path.name == "seal.json":
            raise WriteError("the disk is full.", place=str(path))
        return write(whole, path, text)

    write = WholeFiles.write_text
    monkeypatch.setattr(WholeFiles, "write_text", full)
    said = call(capsys, "conceal", lesson, "--effect", "none", "--seed", "1", "--out", "case")
    assert (said.code, said.err.splitlines()[-1]) == (1, "case/seal.json: the disk is full.")
    assert [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")] == ["case"]


def test_a_sign_that_the_terminal_lacks_is_no_fault() -> None:
    here = {**environment(), "PYTHONIOENCODING": "cp1252"}
    done = subprocess.run([sys.executable, "-m", "lathesim", "help", "app"], env=here, capture_output=True, check=True)
    assert "✓" in chapter("app").text
    assert done.stdout.decode("cp1252").startswith("# ")
