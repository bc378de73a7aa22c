"""``lathesim help --site DIR``: the manual and the reference as HTML, in which no link leads nowhere and a search finds what there is."""

import json
import re
from pathlib import Path

import pytest

from lathesim.cli.listing import REFERENCE
from lathesim.cli.main import stock_commands
from lathesim.manual.chapters import TOPICS
from lathesim.plugins import load_registry
from tests.cli.command import call, done


def test_the_site_holds_the_manual_and_all_there_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, "help", "--site", "site")
    site = tmp_path / "site"
    pages = {path.stem: path.read_text(encoding="utf-8") for path in site.glob("*.html")}
    assert set(pages) == {*TOPICS, *REFERENCE, "index"}
    for text in pages.values():
        for link in re.findall(r'(?:href|src)="(?!https?:)([^"#]+)', text):
            assert (site / link).is_file(), link
    index = json.loads((site / "index.js").read_text(encoding="utf-8").removeprefix("const INDEX = ").removesuffix(";\n"))
    headings = {entry["heading"] for entry in index}
    registry = load_registry(installed=False)
    assert headings >= {*registry.components, *registry.effects, *(f"lathesim {name}" for name in stock_commands())}
    metrics = next(entry for entry in index if entry["href"].startswith("metrics.html"))
    assert all(name in metrics["text"] for name in registry.metrics)
    for entry in index:
        page, _, place = entry["href"].partition("#")
        assert f'id="{place}"' in pages[page.removesuffix(".html")]
    assert '<a href="diagnosis.html">diagnosis</a>' in pages["writing_lessons"]


def test_a_page_of_the_reference_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert "| `max_contour_error` | `m` | largest contour error in contact |" in call(capsys, "help", "metrics").out
    assert "| `minutes` | integer | about how long the lesson takes |" in call(capsys, "help", "keys").out


def test_the_messages_of_errors_are_listed_with_their_remedies(capsys: pytest.CaptureFixture[str]) -> None:
    page = call(capsys, "help", "errors").out
    assert "| there is no part '{part}'. | Did you mean '{nearest name}'? |" in page
    assert "| the folder has another class. | Choose another folder with --out. |" in page
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    assert len(rows) > 500
    assert sum(not row.endswith("|  |") for row in rows) > 0.8 * len(rows)
    assert [row for row in rows if row.count(" | ") != 1 and not row.endswith("|  |")] == []
