"""``lathesim isolable LESSON``: what a recording could tell, before it is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from lathesim.cli.options import ChosenLesson, grouped, json_option, of_variant, option, read_names, save_option
from lathesim.cli.progress import steps
from lathesim.cli.writing import CommandResult, write


@dataclass(frozen=True)
class RecordingMeans:
    """With what is recorded."""

    recording: Path | None
    sensors: tuple[str, ...] = option("What is recorded [default: what the lesson compares].", metavar="PART.OUTPUT,...")
    rate: str | None = option("How often a row is taken [default: as the lesson says].", metavar="FREQUENCY")
    program: Path | None = option("Another part program.", metavar="FILE")
    only: tuple[str, ...] = option("Ask about these effects only.", "--effect", metavar="NAME")


@click.command()
@click.argument("lesson")
@click.argument("recording", required=False, type=click.Path(path_type=Path))
@grouped(means=RecordingMeans)
@json_option("lathesim-isolation/1")
@save_option("Draw the matrix.")
@of_variant
def isolable(chosen: ChosenLesson, means: RecordingMeans, as_json: bool, save: Path | None) -> int:
    """Show which effects a recording of LESSON would reveal from which size on, and which it could not tell apart.

    The lesson is run with its sensors, their noise and their steps. With RECORDING, one of the machine as it is, that gives the command and
    the noise. Each effect of the catalogue is then held against all others, with the limits of 'diagnose'.
    """
    from lathesim.diagnosis.reporting.isolation_report import isolation_figure
    from lathesim.experiments.isolable import Means
    from lathesim.experiments.isolable import isolable as answer
    from lathesim.units import quantity

    rate = quantity(means.rate, "Hz") if means.rate else 0.0
    if means.rate and rate <= 0.0:
        raise click.UsageError("--rate: a recording takes more than no rows a second.")
    wanted = Means(tuple(read_names(means.sensors)), rate, means.program, means.recording, means.only)
    with steps(shown=not as_json, first="reading the lesson") as tell:
        found = answer(chosen.loaded, chosen.registry, wanted, chosen.variant, tell)
    title = f"{chosen.loaded.title}: what {', '.join(found.sensors)} could tell"
    result = CommandResult("lathesim-isolation/1", found.as_json(), found.lines(), lambda: isolation_figure(found.found, title))
    return write(result, as_json, save)
