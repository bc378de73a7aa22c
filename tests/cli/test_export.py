"""``lathesim export``: a record as CSV or MAT file."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.recordings.raw_table import read_recording
from lathesim.recordings.stock_readers import stock_readers
from tests.analysis.small_record import shoulder
from tests.cli.command import call

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("suffix", [".csv", ".mat"])
def test_a_record_is_exported_and_read_back(suffix: str, capsys: Capture, run: Path) -> None:
    file = run.with_suffix(suffix)
    said = call(capsys, "export", run, file)
    assert (said.code, said.out, said.err) == (0, f"{file}: 801 instants of 13 channels.\n", "")
    assert np.array_equal(read_recording(file, stock_readers()).columns["x_axis.position"], shoulder()["x_axis.position"])


def test_some_channels_only(capsys: Capture, run: Path) -> None:
    file = run.with_suffix(".csv")
    assert call(capsys, "export", run, file, "x_dac.voltage").out == f"{file}: 801 instants of 1 channels.\n"
    assert file.read_text(encoding="utf-8").splitlines()[:2] == ["time [s],x_dac.voltage [V]", "0.0,0.0"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run.xlsx"], "run.xlsx: a record cannot be exported as '.xlsx'. Use .csv or .mat.\n"),
        (["run.csv", "z_dac.volts"], "the record has no channel 'z_dac.volts'. Did you mean 'z_dac.voltage'?\n"),
    ],
)
def test_what_cannot_be_exported(arguments: list[str], sentence: str, capsys: Capture, run: Path) -> None:
    said = call(capsys, "export", run, *arguments)
    assert (said.code, said.out, said.err) == (1, "", sentence)
