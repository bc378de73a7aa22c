"""Each test of a command runs in an empty folder."""

from pathlib import Path

import pytest

from lathesim.record_writer import save
from tests.analysis.small_record import shoulder


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """The record of a small part, saved."""
    save(shoulder(), tmp_path / "run.h5")
    return tmp_path / "run.h5"
