"""Where the unit definitions of an installation are kept."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from lathesim.cache_folder import cache_folder
from lathesim.units import _kept_definitions, registry


@pytest.fixture(autouse=True)
def own_caches() -> Iterator[None]:
    """Leave no folder of a test behind."""
    yield
    cache_folder.cache_clear()
    registry.cache_clear()


def test_each_installation_keeps_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What one environment keeps names its files; another one must not read it, as the first may be deleted."""
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path))
    cache_folder.cache_clear()
    one, other = (SimpleNamespace(__version__="0.25", __file__=f"/{place}/pint/__init__.py") for place in ("one", "other"))
    assert _kept_definitions(one) == _kept_definitions(one)
    assert _kept_definitions(one) != _kept_definitions(other)


def test_where_nothing_can_be_written_units_work_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("LATHESIM_CACHE", str(tmp_path / "file"))
    cache_folder.cache_clear()
    registry.cache_clear()
    assert tmp_path not in _kept_definitions(SimpleNamespace(__version__="0.25", __file__="/one/pint/__init__.py")).parents
    assert registry()("25.4 mm").to("inch").magnitude == pytest.approx(1.0)
