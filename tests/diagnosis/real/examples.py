"""``python -m tests.diagnosis.real.examples``: ask about the real recordings, and write answers and pictures into the manual.

The chapter has a line ``<!-- answer of CASE -->`` for each; the answer stands between it and the next heading or command.
"""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.reporting.figures import WHOLE, missing_svg, trace_svg
from lathesim.diagnosis.reporting.number_text import plain
from lathesim.diagnosis.reporting.summary import headline, summary_lines
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.cli.command import ROOT
from tests.diagnosis.real.cases import Case
from tests.diagnosis.real.recordings import real

CHAPTER = ROOT / "lathesim" / "manual" / "real_machines.md"
PICTURES = CHAPTER.parent / "pictures"
WIDTH = 140
POINTS = 500
"""Points of a line in a picture: a page of the manual is small, and the repository should stay so."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.real.examples", description=__doc__)
    parser.add_argument("--only", default="", metavar="NAME", help="cases with one of these in their name, separated by commas")
    asked = parser.parse_args(arguments)
    for case in real():
        if any(part in case.name for part in asked.only.split(",")):
            answer = answered(case)
            place = PICTURES / f"real_{case.name}.svg"
            place.write_text(picture(case, answer), encoding="utf-8")
            text = CHAPTER.read_text(encoding="utf-8")
            CHAPTER.write_text(with_answer(text, case.name, answer_block(answer, place)), encoding="utf-8")
            print(f"{case.name}: {headline(answer)} {answer.search.wall_time:.0f} s", flush=True)
    return 0


def answered(case: Case) -> Diagnosis:
    """Return what the program answers to a case."""
    registry = load_registry(installed=False)
    lesson = load_lesson(str(case.file(case.lesson)))
    files = [case.file(name) for name in (case.fitted, case.validation) if name]
    loaded = load_case(lesson, files, registry)
    return diagnose(ask(lesson.title, loaded.machine, loaded.recordings, registry.effects.values()))


def answer_block(answer: Diagnosis, place: Path) -> str:
    """Return the six lines of an answer and its picture, in Markdown."""
    lines = [textwrap.fill(plain(line), WIDTH, subsequent_indent="  ", break_on_hyphens=False) for line in summary_lines(answer)]
    return "\n".join(["```", *lines, "```", "", f"![Recorded, and simulated before and after](pictures/{place.name})"])


def with_answer(text: str, name: str, block: str) -> str:
    """Return a chapter with the answer of a case in the place of the one that it had."""
    mark = f"<!-- answer of {name} -->"
    before, found, after = text.partition(mark)
    if not found:
        raise ValueError(f"the chapter has no line {mark}")
    old = re.match(r"\n\n```\n.*?\n```\n\n!\[[^\n]*\n", after, flags=re.S)
    return f"{before}{mark}\n\n{block}\n{after[old.end() if old else 1 :]}"


def picture(case: Case, answer: Diagnosis) -> str:
    """Return the picture of the channel that decides, or else of the one that is furthest off: its simulation, or what it lacks beside the
    other recorded ones."""
    evidence, channel = answer.evidence, case.deciding.channel if case.deciding else ""
    missing = next((item for item in evidence.missing if item.at == channel), None)
    trace = next((item for item in evidence.traces if item.channel == channel), None)
    if case.deciding and case.deciding.within == "missing" and missing is not None:
        drawn = missing_svg(missing, (), case.name, WHOLE, POINTS)
    else:
        # recordings that were fitted together are judged by their readings, and not by what a part lacks
        trace = trace or max(evidence.traces, key=lambda item: answer.fit[item.channel].after / answer.fit[item.channel].floor)
        channel = trace.channel
        drawn = trace_svg(trace, answer.fit[channel].floor, (), case.name, WHOLE, POINTS)
    return standing_alone(drawn)


def standing_alone(drawn: str) -> str:
    """Return a figure of a page as a file of its own, its coordinates to a tenth of a point."""
    drawn = drawn.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
    return re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\d+\.\d)\d+", r"\1", path[0]), drawn) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
