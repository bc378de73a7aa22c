"""Where the unit definitions of an installation are kept."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from lathesim.units import _kept_definitions


def test_each_installation_keeps_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What one environment keeps names its files; another one must not read it, as the first may be deleted."""
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path))
    one, other = (SimpleNamespace(__version__="0.25", __file__=f"/{place}/pint/__init__.py") for place in ("one", "other"))
    assert _kept_definitions(one) == _kept_definitions(one)
    assert _kept_definitions(one) != _kept_definitions(other)


def test_where_nothing_can_be_written_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path / "file"))
    assert _kept_definitions(SimpleNamespace(__version__="0.25", __file__="/one/pint/__init__.py")) is None
