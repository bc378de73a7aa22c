"""``lathesim twin LESSON SOURCE``: the simulation beside the machine, while it runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, grouped, plugins_option, variant_option

if TYPE_CHECKING:
    from lathesim.live.samples import Source
    from lathesim.live.twin import Twin, TwinLine

_BAR = 21


@click.command()
@click.argument("lesson")
@click.argument("source", metavar="SOURCE")
@click.option("--map", "map_file", type=click.Path(path_type=Path), metavar="MAP.yaml", help="Which node or data item is which channel.")
@click.option("--every", default="0.5 s", show_default=True, metavar="TIME", help="How often a line is shown.")
@click.option("--scale", metavar="5um", help="Difference that fills the bar [default: the largest so far].")
@click.option("--out", type=OutputPath(), metavar="R.h5", help="Keep references, executed and simulated channels.")
@click.option("--fast", is_flag=True, help="Show a recording as fast as it can be read, not at its own times.")
@click.option("--plain", is_flag=True, help="Write lines of text also where the output is a terminal.")
@variant_option
@plugins_option
@grouped(chosen=ChosenLesson)
def twin(
    chosen: ChosenLesson,
    source: str,
    map_file: Path | None,
    every: str,
    scale: str | None,
    out: Path | None,
    fast: bool,
    plain: bool,
) -> int:
    """Run LESSON's simulation beside a machine and show both: reference, executed, simulated, and their difference magnified.

    In a terminal both are drawn, path and surface, with the fill of the buffer; elsewhere, and with --plain, a line of text is written.

    SOURCE is an OPC UA server (opc.tcp://host:port), an MTConnect agent (http://host:port), the servo side of 'lathesim machine'
    (tcp://host:port), a pipe of lines as halsampler writes them (-, or its name), or a recording, which is played again at its own times.
    Ctrl-C ends it and keeps what was recorded with --out.
    """
    import sys

    from lathesim.live.opening import live, open_source
    from lathesim.live.samples import run_until_stopped
    from lathesim.live.twin import Twin
    from lathesim.units import quantity

    registry, prepared = chosen.registry, chosen.prepared
    opened = open_source([source], map_file, prepared, registry)
    drawn = not plain and sys.stdin.isatty() and sys.stdout.isatty()
    shown = Twin(prepared, opened, out, every=quantity(every, "s"), pace=not live([source]) and not fast)
    if drawn:
        return _on_screen(shown, opened, prepared.name, out)
    lines = _Lines(None if scale is None else quantity(scale, "m"))
    status, stopped = run_until_stopped(lambda stop: shown.run(stop, lines.show))
    click.echo(f"{shown.samples} samples; {status}.")
    if out is not None:
        click.echo(f"Reference, executed and simulated channels are in {out}. Draw them with: lathesim plot {out}")
    return STOPPED if stopped else 0


def _on_screen(shown: Twin, source: Source, title: str, out: Path | None) -> int:
    """Draw the twin in the terminal until its source ends or a person leaves."""
    from lathesim.tui.twin_app import TwinApp

    app = TwinApp(shown, f"{title} at {source.name}", lambda: getattr(source, "fill", None))
    app.run()
    if app.fault is not None:
        raise app.fault
    click.echo(f"{shown.samples} samples; {app.status or 'stopped'}.")
    if out is not None and shown.samples:
        click.echo(f"Reference, executed and simulated channels are in {out}. Draw them with: lathesim plot {out}")
    return 0


class _Lines:
    """Writes a line for each moment: the first compared position as a bar, every channel's largest difference as a number."""

    def __init__(self, scale: float | None) -> None:
        self._given = scale
        self._scale = scale or 0.0

    def show(self, line: TwinLine) -> None:
        """Write a line."""
        from lathesim.units import shown

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
