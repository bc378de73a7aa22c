"""Where the runs of a sweep are made: on the cores of this computer, or on a Dask cluster, with a case as plain text.

A case of a lesson as plain text, so that a worker on another computer can put the same machine together.

The plug-ins the case needs travel along as their source: a worker runs what the user who started the sweep chose to run.
"""

from __future__ import annotations

import functools
import os
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import Lesson, MachineTemplate
from lathesim.lessons.schema import LessonSettings, MachineSettings
from lathesim.lessons.simulate import prepare
from lathesim.lessons.sweep_runs import Job, Member, Members
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import source_of
from lathesim.plugins import load_registry

TextFile = tuple[str, str]
"""Name and text of a file."""


@dataclass(frozen=True)
class Bundle:
    """The files of a case, what was set from outside, and what is to be varied and measured."""

    lesson: TextFile
    machine: TextFile
    program: TextFile | None
    plugins: tuple[TextFile, ...]
    variant: str | None
    overrides: tuple[tuple[str, str | float], ...]
    names: tuple[str, ...]
    metrics: tuple[str, ...]


def pack(members: Members, overrides: Mapping[str, str | float], plugins: Sequence[str]) -> Bundle:
    """Return the bundle of a sweep; ``plugins`` are the names of the registry's plug-ins, of which those that are files go along."""
    case = members.prepared.case
    lesson, program = case.lesson, case.program
    return Bundle(
        lesson=(lesson.name, lesson.source.text),
        machine=(lesson.machine.name, lesson.machine.source.text),
        program=None if program is None else (program.name, program.read_text(encoding="utf-8")),
        plugins=tuple(
            (path.name, path.read_text(encoding="utf-8")) for path in map(Path, plugins) if path.suffix == ".py" and path.is_file()
        ),
        variant=case.variant,
        overrides=tuple(overrides.items()),
        names=members.names,
        metrics=tuple(members.metrics),
    )


def run_on_worker(bundle: Bundle, digest: str, jobs: Sequence[Job]) -> list[Member]:
    """Return what some runs of a bundle give on a worker; :class:`LatheSimError` where its machine is not that of the one who asked."""
    members = _unpacked(bundle)
    if members.digest != digest:
        raise LatheSimError("a worker builds a different machine.", remedy="Install the same version of lathesim on all workers.")
    found: list[Member] = []
    members.runs(jobs, found.append)
    return found


_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []
"""Folders of unpacked programs and plug-ins, kept until the worker ends."""


@functools.lru_cache(maxsize=8)
def _unpacked(bundle: Bundle) -> Members:
    _FOLDERS.append(tempfile.TemporaryDirectory(prefix="lathesim-sweep-"))
    folder = Path(_FOLDERS[-1].name)
    (folder / "plugins").mkdir()
    for name, text in bundle.plugins:
        (folder / "plugins" / name).write_text(text, encoding="utf-8")
    program = None
    if bundle.program is not None:
        program = folder / bundle.program[0]
        program.write_text(bundle.program[1], encoding="utf-8")
    registry = load_registry([folder / "plugins"])
    prepared = prepare(_lesson(bundle), registry, bundle.variant, dict(bundle.overrides), program=program)
    members = Members(prepared, bundle.names, {name: registry.metric(name) for name in bundle.metrics})
    members.compile()
    return members


def _lesson(bundle: Bundle) -> Lesson:
    (name, text), (machine_name, machine_text) = bundle.lesson, bundle.machine
    machine_source = source_of(machine_text, f"{machine_name}.yaml")
    machine = MachineTemplate(machine_name, Path(f"{machine_name}.yaml"), validated(MachineSettings, machine_source), machine_source)
    source = source_of(text, f"{name}.yaml")
    return Lesson(name, Path(f"{name}.yaml"), validated(LessonSettings, source), source, machine)


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
