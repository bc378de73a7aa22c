"""README and manual name what there is: every command, every lesson, every verdict, and nothing else."""

import re

from lathesim.cli.main import stock_commands
from lathesim.diagnosis.records.diagnosis import VERDICTS
from lathesim.lessons.schema import json_schema
from lathesim.manual.chapters import chapter, chapters
from lathesim.shipped import FOLDERS, shipped_files
from tests.cli.command import ROOT

README = "\n".join([(ROOT / "README.md").read_text(encoding="utf-8"), *(chapter.text for chapter in chapters())])


def first_cells(heading: str) -> list[str]:
    """Return the text in code signs that begins each row of the table under a heading."""
    table = README.partition(f"\n| {heading} |")[2].partition("\n\n")[0]
    return re.findall(r"^\| `([^`]+)`", table, re.M)


def test_the_table_of_commands_has_every_command_once() -> None:
    assert [cell.split()[1] for cell in first_cells("command")] == list(stock_commands())
    assert {cell.split()[0] for cell in first_cells("command")} == {"lathesim"}


def test_the_table_of_lessons_has_every_lesson() -> None:
    assert first_cells("lesson") == [path.stem for path in shipped_files("lesson_configs", "*.yaml")]


def test_the_table_of_templates_has_every_template() -> None:
    rows = re.findall(r"^\| (`[^|]+) \|", README.partition("\n| template |")[2].partition("\n\n")[0], re.M)
    named = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(named) == sorted(path.stem for path in shipped_files("lesson_configs", "machines/*.yaml"))


def test_the_table_of_verdicts_has_every_verdict() -> None:
    assert first_cells("verdict") == list(VERDICTS)


def test_the_table_of_folders_names_what_is_there() -> None:
    rows = re.findall(r"^\| (`[^|]+) \|", README.partition("\n| folder |")[2].partition("\n\n")[0], re.M)
    named: set[str] = set()
    for row in rows:
        cells = [cell.strip("` ") for cell in row.split(",")]
        parent = "lathesim/" if cells[0].startswith("lathesim/") else ""
        named |= {cell if cell.startswith(parent) else parent + cell for cell in cells}
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []
    packages = {f"lathesim/{path.parent.name}/" for path in (ROOT / "lathesim").glob("*/__init__.py")}
    assert packages | {f"{name}/" for name in FOLDERS} <= named


def test_the_readme_names_every_chapter_and_has_two_screens() -> None:
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| \[`(\w+)`\]\(lathesim/manual/\1\.md\)", page, re.M) == [chapter.topic for chapter in chapters()]
    assert len(page.splitlines()) <= 120


def test_the_chapter_on_lessons_explains_every_key() -> None:
    schema = json_schema()
    named = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`[^|]+) \|", chapter("writing_lessons").text, re.M))))
    assert named >= {*schema["properties"], *schema["$defs"]["Variant"]["properties"]}


MOST_READ = (
    "first_hour", "writing_lessons", "your_recording", "plugins", "sweeps", "comparing", "circular_test", "lobes", "app", "programs",
)  # fmt: skip
"""Chapters that a newcomer opens beside the README: tutorials, and tasks that end in a picture."""


def test_the_pages_that_are_read_most_have_pictures_and_each_picture_a_page() -> None:
    pages = {"README": (ROOT / "README.md").read_text(encoding="utf-8"), **{chapter.topic: chapter.text for chapter in chapters()}}
    used = {name: set(re.findall(r"\[[^\]]+\]\((?:lathesim/manual/)?pictures/([\w.]+)\)", text)) for name, text in pages.items()}
    assert [name for name in ("README", *MOST_READ) if not used[name]] == []
    folder = ROOT / "lathesim" / "manual" / "pictures"
    assert {path.name for path in folder.iterdir()} == set().union(*used.values())
    assert [path.name for path in folder.iterdir() if path.stat().st_size > 100_000] == []
