"""``python -m tests.diagnosis.real.comparators``: what a person would reach without the program, on the same recordings, in one table.

Right, partly and wrong are those of ``tests.diagnosis.real``, by verdict and names alone: an equation predicts no simulation.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tests.diagnosis.real.__main__ import read
from tests.diagnosis.real.cases import Case
from tests.diagnosis.real.comparators.grey_box import answer
from tests.diagnosis.real.comparators.regressions import adcd, sindy
from tests.diagnosis.real.recordings import cases
from tests.diagnosis.real.scoring import named_at, worth

PROGRAM = "lathesim"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.real.comparators", description=__doc__)
    parser.add_argument("--only", default="", metavar="NAME", help="cases with one of these in their name, separated by commas")
    parser.add_argument("--adcd", type=Path, default=None, metavar="PYTHON", help="an interpreter where adcd is installed")
    parser.add_argument("--program", type=Path, default=None, metavar="FILE", help="answers kept by tests.diagnosis.real")
    parser.add_argument("--table", action="store_true", help="ask nothing, show the answers that are kept")
    parser.add_argument("--json", type=Path, default=Path("build/comparators.json"), metavar="FILE", help="where the answers are kept")
    asked = parser.parse_args(arguments)
    chosen = [case for case in cases() if any(part in case.name for part in asked.only.split(","))]
    kept: dict[str, dict[str, Any]] = json.loads(asked.json.read_text(encoding="utf-8")) if asked.json.is_file() else {}
    with tempfile.TemporaryDirectory() as folder:
        ways: dict[str, Callable[[Case], dict[str, Any]]] = {
            "grey box, BIC": lambda case: answer(case, careful=False),
            "grey box, BIC and held out": lambda case: answer(case, careful=True),
            "SINDy": sindy,
        }
        if asked.adcd:
            ways["adcd"] = lambda case: adcd(case, asked.adcd, Path(folder))
        for name, way in ways.items() if not asked.table else ():
            for case in chosen:
                kept.setdefault(name, {})[case.name] = way(case)
            asked.json.parent.mkdir(parents=True, exist_ok=True)
            asked.json.write_text(json.dumps(kept, indent=1), encoding="utf-8")
    if asked.program:
        kept[PROGRAM] = {name: dict(one.told) for name, one in read(asked.program).items()}
    print(table(chosen, kept))
    return 0


def table(chosen: Sequence[Case], kept: dict[str, dict[str, Any]]) -> str:
    """Return the table as Markdown: a row a case, a column a way, and how many each way has right and partly right."""
    lines = [f"| case | truth | {' | '.join(kept)} |", "|---" * (len(kept) + 2) + "|"]
    for case in chosen:
        cells = [_cell(case, answers.get(case.name)) for answers in kept.values()]
        lines.append(f"| {case.name} | {case.truth} | {' | '.join(cells)} |")
    marks = [[worth(case, answers[case.name], by_names=True) for case in chosen if case.name in answers] for answers in kept.values()]
    sums = [f"{one.count('right')} right, {one.count('partly')} partly of {len(one)}" for one in marks]
    return "\n".join([*lines, f"| all | | {' | '.join(sums)} |"])


def _cell(case: Case, told: dict[str, Any] | None) -> str:
    return "-" if told is None else f"{worth(case, told, by_names=True)}: {named_at(told) or told.get('verdict', 'no answer')}"


if __name__ == "__main__":
    raise SystemExit(main())
