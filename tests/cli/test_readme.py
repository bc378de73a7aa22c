"""What README and manual show is what happens: the two commands first, every command in working order, the lesson and the part too."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
import yaml

from lathesim.analysis.metric import measure
from lathesim.classroom.teacher_notes import TeacherNotes
from lathesim.cli.main import group
from lathesim.lessons.grading import judge
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.simulate import simulate
from lathesim.live.channel_names import map_from
from lathesim.manual.chapters import chapters
from lathesim.motion.axis_limits import limits_from
from lathesim.motion.kinematics import chain_from
from lathesim.plugins import load_registry
from lathesim.stability.assembly_file import load_assembly
from tests.cli.command import ROOT, call, done, environment

README = "\n".join([(ROOT / "README.md").read_text(encoding="utf-8"), *(chapter.text for chapter in chapters())])
SETUP = [
    "python -m pip install . && lathesim run lesson_configs/01_contour_error.yaml\n",
    "python -m pip install '.[test]' && python -m pytest\n",
]


def blocks(language: str, page: str = README) -> list[str]:
    """Return the fenced blocks of a page, else of all, in a language, without their indentation."""
    found = re.findall(r"^( *)```(\w*)\n(.*?)^ *```$", page, re.S | re.M)
    texts = [(indent, text) for indent, named, text in found if named == language]
    return ["".join(line.removeprefix(indent) for line in text.splitlines(keepends=True)) for indent, text in texts]


def block(language: str, containing: str, page: str = README) -> str:
    """Return the one block of a language that holds a text."""
    (found,) = (text for text in blocks(language, page) if containing in text)
    return found


def commands() -> list[list[str]]:
    """Return every call of lathesim that a page shows, as its arguments."""
    shown = [*blocks("sh"), *(text for text in (*blocks(""), *blocks("text")) if text.startswith("lathesim "))]
    lines = "".join(shown).replace("\\\n", " ").splitlines()
    calls = [shlex.split(part) for line in lines for part in line.split("&&")]
    return [words[1 : words.index(">") if ">" in words else None] for words in calls if words[0] == "lathesim"]


def test_the_first_screen_holds_exactly_the_two_commands() -> None:
    screen = "\n".join(README.splitlines()[:20])
    assert re.findall(r"```sh\n(.*?)```", screen, re.S) == SETUP


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_a_command_of_the_readme_is_understood(words: list[str]) -> None:
    name, *arguments = words
    command = group.get_command(click.Context(group), name)
    assert command is not None
    command.make_context(name, arguments)


def test_what_a_sentence_names_of_a_command_is_there() -> None:
    missing = []
    for text in re.findall(r"`lathesim ([a-z][a-z-]*(?: [^`]*)?)`", re.sub(r"```.*?```", "", README, flags=re.S)):
        name, *words = text.split()
        command = group.get_command(click.Context(group), name)
        if isinstance(command, click.Group):
            command = command.get_command(click.Context(command), words[0])
        known = {option for item in command.params for option in (*item.opts, *item.secondary_opts)} if command is not None else set()
        missing += [text] if command is None else [f"{name} {word}" for word in words if word.startswith("--") and word not in known]
    assert missing == []


def test_the_part_and_the_lesson_of_the_readme_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done(capsys, "init", "work")
    monkeypatch.chdir(tmp_path / "work")
    Path("plugins/my_force.py").write_text(block("python", "class MyForce"), encoding="utf-8")
    Path("mine.yaml").write_text(block("yaml", "A force of my own"), encoding="utf-8")
    done(capsys, "check", "plugins/my_force.py", "mine.yaml")
    assert "\ncutting_force: MyForce\n" in call(capsys, "wiring", "mine.yaml").out
    assert " met\n" in call(capsys, "run", "mine.yaml", "--plain", "--no-plots").out


LESSONS = [text for text in blocks("yaml") if text.startswith("lesson:") and "MyForce" not in text]
OF_RECORDINGS = [text for text in LESSONS if "recordings:" in text]
"""Lessons that a recording is held against; they are no exercise and have no goal."""


@pytest.mark.parametrize("text", OF_RECORDINGS, ids=lambda text: text.splitlines()[0])
def test_a_lesson_that_a_recording_is_held_against_passes_the_check(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    for name in re.findall(r"^program: (\S+)", text, re.MULTILINE):  # the page shows it beside the lesson
        (tmp_path / name).write_text("G21 G90 G94 G18\nG01 X1.0 F100\nM02\n", encoding="utf-8")
    done(capsys, "check", tmp_path / "mine.yaml")


@pytest.mark.parametrize("text", [text for text in LESSONS if text not in OF_RECORDINGS], ids=lambda text: text.splitlines()[0])
def test_a_lesson_of_the_manual_meets_its_goals_or_the_manual_says_which_case_misses(text: str) -> None:
    lesson, registry = lesson_from_text(text, ROOT / "lesson.yaml"), load_registry(installed=False)
    assert lesson.settings.goals
    for variant in lesson.variants or (None,):
        found = measure(simulate(lesson, registry, variant, engine="compiled"), registry.metrics)
        met = all(goal.met for goal in judge(lesson.settings.goals, found.values, found.skipped))
        assert met != (f"The case `{variant}` misses its goal" in README), variant


FRAGMENTS = [text for text in blocks("yaml") if not text.startswith("lesson:")]
LATHE = "machine: two_axis_lathe\nprogram: one_pass.nc\n"
HOMES = {
    "recordings": "machine: cascade_axis\n",
    "time": "machine: cutting_process\nrecordings:\n  compare: {cutting.feed_force: {column: F, unit: N}}\n",
    "goals": LATHE,
    "tools": LATHE,
    "questions": LATHE,
    "tool_point": "machine: turning_with_chatter\nduration: 1 s\n",
    "uncertain": f"machine: turning_with_chatter\nduration: 1 s\n{block('yaml', 'tool_point:')}",
}
"""By the first key of a fragment, the lesson that it belongs to."""


def axes_of(data: dict[str, Any]) -> object:
    """Return the kinematics of a file, whose axes have limits or none."""
    if "axes" in data:
        limits_from(data, list(data["axes"]), ["rad" if name in "abc" else "m" for name in data["axes"]], "manual")
    return chain_from(data["kinematics"], "manual")


READERS: dict[str, Callable[[Path], object]] = {
    "assembly": load_assembly,
    "kinematics": lambda file: axes_of(yaml.safe_load(file.read_text())),
    "channels": lambda file: map_from(yaml.safe_load(file.read_text()), "manual"),
    "vary": lambda file: TeacherNotes.model_validate(yaml.safe_load(file.read_text())),
}
"""The same for files beside lessons."""


@pytest.mark.parametrize("text", FRAGMENTS, ids=lambda text: text.strip().splitlines()[0])
def test_a_fragment_of_yaml_that_a_page_shows_fits_where_it_belongs(text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = text.strip().partition(":")[0]
    file = tmp_path / "mine.yaml"
    file.write_text(text if key in READERS else f"lesson: Mine\n{HOMES[key]}{text}", encoding="utf-8")
    if key in READERS:
        assert READERS[key](file)
    else:
        done(capsys, "check", file)


def test_a_lesson_changed_in_the_workspace_is_the_one_that_its_name_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert "cutting_force: NonlinearForce" in call(capsys, "wiring", "10_feed_and_roughness").out
    Path("lesson_configs").mkdir()
    changed = "lesson: Mine\nmachine: two_axis_lathe\nprogram: one_pass.nc\nreplace: {cutting_force: LinearForce}\n"
    Path("lesson_configs/10_feed_and_roughness.yaml").write_text(changed, encoding="utf-8")
    assert "cutting_force: LinearForce" in call(capsys, "wiring", "10_feed_and_roughness").out


PAGES = {"README": (ROOT / "README.md").read_text(encoding="utf-8"), **{chapter.topic: chapter.text for chapter in chapters()}}
SHOWN = {
    "README": ["VI    18.48 s"],
    "lessons": ["sharp_nose"],
    "grading": ["max surface roughness  at most"],
    "comparing": ["x_drive.current       619 mA"],
}
"""By page, what stands in the blocks without a language that are answers of the commands above them, to the last digit."""
SAID = {"first_hour": ["0.33787 mm", "least 0.1812 mm", "most 1.553 mm", "71%  velocity of x_axis", "level: 19.9"]}
"""By page, what its sentences say of the answers of its commands."""
BEGUN = {"diagnosing": ["The simulation left out", "Right: "]}
"""The same, where only the first line is compared."""


def saved(page: str) -> dict[str, str]:
    """Return the files that a page says to save, by name."""
    found = re.findall(r"Save\s+this\s+as\s+`([\w./]+)`[^\n]*:\n\n```\w+\n(.*?)^```$", PAGES[page], re.S | re.M)
    return dict(found)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("page", [name for name, text in PAGES.items() if blocks("sh", text)])
def test_the_commands_of_a_page_work_as_written_in_a_new_folder(page: str, tmp_path: Path) -> None:
    caller = tmp_path / "bin" / "lathesim"
    caller.parent.mkdir()
    caller.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lathesim "$@"\n', encoding="utf-8")
    caller.chmod(0o755)
    paths = {**environment(), "PATH": f"{caller.parent}{os.pathsep}{os.environ['PATH']}"}
    texts = [text for text in blocks("sh", PAGES[page]) if text not in SETUP]
    begin = "" if texts and texts[0].startswith("lathesim init") else "lathesim init work && cd work\n"
    files = "".join(
        f'mkdir -p "$(dirname {name})"\ncat > {name} <<"END OF FILE"\n{text}END OF FILE\n' for name, text in saved(page).items()
    )
    if page == "README":
        texts.append("lathesim run 01_contour_error --no-plots\n")
    script = "".join(["set -e\n", begin or texts.pop(0), files, *texts])
    done = subprocess.run(["/bin/sh", "-c", script], cwd=tmp_path, env=paths, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = [line.rstrip(" .") for part in SHOWN.get(page, ()) for line in block("", part, PAGES[page]).splitlines()]
    shown += SAID.get(page, [])
    shown += [block("", part, PAGES[page]).splitlines()[0] for part in BEGUN.get(page, ())]
    assert [line for line in shown if line not in done.stdout] == []
