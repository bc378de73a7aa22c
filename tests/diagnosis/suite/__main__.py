"""``python -m tests.diagnosis.suite``: generate the cases, ask the program about each, print the table.

``limits`` shows how near right and wrong answers came to each limit of the method. ``--checkout`` asks an older program, ``--kept-as`` and
``--against`` show what two of them answer otherwise; ``--without STEP`` leaves a step of the method out.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from tests.diagnosis import asking, scoring
from tests.diagnosis.suite.generate import generate
from tests.diagnosis.suite.limits import near, table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.suite", description=__doc__)
    parser.add_argument("what", nargs="?", default="run", choices=("generate", "run", "table", "limits"))
    parser.add_argument("--cases", type=Path, default=Path("build/diagnosis_suite"), help="folder of cases and answers")
    parser.add_argument("--number", type=int, default=None, help="the first so many of the cases; all without it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes that make cases")
    asking.options(parser)
    asked = parser.parse_args(arguments)
    folders = [one for one in generate(asked.cases, asked.seed, asked.number, asked.jobs) if asked.only in _label(one)]
    if asked.what == "run":
        asking.ask_all(folders, asked, lambda folder, answer: scoring.line(asking.truth_of(folder), answer))
    if asked.what in ("run", "table"):
        scoring.show(folders, asked)
    if asked.what == "limits":
        print("\n".join(table(near(folders))))
    return 0


def _label(folder: Path) -> str:
    truth = asking.truth_of(folder)
    return f"{folder.name} {truth['rig']}/{truth['kind']} {truth['poor']} {'+'.join(truth['right']) or truth['fault']}"


if __name__ == "__main__":
    raise SystemExit(main())
