"""A case of a lesson as plain text, so that a worker on another computer can put the same machine together.

The plug-ins the case needs travel along as their source: a worker runs what the user who started the sweep chose to run.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import Lesson, Machine
from lathesim.lessons.schema import LessonSettings, MachineSettings
from lathesim.lessons.simulate import prepare
from lathesim.lessons.sweeping.members import Job, Member, Members
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
        raise LatheSimError("a worker puts another machine together.", remedy="Install the same version of lathesim on all workers.")
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
    machine = Machine(machine_name, Path(f"{machine_name}.yaml"), validated(MachineSettings, machine_source), machine_source)
    source = source_of(text, f"{name}.yaml")
    return Lesson(name, Path(f"{name}.yaml"), validated(LessonSettings, source), source, machine)
