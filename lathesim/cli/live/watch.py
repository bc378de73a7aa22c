"""``lathesim watch LESSON SOURCE...``: a diagnosis that runs with the machine."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, grouped, plugins_option, variant_option

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.live.watching.verdict import WatchEvent


@dataclass(frozen=True)
class WatchOptions:
    """How long is learnt, summed up, kept and diagnosed, and what is said."""

    learn: str
    block: str
    window: str
    validate_with: int
    tolerances: tuple[str, ...]
    at_most: str
    no_diagnosis: bool


@click.command()
@click.argument("lesson")
@click.argument("sources", nargs=-1, required=True, metavar="SOURCE...")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@click.option("--learn", default="60 s", show_default=True, metavar="TIME", help="How long what is usual is learnt.")
@click.option("--block", default="0.2 s", show_default=True, metavar="TIME", help="Over how long residuals are summed up.")
@click.option("--window", default="20 s", show_default=True, metavar="TIME", help="How much of the stream a diagnosis gets.")
@click.option("--validate-with", type=click.IntRange(0, 20), default=0, metavar="N", help="Judge on N further windows [default: its half].")
@click.option("--tolerance", "tolerances", multiple=True, metavar="CHANNEL=5um", help="Say when a drift of this channel reaches it.")
@click.option("--at-most", default="120 s", show_default=True, metavar="TIME", help="How long a diagnosis may take.")
@click.option("--no-diagnosis", is_flag=True, help="Tell changes and drifts only.")
@click.option("--json-lines", is_flag=True, help="Write each event as a line of JSON (schema lathesim-watch/1) and nothing else.")
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where windows and answers go.")
@variant_option
@plugins_option
@grouped(chosen=ChosenLesson, watching=WatchOptions)
def watch(
    chosen: ChosenLesson, sources: tuple[str, ...], map_file: Path | None, watching: WatchOptions, json_lines: bool, out: Path | None
) -> int:
    """Watch a machine: say when it began to differ from LESSON, where, and what that is.

    SOURCE is an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port), the servo side of 'lathesim machine'
    (tcp://host:port), a pipe of lines as halsampler writes them (-, or its name), or recordings, one after another. What is usual is learnt
    first. Then a change or a drift is told with its time and place, and the window around it is diagnosed in the background.
    Values may move within what the lesson calls uncertain. Faults of the recording are told as such. Ctrl-C ends it.
    """
    from lathesim.lessons.lesson import results_folder
    from lathesim.live.opening import live, open_source
    from lathesim.live.samples import run_until_stopped
    from lathesim.live.watching.watch_session import WatchSession, WatchSettings
    from lathesim.units import quantity

    registry, prepared = chosen.registry, chosen.prepared
    settings = WatchSettings(
        learn=quantity(watching.learn, "s"),
        block=quantity(watching.block, "s"),
        window=quantity(watching.window, "s"),
        patience=quantity(watching.at_most, "s"),
        validation_windows=watching.validate_with,
        tolerance=_tolerances(watching.tolerances, prepared),
        folder=out or results_folder(prepared.case.lesson, variant=chosen.variant),
        diagnose=not watching.no_diagnosis,
        plugins=chosen.plugin_folders,
        waits=not live(sources),
    )
    source = open_source(sources, map_file, prepared, registry)
    session = WatchSession(prepared, registry, source, settings, _json_line if json_lines else _line)
    _, stopped = run_until_stopped(session.run)
    return STOPPED if stopped else 0


def _line(event: WatchEvent) -> None:
    click.echo(event.sentence)


def _json_line(event: WatchEvent) -> None:
    line = {"schema": "lathesim-watch/1", "event": event.kind, "time_s": event.time, "sentence": event.sentence, **event.data}
    click.echo(json.dumps(line, default=float))


def _tolerances(texts: tuple[str, ...], prepared: Prepared) -> dict[str, float]:
    from lathesim.live.opening import lesson_signals
    from lathesim.live.samples import LiveError
    from lathesim.units import quantity

    units = {signal.name: signal.unit for signal in lesson_signals(prepared)}
    found = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise click.UsageError(f"--tolerance {text}: write it as --tolerance x_scale.position=5um.")
        if name not in units:
            from lathesim.errors import nearest

            raise LiveError(f"the lesson has no channel '{name}'.", remedy=nearest(name, units) or f"It has {', '.join(units)}.")
        found[name] = quantity(value, units[name])
    return found
