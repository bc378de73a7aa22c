"""``lathesim emulate LESSON RECORDING... --out DIR``: a closed machine learnt from way-points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from lathesim.cli.options import (
    STOPPED,
    ChosenLesson,
    OutputPath,
    cluster_at,
    cluster_option,
    grouped,
    json_option,
    of_lesson,
    option,
    read_names,
)
from lathesim.cli.progress import interruptible, said_beside
from lathesim.cli.writing import CommandResult, write


@dataclass(frozen=True)
class EmulateOptions:
    """How the machine is learnt, and what of it."""

    method: str = option(
        "Least squares, the genetic algorithm as published, differential evolution, or CMA-ES.",
        type=click.Choice(("replay", "genetic", "evolution", "cma")),
        default="replay",
    )
    weight: float = option("Weight of recorded speeds in Q [s^2].", "--lambda", type=click.FloatRange(min=0.0), default=0.0)
    free: tuple[str, ...] = option("What is learnt [default: what the lesson calls uncertain].", metavar="PART.NAME,...")
    factor: float | None = option(
        "Values stay within 1/FACTOR to FACTOR of the given ones [default: 4; 2 for populations].",
        "--bounds",
        type=click.FloatRange(min=1.01),
    )
    population: int = option("Size of a population.", type=click.IntRange(min=8), default=50)
    generations: int = option("How many populations.", type=click.IntRange(min=1), default=100)
    seed: int = option("Which random numbers the populations take.", type=click.IntRange(min=0), default=1)
    keep_structure: bool = option("Change values only: insert no effect, replace no part.")


@click.command()
@click.argument("lesson")
@click.argument("recordings", nargs=-1, required=True, metavar="[PROGRAM=]RECORDING...")
@click.option(
    "--validate", "validate", multiple=True, metavar="[PROGRAM=]FILE", help="Way-points of a program that is not fitted, to judge on."
)
@grouped(learning=EmulateOptions)
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="Where lesson and report go.")
@json_option("lathesim-emulation/1")
@cluster_option
@of_lesson
def emulate(
    chosen: ChosenLesson, learning: EmulateOptions, recordings: tuple[str, ...], validate: tuple[str, ...], out: Path, as_json: bool,
    cluster: str | None,
) -> int:  # fmt: skip
    """Learn the machine of LESSON from way-points of its programs, and say what they cannot tell.

    A recording may be uneven in time and as slow as 10 Hz. PROGRAM is a variant of the lesson or a part program. Without PROGRAM, a file
    with the name of a variant or program is a run of that one. DIR gets lesson.yaml, which runs, report.html and emulation.json. Ctrl-C
    keeps the best machine so far.
    """
    from lathesim.experiments.emulation import EmulationQuestion
    from lathesim.experiments.emulation import emulate as learn
    from lathesim.experiments.emulation_report import as_json as as_json_of
    from lathesim.experiments.emulation_report import told_lines, write_emulation
    from lathesim.experiments.objective import Effort
    from lathesim.lessons.lesson import keep_read_lesson

    question = EmulationQuestion(
        learning.method,
        learning.weight,
        learning.factor or (4.0 if learning.method == "replay" else 2.0),
        tuple(read_names(learning.free)),
        not learning.keep_structure,
        Effort(learning.population, learning.generations),
        learning.seed,
    )
    keep_read_lesson(chosen.loaded, out)

    with interruptible() as stop, cluster_at(cluster, chosen.registry.plugins) as workers:
        found = learn(chosen.loaded, recordings, validate, chosen.registry, question, said_beside(as_json), stop, workers)
    write(CommandResult("lathesim-emulation/1", as_json_of(found), told_lines(found)), as_json)
    places = write_emulation(found, out)
    if not as_json:
        click.echo(f"\nThe lesson is {places['lesson']}, the report {places['report']}")
    return STOPPED if found.search.stopped else 0
