"""One watch over a source: events as they come, and the diagnosis of the window around each change in the background."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.cluster import Cluster
from lathesim.errors import LatheSimError
from lathesim.lessons.simulate import Prepared
from lathesim.live.even_clock import Stretch
from lathesim.live.opening import FileSource
from lathesim.live.samples import SampleBlock, Source
from lathesim.live.session_start import BegunStream, begun_blocks, driven_and_compared
from lathesim.live.watching.forecast import Following
from lathesim.live.watching.known_effects import KnownEffects, followed_sizes, scales, with_named
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.live.watching.states import ReportedChange
from lathesim.live.watching.watch import Watch
from lathesim.live.watching.watch_verdict import (
    NAMING,
    Away,
    BeforeChange,
    Verdict,
    WatchEvent,
    Window,
    Windows,
    diagnose_window,
    free_number,
    known_before,
    told_verdict,
)
from lathesim.plugins import Registry
from lathesim.record import FloatArray

_ANSWER = 45.0
"""Seconds after the alarm at which the window of a drift ends: later it has grown, and its name is wanted within a minute."""
_LEAST = 200
"""Samples of a window that are worth a diagnosis."""


@dataclass(frozen=True)
class WatchSettings:
    """How to watch: seconds to ``learn``, of a ``block``, of the ``window`` for a diagnosis; seconds it may take (``patience``); further
    windows to validate with; tolerances [SI] by channel; where files go; whether to diagnose at all; whether the source ``waits`` for a
    diagnosis, as recordings can and machines cannot; the cluster whose workers diagnose, if any."""

    learn: float = 60.0
    block: float = 0.2
    window: float = 20.0
    patience: float = 120.0
    validation_windows: int = 0
    tolerance: Mapping[str, float] = field(default_factory=dict)
    folder: Path = Path("lathesim_runs")
    diagnose: bool = True
    plugins: Sequence[Path] = ()
    waits: bool = False
    cluster: Cluster | None = None


class WatchSession:
    """Watches a source and tells events. ``run`` ends with the source, or when ``stop`` is set; a diagnosis under way is then ended.

    An alarm is about a new difference. What a diagnosis names belongs to the simulated machine from then on. Where it names nothing, what
    is usual is learnt anew from the changed state. Between an alarm and its verdict nothing is judged.
    """

    def __init__(
        self, prepared: Prepared, registry: Registry, source: Source, settings: WatchSettings, tell: Callable[[WatchEvent], None]
    ) -> None:
        self._prepared, self._registry, self._source, self._settings, self._tell = prepared, registry, source, settings, tell
        self._first, self._channels = prepared, driven_and_compared(prepared)
        self._known = KnownEffects(prepared, registry)
        self._begun: BegunStream
        self._watch: Watch
        self._has_begun = False
        self._raw: deque[tuple[float, FloatArray]] = deque()
        self._sound: Window | None = None
        self._windows: list[_Pending] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._following: Following | None = None
        self._drifting: ReportedChange | None = None
        self._learnt = False
        self._end = 0.0
        self.alarms = 0

    async def run(self, stop: asyncio.Event) -> None:
        """Watch until the source ends or ``stop`` is set."""
        ending: asyncio.Task[bool] = asyncio.ensure_future(stop.wait())
        try:
            async with contextlib.aclosing(begun_blocks(self._prepared, self._source, self._channels, stop)) as blocks:
                async for begun, block in blocks:
                    if not self._has_begun:
                        self._begin(begun)
                    self._judge(block)
                    await (asyncio.wait([ending, *self._tasks], return_when=asyncio.FIRST_COMPLETED) if self._waits else asyncio.sleep(0))
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

    @property
    def _waits(self) -> bool:
        return self._settings.waits and bool(self._tasks)

    def _begin(self, begun: BegunStream) -> None:
        self._begun, self._has_begun = begun, True
        residuals, plain = self._simulations()
        self._watch = Watch(residuals, begun.clock.period, learn=self._settings.learn, block=self._settings.block, plain=plain)
        self._follow()

    def _simulations(self) -> tuple[ResidualStream, ResidualStream | None]:
        """Return the machine with the sizes of its effects followed, and, where a tolerance asks what they do, the lesson's first one."""
        drive, compare, period = self._begun.drive, self._begun.compare, self._begun.clock.period
        followed = scales(followed_sizes(self._prepared, self._registry))
        residuals = ResidualStream(self._prepared, drive, compare, period, followed=followed)
        if not followed or not self._settings.tolerance:
            return residuals, None
        first = scales(followed_sizes(self._first, self._registry))
        return residuals, ResidualStream(self._first, drive, compare, period, followed=first, plain=True)

    def _new(self, residuals: ResidualStream) -> FloatArray:
        """Return how large the followed effects are that the lesson did not have at first [scales], (parameters,)."""
        first, sizes = followed_sizes(self._first, self._registry), followed_sizes(self._prepared, self._registry)
        return np.array([
            (sizes[name].value - sizes[name].neutral) / residuals.scales[name] if free and name not in first else 0.0
            for name, free in zip(residuals.parameters, residuals.free, strict=True)
        ])  # fmt: skip

    def _follow(self) -> None:
        """Follow the values of the simulation as it is now."""
        sizes = followed_sizes(self._prepared, self._registry)
        self._following = Following(self._watch, sizes, self._known, self._settings.tolerance, self._following)

    def _judge(self, block: SampleBlock) -> None:
        clock = self._begun.clock
        stretches = clock.take(block)
        for fault in clock.told():
            many = f"{fault.samples} sample{'s' if fault.samples != 1 else ''} " if fault.samples else ""
            sentence = f"t = {fault.time:.3f} s: the recording: {many}{fault.kind}."
            self._tell(WatchEvent("recording", fault.time, sentence, {"fault": fault.kind, "samples": fault.samples}))
        for stretch in stretches:
            self._keep(stretch)
            for alarm in self._watch.take(stretch):
                self._alarm(alarm)
            self._end = stretch.begin + stretch.values.shape[1] * clock.period
            self._after(stretch)

    def _keep(self, stretch: Stretch) -> None:
        """Keep the newest samples for the window of a diagnosis; nothing from before a gap."""
        if stretch.fresh:
            self._raw.clear()
        self._raw.append((stretch.begin, stretch.values))
        room = 2.0 * self._settings.window + 30.0
        while len(self._raw) > 1 and self._raw[1][0] < stretch.begin + stretch.values.shape[1] * self._begun.clock.period - room:
            self._raw.popleft()

    def _alarm(self, alarm: ReportedChange) -> None:
        assert self._following is not None
        self._learnt = False
        goes_on = self._drifting
        if goes_on is not None and (alarm.drift or (alarm.channel, alarm.state) == (goes_on.channel, goes_on.state)):
            sentence = (
                f"t = {alarm.time:.1f} s: the drift since t = {goes_on.begun:.1f} s goes on: {alarm.channel}, {alarm.state}, "
                f"by {alarm.size:.1f} usual deviations or more."
            )
            data = {"since_s": goes_on.begun, "channel": alarm.channel, "state": alarm.state, "deviations": alarm.size, "grown": []}
            self._tell(WatchEvent("growth", alarm.time, sentence, data))
        else:
            self.alarms += 1
            when = "has drifted" if alarm.drift else "has changed"
            sentence = (
                f"t = {alarm.time:.1f} s: {alarm.channel} {when} since t = {alarm.begun:.1f} s{self._where(alarm.begun)}, {alarm.state}, "
                f"by {alarm.size:.1f} usual deviations or more."
            )
            data = {"since_s": alarm.begun, "channel": alarm.channel, "state": alarm.state, "deviations": alarm.size}
            self._tell(WatchEvent(alarm.kind, alarm.time, sentence, data))
            self._drifting = alarm if alarm.drift else None
        self._following.alarmed(alarm.drift)
        if self._settings.diagnose:
            begin = diagnosis_begin(alarm, self._settings.window)
            end = begin + self._settings.window * (1 + self._settings.validation_windows)
            self._windows.append(_Pending(begin, end, alarm.begun if self._drifting is None else self._drifting.begun))
            self._watch.pause()

    def _after(self, stretch: Stretch) -> None:
        """Report what is known now: learnt values, values that moved, windows that are whole, drifts that go on."""
        if self._watch.learnt and not self._learnt:
            self._learnt = True
            self._sound = self._sound or self._newest_window()
            off = ", ".join(f"{name} {value:+.1f}" for name, value in self._watch.values.items())
            sentence = f"t = {self._end:.1f} s: what is usual is learnt; uncertain values are off by {off} standard deviations."
            self._tell(WatchEvent("learnt", self._end, sentence, {"values": self._watch.values}))
        for pending in [item for item in self._windows if self._end >= item.end]:
            self._windows.remove(pending)
            self._diagnose(pending)
        assert self._following is not None
        for event in self._following.news(self._end):
            self._tell(event)

    def _newest_window(self) -> Window | None:
        """Return the newest samples as a window, of what is usual now; None where there are too few."""
        period, values = self._begun.clock.period, np.concatenate([piece for _, piece in self._raw], axis=1)
        kept = values[:, -round(self._settings.window / period) :]
        return Window(self._end - kept.shape[1] * period, period, self._begun.signals, kept) if kept.shape[1] >= _LEAST else None

    def _close_windows(self) -> None:
        """Diagnose what is there of the windows that the end of the source cut."""
        for pending in self._windows:
            self._diagnose(pending)
        self._windows = []

    def _diagnose(self, pending: _Pending) -> None:
        period = self._begun.clock.period
        values = np.concatenate([piece for _, piece in self._raw], axis=1)
        first = self._raw[0][0]
        at = [round((time - first) / period) for time in (pending.begin, pending.begin + self._settings.window, pending.end)]
        whole = values[:, max(0, at[0]) : max(0, at[1])]
        if whole.shape[1] < _LEAST:
            sentence = f"t = {pending.begin:.1f} s: only {whole.shape[1]} samples follow, too few for a diagnosis."
            self._tell(WatchEvent("verdict", pending.begin, sentence, {"verdict": "too_short"}))
            self._go_on(None)
            return
        further = values[:, at[1] : at[2]]
        validation = Window(pending.begin, period, self._begun.signals, further) if further.shape[1] >= _LEAST else None
        windows = Windows(Window(pending.begin, period, self._begun.signals, whole), validation, self._sound)
        before = known_before(self._prepared, self._known.texts(), self._watch.expected(pending.begin + 0.5 * self._settings.window))
        task = asyncio.ensure_future(self._verdict(pending, before, windows))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _verdict(self, pending: _Pending, before: BeforeChange, windows: Windows) -> None:
        folder, window = self._settings.folder, windows.asked
        number = 0
        try:
            number = free_number(folder)
            away = Away(self._settings.cluster, self._registry) if self._settings.cluster is not None else None
            verdict = await diagnose_window(
                self._prepared, before, windows, folder, number, self._settings.patience, self._settings.plugins, away
            )
        except (LatheSimError, OSError) as error:
            verdict = Verdict({}, f"it could not be made: {error}")
        until = window.begin + window.values.shape[1] * window.period if self._drifting is not None else pending.since
        # of two effects that explain as much, one that is put in would take the growth of the other for its own
        names = verdict.answer.get("verdict") in (NAMING if self._drifting is None else NAMING[:1])
        grown = self._known.grown(verdict.answer, pending.since, until) if names else []
        self._tell(told_verdict(verdict, window.begin, grown, folder / f"watch_{number}.json", before.values))
        self._drifting = None if names else self._drifting
        self._go_on(self._with_named(verdict, folder / f"watch_{number}_goes_on.yaml") if names else None)

    def _with_named(self, verdict: Verdict, place: Path) -> Prepared | None:
        """Return the machine with what was named; None, and a sentence, where it cannot be put in."""
        try:
            return with_named(self._prepared, verdict.answer, self._known, self._registry, place)
        except (LatheSimError, OSError) as error:
            self._tell(WatchEvent("continued", self._end, f"What was named cannot be put into the lesson: {error}", {"lesson": None}))
            return None

    def _go_on(self, changed: Prepared | None) -> None:
        """Go on watching with a machine that holds what changed, or else from the changed state.

        What is usual then is what a later change is held against; of a drift that nothing names yet that stays what was before it.
        """
        if changed is not None or self._drifting is None:
            self._sound = None
        if changed is None:
            self._watch.go_on(as_changed=not (self._drifting or self._known.drift))
            self._tell(
                WatchEvent("continued", self._end, f"t = {self._end:.1f} s: watching goes on from the changed state.", {"lesson": None})
            )
            return
        self._prepared = changed
        residuals, plain = self._simulations()
        self._watch.go_on(residuals, plain, self._new(residuals))
        self._follow()
        place = changed.case.lesson.path
        sentence = f"t = {self._end:.1f} s: watching goes on with that in the simulation ({place})."
        self._tell(WatchEvent("continued", self._end, sentence, {"lesson": str(place)}))

    def _where(self, time: float) -> str:
        """Return in which of several recordings a time lies, as a part of a sentence."""
        return self._source.where(time) if isinstance(self._source, FileSource) else ""

    def _tell_end(self) -> None:
        counts = self._begun.clock.counts if self._has_begun else {}
        faults = ", ".join(f"{kind} {count}" for kind, count in counts.items()) or "none"
        sentence = f"Watched {self._end:.0f} s: {self.alarms} alarm{'s' if self.alarms != 1 else ''}; faults of the recording: {faults}."
        found = []
        for effect in self._known.changed:
            since, until = f"t = {effect.since:.1f} s{self._where(effect.since)}", f"t = {effect.until:.1f} s{self._where(effect.until)}"
            when = f"since {since}" if effect.until <= effect.since else f"since {since}, until {until} at least"
            sentence += f" {effect.name}: {effect.course()}, {when}."
            found.append({
                "effect": effect.effect, "at": effect.at, "since_s": effect.since, "until_s": effect.until,
                "sizes": {name: {"from": size.was, "to": size.now, "unit": size.unit} for name, size in effect.sizes.items()},
            })  # fmt: skip
        self._tell(WatchEvent("end", self._end, sentence, {"alarms": self.alarms, "faults": counts, "found": found}))


@dataclass(frozen=True)
class _Pending:
    """A window that is still being filled, and since when it is about something."""

    begin: float
    end: float
    since: float


def diagnosis_begin(alarm: ReportedChange, window: float) -> float:
    """Return where the window of a diagnosis begins [s]: with a change; of a drift as late as still gives an answer within a minute."""
    return alarm.time + max(0.0, _ANSWER - window) if alarm.drift else alarm.begun
