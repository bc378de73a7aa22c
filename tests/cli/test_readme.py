"""What the README shows is what happens: the two commands first, the lesson and the part of its examples in working order."""

import re
from pathlib import Path

import pytest

from tests.cli.command import ROOT, call

README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str, containing: str) -> str:
    """Give the fenced block of the README that holds a text, without its indentation."""
    found = [match for match in re.findall(rf"^ *```{language}\n(.*?)^ *```$", README, re.S | re.M) if containing in match]
    assert len(found) == 1
    indent = len(found[0]) - len(found[0].lstrip(" "))
    return "\n".join(line[indent:] for line in found[0].splitlines()) + "\n"


def test_the_first_screen_holds_exactly_the_two_commands() -> None:
    screen = "\n".join(README.splitlines()[:20])
    assert re.findall(r"```sh\n(.*?)```", screen, re.S) == [
        "python -m pip install . && lathesim run lesson_configs/01_contour_error.yaml\n",
        "python -m pip install '.[test]' && python -m pytest\n",
    ]


def test_the_part_and_the_lesson_of_the_readme_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(capsys, "init", "work").code == 0
    monkeypatch.chdir(tmp_path / "work")
    Path("plugins/my_force.py").write_text(block("python", "class MyForce"), encoding="utf-8")
    Path("mine.yaml").write_text(block("yaml", "My first lesson").replace("LinearForce", "MyForce"), encoding="utf-8")
    said = call(capsys, "check", "plugins/my_force.py", "mine.yaml")
    assert said.code == 0, said.err
    assert "\ncutting_force: MyForce\n" in call(capsys, "wiring", "mine.yaml").out
    assert call(capsys, "run", "mine.yaml", "--variant", "stiff", "--plain", "--no-plots").code == 0
