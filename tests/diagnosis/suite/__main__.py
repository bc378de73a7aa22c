"""``python -m tests.diagnosis.suite``: generate the cases, run the program under test on them, print the table.

``comparators`` answers the same cases in the ways a person would try without the program, and ``run --without STEP`` with a step of its
method left out; both are kept below the folder of the answers, and the table shows them beside the program. ``limits`` shows how near
right and wrong answers came to each limit: those of the tests of what is left, and all after ``run --margins``. ``speed --against
CHECKOUT`` computes the first ten cases in an older checkout too, and ``differences --against ANSWERS`` lists what that one answered
otherwise.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from tests.diagnosis.suite.against import differences, speed
from tests.diagnosis.suite.beside import folder_beside, print_beside
from tests.diagnosis.suite.comparators.answer import COMPARATORS, answer_file_of
from tests.diagnosis.suite.generate import generate
from tests.diagnosis.suite.limits import print_limits
from tests.diagnosis.suite.runner import TIME_LIMIT, answer_file, chosen, run
from tests.diagnosis.suite.table import print_table

SLOWER = 1.05
"""Ratio of CPU times above which the program has become slower."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.suite", description=__doc__)
    whats = ("generate", "run", "comparators", "table", "limits", "speed", "differences", "all")
    parser.add_argument("what", nargs="?", choices=whats, default="all")
    parser.add_argument("--cases", type=Path, default=Path("build/diagnosis_suite/cases"), help="folder of the cases")
    parser.add_argument("--answers", type=Path, default=Path("build/diagnosis_suite/answers"), help="folder of the answers")
    parser.add_argument("--number", type=int, default=None, help="the first so many of the cases; all without it")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases with this in their 'rig/category hidden'")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--limit", type=float, default=TIME_LIMIT, help="seconds for a case")
    parser.add_argument("--resume", action="store_true", help="keep the answers that are there")
    parser.add_argument("--trail", action="store_true", help="keep the steps of each search beside its answer")
    parser.add_argument("--margins", action="store_true", help="keep beside each answer how near it came to every limit")
    parser.add_argument("--without", action="append", default=[], metavar="STEP", help="run: leave out replay, baseline, null or held-out")
    parser.add_argument("--markdown", type=Path, default=None, metavar="FILE", help="write the table as Markdown too")
    parser.add_argument("--against", type=Path, default=None, metavar="PATH", help="speed: another checkout; differences: its answers")
    asked = parser.parse_args(arguments)
    if asked.what in ("speed", "differences"):
        if asked.against is None:
            parser.error(f"{asked.what} needs --against PATH")
        return _against(asked)
    if asked.what in ("generate", "all"):
        generate(asked.cases, asked.seed, asked.number, asked.jobs)
    if asked.what in ("run", "all"):
        folders = chosen(asked.cases, asked.only, asked.number)
        answers = folder_beside(asked.answers, f"without {' and '.join(asked.without)}") if asked.without else asked.answers
        run(
            folders, answers, jobs=asked.jobs, resume=asked.resume, limit=asked.limit, trail=asked.trail, without=asked.without,
            margins=asked.margins, tell=_tell,
        )  # fmt: skip
    if asked.what in ("comparators", "all"):
        for name in COMPARATORS:
            _tell(name)
            run(
                chosen(asked.cases, asked.only, asked.number), folder_beside(asked.answers, name), jobs=asked.jobs, resume=asked.resume,
                limit=asked.limit, tell=_tell, work=partial(answer_file_of, name),
            )  # fmt: skip
    if asked.what in ("table", "limits", "all"):
        folders = chosen(asked.cases, asked.only, asked.number)
        print_table(folders, asked.answers, asked.markdown)
        print_beside(folders, asked.answers, asked.markdown)
    if asked.what == "limits":
        print_limits(chosen(asked.cases, asked.only, asked.number), asked.answers, asked.markdown)
    return 0


def _against(asked: argparse.Namespace) -> int:
    if asked.what == "speed":
        folders = generate(asked.cases, asked.seed, asked.number or 10, asked.jobs)
        return int(speed(folders, asked.against.resolve(), asked.answers / "speed.jsonl", _tell) > SLOWER)
    folders = chosen(asked.cases, asked.only, asked.number)
    both = [folder for folder in folders if all(answer_file(place, folder.name).is_file() for place in (asked.answers, asked.against))]
    found = list(differences(both, asked.answers, asked.against))
    _tell("\n".join([*found, f"{len(both) - len(found)} of {len(both)} cases have the same verdict and effects"]))
    return 0


def _tell(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
