"""The suite as folders: one for each case, made in two processes; a folder that is whole is not made again."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from tests.diagnosis.asking import truth_of
from tests.diagnosis.suite.cases import write_case
from tests.diagnosis.suite.schedule import schedule


def folder_of(out: Path, index: int) -> Path:
    """Return the folder of a case; its name tells nothing of what it hides."""
    return out / f"case_{index:03d}"


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
    """Write what is hidden where, for the reader; no answer depends on it."""
    lines = ["case, rig, kind, hidden (largest size in floors)"]
    for folder in folders:
        truth = truth_of(folder)
        hidden = " + ".join(f"{one['key']} ({max(one['size'].values()):.3g})" for one in truth["effects"])
        lines.append(f"{folder.name}, {truth['rig']}, {truth['kind']} {truth['poor']}, {hidden or truth['fault'] or '-'}")
    (out / "index.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
