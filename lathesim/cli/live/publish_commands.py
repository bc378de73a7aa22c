"""``lathesim publish`` and ``record``: a simulated machine as real ones look, over OPC UA and MTConnect, and what a machine publishes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import (
    STOPPED,
    ChosenLesson,
    OutputPath,
    grouped,
    host_option,
    json_option,
    of_case,
    open_registry,
    option,
    plugins_option,
    variant_option,
)
from lathesim.cli.progress import time_bar
from lathesim.cli.writing import CommandResult, write
from lathesim.whole_file import write_text

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.live.publishing import Faults
    from lathesim.live.recording_run import Noted


@dataclass(frozen=True)
class ServerOptions:
    """Where values are published."""

    host: str
    opcua: int | None = option("Publish as an OPC UA server with the names of OPC 40502.", type=click.IntRange(1, 65535), metavar="PORT")
    mtconnect: int | None = option("Publish as an MTConnect agent.", type=click.IntRange(0, 65535), metavar="PORT")
    shdr: int | None = option("With --mtconnect: send the same as SHDR lines.", type=click.IntRange(1, 65535), metavar="PORT")


@dataclass(frozen=True)
class FaultOptions:
    """The faults that are made on demand."""

    gap: str | None = option("Publish nothing for LENGTH at the end of every EVERY, as 10s:0.5s.", metavar="EVERY:LENGTH")
    burst: str | None = option("Hold values back and publish them together, as 1s.", metavar="TIME")
    clock_jump: str | None = option("Let the clock of the time stamps jump, as 20s:-3s.", metavar="AT:BY")


@click.command()
@click.argument("lesson")
@grouped(servers=ServerOptions)
@click.option("--play", type=click.Path(path_type=Path), metavar="FILE", help="Publish this recording of the machine, not a simulation.")
@click.option("--rate", metavar="100Hz", help="How often values are published [default: as often as the machine has them].")
@click.option("--laps", type=click.IntRange(0), default=0, help="End after so many runs [default: Ctrl-C ends it].")
@grouped(made=FaultOptions)
@host_option
@of_case
def publish(chosen: ChosenLesson, servers: ServerOptions, made: FaultOptions, play: Path | None, rate: str | None, laps: int) -> int:
    """Publish what LESSON's machine does, again and again, as a machine on the shop floor would.

    Values of one instant belong together and have one time stamp, that of the source. Faults come on demand: gaps, values that are held
    back, a clock that jumps. 'lathesim record' takes it down again.
    """
    from lathesim.live.channel_names import published_names
    from lathesim.live.publishing import Places, publish_all, recorded_lap, simulated_lap
    from lathesim.live.samples import run_until_stopped

    if servers.opcua is None and servers.mtconnect is None:
        raise click.UsageError("Say where to publish: --opcua PORT, --mtconnect PORT, or both.")
    registry, prepared = chosen.registry, chosen.prepared
    lap = simulated_lap(prepared) if play is None else recorded_lap(prepared, play, registry)
    if rate is not None:
        lap = lap.sampled(_quantity(rate, "Hz"))
    faults = _faults(made)
    names = published_names(prepared.machinery, lap.signals)
    places = Places(servers.host, servers.opcua, servers.mtconnect, servers.shdr)
    click.echo(f"{lap.name}: {len(lap.signals)} channels at {1.0 / lap.period:g} Hz, a run of {len(lap) * lap.period:.3g} s.", err=True)
    rows, stopped = run_until_stopped(lambda stop: publish_all(lap, faults, laps, names, places, stop, _told))
    click.echo(f"{max(rows)} instants were published.")
    return STOPPED if stopped else 0


def _faults(made: FaultOptions) -> Faults:
    """Return the faults in SI."""
    from dataclasses import replace

    from lathesim.live.publishing import Faults

    faults = Faults()
    if made.gap is not None:
        every, length = _pair(made.gap, "--gap")
        faults = replace(faults, gap_every=every, gap=length)
    if made.burst is not None:
        faults = replace(faults, burst=_quantity(made.burst, "s"))
    if made.clock_jump is not None:
        at, by = _pair(made.clock_jump, "--clock-jump")
        faults = replace(faults, jump_at=at, jump=by)
    return faults


def _told(url: str) -> None:
    click.echo(f"Published at {url}; Ctrl-C ends it.", err=True)


def _quantity(text: str, unit: str) -> float:
    from lathesim.units import quantity

    return quantity(text, unit)


def _pair(text: str, option: str) -> tuple[float, float]:
    first, colon, second = text.partition(":")
    if not colon:
        raise click.UsageError(f"{option} {text}: write it as {option} 10s:0.5s.")
    return _quantity(first, "s"), _quantity(second, "s")


_FEWER = 1.5
"""Requested periods from which values come more seldom than was requested, assumed: half a period is the unrest of a network."""
_FIRST = 10
"""Gaps and notes that are listed."""


@dataclass(frozen=True)
class RecordOptions:
    """What is recorded, for how long, and how often the source is asked."""

    map_file: Path | None
    duration: str
    interval: str = option("Sampling period to request; 0 s: as often as values change.", default="0 s", metavar="TIME")
    queue: int = option("Number of values that the server should queue.", type=click.IntRange(1, 100_000), default=5000)


@click.command()
@click.argument("url", metavar="URL")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@click.option("--for", "duration", default="10min", show_default=True, metavar="TIME", help="How long to record.")
@click.option("--out", type=OutputPath(), required=True, metavar="R.h5", help="Where the record goes.")
@click.option("--lesson", metavar="LESSON", help="Write the lesson with its mapping beside the record, so that 'diagnose' works next.")
@grouped(reading=RecordOptions)
@variant_option
@json_option("lathesim-record/1", "what was found")
@plugins_option
def record(
    url: str, reading: RecordOptions, out: Path, lesson: str | None, variant: str | None, as_json: bool, plugin_folders: tuple[Path, ...]
) -> int:
    """Record what an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port) or a servo side (tcp://host:port) sends.

    With --lesson, URL may also be - or a named pipe of lines as halsampler writes them.

    MAP.yaml has 'channels: {x_scale.position: {path: CncAxisList/x_axis/PosDirect/ActPos, unit: mm}}', 'node:' for a node id and 'item:'
    for a data item of MTConnect. With --lesson and without --map the names of OPC 40502 and of the channels are looked for. Times are those
    of the source; gaps, restarts and lost values are kept in the record. Ctrl-C ends it and keeps what came.
    """
    from lathesim.live.opening import is_pipe, open_machine, open_source
    from lathesim.live.recording_run import record as take_down
    from lathesim.live.samples import run_until_stopped
    from lathesim.units import in_unit, quantity

    seconds, every = quantity(reading.duration, "s"), quantity(reading.interval, "s")
    registry = open_registry(plugin_folders)
    prepared = None if lesson is None else ChosenLesson(lesson, variant, plugin_folders=plugin_folders).prepared
    piped = prepared is not None and is_pipe(url)
    source: Any = (
        open_source([url], reading.map_file, prepared, registry)
        if piped and prepared
        else open_machine(url, reading.map_file, prepared, every, reading.queue)
    )
    with time_bar("recording", seconds, 10.0, shown=not as_json) as bar:
        noted, stopped = run_until_stopped(lambda stop: take_down(source, out, seconds, stop, bar, _notice))
    if not noted.samples:
        from lathesim.live.samples import LiveError

        raise LiveError(f"nothing came from {url} in {seconds:g} s.", remedy="Is the machine running?")
    if every > 0.0 and noted.period > _FEWER * every:
        source.remarks.append(f"values come every {in_unit(noted.period, 'ms')}, and {in_unit(every, 'ms')} was requested")
    written = None if prepared is None else _write_lesson(prepared, [signal.name for signal in source.signals], out, variant)
    data = {"out": out, "lesson": written, "remarks": source.remarks, **noted.as_json()}
    lines = _lines(noted, source.remarks, out, written)
    return write(CommandResult("lathesim-record/1", data, lines, code=STOPPED if stopped else 0), as_json)


def _notice(sentence: str) -> None:
    """Write a note of the source at once, on a line of its own beside the progress bar."""
    click.echo(f"\nNote: {sentence}.", err=True)


def _write_lesson(prepared: Prepared, recorded: list[str], out: Path, variant: str | None) -> str:
    from lathesim.lessons.changed_lesson import changed_lesson
    from lathesim.live.opening import recordings_for

    place = out.with_name(f"{out.stem}_lesson.yaml")
    further = {"recordings": recordings_for(prepared, recorded)}
    write_text(place, changed_lesson(prepared.case.lesson, [], {}, place.parent, variant=variant, further=further))
    return str(place)


def _lines(noted: Noted, remarks: list[str], out: Path, written: str | None) -> Iterator[str]:
    rate = f" at {1.0 / noted.period:.4g} Hz" if noted.period > 0.0 else ""
    yield f"{noted.samples} instants{rate} are in {out}; {noted.status}."
    for begin, end, count in noted.gaps[:_FIRST]:
        yield f"Gap: {count} samples are missing between {begin:.4f} s and {end:.4f} s."
    if len(noted.gaps) > _FIRST:
        yield f"... and {len(noted.gaps) - _FIRST} gaps more; {noted.lost} samples are missing in all."
    yield from (f"At {time:.3f} s: {sentence}." for time, sentence in noted.notes[:_FIRST])
    yield from (f"Note: {remark}." for remark in remarks)
    if noted.doubled:
        yield f"{noted.doubled} instants came again, or out of order, and were left out."
    if written is not None:
        yield f"The lesson with its mapping is {written}. Next: lathesim diagnose {written} {out}"
