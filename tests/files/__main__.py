"""``python -m tests.files [--kills N] [--levels N] [--only NAME] [--seed N]``: the campaign, with a line for each command.

Kills: each command is killed (SIGKILL) at random moments of its life, half of them in the last quarter, where it writes; every third one
begins with an empty cache. Then the same command is called again in the same folder. Full disk: a file system in memory is filled so that
some pages are left, and the command runs in it, with its cache there too in every second case. Read-only: the same, mounted read-only.
File systems are mounted, so the last two need root.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.cli.command import environment
from tests.files.commands import COMMANDS, arguments, make_inputs
from tests.files.whole import half_files, left_parts

LONGEST = 300.0
KILLED = -signal.SIGKILL


@dataclass
class Bench:
    """Where the campaign works: inputs, a warm cache, and a folder for each trial; ``faults`` are told at the end."""

    root: Path
    dice: random.Random
    faults: list[str] = field(default_factory=list)

    @property
    def inputs(self) -> Path:
        return self.root / "inputs"

    @property
    def cache(self) -> Path:
        return self.root / "cache"

    def call(self, name: str, folder: Path, cache: Path, killed_after: float | None = None) -> tuple[int, str, float]:
        """Call a command, or kill it after some seconds; return its exit code, the error stream and how long it took."""
        begun = time.monotonic()
        where = {**environment(), "LATHESIM_CACHE": str(cache), "TMPDIR": str(self.root / "tmp"), "PYTHONDONTWRITEBYTECODE": "1"}
        process = subprocess.Popen(
            arguments(name, self.inputs), cwd=folder, env=where, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
        )
        try:
            _, said = process.communicate(timeout=LONGEST if killed_after is None else killed_after)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            _, said = process.communicate()
        return process.returncode, said.decode(errors="replace"), time.monotonic() - begun

    def fault(self, name: str, what: object) -> None:
        """Note what went wrong."""
        self.faults.append(f"{name}: {what}")
        print(f"  FAULT {name}: {what}", flush=True)


def kills(bench: Bench, name: str, count: int) -> None:
    """Kill a command ``count`` times, and call it again each time."""
    usual = bench.call(name, _fresh(bench), bench.cache)[2]
    reached = 0
    for number in range(count):
        folder, cache = _fresh(bench), bench.cache if number % 3 else bench.root / "trial_cache"
        shutil.rmtree(bench.root / "trial_cache", ignore_errors=True)
        moment = usual * (bench.dice.uniform(0.75, 1.05) if number % 2 else bench.dice.uniform(0.02, 0.75))
        reached += bench.call(name, folder, cache, moment)[0] == KILLED
        for half in half_files(folder):
            bench.fault(name, f"killed after {moment:.2f} s of {usual:.2f}: {half}")
        code, said, _ = bench.call(name, folder, cache)
        if not _well(code, said) or half_files(folder) or left_parts(folder):
            bench.fault(name, f"after a kill at {moment:.2f} s: {code} {said[-300:]} {half_files(folder)} {left_parts(folder)}")
    print(f"{name:16} {usual:6.1f} s, {reached} of {count} killed while it ran", flush=True)


def disks(bench: Bench, name: str, levels: int) -> None:
    """Run a command on a disk with little room, ``levels`` times, and on one that cannot be written."""
    folder = _fresh(bench)
    bench.call(name, folder, bench.cache)
    needed = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) + 8192
    codes = []
    for level in range(levels):
        with _disk(bench) as disk:
            own_cache = level % 2 == 1
            cache = disk / "cache" if own_cache else bench.cache
            free = _fill(disk, int(1.5 * needed * level / max(levels - 1, 1)))
            work = disk / "work"
            code, said, _ = bench.call(name, work, cache)
            codes.append(code)
            _judge(bench, name, work, code, said, f"{free} bytes left")
            (disk / "filling").unlink()
            again, said, _ = bench.call(name, work, cache)
            if not _well(again, said) or half_files(work) or left_parts(work):
                bench.fault(name, f"after a full disk: {again} {said[-300:]} {half_files(work)} {left_parts(work)}")
    with _disk(bench) as disk:
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        code, said, _ = bench.call(name, disk / "work", bench.cache)
        _judge(bench, name, disk / "work", code, said, "read only")
        writes_cache_only = name == "warm"
        if code == 0 and not writes_cache_only:
            bench.fault(name, "it left with 0 where nothing can be written")
    print(f"{name:16} full disk: {codes.count(0)} of {levels} fitted; read only: {code}", flush=True)


def _judge(bench: Bench, name: str, folder: Path, code: int, said: str, when: str) -> None:
    """Note half files, parts, exit codes that are not honest and words that are none of lathesim's."""
    if code not in (0, 1) or "Traceback" in said or (code == 1 and not said.strip()):
        bench.fault(name, f"{when}: {code} {said[-300:]}")
    for found in (*half_files(folder), *left_parts(folder)):
        bench.fault(name, f"{when}: {code} {found}")


def _well(code: int, said: str) -> bool:
    """Return whether a start went well; a whole file that is there already may be refused."""
    return code == 0 or (code == 1 and " already" in said and "Traceback" not in said)


def _fresh(bench: Bench) -> Path:
    folder = bench.root / "work"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


@contextlib.contextmanager
def _disk(bench: Bench) -> Iterator[Path]:
    """Yield a file system of 24 MB in memory with a folder ``work``."""
    disk = bench.root / "disk"
    disk.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24m", "tmpfs", str(disk)], check=True)
    try:
        (disk / "work").mkdir()
        yield disk
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def _fill(disk: Path, room: int) -> int:
    """Fill a disk but for about ``room`` bytes, and return what is free."""
    free = shutil.disk_usage(disk).free
    with (disk / "filling").open("wb") as file:
        file.write(bytes(max(0, free - room)))
    return shutil.disk_usage(disk).free


def main() -> int:
    """Run the campaign and leave with 1 where there was a fault."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=200, help="of each command")
    options.add_argument("--levels", type=int, default=20, help="fill levels of the disk, for each command")
    options.add_argument("--only", action="append", choices=list(COMMANDS), help="this command; several times for several")
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="lathesim_files_") as root:
        bench = Bench(Path(root), random.Random(given.seed))
        (bench.root / "tmp").mkdir()
        names = given.only or list(COMMANDS)
        if any("{in}" in item for name in names for item in COMMANDS[name]):
            make_inputs(bench.inputs, bench.cache)
        for name in names:
            if given.kills:
                kills(bench, name, given.kills)
            if given.levels:
                disks(bench, name, given.levels)
    print(f"{len(bench.faults)} faults")
    return int(bool(bench.faults))


if __name__ == "__main__":
    sys.exit(main())
