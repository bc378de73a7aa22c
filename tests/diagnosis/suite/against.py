"""The program against an older checkout of itself: how much longer it computes, and which answers are other ones."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from tests.diagnosis.suite.runner import read_answer

HERE = Path(__file__).parents[3]
"""The checkout that these tests belong to."""


def speed(folders: Sequence[Path], other: Path, kept: Path, tell: Callable[[str], None] = print) -> float:
    """Return the ratio of the medians of CPU time over some cases, of this checkout over another one.

    Each case is asked in both, one after the other and in turn first, in processes of their own with caches that begin empty. What was
    measured is added to a file, and what stands there is not measured again.
    """
    known = _known(kept)
    kept.parent.mkdir(parents=True, exist_ok=True)
    for number, folder in enumerate(folders):
        for checkout in (HERE, other) if number % 2 == 0 else (other, HERE):
            key = (folder.name, str(checkout))
            if key not in known:
                known[key] = computed_seconds(folder, checkout)
                with kept.open("a", encoding="utf-8") as lines:
                    print(json.dumps({"case": key[0], "checkout": key[1], "seconds": known[key]}), file=lines)
        here, there = (known[folder.name, str(checkout)] for checkout in (HERE, other))
        tell(f"{folder.name}: {here:.1f} s, {there:.1f} s in {other.name}, {here / there:.3f}")
    here, there = (statistics.median(known[folder.name, str(checkout)] for folder in folders) for checkout in (HERE, other))
    tell(f"median of {len(folders)} cases: {here:.1f} s, {there:.1f} s in {other.name}; ratio {here / there:.3f}")
    return here / there


def _known(kept: Path) -> dict[tuple[str, str], float]:
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.is_file() else []
    return {(item["case"], item["checkout"]): item["seconds"] for item in map(json.loads, lines)}


def computed_seconds(folder: Path, checkout: Path) -> float:
    """Return the CPU time [s] of a diagnosis of a case by a checkout, with all that it starts."""
    with tempfile.TemporaryDirectory() as scratch:
        words = ["diagnose", folder / "lesson.yaml", folder / "fit.csv", "--validate", folder / "validate.csv", "--no-report"]
        command = [sys.executable, "-m", "lathesim", *map(str, words), "--json", f"{scratch}/answer.json", "--out", scratch]
        here = {"PYTHONPATH": str(checkout), "LATHESIM_CACHE": scratch, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        began = _of_children()
        subprocess.run(command, cwd=checkout, env={**os.environ, **here}, check=False, capture_output=True)
        if not Path(scratch, "answer.json").is_file():
            raise RuntimeError(f"{checkout} does not answer {folder}")
        return _of_children() - began


def _of_children() -> float:
    times = os.times()
    return times.children_user + times.children_system


def differences(folders: Sequence[Path], answers: Path, others: Path) -> Iterator[str]:
    """Return the cases whose verdict or whose effects are other ones in two folders of answers, each with both answers."""
    for folder in folders:
        first, second = (read_answer(place, folder.name) for place in (others, answers))
        if first and second and _said(first["answer"]) != _said(second["answer"]):
            yield f"{folder.name}: {_said(first['answer'])} -> {_said(second['answer'])}"


def _said(answer: dict[str, Any]) -> str:
    """Return the verdict of an answer and its effects, each with what it is tied with."""
    found = [" | ".join([f"{one['effect']} at {one['at']}", *one.get("tied_with", ())]) for one in answer.get("effects", ())]
    return ", ".join([answer.get("verdict", "no answer"), *found])
