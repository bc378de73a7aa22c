"""The files beside the program agree with it: the checks, the version, the chapters, the links of the README."""

import re

import pytest
import yaml

import lathesim
from lathesim.manual.chapters import TOPICS
from tests.cli.command import ROOT


def test_a_commit_is_checked_as_the_whole_is() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    last = (ROOT / ".ci" / "run").read_text(encoding="utf-8").partition('echo "== style, types, floors"\n')[2]
    assert [hook["entry"] for hook in hooks] == re.split(r" && |\n", last.strip())


def test_the_changelog_begins_with_this_version() -> None:
    assert re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)[0] == lathesim.__version__


def test_every_chapter_has_its_place_in_the_manual() -> None:
    assert {path.stem for path in (ROOT / "lathesim" / "manual").glob("*.md")} == set(TOPICS)


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_what_a_page_links_to_is_there(page: str) -> None:
    links = re.findall(r"\]\(([^)]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    assert [link for link in links if not link.startswith("https://") and not (ROOT / link).is_file()] == []
