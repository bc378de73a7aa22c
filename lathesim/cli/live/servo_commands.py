"""``lathesim machine`` and ``stream``: the servo side of a simulated machine, and what sends it set-points."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import (
    STOPPED,
    ChosenLesson,
    OutputPath,
    axis_option,
    grouped,
    host_option,
    json_option,
    of_case,
    option,
    read_axes,
)
from lathesim.cli.progress import time_bar
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from lathesim.live.recording_run import RecordBlocks
    from lathesim.live.samples import SampleSink
    from lathesim.live.servo_session import ServoSettings, Session
    from lathesim.live.stepped_machine import SteppedMachine
    from lathesim.record import FloatArray


@dataclass(frozen=True)
class BufferOptions:
    """The clock of the servos, and the buffer of their set-points."""

    clock: str = option("Which clock the servos keep.", type=click.Choice(("wall", "virtual")), default="wall")
    capacity: int = option("Room of the buffer.", "--buffer", type=click.IntRange(2, 1_000_000), default=200)
    begin: int = option("Set-points to wait for at the start.", type=click.IntRange(1, 1_000_000), default=50)
    elastic: float | None = option("Slow down on the path when the buffer runs low.", type=click.FloatRange(1e-5, 1.0), metavar="RHO")


@click.command()
@click.argument("lesson")
@click.option("--listen", "port", type=click.IntRange(0, 65535), required=True, metavar="PORT", help="TCP port; 0 takes a free one.")
@host_option
@grouped(buffer=BufferOptions)
@click.option("--out", type=OutputPath(), metavar="R.h5", help="Keep what the machine did.")
@click.option("--once", is_flag=True, help="End after the first stream.")
@axis_option
@of_case
def machine(
    chosen: ChosenLesson, port: int, host: str, buffer: BufferOptions, out: Path | None, once: bool, axis_texts: tuple[str, ...]
) -> int:
    """Be the servo side of LESSON's machine: take set-points over TCP, move, and send feedback over UDP.

    When the buffer runs empty, the tool holds its place. With --elastic RHO it slows down before, on its path, and the playback rate
    changes by at most RHO a period. Ctrl-C ends it; what was recorded is kept.
    """
    from lathesim.live.samples import run_until_stopped
    from lathesim.live.servo_session import ServoSettings
    from lathesim.live.servo_side import ServoSide, serve
    from lathesim.live.stepped_machine import SteppedMachine, axes_of

    axes = read_axes(axis_texts)
    prepared = chosen.prepared
    how = ServoSettings(buffer.capacity, min(buffer.begin, buffer.capacity), buffer.elastic, buffer.clock == "virtual")
    records = Records(out)

    def make(names: tuple[str, ...]) -> SteppedMachine:
        return SteppedMachine(prepared, axes_of(prepared, names, axes))

    def ready(taken: int) -> None:
        click.echo(f"{prepared.name} takes set-points at {host}:{taken}; Ctrl-C ends it.", err=True)

    side = ServoSide(make, how, lambda sentence: click.echo(sentence, err=True), records.open)
    sessions, stopped = run_until_stopped(lambda stop: serve(side, host, port, stop, ready, once=once))
    for session in sessions:
        for line in _lines(session, how):
            click.echo(line)
    return STOPPED if stopped else 0


class Records:
    """Opens a record for each stream: R.h5, then R_2.h5 and so on; existing records are not replaced."""

    def __init__(self, out: Path | None) -> None:
        self._out = out
        self._count = 0

    def open(self, machine: SteppedMachine) -> SampleSink | None:
        """Return the record of a new stream, or none where none is wanted."""
        if self._out is None:
            return None
        import numpy as np

        from lathesim.live.servo_session import machine_signals
        from lathesim.record import Record
        from lathesim.record_writer import RecordWriter, save
        from lathesim.whole_file import write_new

        self._count += 1
        channels = [signal.as_channel() for signal in machine_signals(machine)]
        first = place = self._out
        if self._count > 1:
            names = (first.with_name(f"{first.stem}_{number}{first.suffix}") for number in itertools.count(self._count))
            empty = Record(np.empty(0), {channel.name: channel for channel in channels}, {"status": "begun"})
            place = write_new(names, lambda part: save(empty, part))  # the record of another machine under this name stays
        return RecordWriter(place, channels, growing=True)


def _lines(session: Session, how: ServoSettings) -> Iterator[str]:
    from lathesim.units import in_unit

    count = session.counts
    if not count:
        return
    stops = f"{count['underruns']} underruns" if how.rho is None else f"{count['hard_stops']} hard stops"
    yield f"{session.peer}: {session.periods} periods, {count['arrived']} set-points, {stops}; ended: {session.reason}."
    clock = session.clock.as_json()
    if clock.get("wakes") and not how.virtual:
        late, latest, jitter = (clock[name] or 0.0 for name in ("late_mean_s", "latest_s", "jitter_s"))
        yield (
            f"  It came {in_unit(late, 'ms', '.2f')} late on average, {in_unit(latest, 'ms', '.1f')} at most, "
            f"with a jitter of {in_unit(jitter, 'ms', '.2f')}; the lowest fill was {clock['lowest_fill']:.0f}."
        )
    if session.late_periods:
        yield f"  {session.late_periods} periods passed while this computer was away."


_SUFFIX = ".position"
_SAME_PLACE = 1e-6
"""Way [m, rad] between the ends of a path that counts as closed, assumed."""
_SAME_PERIOD = 1e-6
"""Share by which two periods may differ, assumed: rounding of what is written."""


@dataclass(frozen=True)
class StreamOptions:
    """How set-points are sent: the fill of the buffer, how often, and what a simulated planner and machine do."""

    fill: int
    axis_texts: tuple[str, ...]
    elastic: float | None = option(
        "With sim: play elastically, as machine --elastic does.", type=click.FloatRange(1e-5, 1.0), metavar="RHO"
    )
    away: float = option(
        "With sim: planner away 5 + Exp(N) periods.", type=click.FloatRange(0.0, 1e6), default=0.0, metavar="N", show_default=False
    )
    seed: int = option("With sim: seed of the planner's absences.", type=click.IntRange(min=0), default=0, show_default=False)
    loops: int = option(
        "Send the set-points so many times; they must end as they begin.", type=click.IntRange(1, 1_000_000), default=1, show_default=False
    )


@click.command()
@click.argument("set_points", type=click.Path(path_type=Path), metavar="S.h5")
@click.argument("url", metavar="URL")
@click.option("--fill", type=click.IntRange(2, 1_000_000), default=150, show_default=True, help="How full to keep the buffer.")
@click.option("--out", type=OutputPath(), metavar="R.h5", help="Keep the feedback.")
@grouped(playing=StreamOptions)
@axis_option
@json_option("lathesim-stream/1")
def stream(set_points: Path, url: str, playing: StreamOptions, out: Path | None, as_json: bool) -> int:
    """Send the set-points of S.h5, as 'lathesim retime' writes them, to the servo side at URL (127.0.0.1:5600), and take its feedback.

    With the URL sim:LESSON planner, buffer and machine run here on a virtual clock, as fast as they can, the same bits each time.
    """
    from lathesim.live.recording_run import RecordBlocks

    source = RecordBlocks(set_points)
    try:
        names = _axes(source)
        if playing.loops > 1:
            _check_closed(source, names)
        send = _virtual if url.startswith("sim:") else _network
        result, stopped = send(source, names, url.removeprefix("sim:"), playing, out, as_json)
    finally:
        source.close()
    return write(CommandResult("lathesim-stream/1", result, _stream_lines(result, out), code=STOPPED if stopped else 0), as_json)


def _axes(source: RecordBlocks) -> list[str]:
    from lathesim.live.samples import LiveError

    names = [signal.name.removesuffix(_SUFFIX) for signal in source.signals if signal.name.endswith(_SUFFIX)]
    if not names or len(source) < 2:
        remedy = "Make one with 'lathesim retime'."
        raise LiveError("the record holds no set-points: no channels 'AXIS.position'.", place=str(source.path), remedy=remedy)
    return names


def _check_closed(source: RecordBlocks, names: list[str]) -> None:
    from lathesim.live.samples import LiveError

    first = last = None
    for block in source.blocks([name + _SUFFIX for name in names]):
        first = block.values[:, 0] if first is None else first
        last = block.values[:, -1]
    assert first is not None
    assert last is not None
    for name, begin, end in zip(names, first, last, strict=True):
        if abs(end - begin) > _SAME_PLACE:
            fact = f"the axis {name} ends {abs(end - begin):.3g} away from where it begins."
            raise LiveError(fact, place=str(source.path), remedy="Leave --loops out, or close the path.")


def _blocks(source: RecordBlocks, names: list[str], loops: int) -> Iterator[FloatArray]:
    for _ in range(loops):
        for block in source.blocks([name + _SUFFIX for name in names]):
            yield block.values.T.copy()


def _writer(out: Path | None, signals: Any) -> Any:
    from lathesim.record_writer import RecordWriter

    return None if out is None else RecordWriter(out, [signal.as_channel() for signal in signals], growing=True)


def _network(
    source: RecordBlocks, names: list[str], url: str, playing: StreamOptions, out: Path | None, as_json: bool
) -> tuple[dict[str, Any], bool]:
    from lathesim.live.connections import read_address
    from lathesim.live.samples import run_until_stopped
    from lathesim.live.streaming import StreamJob
    from lathesim.live.streaming import stream as send

    address = read_address(url, "tcp")
    job = StreamJob(names, source.period, _blocks(source, names, playing.loops), playing.fill, lambda signals: _writer(out, signals))
    with time_bar("set-points", source.period * len(source) * playing.loops, 1e3, shown=not as_json) as bar:
        job.progress = bar
        result, stopped = run_until_stopped(lambda stop: send(job, address, stop))
    return result.as_json(), stopped


def _virtual(
    source: RecordBlocks, names: list[str], lesson: str, playing: StreamOptions, out: Path | None, as_json: bool
) -> tuple[dict[str, Any], bool]:
    from dataclasses import asdict

    from lathesim.live.samples import LiveError
    from lathesim.live.servo_session import machine_signals
    from lathesim.live.set_point_buffer import SetPointBuffer
    from lathesim.live.stepped_machine import SteppedMachine, axes_of
    from lathesim.live.streaming import Planner, stream_virtually
    from lathesim.units import in_unit

    prepared = ChosenLesson(lesson).prepared
    machine = SteppedMachine(prepared, axes_of(prepared, names, read_axes(playing.axis_texts)))
    if abs(source.period / machine.period - 1.0) > _SAME_PERIOD:
        taken = in_unit(machine.period, "ms", "g")
        fact = f"the set-points come every {in_unit(source.period, 'ms', 'g')}, and the machine takes one every {taken}."
        raise LiveError(fact, remedy=f"Time the path with --period '{taken}'.")
    sink = _writer(out, machine_signals(machine))
    stopped, planner = False, Planner(playing.fill, 5.0, playing.away, playing.seed)
    buffer = SetPointBuffer(len(names), max(playing.fill, 2), playing.elastic)
    with time_bar("set-points", source.period * len(source) * playing.loops, 1e3, shown=not as_json) as bar:
        try:
            count = stream_virtually(_blocks(source, names, playing.loops), machine, buffer, planner, sink, bar)
        except KeyboardInterrupt:
            stopped, count = True, buffer.count()
    if sink is not None:
        status = "stopped" if stopped else "complete"
        own = prepared.case.lesson
        of_lesson = {"lesson": own.text, "lesson_name": own.name}  # so that the record is graded like that of a run
        sink.finish({"sample_period": machine.period, "status": status, "machine": machine.name, **of_lesson})
    result = {"machine": machine.name, "sent": count.arrived, "ended": "stopped" if stopped else "complete"}
    return {**result, "servo": {**asdict(count), "periods": machine.periods}, "feedback": {"received": machine.periods, "lost": 0}}, stopped


def _stream_lines(result: dict[str, Any], out: Path | None) -> Iterator[str]:
    servo, feedback = result["servo"], result["feedback"]
    yield f"{result['machine']}: {result['sent']} set-points sent, {servo.get('periods', 0)} periods played; {result['ended']}."
    yield f"Underruns {servo.get('underruns', 0)}, hard stops {servo.get('hard_stops', 0)}, lowest fill {servo.get('lowest', 0):.0f}."
    lost = ", ".join(f"{name} {number}" for name, number in feedback.items() if number and name != "received")
    yield f"Feedback: {feedback.get('received', 0)} samples{f'; {lost}' if lost else ', none lost'}."
    if out is not None:
        yield f"What the machine did is in {out}. Draw it with: lathesim plot {out}"
