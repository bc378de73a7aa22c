"""Faults of a recording: what a logger, a cable or a hurried export does to data of a sound machine."""

from __future__ import annotations

import numpy as np

from tests.diagnosis.suite.recorded import Recording

CHANNEL = {"axis": "encoder", "spindle": "tachometer", "cutting": "main"}


def spoil(rng: np.random.Generator, rig: str, fault: str, recording: Recording) -> tuple[Recording, dict[str, str]]:
    """Return the recording with the fault in it and what an answer has to say: the fault, its channels and words that name it."""
    channel = CHANNEL[rig]
    time = recording.columns["time"][1]
    values = recording.columns[channel][1].copy()
    count = len(values)
    if fault in ("unit_1000", "unit_25.4", "unit_2pi"):
        factor = {"unit_1000": 1000.0, "unit_25.4": 1.0 / 25.4, "unit_2pi": 2.0 * np.pi}[fault]
        return recording.with_values(channel, values * factor), {"channel": channel, "words": "unit|factor|scale|times"}
    if fault == "swapped":
        first, second = {"axis": ("encoder", "command"), "cutting": ("feed", "depth"), "spindle": ("encoder", "tachometer")}[rig]
        swapped = recording.with_values(first, recording.columns[second][1]).with_values(second, recording.columns[first][1])
        return swapped, {"channel": f"{first}|{second}", "words": "swap|exchang|interchang"}
    if fault == "frozen":
        begin = int(rng.uniform(0.3, 0.5) * count)
        values[begin : begin + int(rng.uniform(0.08, 0.15) * count)] = values[begin]
        return recording.with_values(channel, values), {"channel": channel, "words": "frozen|stuck|constant|still|stands|repeat"}
    if fault == "shifted":
        late = int(rng.uniform(30, 120))
        return recording.with_values(channel, np.r_[np.full(late, values[0]), values[:-late]]), {
            "channel": channel,
            "words": "shift|late|delay|align",
        }
    if fault == "wrong_period":
        factor = float(rng.choice([2.0, 0.5, 1.25]))
        return recording.with_values("time", time * factor), {"channel": "time", "words": "period|rate|clock|time"}
    if fault == "dropped":
        kept = np.ones(count, dtype=bool)
        for begin in rng.integers(1000, count - 1000, 12):
            kept[begin : begin + int(rng.integers(5, 60))] = False
        rows = {name: (unit, column[kept]) for name, (unit, column) in recording.columns.items()}
        # the logger numbers the rows it kept: the gaps do not show in its time column
        rows["time"] = ("s", time[: int(np.sum(kept))])
        return Recording(rows), {"channel": "time", "words": "drop|miss|gap|lost|skip|jump"}
    if fault == "clipped":
        level = float(np.quantile(np.abs(values - np.mean(values)), 0.8))
        clipped = np.clip(values, np.mean(values) - level, np.mean(values) + level)
        return recording.with_values(channel, clipped), {"channel": channel, "words": "clip|range|flat|saturat|limit"}
    raise ValueError(f"no fault is called {fault!r}")
