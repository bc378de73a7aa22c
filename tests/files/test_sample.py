"""A small sample of the campaign: the check of whole files, a command killed while it writes, and a place that cannot be written."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from lathesim.record import Channel, Record
from lathesim.record_writer import save
from tests.files.__main__ import Bench, kills
from tests.files.whole import half_files


def test_a_half_file_of_each_kind_is_known(tmp_path: Path) -> None:
    save(Record(np.arange(500.0), {"a.b": Channel("a.b", "m", np.arange(500.0))}, {}), tmp_path / "r.h5")
    texts = {
        "a.csv": "x,y\n1,2\n",
        "a.json": "[1, 2]",
        "a.yaml": "a: [1]\n",
        "a.html": "<p></html>\n",
        "a.svg": "<p></svg>\n",
        "a.nc": "G1 X1\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert half_files(tmp_path) == []
    for path in list(tmp_path.iterdir()):
        path.write_bytes(path.read_bytes()[:-3])
    assert len(half_files(tmp_path)) == len(texts) + 1


def test_a_command_that_is_killed_leaves_a_whole_file_or_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(tmp_path, random.Random(5))
    (tmp_path / "tmp").mkdir()
    kills(bench, "new-program", 2)
    assert bench.faults == []
    assert "of 2 killed while it ran" in capsys.readouterr().out
