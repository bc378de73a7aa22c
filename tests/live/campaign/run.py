"""One case of the campaign: a watch over its stream, with its diagnoses."""

from __future__ import annotations

import asyncio
import resource
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lathesim.live.watching.watch_session import WatchSession, WatchSettings
from lathesim.live.watching.watch_verdict import WatchEvent
from lathesim.plugins import load_registry
from tests.live.campaign.cases import Case, floor, prepared, signals, stream_of
from tests.live.campaign.machines import LEARN
from tests.live.streams import Streamed

WINDOW = 20.0


def run_case(case: Case, patience: float) -> dict[str, Any]:
    """Return what the watch told of a case: its events, its verdicts, and the time [CPU s] that both took."""
    ready = prepared(case.machine)
    floor(case.machine)
    stream = stream_of(case)
    events: list[WatchEvent] = []
    children = [_children()]
    spent: list[float] = []

    def tell(event: WatchEvent) -> None:
        events.append(event)
        if "verdict" in event.data:
            children.append(_children())
            spent.append(children[-1] - children[-2])

    tolerance = {stream.channel: stream.tolerance} if stream.channel else {}
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        settings = WatchSettings(
            learn=LEARN, window=WINDOW, diagnose=patience > 0.0, patience=patience, tolerance=tolerance, folder=Path(folder), waits=True
        )
        session = WatchSession(ready, load_registry([]), Streamed(stream.values, signals(case.machine)), settings, tell)
        asyncio.run(session.run(asyncio.Event()))
    watched = time.process_time() - begun
    told = [{"event": event.kind, "time_s": event.time, **event.data} for event in events if event.kind != "learnt"]
    verdicts = [item for item in told if "verdict" in item]
    return {
        "case": asdict(case),
        "truth": {"channel": stream.channel, "tolerance": stream.tolerance, "reached_s": stream.reached},
        "watch_cpu_s": watched,
        "events": told,
        "verdicts": [
            {
                "verdict": item["verdict"],
                "effects": [[entry["effect"], entry["at"]] for entry in item.get("effects", [])],
                "ended_s": item["time_s"] + WINDOW,
                "cpu_s": cpu,
            }
            for item, cpu in zip(verdicts, spent, strict=True)
        ],
    }  # fmt: skip


def _children() -> float:
    """Return the CPU time of the diagnoses that ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
