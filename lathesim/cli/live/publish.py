"""``lathesim publish LESSON``: the simulated machine as real ones look, over OPC UA and MTConnect."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.case_options import read_settings, set_option, variant_option
from lathesim.cli.live.live_options import STOPPED, host_option
from lathesim.cli.options import plugins_option
from lathesim.cli.registry import open_registry


@click.command()
@click.argument("lesson")
@click.option("--opcua", type=click.IntRange(1, 65535), metavar="PORT", help="Publish as an OPC UA server with the names of OPC 40502.")
@click.option("--mtconnect", type=click.IntRange(0, 65535), metavar="PORT", help="Publish as an MTConnect agent.")
@click.option("--shdr", type=click.IntRange(1, 65535), metavar="PORT", help="With --mtconnect: send the same as SHDR lines.")
@click.option("--play", type=click.Path(path_type=Path), metavar="FILE", help="Publish this recording of the machine, not a simulation.")
@click.option("--rate", metavar="100Hz", help="How often values are published [default: as often as the machine has them].")
@click.option("--laps", type=click.IntRange(0), default=0, help="End after so many runs [default: Ctrl-C ends it].")
@click.option("--gap", metavar="EVERY:LENGTH", help="Publish nothing for LENGTH at the end of every EVERY, as 10s:0.5s.")
@click.option("--burst", metavar="TIME", help="Hold values back and publish them together, as 1s.")
@click.option("--clock-jump", metavar="AT:BY", help="Let the clock of the time stamps jump, as 20s:-3s.")
@host_option
@variant_option
@set_option
@plugins_option
def publish(
    lesson: str,
    opcua: int | None,
    mtconnect: int | None,
    shdr: int | None,
    play: Path | None,
    rate: str | None,
    laps: int,
    gap: str | None,
    burst: str | None,
    clock_jump: str | None,
    host: str,
    variant: str | None,
    settings: tuple[str, ...],
    plugin_folders: tuple[Path, ...],
) -> int:
    """Publish what LESSON's machine does, again and again, as a machine on the shop floor would.

    Values of one instant belong together and have one time stamp, that of the source. Faults come on demand: gaps, values that are held
    back, a clock that jumps. 'lathesim record' takes it down again.
    """
    from dataclasses import replace

    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare
    from lathesim.live.opcua.cnc_names import published_names
    from lathesim.live.publishing import Places, publish_all
    from lathesim.live.sources.until_stopped import run_until_stopped
    from lathesim.live.watching.lap import Faults, recorded_lap, simulated_lap

    if opcua is None and mtconnect is None:
        raise click.UsageError("Say where to publish: --opcua PORT, --mtconnect PORT, or both.")
    registry = open_registry(plugin_folders)
    prepared = prepare(load_lesson(lesson), registry, variant, read_settings(settings))
    lap = simulated_lap(prepared) if play is None else recorded_lap(prepared, play, registry)
    if rate is not None:
        lap = lap.sampled(_quantity(rate, "Hz"))
    faults = Faults()
    if gap is not None:
        faults = replace(faults, gap_every=_pair(gap, "--gap")[0], gap=_pair(gap, "--gap")[1])
    if burst is not None:
        faults = replace(faults, burst=_quantity(burst, "s"))
    if clock_jump is not None:
        faults = replace(faults, jump_at=_pair(clock_jump, "--clock-jump")[0], jump=_pair(clock_jump, "--clock-jump")[1])
    names = published_names(prepared.machinery, lap.signals)
    places = Places(host, opcua, mtconnect, shdr)
    click.echo(f"{lap.name}: {len(lap.signals)} channels at {1.0 / lap.period:g} Hz, a run of {len(lap) * lap.period:.3g} s.", err=True)
    rows, stopped = run_until_stopped(lambda stop: publish_all(lap, faults, laps, names, places, stop, _told))
    click.echo(f"{max(rows)} instants were published.")
    return STOPPED if stopped else 0


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
