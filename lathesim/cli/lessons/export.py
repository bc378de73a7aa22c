"""``lathesim export RUN.h5 FILE``: a record for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from lathesim.cli.output_path import OutputPath


@click.command(name="export")
@click.argument("run", type=click.Path(path_type=Path), metavar="RUN.h5")
@click.argument("file", type=OutputPath(), metavar="F.csv|F.mat")
@click.argument("channels", nargs=-1, metavar="[CHANNEL ...]")
def export(run: Path, file: Path, channels: tuple[str, ...]) -> int:
    """Write the record RUN.h5 as CSV or MAT file; some CHANNELs only, where they are named.

    The CSV has the header "time [s],x_axis.position [m],..." and every digit; it is also read back as a recording.
    """
    from lathesim.analysis.export import export as write
    from lathesim.record import Record, load

    record = load(run)
    if channels:
        record = Record(record.time, {name: record.channel(name) for name in channels}, record.meta)
    write(record, file)
    click.echo(f"{file}: {len(record)} instants of {len(record.channels)} channels.")
    return 0
