"""``lathesim help``: the chapters, one of them, and the nearest topic for a wrong one."""

import subprocess
import sys

import pytest

from lathesim.manual.chapters import GROUPS, TOPICS, chapter
from tests.cli.command import call, done


def test_the_list_names_every_chapter_with_its_title(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "help")
    parts = [part.splitlines() for part in said.out.split("\n\n")[: len(GROUPS)]]
    listed = {part[0].removesuffix(":"): tuple(line.split()[0] for line in part[1:]) for part in parts}
    assert listed == GROUPS
    assert all(f"{topic:<16} {chapter(topic).title}\n" in said.out for topic in TOPICS)


HOW_TO = GROUPS["How to, on one screen"]


@pytest.mark.parametrize("topic", HOW_TO)
def test_a_page_of_one_screen_is_no_longer_and_has_commands(topic: str) -> None:
    lines = chapter(topic).text.splitlines()
    assert len(lines) <= 40
    assert any("lathesim " in line for line in lines) or topic == "goals"


@pytest.mark.parametrize("topic", TOPICS)
def test_a_chapter_that_goes_to_a_file_is_its_markdown(topic: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "help", topic)
    assert (said.code, said.out) == (0, chapter(topic).text + "\n")


def test_a_wrong_topic_is_answered_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "help", "stabilty")
    assert (said.code, said.out) == (1, "")
    assert said.err == "the manual has no chapter 'stabilty'. Did you mean 'stability'?\n"


def test_a_chapter_needs_nothing_heavy() -> None:
    heavy = "{'numpy', 'scipy', 'numba', 'textual', 'matplotlib', 'yaml', 'pint'}"
    code = (
        f"import sys\nfrom lathesim.cli.main import run_command_line as run\nrun(['help', 'speed'])\nassert not {heavy} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
