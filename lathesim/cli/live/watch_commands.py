"""``lathesim twin`` and ``watch``: the simulation, or a diagnosis, beside a machine that runs."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, cluster_at, cluster_option, grouped, of_variant, option

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.live.samples import Source
    from lathesim.live.twin import Twin, TwinLine
    from lathesim.live.watching.watch_verdict import WatchEvent


_BAR = 21


@dataclass(frozen=True)
class TwinOptions:
    """What is shown beside the machine and how often, and what is kept."""

    map_file: Path | None = option("Which node or data item is which channel.", "--map", metavar="MAP.yaml")
    every: str = option("How often a line is shown.", default="0.5 s", metavar="TIME")
    scale: str | None = option("Difference that fills the bar [default: the largest so far].", metavar="5um")
    out: Path | None = option("Keep references, executed and simulated channels.", type=OutputPath(), metavar="R.h5")
    fast: bool = option("Show a recording as fast as it can be read, not at its own times.")
    plain: bool = option("Write lines of text also where the output is a terminal.")


@click.command()
@click.argument("lesson")
@click.argument("source", metavar="SOURCE")
@grouped(showing=TwinOptions)
@of_variant
def twin(chosen: ChosenLesson, source: str, showing: TwinOptions) -> int:
    """Run LESSON's simulation beside a machine and show both: reference, executed, simulated, and their difference magnified.

    In a terminal both are drawn, path and surface, with the fill of the buffer; elsewhere, and with --plain, a line of text is written.

    SOURCE is an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port) or a servo side (tcp://host:port). It may also
    be a pipe of lines as halsampler writes them (-, or its name), or a recording, which is played again at its own times. Ctrl-C ends it
    and keeps what was recorded with --out.
    """
    import sys

    from lathesim.live.opening import live, open_source
    from lathesim.live.samples import run_until_stopped
    from lathesim.live.twin import Twin
    from lathesim.units import quantity

    registry, prepared = chosen.registry, chosen.prepared
    opened = open_source([source], showing.map_file, prepared, registry)
    drawn = not showing.plain and sys.stdin.isatty() and sys.stdout.isatty()
    shown = Twin(prepared, opened, showing.out, every=quantity(showing.every, "s"), pace=not live([source]) and not showing.fast)
    if drawn:
        return _on_screen(shown, opened, prepared.name, showing.out)
    lines = _Lines(None if showing.scale is None else quantity(showing.scale, "m"))
    status, stopped = run_until_stopped(lambda stop: shown.run(stop, lines.show))
    _say_end(shown, status, showing.out)
    return STOPPED if stopped else 0


def _say_end(shown: Twin, status: str, out: Path | None) -> None:
    click.echo(f"{shown.samples} samples; {status}.")
    if out is not None:
        click.echo(f"Reference, executed and simulated channels are in {out}. Draw them with: lathesim plot {out}")


def _on_screen(shown: Twin, source: Source, title: str, out: Path | None) -> int:
    """Draw the twin in the terminal until its source ends or a person leaves."""
    from lathesim.tui.twin_app import TwinApp

    app = TwinApp(shown, f"{title} at {source.name}", lambda: getattr(source, "fill", None))
    app.run()
    if app.fault is not None:
        raise app.fault
    _say_end(shown, app.status or "stopped", out if shown.samples else None)
    return 0


class _Lines:
    """Writes a line for each moment: the first compared position as a bar, every channel's largest difference as a number."""

    def __init__(self, scale: float | None) -> None:
        self._given = scale
        self._scale = scale or 0.0

    def show(self, line: TwinLine) -> None:
        """Write a line."""
        from lathesim.analysis.display_unit import shown_with_unit as shown

        name, unit, reference, executed, simulated = line.axes[0]
        largest = line.largest[name]
        if self._given is None:
            self._scale = max(self._scale, largest, 1e-12)
        place = round((1.0 + max(-1.0, min(1.0, (executed - simulated) / self._scale))) / 2.0 * (_BAR - 1))
        bar = "".join("|" if at == place else "+" if at == _BAR // 2 else "." for at in range(_BAR))
        rest = ", ".join(f"{other} {shown(value, other_unit, 3)}" for other, other_unit, value in _largest(line))
        lost = f", {line.lost} samples lost" if line.lost else ""
        where = f"reference {shown(reference, unit, 5)}, executed {shown(executed, unit, 5)}, simulated {shown(simulated, unit, 5)}"
        click.echo(f"t = {line.time:8.2f} s  {where}  [{bar}] {shown(self._scale, unit, 2)}  largest: {rest}{lost}")


def _largest(line: TwinLine) -> list[tuple[str, str, float]]:
    units = {name: unit for name, unit, *_ in line.axes}
    return [(name, units[name], value) for name, value in line.largest.items()]


@dataclass(frozen=True)
class WatchOptions:
    """How long is learnt, summed up, kept and diagnosed, and what is said."""

    learn: str = option("How long what is usual is learnt.", default="60 s", metavar="TIME")
    block: str = option("Over how long residuals are summed up.", default="0.2 s", metavar="TIME")
    window: str = option("How much of the stream a diagnosis gets.", default="20 s", metavar="TIME")
    validate_with: int = option(
        "Judge on N further windows [default: its half].", type=click.IntRange(0, 20), default=0, metavar="N", show_default=False
    )
    tolerances: tuple[str, ...] = option("Say when a drift of this channel reaches it.", "--tolerance", metavar="CHANNEL=5um")
    at_most: str = option("How long a diagnosis may take.", default="120 s", metavar="TIME")
    no_diagnosis: bool = option("Tell changes and drifts only.")


@click.command()
@click.argument("lesson")
@click.argument("sources", nargs=-1, required=True, metavar="SOURCE...")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@grouped(watching=WatchOptions)
@click.option("--json-lines", is_flag=True, help="Write each event as a line of JSON (schema lathesim-watch/1) and nothing else.")
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where windows and answers go.")
@cluster_option
@of_variant
def watch(
    chosen: ChosenLesson, sources: tuple[str, ...], map_file: Path | None, watching: WatchOptions, json_lines: bool, out: Path | None,
    cluster: str | None,
) -> int:  # fmt: skip
    """Watch a machine: say when it began to differ from LESSON, where, and what that is.

    SOURCE is an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port) or a servo side (tcp://host:port). It may also
    be a pipe of lines as halsampler writes them (-, or its name), or recordings, one after another. What is usual is learnt first. Then a
    change or a drift is reported with its time and place, and the window around it is diagnosed in the background. Values may move within
    what the lesson calls uncertain. Faults of the recording are reported as such. Ctrl-C ends it.
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
    with cluster_at(cluster, registry.plugins) as workers:
        session = WatchSession(prepared, registry, source, replace(settings, cluster=workers), _json_line if json_lines else _line)
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
