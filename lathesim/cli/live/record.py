"""``lathesim record URL``: what a machine publishes, written to a record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, grouped, json_option, open_registry, plugins_option, variant_option
from lathesim.cli.progress import time_bar
from lathesim.cli.writing import CommandResult, write
from lathesim.whole_file import write_text

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.live.recording_run import Noted


_FIRST = 10
"""Gaps and notes that are listed."""


@dataclass(frozen=True)
class RecordOptions:
    """What is recorded, for how long, and how often the source is asked."""

    map_file: Path | None
    duration: str
    interval: str
    queue: int


@click.command()
@click.argument("url", metavar="URL")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@click.option("--for", "duration", default="10min", show_default=True, metavar="TIME", help="How long to record.")
@click.option("--out", type=OutputPath(), required=True, metavar="R.h5", help="Where the record goes.")
@click.option("--lesson", metavar="LESSON", help="Write the lesson with its mapping beside the record, so that 'diagnose' works next.")
@click.option("--interval", default="0 s", show_default=True, metavar="TIME", help="Sampling asked for; 0 s: as often as there is news.")
@click.option("--queue", type=click.IntRange(1, 100_000), default=5000, show_default=True, help="Values the server is asked to queue.")
@variant_option
@json_option("lathesim-record/1", "what was found")
@plugins_option
@grouped(reading=RecordOptions)
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
    if every > 0.0 and noted.period > 1.5 * every:
        source.remarks.append(f"values come every {in_unit(noted.period, 'ms')}, and {in_unit(every, 'ms')} was asked for")
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
