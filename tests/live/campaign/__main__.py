"""``python -m tests.live.campaign``: watch sixty streams of twenty simulated minutes, and print what was asked and what was measured.

Answers are appended to a file, one line a stream; a campaign that was stopped goes on where it stood. The order is drawn at random, so the
first streams are a fair share.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import resource
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lathesim.live.watching.watch_session import WatchSession, WatchSettings
from lathesim.live.watching.watch_verdict import WatchEvent
from lathesim.plugins import load_registry
from tests.live.campaign.cases import SEED, Case, all_cases, floor, prepared, signals, stream_of
from tests.live.campaign.machines import LEARN
from tests.live.campaign.scoring import line, table
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.live.campaign", description=__doc__)
    parser.add_argument("what", nargs="?", choices=("run", "table", "all"), default="all")
    parser.add_argument("--answers", type=Path, default=Path("build/watch_campaign.jsonl"), help="file of the answers")
    parser.add_argument("--seed", type=int, default=SEED, help="of the cases")
    parser.add_argument("--number", type=int, default=60, help="the first so many of the streams")
    parser.add_argument("--only", default="", metavar="TEXT", help="streams with this in their 'machine change'")
    parser.add_argument("--patience", type=float, default=160.0, help="seconds of a diagnosis; 0 leaves it out")
    asked = parser.parse_args(arguments)
    asked.answers.parent.mkdir(parents=True, exist_ok=True)
    answers = [json.loads(text) for text in asked.answers.read_text().splitlines()] if asked.answers.exists() else []
    done = {answer["case"]["number"] for answer in answers}
    for case in all_cases(asked.seed)[: asked.number] if asked.what != "table" else []:
        if case.number in done or asked.only not in f"{case.machine} {case.change}":
            continue
        answers.append(json.loads(json.dumps(run_case(case, asked.patience), default=float)))
        with asked.answers.open("a", encoding="utf-8") as file:
            file.write(json.dumps(answers[-1]) + "\n")
        print(line(answers[-1]), flush=True)
    if asked.what == "table":
        print("\n".join(line(answer) for answer in answers))
    print(table(answers))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
