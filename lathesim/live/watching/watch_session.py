"""One watch over a source: events as they come, and the diagnosis of the window around each change in the background."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.lessons.simulate import Prepared
from lathesim.live.sources.sample_clock import SampleClock, Stretch
from lathesim.live.sources.samples import Block, LiveError, Source
from lathesim.live.watching.background_diagnosis import Verdict, Window, diagnose_window
from lathesim.live.watching.forecast import forecast
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.live.watching.watch import Alarm, Watch
from lathesim.record import FloatArray

_POINTS = 400
"""Points of a drift that are kept; with more of them every second one goes."""
_POINT = 20.0
"""Seconds of each point: about a lap, over which what differs comes and goes."""
_ANSWER = 45.0
"""Seconds after the alarm at which the window of a drift ends: later it has grown, and its name is wanted within a minute."""
_LEAST = 200
"""Samples of a window that are worth a diagnosis."""
_FOR_THE_PERIOD = 20


@dataclass(frozen=True)
class WatchSettings:
    """How to watch: seconds to ``learn``, of a ``block``, of the ``window`` for a diagnosis; seconds it may take (``patience``); further
    windows to validate with; tolerances [SI] by channel; where files go; whether to diagnose at all."""

    learn: float = 60.0
    block: float = 0.2
    window: float = 20.0
    patience: float = 120.0
    validation_windows: int = 0
    tolerance: Mapping[str, float] = field(default_factory=dict)
    folder: Path = Path("lathesim_runs")
    diagnose: bool = True
    plugins: Sequence[Path] = ()


@dataclass(frozen=True)
class Event:
    """Something to tell: ``kind`` (learnt, change, drift, recording, values, verdict, growth, forecast, end), ``time`` [s], a sentence, and
    the same as plain data."""

    kind: str
    time: float
    sentence: str
    data: Mapping[str, Any]


class WatchSession:
    """Watches a source and tells events. ``run`` ends with the source, or when ``stop`` is set; a diagnosis under way is then ended."""

    def __init__(self, prepared: Prepared, source: Source, settings: WatchSettings, tell: Callable[[Event], None]) -> None:
        self._prepared, self._source, self._settings, self._tell = prepared, source, settings, tell
        recordings = prepared.case.lesson.settings.recordings
        if recordings is None or not recordings.drive or not recordings.compare:
            place = str(prepared.case.lesson.path)
            raise LiveError("the lesson does not say what drives it and what is compared.", place=place, remedy="Add 'recordings:'.")
        self._drive, self._compare = list(recordings.drive), list(recordings.compare)
        self._known = {(str(entry.effect), str(entry.at)) for entry in prepared.case.lesson.settings.insert}
        self._watch: Watch | None = None
        self._clock: SampleClock | None = None
        self._rows: list[int] = []
        self._raw: deque[tuple[float, FloatArray]] = deque()
        self._windows: list[_Pending] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._drifts: list[_Drift] = []
        self._number = 0
        self._learnt = False
        self._values_told = 0
        self._end = 0.0
        self.alarms = 0

    async def run(self, stop: asyncio.Event) -> None:
        """Watch until the source ends or ``stop`` is set."""
        blocks = self._source.blocks()
        ending: asyncio.Task[bool] = asyncio.ensure_future(stop.wait())
        waiting: list[Block] = []
        try:
            while not stop.is_set():
                following = asyncio.ensure_future(_next(blocks))
                await asyncio.wait([following, ending], return_when=asyncio.FIRST_COMPLETED)
                if not following.done():
                    following.cancel()
                    with contextlib.suppress(asyncio.CancelledError, Exception):
                        await following
                    break
                block = following.result()
                if block is None:
                    break
                waiting = self._take(block, waiting)
                await asyncio.sleep(0)
            self._close_windows()
            if self._tasks and not stop.is_set():
                whole: asyncio.Future[list[Any]] = asyncio.gather(*self._tasks, return_exceptions=True)
                both: list[asyncio.Future[Any]] = [whole, ending]
                await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
                if not whole.done():
                    whole.cancel()
                    await asyncio.gather(whole, return_exceptions=True)
        finally:
            ending.cancel()
            for task in list(self._tasks):
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)
        self._tell_end()

    def _take(self, block: Block, waiting: list[Block]) -> list[Block]:
        """Take a block; the first ones wait until the sample period is known."""
        if self._watch is None:
            waiting = [*waiting, block]
            if sum(len(item) for item in waiting) < _FOR_THE_PERIOD:
                return waiting
            self._begin(np.concatenate([item.time for item in waiting]))
            for item in waiting:
                self._judge(item)
            return []
        self._judge(block)
        return []

    def _begin(self, time: FloatArray) -> None:
        names = [signal.name for signal in self._source.signals]
        missing = [name for name in self._drive if name not in names]
        if missing:
            raise LiveError(f"{self._source.name} has no '{missing[0]}', which drives the lesson.", remedy="Add it to the map.")
        compare = [name for name in self._compare if name in names]
        if not compare:
            raise LiveError(f"{self._source.name} has no channel that the lesson compares.", remedy=f"Map {', '.join(self._compare)}.")
        self._rows = [names.index(name) for name in (*self._drive, *compare)]
        steps = np.diff(np.sort(time))
        period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else self._prepared.plan.assembly.sample_period
        own = self._prepared.plan.assembly.sample_period
        period = own * max(1, round(period / own))
        self._clock = SampleClock(period)
        residuals = ResidualStream(self._prepared, self._drive, compare, period)
        self._watch = Watch(residuals, period, learn=self._settings.learn, block=self._settings.block)

    def _judge(self, block: Block) -> None:
        assert self._clock is not None
        assert self._watch is not None
        stretches = self._clock.take(Block(block.time, block.values[self._rows], block.notes, block.fresh))
        for fault in self._clock.told():
            many = f"{fault.samples} sample{'s' if fault.samples != 1 else ''} " if fault.samples else ""
            sentence = f"t = {fault.time:.3f} s: the recording: {many}{fault.kind}."
            self._tell(Event("recording", fault.time, sentence, {"fault": fault.kind, "samples": fault.samples}))
        for stretch in stretches:
            self._keep(stretch)
            for alarm in self._watch.take(stretch):
                self._alarm(alarm)
            self._end = stretch.begin + stretch.values.shape[1] * self._clock.period
            self._after(stretch)

    def _keep(self, stretch: Stretch) -> None:
        """Keep the newest samples for the window of a diagnosis; nothing from before a gap."""
        assert self._clock is not None
        if stretch.fresh:
            self._raw.clear()
        self._raw.append((stretch.begin, stretch.values))
        room = 2.0 * self._settings.window + 30.0
        while len(self._raw) > 1 and self._raw[1][0] < stretch.begin + stretch.values.shape[1] * self._clock.period - room:
            self._raw.popleft()

    def _alarm(self, alarm: Alarm) -> None:
        assert self._watch is not None
        self.alarms += 1
        self._learnt = False
        when = "has drifted" if alarm.drift else "has changed"
        sentence = (
            f"t = {alarm.time:.1f} s: {alarm.channel} {when} since t = {alarm.begun:.1f} s, {alarm.state}, "
            f"by {alarm.size:.1f} usual deviations or more."
        )
        data = {"since_s": alarm.begun, "channel": alarm.channel, "state": alarm.state, "deviations": alarm.size}
        self._tell(Event(alarm.kind, alarm.time, sentence, data))
        if self._settings.diagnose:
            begin = diagnosis_begin(alarm, self._settings.window)
            self._windows.append(_Pending(begin, begin + self._settings.window * (1 + self._settings.validation_windows)))
        if alarm.drift and not self._drifts:
            self._drifts = [_Drift(channel, tolerance) for channel, tolerance in self._settings.tolerance.items()]

    def _after(self, stretch: Stretch) -> None:
        """Tell what is known now: learnt values, values that moved, windows that are whole, drifts that go on."""
        assert self._watch is not None
        if self._watch.learnt and not self._learnt:
            self._learnt = True
            off = ", ".join(f"{name} {value:+.1f}" for name, value in self._watch.values.items())
            sentence = f"t = {self._end:.1f} s: what is usual is learnt; uncertain values are off by {off} standard deviations."
            self._tell(Event("learnt", self._end, sentence, {"values": self._watch.values}))
        for time, name in self._watch.absorbed[self._values_told :]:
            sentence = f"t = {time:.1f} s: {name} moved, within what the lesson calls uncertain."
            self._tell(Event("values", time, sentence, {"parameter": name}))
        self._values_told = len(self._watch.absorbed)
        for pending in [item for item in self._windows if self._end >= item.end]:
            self._windows.remove(pending)
            self._diagnose(pending)
        for drift in self._drifts:
            told = drift.take(self._watch, self._end)
            if told is not None:
                self._tell(told)

    def _close_windows(self) -> None:
        """Diagnose what is there of the windows that the end of the source cut."""
        for pending in self._windows:
            self._diagnose(pending)
        self._windows = []

    def _diagnose(self, pending: _Pending) -> None:
        assert self._clock is not None
        period = self._clock.period
        values = np.concatenate([piece for _, piece in self._raw], axis=1)
        first = self._raw[0][0]
        at = [round((time - first) / period) for time in (pending.begin, pending.begin + self._settings.window, pending.end)]
        whole = values[:, max(0, at[0]) : max(0, at[1])]
        if whole.shape[1] < _LEAST:
            sentence = f"t = {pending.begin:.1f} s: only {whole.shape[1]} samples follow, too few for a diagnosis."
            self._tell(Event("verdict", pending.begin, sentence, {"verdict": "too_short"}))
            return
        signals = tuple(self._source.signals[row] for row in self._rows)
        further = values[:, at[1] : at[2]]
        validation = Window(pending.begin, period, signals, further) if further.shape[1] >= _LEAST else None
        self._number += 1
        window = Window(pending.begin, period, signals, whole)
        task = asyncio.ensure_future(self._verdict(window, validation, self._number))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _verdict(self, window: Window, validation: Window | None, number: int) -> None:
        try:
            verdict = await diagnose_window(
                self._prepared, window, validation, self._settings.folder, number, self._settings.patience, self._settings.plugins
            )
        except (LatheSimError, OSError) as error:
            verdict = Verdict({}, f"it could not be made: {error}")
        self._tell(_event_of(verdict, window.begin, self._known, self._settings.folder / f"watch_{number}.json"))

    def _tell_end(self) -> None:
        assert self._clock is not None or self._watch is None
        counts = {} if self._clock is None else self._clock.counts
        faults = ", ".join(f"{kind} {count}" for kind, count in counts.items()) or "none"
        sentence = f"Watched {self._end:.0f} s: {self.alarms} alarm{'s' if self.alarms != 1 else ''}; faults of the recording: {faults}."
        self._tell(Event("end", self._end, sentence, {"alarms": self.alarms, "faults": counts}))


@dataclass(frozen=True)
class _Pending:
    """A window that is still being filled."""

    begin: float
    end: float


@dataclass
class _Drift:
    """A channel on its way to a tolerance: the rms of its residual above the first laps, of 20 s each; fewer as time goes on."""

    channel: str
    tolerance: float
    next_told: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    _squares: list[float] = field(default_factory=list)
    _since: float = np.nan
    _reached: bool = False

    def take(self, watch: Watch, now: float) -> Event | None:
        """Take what is new, and return a forecast every minute until the tolerance is reached."""
        self._since = now if np.isnan(self._since) else self._since
        self._squares.append(watch.excess(self.channel))
        if now - self._since < _POINT or self._reached:
            return None
        self.times.append(0.5 * (self._since + now))
        self.values.append(float(np.sqrt(max(0.0, float(np.mean(self._squares))))))
        self._since, self._squares = now, []
        if len(self.times) > _POINTS:
            self.times, self.values = self.times[::2], self.values[::2]
        if now < self.next_told:
            return None
        found = forecast(np.array(self.times), np.array(self.values), self.tolerance)
        if found is None:
            return None
        self.next_told = now + 60.0
        self._reached = found.time <= now
        if self._reached:
            sentence = f"t = {now:.1f} s: {self.channel} has reached its tolerance."
            return Event("forecast", now, sentence, {"channel": self.channel, "at_s": found.time, "low_s": now, "high_s": now})
        left, low, high = (max(0.0, time - now) for time in (found.time, found.low, found.high))
        sentence = (
            f"t = {now:.1f} s: {self.channel} reaches its tolerance in {left:.0f} s, between {low:.0f} and {high:.0f} s from now (95 %)."
        )
        data = {"channel": self.channel, "at_s": found.time, "low_s": found.low, "high_s": _finite(found.high)}
        return Event("forecast", now, sentence, data)


def diagnosis_begin(alarm: Alarm, window: float) -> float:
    """Return where the window of a diagnosis begins [s]: with a change; of a drift as late as still gives an answer within a minute."""
    return alarm.time + max(0.0, _ANSWER - window) if alarm.drift else alarm.begun


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _event_of(verdict: Verdict, begin: float, known: set[tuple[str, str]], place: Path) -> Event:
    if verdict.failure:
        return Event("verdict", begin, f"The diagnosis from t = {begin:.1f} s: {verdict.failure}", {"verdict": "failed"})
    answer = verdict.answer
    named = [f"{effect} at {at}" for effect, at in verdict.effects]
    sizes = [_sizes(entry) for entry in answer.get("effects", [])]
    grown = [name for name, pair in zip(named, verdict.effects, strict=True) if pair in known]
    data = {"since_s": begin, "answer": str(place), "verdict": answer.get("verdict"), "effects": answer.get("effects", [])}
    if grown and answer.get("verdict") in ("named", "tied"):
        return Event(
            "growth", begin, f"From t = {begin:.1f} s: {', '.join(grown)} has grown: {'; '.join(sizes)}.", {**data, "grown": grown}
        )
    told = {
        "named": f"{', '.join(named)}: {'; '.join(sizes)}",
        "tied": f"{' or '.join(named)}; the window cannot tell which",
        "unknown": "physics outside the catalogue, or too little to name",
        "no_mismatch": "nothing that the window shows",
        "parameters_only": "values of the lesson are off",
        "recording_fault": "the recording is at fault",
    }.get(str(answer.get("verdict")), str(answer.get("verdict")))
    return Event("verdict", begin, f"From t = {begin:.1f} s: {told}.", data)


def _sizes(entry: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {item['value']:.4g} {item['unit']}" for name, item in entry.get("parameters", {}).items())


async def _next(blocks: AsyncIterator[Block]) -> Block | None:
    return await anext(blocks, None)
