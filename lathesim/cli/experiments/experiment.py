"""``lathesim experiment LESSON [DIAGNOSIS.json] --out DIR``: the next part program, the one that tells most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.case_options import variant_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.experiments.design.prediction import Foretold


_LONGEST = 3600.0
"""Longest program [s] that is designed."""


@click.command()
@click.argument("lesson")
@click.argument("diagnosis", required=False, type=click.Path(path_type=Path), metavar="[DIAGNOSIS.json|EMULATION.json]")
@click.option("--between", metavar="EFFECT@PART,...", help="The rivals; 'nothing' is one of them: the machine as the lesson has it.")
@click.option("--for", "wanted", multiple=True, metavar="PART.NAME,...", help="Values to be known as well as possible, instead of rivals.")
@click.option("--criterion", type=click.Choice(("D", "A", "E", "V")), default="D", show_default=True, help="What is made best with --for.")
@click.option("--rate", metavar="FREQUENCY", help="How often the recording takes a row, with --for [default: as the lesson says].")
@click.option("--at-most", default="30 s", show_default=True, metavar="TIME", help="How long the program may last.")
@click.option("--programs", type=click.IntRange(min=4), default=100, show_default=True, help="How many programs are tried.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Which programs these are.")
@click.option("--rounds", type=click.IntRange(min=1), metavar="N", help="Design, run on --machine, diagnose, and again, N times at most.")
@click.option("--machine", metavar="LESSON", help="The lesson that plays the real machine, for --rounds.")
@click.option("--no-trial", is_flag=True, help="Do not run the diagnosis on simulated recordings of each rival.")
@click.option(
    "--without",
    "left_out",
    multiple=True,
    type=click.Choice(("average", "refit", "price", "floor")),
    help="Leave a step of the design out, to see what it is good for: the program gets worse.",
)
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="Where program and lesson go.")
@click.option("--json", "as_json", is_flag=True, help="Print the prediction (schema lathesim-experiment/1) and nothing else.")
@variant_option
@plugins_option
def experiment(
    lesson: str,
    diagnosis: Path | None,
    between: str | None,
    wanted: tuple[str, ...],
    criterion: str,
    rate: str | None,
    at_most: str,
    programs: int,
    seed: int,
    rounds: int | None,
    machine: str | None,
    no_trial: bool,
    left_out: tuple[str, ...],
    out: Path,
    as_json: bool,
    variant: str | None,
    plugin_folders: tuple[Path, ...],
) -> int:
    """Write the next part program for the machine of LESSON: the one whose run is expected to tell most for its seconds.

    Rivals come from --between, or from what a diagnosis left tied. Each is refitted to the others, over what the lesson calls uncertain.
    DIR gets program.nc, lesson.yaml to diagnose the run with, prediction.json and experiment.png. Ctrl-C keeps the best program so far.
    """
    import contextlib
    import json

    from lathesim.cli.progress import interruptible
    from lathesim.errors import LatheSimError, UnitError
    from lathesim.experiments.design.discrimination import Conditions
    from lathesim.experiments.design.experiment import Wish, design_experiment
    from lathesim.experiments.design.experiment_files import as_json as json_of
    from lathesim.experiments.design.experiment_files import told_lines, write_experiment, write_program_and_lesson
    from lathesim.experiments.design.prediction import tried_design
    from lathesim.experiments.design.rivals import named_between, named_in_diagnosis
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.results_folder import keep_read_lesson
    from lathesim.units import quantity

    try:
        limit = quantity(at_most, "s")
    except UnitError as error:
        raise UnitError(error.fact, place="--at-most", remedy=error.remedy) from None
    if limit < 2.0:
        raise LatheSimError(f"a program of {limit:g} s is too short to tell anything.", place="--at-most", remedy="Allow 2 s or more.")
    if (between is not None) + bool(wanted) + (diagnosis is not None and not wanted) != 1:
        raise click.UsageError("Name the rivals with --between, give a DIAGNOSIS.json, or name values with --for: one of the three.")
    if limit > _LONGEST:
        raise LatheSimError(f"a program of {limit:g} s is too long to be designed.", place="--at-most", remedy="Allow an hour or less.")
    per_second = quantity(rate, "Hz") if rate else 0.0
    if rate and per_second <= 0.0:
        raise LatheSimError(
            f"a recording cannot take a row {per_second:g} times a second.", place="--rate", remedy="Give a rate above 0 Hz."
        )
    loaded = load_lesson(lesson)
    keep_read_lesson(loaded, out)
    registry = open_registry(plugin_folders)
    wish = Wish(
        limit,
        programs,
        seed=seed,
        conditions=Conditions(*(name not in left_out for name in ("average", "refit", "price", "floor"))),
        rate=per_second,
    )

    def say(sentence: str) -> None:
        if not as_json:
            click.echo(sentence, err=True)

    if wanted:
        from lathesim.experiments.design.aims import before_design
        from lathesim.experiments.design.precision import design_for_precision, precision_lines, write_precision

        before = before_design(diagnosis, loaded) if diagnosis is not None else None
        names = [name.strip() for text in wanted for name in text.split(",") if name.strip()]
        with interruptible() as stop:
            precise = design_for_precision(loaded, names, registry, wish, criterion, variant, say, stop, before)
        told = write_precision(precise, out)
        click.echo(json.dumps(told, indent=2) if as_json else "\n".join(precision_lines(precise, out)))
        return 130 if precise.stopped else 0
    named = named_between(between) if between is not None else named_in_diagnosis(diagnosis or Path(), loaded.title)
    place = "--between" if between is not None else str(diagnosis)
    if rounds is not None:
        from lathesim.experiments.sequence import run_rounds

        if machine is None:
            raise click.UsageError("--rounds runs its programs on a machine: name the lesson that plays it with --machine.")
        with interruptible() as stop:
            ran = run_rounds(loaded, load_lesson(machine), named, registry, wish, rounds, out, place, say, stop)
        for number, item in enumerate(ran.rounds, 1):
            click.echo(f"Round {number}: {item.seconds:.1f} s, {item.verdict} {', '.join(item.named)}".rstrip())
        click.echo(f"{ran.ended} {ran.seconds:.1f} s of programs in all.")
        return 0
    with interruptible() as stop:
        found = design_experiment(loaded, named, registry, wish, variant, place, say, stop)
        write_program_and_lesson(found, out)
        foretold: list[Foretold] = []
        if not no_trial and not found.stopped and found.decidable:
            with contextlib.suppress(KeyboardInterrupt):
                found, foretold = tried_design(found, lambda design: write_program_and_lesson(design, out), registry, seed, say)
    click.echo(json.dumps(json_of(found, foretold), indent=2) if as_json else "\n".join(told_lines(found, foretold, out)))
    write_experiment(found, foretold, out)
    return 130 if found.stopped else 0
