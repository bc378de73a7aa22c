"""Where the runs of a sweep are made: on the cores of this computer, or on the workers of a cluster."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

from lathesim.cluster import Cluster
from lathesim.lessons.sweep_runs import Job, Member, Members

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
        size = min(-(-(len(jobs) - first) // (2 * workers * SIDE_BY_SIDE)) * SIDE_BY_SIDE, _LARGEST_GROUP)
        yield jobs[first : first + size]
        first += size


def run_on_cluster(cluster: Cluster, members: Members, jobs: Sequence[Job]) -> Iterator[Member]:
    """Return the runs as they end, made by the workers of a cluster."""
    for _, found in cluster.results(_made, members, [jobs[first : first + _A_TASK] for first in range(0, len(jobs), _A_TASK)]):
        yield from found


def _made(members: Members, jobs: Sequence[Job]) -> list[Member]:
    found: list[Member] = []
    members.runs(jobs, found.append)
    return found
