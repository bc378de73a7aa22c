"""``python -m tests.diagnosis.suite``: generate the cases, run the program under test on them, print the table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from tests.diagnosis.suite.generate import generate
from tests.diagnosis.suite.runner import TIME_LIMIT, chosen, run
from tests.diagnosis.suite.table import print_table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.suite", description=__doc__)
    parser.add_argument("what", nargs="?", choices=("generate", "run", "table", "all"), default="all")
    parser.add_argument("--cases", type=Path, default=Path("build/diagnosis_suite/cases"), help="folder of the cases")
    parser.add_argument("--answers", type=Path, default=Path("build/diagnosis_suite/answers"), help="folder of the answers")
    parser.add_argument("--number", type=int, default=None, help="the first so many of the cases; all without it")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases with this in their 'rig/category hidden'")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--limit", type=float, default=TIME_LIMIT, help="seconds for a case")
    parser.add_argument("--resume", action="store_true", help="keep the answers that are there")
    parser.add_argument("--trail", action="store_true", help="keep the steps of each search beside its answer")
    parser.add_argument("--markdown", type=Path, default=None, metavar="FILE", help="write the table as Markdown too")
    asked = parser.parse_args(arguments)
    if asked.what in ("generate", "all"):
        generate(asked.cases, asked.seed, asked.number, asked.jobs)
    if asked.what in ("run", "all"):
        folders = chosen(asked.cases, asked.only, asked.number)
        run(folders, asked.answers, jobs=asked.jobs, resume=asked.resume, limit=asked.limit, trail=asked.trail, tell=_tell)
    if asked.what in ("table", "all"):
        print_table(chosen(asked.cases, asked.only, asked.number), asked.answers, asked.markdown)
    return 0


def _tell(text: str) -> None:
    print(text, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
