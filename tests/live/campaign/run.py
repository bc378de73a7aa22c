"""One case of the campaign: the watch over its stream, and the diagnosis of the window around its first alarm."""

from __future__ import annotations

import asyncio
import resource
import tempfile
import time
from collections.abc import AsyncIterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.live.recording.record_mapping import lesson_signals
from lathesim.live.sources.samples import Block, Signal
from lathesim.live.watching.background_diagnosis import Window, diagnose_window
from lathesim.live.watching.watch import Alarm
from lathesim.live.watching.watch_session import Event, WatchSession, WatchSettings, diagnosis_begin
from lathesim.record import FloatArray
from tests.live.campaign.cases import Case, channels, floor, prepared, stream_of
from tests.live.campaign.machines import LEARN, PERIOD

WINDOW = 20.0


class Streamed:
    """A source that gives a stream in blocks of 2 s."""

    name = "stream"

    def __init__(self, values: FloatArray, signals: tuple[Signal, ...]) -> None:
        self._values, self.signals = values, signals

    async def blocks(self) -> AsyncIterator[Block]:
        """Return the blocks."""
        for begin in range(0, self._values.shape[1], 2000):
            part = self._values[:, begin : begin + 2000]
            yield Block((begin + np.arange(part.shape[1])) * PERIOD, part)


def run_case(case: Case, patience: float) -> dict[str, Any]:
    """Return what the watch told of a case: its events, the verdict, and the time [CPU s] that both took."""
    ready = prepared(case.machine)
    drive, compare = channels(case.machine)
    floor(case.machine)
    stream = stream_of(case)
    signals = tuple(Signal(name, unit) for name, unit in zip((*drive, *compare), units(case.machine), strict=True))
    events: list[Event] = []
    tolerance = {stream.channel: stream.tolerance} if stream.channel else {}
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        settings = WatchSettings(learn=LEARN, diagnose=False, tolerance=tolerance, folder=Path(folder))
        session = WatchSession(ready, Streamed(stream.values, signals), settings, events.append)
        asyncio.run(session.run(asyncio.Event()))
        watched = time.process_time() - begun
        told: dict[str, Any] = {
            "case": asdict(case),
            "truth": {"channel": stream.channel, "tolerance": stream.tolerance, "reached_s": stream.reached},
            "watch_cpu_s": watched,
            "events": [{"event": event.kind, "time_s": event.time, **event.data} for event in events if event.kind != "learnt"],
        }
        first = next((event for event in events if event.kind in ("change", "drift")), None)
        if first is not None and patience > 0.0:
            told["verdict"] = _verdict(case, stream.values, first, signals, Path(folder), patience)
    return told


def _verdict(case: Case, values: FloatArray, first: Event, signals: tuple[Signal, ...], folder: Path, patience: float) -> dict[str, Any]:
    alarm = Alarm(first.time, first.data["since_s"], first.data["channel"], first.data["state"], first.kind == "drift", 0.0)
    at = round(diagnosis_begin(alarm, WINDOW) / PERIOD)
    part = values[:, max(0, at) : at + round(WINDOW / PERIOD)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    window = Window(at * PERIOD, PERIOD, signals, part)
    verdict = asyncio.run(diagnose_window(prepared(case.machine), window, None, folder, 1, patience, ()))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    confidence = [entry.get("confidence") for entry in verdict.answer.get("effects", [])]
    return {
        "verdict": verdict.answer.get("verdict"), "effects": verdict.effects, "confidence": confidence, "failure": verdict.failure,
        "cpu_s": spent, "ended_s": at * PERIOD + WINDOW,
    }  # fmt: skip


def units(machine: str) -> tuple[str, ...]:
    """Return the SI units of a machine's stream."""
    drive, compare = channels(machine)
    known = {signal.name: signal.unit for signal in lesson_signals(prepared(machine))}
    return tuple(known[name] for name in (*drive, *compare))
