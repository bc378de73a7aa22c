"""Where the runs of a sweep are made: on the cores of this computer, or on a Dask cluster."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any

from lathesim.errors import LatheSimError
from lathesim.lessons.sweeping.bundle import Bundle, run_on_worker
from lathesim.lessons.sweeping.members import Job, Member, Members

MEMORY = 1 << 30
"""Bytes that all runs under way may take together."""
SIDE_BY_SIDE = 16
"""Runs that one core computes side by side; groups hold a multiple of it."""
_LARGEST_RECORD = MEMORY // 4
"""Bytes of runs side by side above which a batch makes them one by one."""
_LARGEST_GROUP = 64 * SIDE_BY_SIDE
_A_TASK = SIDE_BY_SIDE
"""Runs in one task on a cluster: few, so that little is lost when it stops, and enough to pay for the way there and back."""


def run_here(members: Members, jobs: Sequence[Job], threads: int = 0) -> Iterator[Member]:
    """Return the runs as they end, made in groups on all cores (the compiled loop lets other threads work).

    The groups get smaller towards the end, so that all cores are busy until then. A stop waits for the runs that
    each core is just computing, and for the compiler where lanes are being compiled.
    """
    workers = threads or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else threads or os.cpu_count() or 1
    together = SIDE_BY_SIDE * members.bytes_a_run
    workers = max(1, min(workers, MEMORY // max(1, together if together <= _LARGEST_RECORD else members.bytes_a_run)))
    members.compile()
    groups = _groups(jobs, workers)
    taking, stop = threading.Lock(), threading.Event()
    ended: SimpleQueue[Member | BaseException | None] = SimpleQueue()

    def hand_over(member: Member) -> None:
        if stop.is_set():
            raise InterruptedError
        ended.put(member)

    def work() -> None:
        try:
            while not stop.is_set():
                with taking:
                    group = next(groups, ())
                if not group:
                    break
                members.runs(group, hand_over)
            ended.put(None)
        except BaseException as error:  # raised again where the runs are waited for
            ended.put(error)

    with ThreadPoolExecutor(workers) as pool:
        for _ in range(workers):
            pool.submit(work)
        try:
            while workers:
                member = ended.get()
                if isinstance(member, BaseException):
                    raise member
                if member is None:
                    workers -= 1
                else:
                    yield member
        finally:
            stop.set()


def _groups(jobs: Sequence[Job], workers: int) -> Iterator[Sequence[Job]]:
    """Return the jobs in groups: half of a worker's share of what is left each, rounded up to what runs side by side."""
    first = 0
    while first < len(jobs):
        share = -(-(len(jobs) - first) // (2 * workers * SIDE_BY_SIDE)) * SIDE_BY_SIDE
        size = min(share, _LARGEST_GROUP)
        yield jobs[first : first + size]
        first += size


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
