"""``lathesim publish LESSON``: the simulated machine as real ones look, over OPC UA and MTConnect."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, grouped, host_option, plugins_option, set_option, variant_option

if TYPE_CHECKING:
    from lathesim.live.publishing import Faults


@dataclass(frozen=True)
class ServerOptions:
    """Where values are published."""

    host: str
    opcua: int | None
    mtconnect: int | None
    shdr: int | None


@dataclass(frozen=True)
class FaultOptions:
    """The faults that are made on demand."""

    gap: str | None
    burst: str | None
    clock_jump: str | None


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
@grouped(chosen=ChosenLesson, servers=ServerOptions, made=FaultOptions)
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
