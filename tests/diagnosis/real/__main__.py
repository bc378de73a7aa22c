"""``python -m tests.diagnosis.real``: ask the program about each real recording and print what its answers are worth.

Each recording is asked in a process of its own, through the command ``diagnose``. Seconds are processor time. The answers are kept as
JSON, and ``--against`` shows what changed since another run, so that two commits can be put side by side.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.diagnosis.asking import HERE, Answer, ask
from tests.diagnosis.real.recordings import cases
from tests.diagnosis.real.scoring import RULE, changed, counted, row, table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.real", description=__doc__)
    parser.add_argument("--only", default="", metavar="NAME", help="cases with one of these in their name, separated by commas")
    parser.add_argument("--at-most", type=float, default=0.0, metavar="SECONDS", help="longest time of an answer; no limit without it")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--every-lesson", action="store_true", help="ask suite A from the motor's side too")
    parser.add_argument("--json", type=Path, default=Path("build/real.json"), metavar="FILE", help="where the answers are kept")
    parser.add_argument("--against", type=Path, default=None, metavar="FILE", help="answers of another run: show what changed since")
    parser.add_argument("--checkout", type=Path, default=HERE, metavar="FOLDER", help="ask the program of another checkout")
    parser.add_argument("--table", action="store_true", help="ask nothing, show the answers that are kept")
    asked = parser.parse_args(arguments)
    chosen = [case for case in cases(every_lesson=asked.every_lesson) if any(part in case.name for part in asked.only.split(","))]
    kept = read(asked.json) if asked.json.is_file() else {}
    more = ["--at-most", f"{asked.at_most:g}s"] if asked.at_most else []
    if not asked.table:
        with ThreadPoolExecutor(asked.jobs) as pool:
            answers = pool.map(lambda one: ask([*one.words, *more], checkout=asked.checkout.resolve()), chosen)
            for case, answer in zip(chosen, answers, strict=True):
                kept[case.name] = answer
                write(asked.json, kept)
                print(f"{case.name}: {' | '.join(row(case, answer)[2:])}", file=sys.stderr, flush=True)
    chosen = [case for case in chosen if case.name in kept]
    print(table(row(case, kept[case.name]) for case in chosen))
    print(f"\n{counted(row(case, kept[case.name]) for case in chosen)}\n{RULE}")
    if asked.against is not None:
        print("\n" + "\n".join(changed(chosen, kept, read(asked.against))))
    return 0


def read(file: Path) -> dict[str, Answer]:
    """Return the answers that were kept in a file, by the name of the case."""
    return {name: Answer(**kept) for name, kept in json.loads(file.read_text(encoding="utf-8")).items()}


def write(file: Path, answers: dict[str, Answer]) -> None:
    """Keep answers in a file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({name: vars(answer) for name, answer in answers.items()}, indent=1)
    file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(main())
