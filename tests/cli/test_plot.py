"""``lathesim plot``: figures of a record."""

from pathlib import Path

import pytest

from tests.cli.command import call, done, refused

Capture = pytest.CaptureFixture[str]


def test_the_standard_figures_are_left_beside_the_record(capsys: Capture, run: Path) -> None:
    said = call(capsys, "plot", run)
    files = [run.with_name(f"run_{name}.png") for name in ("path", "contour_error", "voltages")]
    assert (said.code, said.out.split(), said.err) == (0, [str(file) for file in files], "")
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files)


def test_channels_and_whole_parts(capsys: Capture, run: Path) -> None:
    said = call(capsys, "plot", run, "x_dac.voltage", "x_axis", "--save", run.with_name("figure.svg"))
    assert (said.code, said.out) == (0, f"{run.with_name('figure.svg')}\n")
    text = run.with_name("figure.svg").read_text(encoding="utf-8")
    assert "<svg" in text


def test_one_page_with_save(capsys: Capture, run: Path) -> None:
    done(capsys, "plot", run, "--save", run.with_name("page.pdf"))
    assert run.with_name("page.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["x_dac.voltge"], "the record has no channel 'x_dac.voltge'. Did you mean 'x_dac.voltage'?\n"),
        (["x_dac.voltage", "--save", "f.gif"], "f.gif: a figure cannot be saved as '.gif'. Use .png, .svg or .pdf.\n"),
    ],
)
def test_what_cannot_be_plotted(arguments: list[str], sentence: str, capsys: Capture, run: Path) -> None:
    said = call(capsys, "plot", run, *arguments)
    assert (said.code, said.out, said.err) == (1, "", sentence)


def test_a_record_that_is_not_there(capsys: Capture, run: Path) -> None:
    assert "Did you mean 'run.h5'?" in refused(capsys, "plot", run.with_name("rnu.h5")).err
