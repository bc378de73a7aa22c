"""A record written and read block by block, so that memory does not grow with its length."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordError, nearest
from lathesim.hdf5_guard import own_item
from lathesim.json_text import parsed_json
from lathesim.live.samples import SampleBlock, Signal, Source
from lathesim.record import FloatArray, is_record
from lathesim.record_writer import RecordWriter

BLOCK = 8192


class RecordBlocks:
    """An open record file: its ``signals``, its length, and its samples in blocks. Raises :class:`RecordError` where it is no record."""

    def __init__(self, path: str | Path) -> None:
        import h5py

        self.path = Path(path)
        if not self.path.is_file() or not is_record(self.path):
            from lathesim.record import load

            load(self.path)  # which says in one sentence what is wrong
            raise RecordError("the file is no record.", place=str(path))
        self._file: Any = h5py.File(self.path, "r")
        channels = own_item(self._file, "channels")
        columns = {name: own_item(channels, name).attrs for name in _names(self._file)}
        self.signals = tuple(Signal(name, str(noted["unit"]), str(noted["description"])) for name, noted in columns.items())
        self._time = own_item(self._file, "time")

    def __len__(self) -> int:
        return min([int(self._time.shape[0]), *(int(self._file["channels"][signal.name].shape[0]) for signal in self.signals)])

    @property
    def period(self) -> float:
        """Return the median step of the first samples [s]; 0 with fewer than two."""
        first = self._time[:1000]
        return float(np.median(np.diff(first))) if len(first) > 1 else 0.0

    def named(self, names: Sequence[str]) -> list[str]:
        """Return ``names``, or refuse the first that is not there."""
        known = [signal.name for signal in self.signals]
        for name in names:
            if name not in known:
                remedy = nearest(name, known) or f"It has {', '.join(known[:6])}."
                raise RecordError(f"the record has no channel '{name}'.", place=str(self.path), remedy=remedy)
        return list(names)

    def blocks(self, names: Sequence[str] | None = None, size: int = BLOCK) -> Iterator[SampleBlock]:
        """Return the samples of some channels, or of all, in blocks."""
        wanted = self.named(names) if names is not None else [signal.name for signal in self.signals]
        columns = [self._file["channels"][name] for name in wanted]
        for begin in range(0, len(self), size):
            end = begin + size
            values = np.array([column[begin:end] for column in columns]).reshape(len(columns), -1)
            yield SampleBlock(np.asarray(self._time[begin:end]), values)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _names(file: Any) -> list[str]:
    raw = file["channel_names"][()]
    return [str(name) for name in parsed_json(raw.decode("utf-8") if isinstance(raw, bytes) else raw)]


_GAP = 1.5
"""Sample periods from which on a step of the time is a gap."""
_MOST_NOTES = 1000
_STEPS = 200
"""Steps of the time from which the sample period is told."""


@dataclass
class Noted:
    """What was found on the way: ``gaps`` (begin, end, samples) [s], sentences, samples in all and those that were left out."""

    samples: int = 0
    gaps: list[tuple[float, float, int]] = field(default_factory=list)
    notes: list[tuple[float, str]] = field(default_factory=list)
    doubled: int = 0
    period: float = 0.0
    status: str = "complete"

    @property
    def lost(self) -> int:
        """Return how many samples are missing in the gaps."""
        return sum(count for _, _, count in self.gaps)

    def as_json(self) -> dict[str, object]:
        """Return what was found as plain data."""
        return {
            "samples": self.samples,
            "period_s": self.period,
            "gaps": [{"begin_s": begin, "end_s": end, "samples": count} for begin, end, count in self.gaps],
            "lost": self.lost,
            "doubled": self.doubled,
            "notes": [{"time_s": time, "sentence": sentence} for time, sentence in self.notes],
            "status": self.status,
        }


class Recorder:
    """Writes blocks to a record and notes what is odd about their times; memory does not grow with the length of the recording."""

    def __init__(self, source: Source, out: Path, notice: Callable[[str], None] = lambda sentence: None) -> None:
        self._source, self._out, self._notice = source, out, notice
        self._writer: RecordWriter | None = None
        self._early: list[tuple[float, float]] = []
        self._last = -np.inf
        self.noted = Noted()

    def take(self, block: SampleBlock) -> None:
        """Write a block; instants that are not after the last one are left out and counted."""
        for note in block.notes:
            self._note(block.time[0] if len(block) else self._last, note)
        fresh = block.time > np.maximum.accumulate(np.concatenate([[self._last], block.time[:-1]]))
        self.noted.doubled += int(np.sum(~fresh))
        time, values = block.time[fresh], block.values[:, fresh]
        if not len(time):
            return
        if np.isfinite(self._last) or len(time) > 1:
            self._look_for_gaps(time)
        self._last = float(time[-1])
        if self._writer is None:
            self._writer = RecordWriter(self._out, [signal.as_channel() for signal in self._source.signals], growing=True)
        self._writer.write(time, np.ascontiguousarray(values))
        self.noted.samples += len(time)

    def _look_for_gaps(self, time: FloatArray) -> None:
        before = np.concatenate([[self._last], time[:-1]]) if np.isfinite(self._last) else time[:-1]
        after = time if np.isfinite(self._last) else time[1:]
        if len(self._early) < _STEPS:
            self._early += zip(before.tolist(), after.tolist(), strict=True)
            if len(self._early) >= _STEPS:
                self._judge_early()
            return
        self._keep_gaps(before, after)

    def _judge_early(self) -> None:
        """Look for gaps among the first steps, once there are enough of them to know the period."""
        if self._early:
            before, after = np.array(self._early).T
            self.noted.period = float(np.median(after - before))
            self._keep_gaps(before, after)

    def _keep_gaps(self, before: FloatArray, after: FloatArray) -> None:
        period = self.noted.period
        if period <= 0.0:
            return
        for at in np.flatnonzero(after - before > _GAP * period):
            count = round((after[at] - before[at]) / period) - 1
            if count > 0 and len(self.noted.gaps) < _MOST_NOTES:
                self.noted.gaps.append((float(before[at]), float(after[at]), count))

    def _note(self, time: float, sentence: str) -> None:
        self._notice(sentence)
        if len(self.noted.notes) < _MOST_NOTES:
            self.noted.notes.append((float(time) if np.isfinite(time) else 0.0, sentence))

    def finish(self) -> Noted:
        """Close the record with what was found; without a sample there is none."""
        if len(self._early) < _STEPS:
            self._judge_early()
        if self._writer is not None:
            meta: dict[str, str | float | int] = {"status": self.noted.status, "source": self._source.name}
            if self.noted.period > 0.0:
                meta["sample_period"] = self.noted.period
            meta["recording"] = json.dumps(self.noted.as_json())
            self._writer.finish(meta)
        return self.noted


async def record(
    source: Source, out: Path, seconds: float, stop: asyncio.Event, progress: Callable[[float], None],
    notice: Callable[[str], None] = lambda sentence: None,
) -> Noted:  # fmt: skip
    """Record a source for ``seconds`` by this computer's clock, or until it ends or ``stop`` is set; the samples until then are kept.

    ``progress`` is called with the seconds that have passed, and ``notice`` with each note of the source as it comes.
    """
    recorder = Recorder(source, out, notice)
    begun = clock.monotonic()
    blocks = source.blocks()
    following: asyncio.Task[SampleBlock] | None = None
    ending: asyncio.Task[bool] = asyncio.ensure_future(stop.wait())
    try:
        while (left := seconds - (clock.monotonic() - begun)) > 0.0 and not stop.is_set():
            following = following or asyncio.ensure_future(anext(blocks))
            await asyncio.wait([following, ending], timeout=min(left, 0.5), return_when=asyncio.FIRST_COMPLETED)
            progress(clock.monotonic() - begun)
            if following.done():
                recorder.take(following.result())
                following = None
        recorder.noted.status = "stopped" if stop.is_set() else "complete"
    except StopAsyncIteration:
        pass
    finally:
        ending.cancel()
        if following is not None:
            following.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await following
        with contextlib.suppress(Exception):
            await blocks.aclose()  # type: ignore[attr-defined]
        recorder.finish()
    return recorder.noted
