"""Where the runs of a sweep are made: on the cores of this computer, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

from lathesim.errors import LatheSimError
from lathesim.lessons.sweeping.bundle import Bundle, run_on_worker
from lathesim.lessons.sweeping.members import Member, Members

Job = tuple[int, tuple[float, ...]]
"""Number and values [SI] of a run."""

MEMORY = 1 << 30
"""Bytes that all runs under way may take together."""
_A_TASK = 8
"""Runs in one task on a cluster: few, so that little is lost when it stops, and enough to pay for the way there and back."""


def run_here(members: Members, jobs: Sequence[Job], threads: int = 0) -> Iterator[Member]:
    """Return the runs as they end, made on all cores (the compiled loop lets other threads work); only a few wait at a time."""
    workers = threads or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else threads or os.cpu_count() or 1
    workers = max(1, min(workers, MEMORY // max(1, members.bytes_a_run)))
    members.compile()
    with ThreadPoolExecutor(workers) as pool:
        waiting = {pool.submit(members.run, *job) for job in jobs[: 2 * workers]}
        ahead = 2 * workers
        try:
            while waiting:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    if ahead < len(jobs):
                        waiting.add(pool.submit(members.run, *jobs[ahead]))
                        ahead += 1
                    yield future.result()
        finally:
            for future in waiting:
                future.cancel()


def run_on_cluster(address: str, bundle: Bundle, digest: str, jobs: Sequence[Job]) -> Iterator[Member]:
    """Return the runs as they end, made by the workers of a Dask scheduler at ``dask://host:port``.

    Raises :class:`LatheSimError` where ``distributed`` is not installed, no scheduler answers, or a worker has another version.
    """
    distributed = _distributed()
    place = address.removeprefix("dask://")
    try:
        client = distributed.Client(f"tcp://{place}", timeout="10s")
    except OSError:
        raise LatheSimError(f"no Dask scheduler answers at {place}.", remedy="Start one with: dask scheduler") from None
    with client:
        if not client.scheduler_info()["workers"]:
            raise LatheSimError(f"the scheduler at {place} has no workers.", remedy=f"Start some with: dask worker {place}")
        tasks = [jobs[first : first + _A_TASK] for first in range(0, len(jobs), _A_TASK)]
        futures = [client.submit(run_on_worker, bundle, digest, task, pure=False) for task in tasks]
        try:
            for future in distributed.as_completed(futures):
                yield from _result(future)
        finally:
            client.cancel(futures)


def _result(future: Any) -> list[Member]:
    found: list[Member] = future.result()
    return found


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise LatheSimError(
            "a cluster needs the package 'distributed', which is not installed.", remedy="python -m pip install 'lathesim[cluster]'"
        ) from None
    return distributed


Executor = Callable[[Sequence[Job]], Iterator[Member]]
"""What takes runs and gives them back done, in any order."""
