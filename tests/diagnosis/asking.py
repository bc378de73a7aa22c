"""The program asked about recordings as a person asks it, for every campaign: each case in a process of its own, answers kept as files.

What is kept holds the JSON of the program as it is, the seconds of processor time and what it wrote. The truth is not in it and not shown
to the program.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parents[2]
"""The checkout that these tests belong to."""


@dataclass(frozen=True)
class Answer:
    """What the program answered: its JSON (empty without an answer), seconds of processor time, and what it wrote."""

    told: Mapping[str, Any]
    seconds: float = 0.0
    said: str = ""


def ask(words: Sequence[str | Path], *, checkout: Path = HERE, limit: float = 0.0) -> Answer:
    """Call ``lathesim diagnose`` of a checkout with some words; ``limit`` is the most processor time [s], 0 for none."""
    with tempfile.TemporaryDirectory() as scratch:
        file, written = Path(scratch) / "answer.json", Path(scratch) / "said.txt"
        given = [word.resolve() if isinstance(word, Path) else word for word in words]
        command = [sys.executable, "-m", "lathesim", "diagnose", *map(str, given), "--no-report", "--json", str(file), "--out", scratch]
        with written.open("w", encoding="utf-8") as text:
            asked = subprocess.Popen(
                command, cwd=scratch, env={**os.environ, "PYTHONPATH": str(checkout)}, stdout=text, stderr=text,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (round(limit), round(limit))) if limit else None,
            )  # fmt: skip
            _, status, used = os.wait4(asked.pid, 0)
        asked.returncode = os.waitstatus_to_exitcode(status)
        said = written.read_text(encoding="utf-8") if asked.returncode >= 0 else f"no answer within {limit:g} s"
        return Answer(_read(file), used.ru_utime + used.ru_stime, said)


def ask_here(*words: str | Path) -> dict[str, Any]:
    """Call ``lathesim diagnose`` in this process, where much is compiled already, and return its JSON (empty without an answer)."""
    from lathesim.cli.main import run_command_line

    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "answer.json"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            run_command_line(["diagnose", *map(str, words), "--no-report", "--json", str(file), "--out", scratch])
        return _read(file)


def answer_in(folder: Path, *words: str) -> dict[str, Any]:
    """Return the JSON of ``diagnose`` for lesson.yaml and log.csv of a folder, judged by other.csv; it has to end without an error."""
    from lathesim.cli.main import run_command_line

    lesson, log, other, answer = (str(folder / name) for name in ("lesson.yaml", "log.csv", "other.csv", "answer.json"))
    out = ["--json", answer, "--no-report", "--out", str(folder / "out")]
    assert run_command_line(["diagnose", lesson, log, "--validate", other, *out, *words]) == 0
    return _read(Path(answer))


def words_of(folder: Path) -> list[str | Path]:
    """Return the lesson and the recordings of a case in a folder, and the parts that it brings along, as ``diagnose`` takes them."""
    parts = folder / "parts"
    more = ["--plugins", parts] if parts.is_dir() else []
    return [folder / "lesson.yaml", folder / "fit.csv", "--validate", folder / "validate.csv", *more]


def truth_of(folder: Path) -> dict[str, Any]:
    """Return what is true of the case in a folder."""
    return dict(_read(folder / "truth.json"))


def ask_case(folder: Path, *, checkout: Path = HERE, limit: float = 0.0, more: Sequence[str] = ()) -> Answer:
    """Ask about the case in a folder."""
    return ask([*words_of(folder), *more], checkout=checkout, limit=limit)


def options(parser: argparse.ArgumentParser) -> None:
    """Add what every campaign of case folders takes."""
    parser.add_argument("--only", default="", metavar="TEXT", help="cases with this in the name of their folder, or in what they hide")
    parser.add_argument("--limit", type=float, default=240.0, help="seconds of processor time for an answer")
    parser.add_argument("--again", action="store_true", help="ask again what was answered")
    parser.add_argument("--without", action="append", default=[], metavar="STEP", help="leave out replay, baseline, null or held-out")
    parser.add_argument("--checkout", type=Path, default=HERE, metavar="FOLDER", help="ask the program of another checkout")
    parser.add_argument("--kept-as", default="told", metavar="NAME", help="file of an answer in the folder of its case")
    parser.add_argument("--against", default="", metavar="NAME", help="answers of another run, kept under that name: show what differs")


def ask_all(folders: Iterable[Path], asked: argparse.Namespace, line: Callable[[Path, Answer], str]) -> None:
    """Ask about the cases that have no answer yet, keep what is answered, and print a line for each."""
    for folder in folders:
        if asked.again or not (folder / f"{asked.kept_as}.json").is_file():
            more = [word for step in asked.without for word in ("--without", step)]
            answer = ask_case(folder, checkout=asked.checkout.resolve(), limit=asked.limit, more=more)
            keep(folder / f"{asked.kept_as}.json", answer)
            print(line(folder, answer), flush=True)


def keep(file: Path, answer: Answer) -> None:
    """Keep an answer as a file."""
    file.write_text(json.dumps(vars(answer), indent=1), encoding="utf-8")


def kept(folders: Iterable[Path], name: str) -> dict[Path, Answer]:
    """Return the answers of cases that are kept under a name, by folder."""
    files = {folder: _read(file) for folder in folders if (file := folder / f"{name}.json").is_file()}
    return {folder: Answer(one["told"], one["seconds"], one["said"]) for folder, one in files.items()}


def differences(now: Mapping[Path, Answer], before: Mapping[Path, Answer]) -> list[str]:
    """Return the cases whose verdict, effects or ties are other ones in two runs, and the ratio of all processor time."""
    both = [folder for folder in now if folder in before]
    said = [(folder, in_words(before[folder].told), in_words(now[folder].told)) for folder in both]
    lines = [f"{folder.name}: {old} -> {new}" for folder, old, new in said if old != new]
    spent = [sum(answers[folder].seconds for folder in both) for answers in (now, before)]
    same = f"{len(both) - len(lines)} of {len(both)} cases have the same verdict and effects"
    return [*lines, f"{same}; processor time {spent[0]:.0f} s, {spent[1]:.0f} s before"]


def in_words(told: Mapping[str, Any]) -> str:
    """Return verdict, effects with their ties, and whether something is left, in a line."""
    named = [" ~ ".join([f"{one['effect']} at {one['at']}", *(one.get("tied_with") or [])]) for one in told.get("effects") or []]
    return f"{told.get('verdict', 'no answer')}: {' + '.join(named) or '-'}{'' if told.get('adequate', True) else ' (not adequate)'}"


def _read(file: Path) -> dict[str, Any]:
    return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}
