"""``lathesim machine LESSON --listen PORT``: the servo side of the simulated machine."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import (
    STOPPED,
    ChosenLesson,
    OutputPath,
    axis_option,
    grouped,
    host_option,
    plugins_option,
    read_axes,
    set_option,
    variant_option,
)  # fmt: skip

if TYPE_CHECKING:
    from lathesim.live.samples import SampleSink
    from lathesim.live.servo_session import ServoSettings, Session
    from lathesim.live.stepped_machine import SteppedMachine


@dataclass(frozen=True)
class BufferOptions:
    """The clock of the servos, and the buffer of their set-points."""

    clock: str
    capacity: int
    begin: int
    elastic: float | None


@click.command()
@click.argument("lesson")
@click.option("--listen", "port", type=click.IntRange(0, 65535), required=True, metavar="PORT", help="TCP port; 0 takes a free one.")
@host_option
@click.option("--clock", type=click.Choice(("wall", "virtual")), default="wall", show_default=True, help="Which clock the servos keep.")
@click.option("--buffer", "capacity", type=click.IntRange(2, 1_000_000), default=200, show_default=True, help="Room of the buffer.")
@click.option("--begin", type=click.IntRange(1, 1_000_000), default=50, show_default=True, help="Set-points to wait for at the start.")
@click.option("--elastic", type=click.FloatRange(1e-5, 1.0), metavar="RHO", help="Slow down on the path when the buffer runs low.")
@click.option("--out", type=OutputPath(), metavar="R.h5", help="Keep what the machine did.")
@click.option("--once", is_flag=True, help="End after the first stream.")
@axis_option
@variant_option
@set_option
@plugins_option
@grouped(chosen=ChosenLesson, buffer=BufferOptions)
def machine(
    chosen: ChosenLesson, port: int, host: str, buffer: BufferOptions, out: Path | None, once: bool, axis_texts: tuple[str, ...]
) -> int:
    """Be the servo side of LESSON's machine: take set-points over TCP, move, and send feedback over UDP.

    When the buffer runs empty the tool holds its place, or with --elastic RHO it slows down before, on its path: the playback rate changes
    by at most RHO a period. Ctrl-C ends it; what was recorded is kept.
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
