"""Files of the cache: whole or as good as none, read by others, and lost without harm where the folder cannot be written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lathesim import cache_folder
from lathesim.cache_folder import keep, keep_sealed, kept_sealed
from lathesim.errors import UnitError, WriteError
from lathesim.units import registry, si_factor

ROOT = Path(__file__).parents[1]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(cache_folder, "_INSTEAD", {})
    return tmp_path / "cache"


def test_what_was_sealed_comes_back_and_nothing_that_was_changed(cache: Path) -> None:
    path = keep_sealed("law.code", b"factor = 0.5\nx")
    assert kept_sealed("law.code") == b"factor = 0.5\nx"
    whole = path.read_bytes()
    for damaged in (whole.replace(b"0.5", b"0.6"), whole[:-1], whole[:20], b""):
        path.write_bytes(damaged)
        assert kept_sealed("law.code") is None
    (cache / "other.code").write_bytes(whole)
    assert kept_sealed("other.code") is None


def test_others_may_read_what_is_kept(cache: Path) -> None:
    before = os.umask(0o022)
    try:
        assert keep_sealed("a", b"x").stat().st_mode & 0o777 == 0o644
    finally:
        os.umask(before)


def test_a_part_of_a_dead_process_goes_and_that_of_a_living_one_stays(cache: Path) -> None:
    cache.mkdir()
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    dead, living = cache / f".law.py.{ended.pid}-1.part", cache / f".law.py.{os.getpid()}-77.part"
    for path in (dead, living, cache / ".of_mine.part"):
        path.write_bytes(b"")
    keep("law.py", b"")
    assert sorted(path.name for path in cache.iterdir()) == sorted([living.name, ".of_mine.part", "law.py"])


def test_a_cache_that_cannot_be_written_is_read_and_said_once(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cache.write_bytes(b"no folder")
    first, second = keep("a.py", b"1"), keep_sealed("b", b"2")
    assert first.parent == second.parent != cache
    assert kept_sealed("b") == b"2"
    said = capsys.readouterr().err
    assert said.startswith(f"{cache}: the cache cannot be written: ")
    assert said.count("LATHESIM_CACHE") == 1


def test_a_temporary_cache_is_gone_afterwards(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"no folder")
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    (tmp_path / f"lathesim-cache-{ended.pid}-of_one_that_was_killed").mkdir()
    lines = "from lathesim.cache_folder import keep\nprint(keep('a.py', b'1').parent, end='')"
    here = {**os.environ, "LATHESIM_CACHE": str(tmp_path / "file"), "TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", lines], env=here, capture_output=True, text=True, check=True)
    assert Path(done.stdout).parent == tmp_path
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_where_nothing_takes_it_the_file_is_named(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes, *, durable: bool) -> Path:
        raise WriteError("the disk is full.", place=str(path))

    monkeypatch.setattr(cache_folder, "write_bytes", full)
    with pytest.raises(WriteError, match=r"lathesim-cache-.*/a\.py: the disk is full\. Make room, or set LATHESIM_CACHE"):
        keep("a.py", b"1")


@pytest.mark.parametrize("error", [EOFError, OSError, KeyError, ValueError])
def test_what_fails_in_the_registry_is_not_called_no_unit(error: type[Exception], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise error("a file that ends early")

    monkeypatch.setattr("lathesim.units.registry", broken)
    si_factor.cache_clear()
    with pytest.raises(error):
        si_factor("furlong/fortnight")
    monkeypatch.undo()
    assert registry() is not None
    with pytest.raises(UnitError):
        si_factor("furlongs per")
