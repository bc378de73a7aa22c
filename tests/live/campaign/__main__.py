"""``python -m tests.live.campaign``: watch sixty streams of twenty simulated minutes, and print what was asked and what was measured.

Answers are appended to a file, one line a stream; a campaign that was stopped goes on where it stood. The order is drawn at random, so the
first streams are a fair share.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from tests.live.campaign.cases import SEED, all_cases
from tests.live.campaign.run import run_case
from tests.live.campaign.scoring import line, table


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.live.campaign", description=__doc__)
    parser.add_argument("what", nargs="?", choices=("run", "table", "all"), default="all")
    parser.add_argument("--answers", type=Path, default=Path("build/watch_campaign.jsonl"), help="file of the answers")
    parser.add_argument("--seed", type=int, default=SEED, help="of the cases")
    parser.add_argument("--number", type=int, default=60, help="the first so many of the streams")
    parser.add_argument("--only", default="", metavar="TEXT", help="streams with this in their 'machine change'")
    parser.add_argument("--patience", type=float, default=160.0, help="seconds of a diagnosis; 0 leaves it out")
    asked = parser.parse_args(arguments)
    asked.answers.parent.mkdir(parents=True, exist_ok=True)
    answers = [json.loads(text) for text in asked.answers.read_text().splitlines()] if asked.answers.exists() else []
    done = {answer["case"]["number"] for answer in answers}
    for case in all_cases(asked.seed)[: asked.number] if asked.what != "table" else []:
        if case.number in done or asked.only not in f"{case.machine} {case.change}":
            continue
        answers.append(json.loads(json.dumps(run_case(case, asked.patience), default=float)))
        with asked.answers.open("a", encoding="utf-8") as file:
            file.write(json.dumps(answers[-1]) + "\n")
        print(line(answers[-1]), flush=True)
    if asked.what == "table":
        print("\n".join(line(answer) for answer in answers))
    print(table(answers))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
