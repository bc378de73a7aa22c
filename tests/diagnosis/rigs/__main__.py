"""``python -m tests.diagnosis.rigs``: write cases, ask the program about each in every description, print the table.

Each case is asked once, in a process of its own with a limit of processor time; what was answered is kept, and ``table`` prints it again.
"""

from __future__ import annotations

import argparse
import functools
import json
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from tests.diagnosis.rigs import cases as first
from tests.diagnosis.rigs.scoring import Answer, table
from tests.diagnosis.rigs.second import cases as second


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagnosis.rigs", description=__doc__)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("--set", dest="rigs", choices=("first", "second", "both"), default="first", help="which set of rigs")
    parser.add_argument("--folder", type=Path, default=Path("build/rigs"), help="folder of cases and answers")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", default="sound=2,values=1,single=2,pair=1,outside=1,fault=1", metavar="KIND=N,...", help="cases a rig")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases with this in the name of their folder")
    parser.add_argument("--half", choices=("calibration", "held-out", "both"), default="both", help="half of the rigs")
    parser.add_argument("--limit", type=float, default=240.0, help="seconds of processor time for a case")
    parser.add_argument("--in-turn", action="store_true", help="ask each case in one description alone, another one from case to case")
    parser.add_argument("--again", action="store_true", help="ask again what was answered")
    asked = parser.parse_args(arguments)
    counts = {kind: int(number) for kind, _, number in (item.partition("=") for item in asked.each.split(","))}
    folders = []
    for case, write in _rounds(asked.rigs, asked.seed, counts):
        if asked.half != "both" and case.rig.calibrating != (asked.half == "calibration"):
            continue
        written = [asked.folder / f"{case.name}__{description}" for description in case.descriptions]
        if not all((folder / "truth.json").is_file() for folder in written):
            written = write(asked.folder)
        written = [written[case.number % len(written)]] if asked.in_turn else written
        folders += [folder for folder in written if asked.only in folder.name]
    if asked.what == "run":
        for folder in folders:
            if asked.again or not (folder / "told.json").is_file():
                _ask(folder, asked.limit)
                print(_read(folder).line, flush=True)
    answers = [_read(folder) for folder in folders if (folder / "told.json").is_file()]
    print(table(answers))
    return 0


def _rounds(rigs: str, seed: int, counts: dict[str, int]) -> Iterator[tuple[first.Case | second.Case, Callable[[Path], list[Path]]]]:
    """Yield the cases in rounds over all rigs, each with what writes it: whatever stops a run leaves a sample of every rig."""

    def turn(case: first.Case | second.Case) -> tuple[int, int]:
        return case.number, list(counts).index(case.kind)

    old = [] if rigs == "second" else [(one, functools.partial(first.write_case, one)) for one in first.schedule(seed, counts)]
    new = [] if rigs == "first" else [(one, functools.partial(second.write_case, one)) for one in second.schedule(seed, counts)]
    yield from sorted([*old, *new], key=lambda case: turn(case[0]))


def _ask(folder: Path, limit: float) -> None:
    """Call ``lathesim diagnose`` as a person does, and keep what it answers."""
    answer, limit = folder / "answer.json", round(limit)
    answer.unlink(missing_ok=True)
    words = ["diagnose", "lesson.yaml", "fit.csv", "--validate", "validate.csv", "--json", answer.name, "--no-report", "--out", "out"]
    words += ["--plugins", "parts"] if (folder / "parts").is_dir() else []
    before = _processor_seconds()
    done = subprocess.run(
        [sys.executable, "-m", "lathesim", *words], cwd=folder, capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)),
    )  # fmt: skip
    seconds = _processor_seconds() - before
    said = done.stderr[-2000:] if done.returncode >= 0 else f"no answer within {limit} s"
    told = json.loads(answer.read_text(encoding="utf-8")) if answer.is_file() else {}
    kept = {"seconds": seconds, "said": said, "told": told}
    (folder / "told.json").write_text(json.dumps(kept, indent=1), encoding="utf-8")


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _read(folder: Path) -> Answer:
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    kept = json.loads((folder / "told.json").read_text(encoding="utf-8"))
    return Answer(truth | {"case": folder.name.rpartition("__")[0]}, kept["told"], kept["seconds"])


if __name__ == "__main__":
    raise SystemExit(main())
