"""``lathesim help``: the chapters, one of them, and the nearest topic for a wrong one."""

import subprocess
import sys

import pytest

from lathesim.manual.chapters import TOPICS, chapter
from tests.cli.command import call


def test_the_list_names_every_chapter_with_its_title(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "help")
    assert said.code == 0
    listed = said.out.partition("\n\n")[0].splitlines()
    assert [tuple(line.split(maxsplit=1)) for line in listed] == [(topic, chapter(topic).title) for topic in TOPICS]


@pytest.mark.parametrize("topic", TOPICS)
def test_a_chapter_that_goes_to_a_file_is_its_markdown(topic: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "help", topic)
    assert (said.code, said.out) == (0, chapter(topic).text + "\n")


def test_a_wrong_topic_is_answered_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "help", "diagnose")
    assert (said.code, said.out) == (1, "")
    assert said.err == "the manual has no chapter 'diagnose'. Did you mean 'diagnosis'?\n"


def test_a_chapter_needs_nothing_heavy() -> None:
    heavy = "{'numpy', 'scipy', 'numba', 'textual', 'matplotlib', 'yaml', 'pint'}"
    code = (
        f"import sys\nfrom lathesim.cli.main import run_command_line as run\nrun(['help', 'speed'])\nassert not {heavy} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
