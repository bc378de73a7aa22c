"""What a watch reports, and the diagnosis of a window of the stream, in a process of its own, so that the watch goes on."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import signal
import sys
import threading
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.cluster import Cluster
from lathesim.diagnosis.diagnose import ask
from lathesim.diagnosis.reporting.answer_files import answer_json
from lathesim.errors import LatheSimError
from lathesim.experiments.sequence import answered
from lathesim.identification.execution import Deadline
from lathesim.identification.replay.loading import load_case, uncertainties
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared
from lathesim.live.opening import recordings_for
from lathesim.live.samples import Signal
from lathesim.live.watching.known_effects import KnownEffect
from lathesim.plugins import Registry
from lathesim.record import Channel, FloatArray, Record
from lathesim.record_writer import save
from lathesim.whole_file import make_folder, write_text


@dataclass(frozen=True, eq=False)
class Window:
    """Samples around a change: ``begin`` [s], ``values`` (signals, samples) every ``period`` [s]."""

    begin: float
    period: float
    signals: tuple[Signal, ...]
    values: FloatArray

    def as_record(self) -> Record:
        """Return the window as a record whose time begins at 0."""
        rows = zip(self.signals, self.values, strict=True)
        channels = {signal.name: Channel(signal.name, signal.unit, row, signal.description) for signal, row in rows}
        meta: dict[str, str | float | int] = {"sample_period": self.period, "status": "complete", "began": self.begin}
        return Record(np.arange(self.values.shape[1], dtype=np.float64) * self.period, channels, meta)


@dataclass(frozen=True)
class Verdict:
    """What a diagnosis said: its JSON, or why there is none."""

    answer: dict[str, Any]
    failure: str = ""

    @property
    def effects(self) -> list[tuple[str, str]]:
        """Return the named effects as (effect, at)."""
        return [(str(entry.get("effect", "")), str(entry.get("at", ""))) for entry in self.answer.get("effects", [])]


@dataclass(frozen=True)
class BeforeChange:
    """What was known before a change, by ``part.parameter``: ``sizes`` of effects, and ``values`` that the lesson calls uncertain."""

    sizes: Mapping[str, str]
    values: Mapping[str, str]


def known_before(prepared: Prepared, sizes: Mapping[str, str], expected: Mapping[str, float]) -> BeforeChange:
    """Return what was known before a change, with the uncertain values ``expected`` by then: how far from the lesson's, in the deviations
    that it declares.

    The doubt stays that of the lesson: a value may be what has changed, and then it is anywhere within it.
    """
    plan, declared = prepared.plan, uncertainties(prepared.case.lesson, prepared.plan)
    values = {}
    for name, offset in expected.items():
        unit = plan.unit(name)
        ending = "" if unit in ("", "1") else f" {unit}"
        values[name] = f"{plan.values[name] + offset * declared[name]:.9g}{ending}"
    return BeforeChange(sizes, values)


@dataclass(frozen=True)
class Windows:
    """The windows that a diagnosis is asked about: the one ``asked``, one that judges it, and one from before the change, if any."""

    asked: Window
    validation: Window | None
    before: Window | None


def free_number(folder: Path) -> int:
    """Reserve and return the next free number in a folder by making ``watch_NUMBER``, so no session replaces the files of another."""
    make_folder(folder)
    for number in itertools.count(1):
        try:
            (folder / f"watch_{number}").mkdir()
        except FileExistsError:
            continue
        return number
    raise AssertionError("the numbers do not end")


async def diagnose_window(
    prepared: Prepared, before: BeforeChange, windows: Windows, folder: Path, number: int, patience: float, plugins: Sequence[Path],
    away: Away | None = None,
) -> Verdict:  # fmt: skip
    """Return the diagnosis of a window; its record, lesson and answer stay in ``folder``; ``patience`` [s] bounds it.

    With ``away`` a worker of a cluster makes it.
    It begins from what was known ``before``: what the laps before have shown of a value need not be found again.
    """
    window = windows.asked
    make_folder(folder)
    record, lesson, answer = (folder / f"watch_{number}{ending}" for ending in (".h5", "_lesson.yaml", ".json"))
    save(window.as_record(), record)
    further = {"recordings": recordings_for(prepared, [signal.name for signal in window.signals])}
    variant = prepared.case.variant
    text = changed_lesson(prepared.case.lesson, [], before.values, folder, variant=variant, further=further, sizes=before.sizes)
    write_text(lesson, text)
    beside: dict[str, Path] = {}
    for option, further_window in (("validate", windows.validation), ("before", windows.before)):
        if further_window is not None:
            beside[option] = folder / f"watch_{number}_{option}.h5"
            save(further_window.as_record(), beside[option])
    if away is not None:
        stop = threading.Event()
        try:
            return await asyncio.to_thread(_away, away, lesson, record, beside, patience, answer, stop)
        finally:
            stop.set()
    command = [sys.executable, "-m", "lathesim", "diagnose", str(lesson), str(record), "--json", str(answer), "--no-report"]
    command += ["--at-most", f"{patience:g} s", "--out", str(folder / f"watch_{number}")]
    for option, place in beside.items():
        command += [f"--{option}", str(place)]
    for plugin in plugins:
        command += ["--plugins", str(plugin)]
    process = await asyncio.create_subprocess_exec(
        *command, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE, start_new_session=True, env=dict(os.environ)
    )
    try:
        _, told = await process.communicate()
    except asyncio.CancelledError:
        _end(process)
        await process.wait()
        raise
    finally:
        _end(process)
    try:
        return Verdict(json.loads(answer.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        lines = told.decode("utf-8", "replace").strip().splitlines()
        return Verdict({}, lines[-1] if lines else "the diagnosis gave no answer.")


@dataclass(frozen=True)
class Away:
    """Where windows are diagnosed instead: a cluster, and the registry of the watch."""

    cluster: Cluster
    registry: Registry


def _away(
    away: Away, lesson: Path, record: Path, beside: Mapping[str, Path], patience: float, file: Path, stop: threading.Event
) -> Verdict:
    """Return the diagnosis that a worker made of a window, and keep its answer."""
    try:
        loaded = load_lesson(str(lesson))
        case = load_case(loaded, [record, *beside.values()], away.registry)
        effects: list[Any] = list(away.registry.effects.values())
        question = ask(loaded.title, case.machine, case.recordings, effects, changed="before" in beside)
        question = replace(question, ends=Deadline.after(patience))
        (diagnosis,) = away.cluster.in_order(answered, None, [question], stop)
    except LatheSimError as error:
        return Verdict({}, str(error))
    write_text(file, json.dumps(answer_json(diagnosis), indent=2) + "\n")
    return Verdict(json.loads(file.read_text(encoding="utf-8")))


def _end(process: asyncio.subprocess.Process) -> None:
    """End a diagnosis with all processes that it started: they have a session of their own."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if sys.platform == "win32":
            process.kill()
        else:
            os.killpg(process.pid, signal.SIGKILL)


@dataclass(frozen=True)
class WatchEvent:
    """Something to tell: ``kind`` (learnt, change, drift, recording, values, range, verdict, continued, growth, forecast, end), ``time``
    [s], a sentence, and the same as plain data."""

    kind: str
    time: float
    sentence: str
    data: Mapping[str, Any]


NAMING = ("named", "tied")
"""Verdicts that hold effects."""


def told_verdict(verdict: Verdict, begin: float, grown: Sequence[KnownEffect], place: Path, before: Collection[str] = ()) -> WatchEvent:
    """Return the event of a verdict on the window from ``begin`` [s].

    ``grown`` is what was known before and has grown, ``place`` where the answer is, ``before`` the values that the laps before have shown.
    """
    if verdict.failure:
        return WatchEvent("verdict", begin, f"The diagnosis from t = {begin:.1f} s: {verdict.failure}", {"verdict": "failed"})
    answer = verdict.answer
    named = [f"{effect} at {at}" for effect, at in verdict.effects]
    sizes = [_sizes(entry) for entry in answer.get("effects", [])]
    data = {"since_s": begin, "answer": str(place), "verdict": answer.get("verdict"), "effects": answer.get("effects", [])}
    if grown:
        known = [effect.name for effect in grown]
        new = "".join(
            f"; new is {name}: {size}" for name, size in zip(named, sizes, strict=True) if name not in known
        )  # fmt: skip
        course = "; ".join(f"{effect.name} has grown: {effect.course()}" for effect in grown)
        return WatchEvent("growth", begin, f"From t = {begin:.1f} s: {course}{new}.", {**data, "grown": known})
    moved = _moved_values(answer, before) if answer.get("verdict") == "parameters_only" else {}
    if moved:
        data["moved"] = moved
    told = {
        "named": f"{', '.join(named)}: {'; '.join(sizes)}",
        "tied": f"{' or '.join(named)}; the window cannot tell which",
        "unknown": "physics outside the catalogue, or too little to name",
        "no_mismatch": "nothing that the window shows",
        "parameters_only": "; ".join(map(_moved, moved.items())) or "values of the lesson are off",
        "recording_fault": "the recording is at fault",
    }.get(str(answer.get("verdict")), str(answer.get("verdict")))
    return WatchEvent("verdict", begin, f"From t = {begin:.1f} s: {told}.", data)


def _sizes(entry: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {item['value']:.4g} {item['unit']}" for name, item in entry.get("parameters", {}).items())


def _moved_values(answer: Mapping[str, Any], before: Collection[str]) -> dict[str, dict[str, Any]]:
    """Return the values whose interval does not hold what was known of them ``before`` the change."""
    return {
        str(name): {"from": item["given"], "to": item["refit_with"], "unit": item["unit"]}
        for name, item in answer.get("baseline", {}).items()
        if name in before and not item["low"] <= item["given"] <= item["high"]
    }


def _moved(value: tuple[str, Mapping[str, Any]]) -> str:
    name, item = value
    return f"{name} has moved from {item['from']:.4g} to {item['to']:.4g} {item['unit']}".removesuffix(" 1")
