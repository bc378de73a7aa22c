"""The files beside the program agree with it: the checks, the version, the chapters, the links of the README."""

import re
import tomllib

import pytest
import yaml

import lathesim
from lathesim.manual.chapters import TOPICS, chapter
from tests.cli.command import ROOT


def test_a_commit_is_checked_as_the_whole_is() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    checks = (ROOT / ".ci" / "run").read_text(encoding="utf-8").partition('echo "== style and floors"\n')[2].partition("\n\n")[0]
    commands = re.sub(r" +[&#].*|^types=.*\n|\nwait.*", "", checks, flags=re.M)  # one may run beside the others there
    assert sorted(command for hook in hooks for command in hook["entry"].split(" && ")) == sorted(commands.split("\n"))


def test_the_changelog_begins_with_this_version() -> None:
    assert re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)[0] == lathesim.__version__


def test_every_chapter_has_its_place_in_the_manual() -> None:
    assert {path.stem for path in (ROOT / "lathesim" / "manual").glob("*.md")} == set(TOPICS)


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_what_a_page_links_to_is_there(page: str) -> None:
    links = re.findall(r"\]\(([^)]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    assert [link for link in links if not link.startswith("https://") and not (ROOT / link).is_file()] == []


def test_an_index_page_has_no_link_that_leads_nowhere() -> None:
    """What a package index shows has no files of the repository beside it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    for change in project["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        page = re.sub(change["pattern"], change["replacement"], page)
    assert re.findall(r"\]\((?!https://)", page) == []
    assert "| `app` | the terminal app: screens and keys |" in page


def test_the_table_of_rooms_names_every_room_and_imports_only_go_down_it() -> None:
    rows = re.findall(r"^\| (`.*?) \|", chapter("house").text, re.M)
    named = [name for row in rows for name in re.findall(r"`([^`]+/)`", row)]
    assert [name for name in named if not any((ROOT / top / name).is_dir() for top in ("", "lathesim"))] == []
    floor = {name: place for place, row in enumerate(rows) for name in re.findall(r"(\w+)/`", row)}
    package = ROOT / "lathesim"
    assert {path.parent.name for path in package.glob("*/__init__.py")} <= floor.keys()
    up = set()
    for path in package.glob("*/**/*.py"):
        room = path.relative_to(package).parts[0]
        for other in re.findall(r"^\s*(?:from|import) lathesim\.(\w+)", path.read_text(encoding="utf-8"), re.M):
            if floor.get(other, len(rows)) < floor[room]:
                up.add((room, other))
    assert up == set()


def test_an_extra_holds_what_code_imports() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    code = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "lathesim").rglob("*.py"))
    names = {"scikit-learn": "sklearn", "textual-serve": "textual_serve", "npTDMS": "nptdms"}
    for extra, items in project["optional-dependencies"].items():
        for item in items if extra != "test" else ():
            name = re.split(r"[<>=\[]", item)[0]
            assert re.search(rf"^\s*(import|from) {names.get(name, name)}\b", code, re.M), f"{extra}: {item}"
