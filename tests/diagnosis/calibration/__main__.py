"""``python -m tests.diagnosis.calibration``: whether intervals, ties and silence are worth what they promise.

Without an option the gates are read off the stored draws, in a second. ``--long`` draws new machines with a new seed, asks the program
about each, adds the draws to the file, and prints the gates of those; a release asks ``--tables 300 --sound 10 --single 10 --suite 60``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from tests.diagnosis.calibration.asking import rigs, tables
from tests.diagnosis.calibration.draws import append, read
from tests.diagnosis.calibration.gates import gates, table

STORED = Path(__file__).parent / "draws.jsonl"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code is 1 where a gate is missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.calibration", description=__doc__)
    parser.add_argument("--draws", type=Path, default=STORED, metavar="FILE", help="where the draws are kept")
    parser.add_argument("--long", action="store_true", help="draw and ask; without it only the stored draws are read")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tables", type=int, default=300, metavar="N", help="pushed tables, one or two seconds each")
    parser.add_argument("--sound", type=int, default=10, metavar="N", help="sound machines of each of the twenty rigs")
    parser.add_argument("--single", type=int, default=10, metavar="N", help="single effects of each of the twenty rigs")
    parser.add_argument("--at-most", type=float, default=60.0, metavar="SECONDS", help="longest time of an answer")
    asked = parser.parse_args(arguments)
    if asked.long:
        kept = {draw.name for draw in read(asked.draws)}
        drawn = chain(
            tables(asked.seed, asked.tables, asked.at_most, kept), rigs(asked.seed, asked.sound, asked.single, asked.at_most, kept),
        )  # fmt: skip
        for draw in drawn:
            append(asked.draws, [draw])
            print(f"{draw.name}: {draw.told['verdict']}, {draw.seconds:.1f} s", file=sys.stderr, flush=True)
    draws = read(asked.draws)
    print(table(draws))
    return int(not all(gate.met for gate in gates(draws)))


if __name__ == "__main__":
    raise SystemExit(main())
