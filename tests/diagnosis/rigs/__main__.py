"""``python -m tests.diagnosis.rigs``: write cases, ask the program about each in every description, print the table.

Each case is asked once, in a process of its own with a limit of processor time; what was answered is kept, and ``table`` prints it again.
``limits`` shows how near right and wrong answers came to each limit of the method, and ``ties`` and ``sizes`` how often ``isolable``
predicted what was answered.
``--checkout`` asks an older program, ``--kept-as`` and ``--against`` show what two of them answer otherwise.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from tests.diagnosis import asking, scoring
from tests.diagnosis.rigs import predicted_ties, smallest_sizes
from tests.diagnosis.rigs.cases import SETS, Case, schedule, write_case
from tests.diagnosis.rigs.limits import near, table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.rigs", description=__doc__)
    parser.add_argument("what", choices=("run", "table", "limits", "ties", "sizes"))
    parser.add_argument("--set", dest="rigs", choices=SETS, default="first", help="which set of rigs")
    parser.add_argument("--folder", type=Path, default=Path("build/rigs"), help="folder of cases and answers")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", default="sound=2,values=1,single=2,pair=1,outside=1,fault=1", metavar="KIND=N,...", help="cases a rig")
    parser.add_argument("--half", choices=("calibration", "held-out", "both"), default="both", help="half of the rigs")
    parser.add_argument("--in-turn", action="store_true", help="ask each case in one description alone, another one from case to case")
    asking.options(parser)
    asked = parser.parse_args(arguments)
    counts = {kind: int(number) for kind, _, number in (item.partition("=") for item in asked.each.split(","))}
    folders: list[Path] = []
    cases: list[tuple[Case, Path]] = []
    for case in schedule(asked.seed, counts, asked.rigs):
        if asked.half != "both" and case.rig.calibrating != (asked.half == "calibration"):
            continue
        written = [asked.folder / f"{case.name}__{description}" for description in case.descriptions]
        if not all((folder / "truth.json").is_file() for folder in written):
            written = write_case(case, asked.folder)
        written = [written[case.number % len(written)]] if asked.in_turn else written
        folders += [folder for folder in written if asked.only in folder.name]
        cases += [(case, folder) for folder in written if asked.only in folder.name]
    if asked.what == "limits":
        print("\n".join(table(near(folders))))
        return 0
    if asked.what == "sizes":
        found = []
        for one in smallest_sizes.asked(cases, asked.kept_as, asked.limit):
            found.append(one)
            print(smallest_sizes.line(*one), flush=True)
        print("\n".join(smallest_sizes.table(found)))
        return 0
    if asked.what == "ties":
        print("\n".join(predicted_ties.table(predicted_ties.compared(folders, asked.kept_as))))
        return 0
    if asked.what == "run":
        asking.ask_all(folders, asked, lambda folder, answer: scoring.line(asking.truth_of(folder), answer))
    scoring.show(folders, asked)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
