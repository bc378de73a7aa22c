"""``lathesim record URL``: what a machine publishes, written to a record."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.case_options import variant_option
from lathesim.cli.live.live_options import STOPPED
from lathesim.cli.options import plugins_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry
from lathesim.whole_file import write_text

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.live.recording.recording_run import Noted


@click.command()
@click.argument("url", metavar="URL")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@click.option("--for", "duration", default="10min", show_default=True, metavar="TIME", help="How long to record.")
@click.option("--out", type=OutputPath(), required=True, metavar="R.h5", help="Where the record goes.")
@click.option("--lesson", metavar="LESSON", help="Write the lesson with its mapping beside the record, so that 'diagnose' works next.")
@click.option("--interval", default="0 s", show_default=True, metavar="TIME", help="Sampling asked for; 0 s: as often as there is news.")
@click.option("--queue", type=click.IntRange(1, 100_000), default=5000, show_default=True, help="Values the server is asked to queue.")
@variant_option
@click.option("--json", "as_json", is_flag=True, help="Write what was found as JSON (schema lathesim-record/1) and nothing else.")
@plugins_option
def record(
    url: str,
    map_file: Path | None,
    duration: str,
    out: Path,
    lesson: str | None,
    interval: str,
    queue: int,
    variant: str | None,
    as_json: bool,
    plugin_folders: tuple[Path, ...],
) -> int:
    """Record what an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port) or a servo side (tcp://host:port) sends.

    With --lesson, URL may also be - or a named pipe of lines as halsampler writes them.

    MAP.yaml has 'channels: {x_scale.position: {path: CncAxisList/x_axis/PosDirect/ActPos, unit: mm}}', 'node:' for a node id and 'item:'
    for a data item of MTConnect. With --lesson and without --map the names of OPC 40502 and of the channels are looked for. Times are those
    of the source; gaps, restarts and lost values are kept in the record. Ctrl-C ends it and keeps what came.
    """
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.live.recording.recording_run import record as take_down
    from lathesim.live.sources.opening import open_machine, open_source
    from lathesim.live.sources.pipe_source import is_pipe
    from lathesim.live.sources.until_stopped import run_until_stopped
    from lathesim.units import quantity

    seconds, every = quantity(duration, "s"), quantity(interval, "s")
    registry = open_registry(plugin_folders)
    prepared = None if lesson is None else prepare(load_lesson(lesson), registry, variant)
    piped = prepared is not None and is_pipe(url)
    source: Any = (
        open_source([url], map_file, prepared, registry) if piped and prepared else open_machine(url, map_file, prepared, every, queue)
    )
    with click.progressbar(length=max(1, int(10 * seconds)), label="recording", show_pos=False) if not as_json else _Silent() as bar:
        noted, stopped = run_until_stopped(lambda stop: take_down(source, out, seconds, stop, _Steps(bar), _notice))
    if not noted.samples:
        from lathesim.live.sources.samples import LiveError

        raise LiveError(f"nothing came from {url} in {seconds:g} s.", remedy="Is the machine running?")
    if every > 0.0 and noted.period > 1.5 * every:
        source.remarks.append(f"values come every {1e3 * noted.period:.4g} ms, and {1e3 * every:.4g} ms was asked for")
    written = None if prepared is None else _write_lesson(prepared, [signal.name for signal in source.signals], out, variant)
    if as_json:
        result = {"schema": "lathesim-record/1", "out": str(out), "lesson": written, "remarks": source.remarks, **noted.as_json()}
        click.echo(json.dumps(result, indent=2))
    else:
        _tell(noted, source.remarks, out, written)
    return STOPPED if stopped else 0


class _Silent:
    def __enter__(self) -> None:
        return None

    def __exit__(self, *error: object) -> None:
        return None


class _Steps:
    """Moves a bar in tenths of a second."""

    def __init__(self, bar: Any) -> None:
        self._bar, self._done = bar, 0

    def __call__(self, seconds: float) -> None:
        steps = int(10 * seconds)
        if self._bar is not None and steps > self._done:
            self._bar.update(steps - self._done)
        self._done = max(self._done, steps)


def _notice(sentence: str) -> None:
    """Write a note of the source at once, on a line of its own beside the progress bar."""
    click.echo(f"\nNote: {sentence}.", err=True)


def _write_lesson(prepared: Prepared, recorded: list[str], out: Path, variant: str | None) -> str:
    from lathesim.lessons.changed_lesson import changed_lesson
    from lathesim.live.recording.record_mapping import recordings_for

    place = out.with_name(f"{out.stem}_lesson.yaml")
    further = {"recordings": recordings_for(prepared, recorded)}
    write_text(place, changed_lesson(prepared.case.lesson, [], {}, place.parent, variant=variant, further=further))
    return str(place)


def _tell(noted: Noted, remarks: list[str], out: Path, written: str | None) -> None:
    rate = f" at {1.0 / noted.period:.4g} Hz" if noted.period > 0.0 else ""
    click.echo(f"{noted.samples} instants{rate} are in {out}; {noted.status}.")
    for begin, end, count in noted.gaps[:10]:
        click.echo(f"Gap: {count} samples are missing between {begin:.4f} s and {end:.4f} s.")
    if len(noted.gaps) > 10:
        click.echo(f"... and {len(noted.gaps) - 10} gaps more; {noted.lost} samples are missing in all.")
    for time, sentence in noted.notes[:10]:
        click.echo(f"At {time:.3f} s: {sentence}.")
    for remark in remarks:
        click.echo(f"Note: {remark}.")
    if noted.doubled:
        click.echo(f"{noted.doubled} instants came again, or out of order, and were left out.")
    if written is not None:
        click.echo(f"The lesson with its mapping is {written}. Next: lathesim diagnose {written} {out}")
