"""The suite as folders: one for each case, made in two processes; a folder that is whole is not made again."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from tests.diagnosis.suite.cases import write_case
from tests.diagnosis.suite.schedule import schedule


def folder_of(out: Path, index: int) -> Path:
    """Return the folder of a case; its name tells nothing of what it hides."""
    return out / f"case_{index:03d}"


def truth_of(folder: Path) -> dict[str, Any]:
    """Read the truth of a case."""
    truth: dict[str, Any] = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return truth


def generate(out: Path, seed: int, cases: int | None = None, jobs: int = 2, tell: Callable[[str], None] = print) -> list[Path]:
    """Make the first ``cases`` of the suite of ``seed`` (all without a number) and give their folders."""
    whole = len(schedule(seed))
    numbers = range(whole if cases is None else min(cases, whole))
    out.mkdir(parents=True, exist_ok=True)
    missing = [index for index in numbers if not _is_there(folder_of(out, index), seed)]
    if missing:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = [pool.submit(write_case, seed, index, folder_of(out, index)) for index in missing]
            for done, future in enumerate(as_completed(waiting), start=1):
                future.result()
                if done % 20 == 0 or done == len(missing):
                    tell(f"{done} of {len(missing)} cases made")
    folders = [folder_of(out, index) for index in numbers]
    _write_index(out, folders)
    return folders


def _is_there(folder: Path, seed: int) -> bool:
    # truth.json is written last
    return (folder / "truth.json").is_file() and truth_of(folder)["seed"] == seed


def _write_index(out: Path, folders: list[Path]) -> None:
    """Write what is hidden where, for the reader; the runner does not read it."""
    lines = ["case, rig, category, hidden (largest size in floors), channels"]
    for folder in folders:
        truth = truth_of(folder)
        hidden = [f"{one['key']} ({largest_size(one):.3g})" for one in truth["effects"]]
        what = " + ".join(hidden) or (truth["fault"]["kind"] if truth["fault"] else "-")
        kind = truth["category"] + (f" {truth['poor']}" if truth["poor"] else "")
        lines.append(f"{folder.name}, {truth['rig']}, {kind}, {what}, {' '.join(truth['channels'])}")
    (out / "index.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def largest_size(effect: dict[str, Any], recording: str = "") -> float:
    """Return how far an effect of a truth moves a channel, in floors: in one recording, or in the one that shows it best."""
    sizes = [size["largest"] for name, size in effect["size"].items() if not recording or name == recording]
    return max(sizes, default=0.0)
