"""``lathesim experiment LESSON [DIAGNOSIS.json] --out DIR``: the part program that separates two explanations best."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, grouped, of_variant, option, read_names
from lathesim.cli.progress import interruptible, said_beside
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from collections.abc import Callable

    from lathesim.experiments.design_experiment import DesignWish
    from lathesim.experiments.experiment_files import Foretold
    from lathesim.experiments.rivals import NamedRival


_LONGEST = 3600.0
"""Longest program [s] that is designed."""


@dataclass(frozen=True)
class AimOptions:
    """What the program is to tell: rivals apart, named or those a diagnosis left tied, or values."""

    diagnosis: Path | None
    between: str | None = option("The rivals; 'nothing' is one of them: the machine as the lesson has it.", metavar="EFFECT@PART,...")
    wanted: tuple[str, ...] = option("Values to be known as well as possible, instead of rivals.", "--for", metavar="PART.NAME,...")
    criterion: str = option("What is made best with --for.", type=click.Choice(("D", "A", "E", "V")), default="D")

    @property
    def place(self) -> str:
        """Where the rivals are named."""
        return "--between" if self.between is not None else str(self.diagnosis)


@dataclass(frozen=True)
class MeansOptions:
    """How long the program may last, how often it is recorded, and how many are tried."""

    left_out: tuple[str, ...]
    rate: str | None = option("How often the recording takes a row, with --for [default: as the lesson says].", metavar="FREQUENCY")
    at_most: str = option("How long the program may last.", default="30 s", metavar="TIME")
    programs: int = option("How many programs are tried.", type=click.IntRange(min=4), default=100)
    seed: int = option("Which programs these are.", type=click.IntRange(min=0), default=1)


@click.command()
@click.argument("lesson")
@click.argument("diagnosis", required=False, type=click.Path(path_type=Path), metavar="[DIAGNOSIS.json|EMULATION.json]")
@grouped(aim=AimOptions)
@grouped(means=MeansOptions)
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
@of_variant
def experiment(
    chosen: ChosenLesson,
    aim: AimOptions,
    means: MeansOptions,
    rounds: int | None,
    machine: str | None,
    no_trial: bool,
    out: Path,
    as_json: bool,
) -> int:
    """Write the next part program for the machine of LESSON: the one whose run is expected to tell most for its seconds.

    Rivals come from --between, or from what a diagnosis left tied. Each is refitted to the others, over what the lesson calls uncertain.
    DIR gets program.nc, lesson.yaml to diagnose the run with, prediction.json and experiment.png. Ctrl-C keeps the best program so far.
    """
    from lathesim.lessons.lesson import keep_read_lesson

    wish = _wish(aim, means)
    keep_read_lesson(chosen.loaded, out)

    say = said_beside(as_json)
    if aim.wanted:
        return _for_values(chosen, aim, wish, out, as_json, say)
    if rounds is not None:
        return _in_rounds(chosen, aim, wish, out, rounds, machine, say)
    return _for_rivals(chosen, aim, wish, out, as_json, say, is_tried=not no_trial)


def _wish(aim: AimOptions, means: MeansOptions) -> DesignWish:
    """Return what is wished for; raises what cannot be met."""
    from lathesim.errors import LatheSimError, UnitError
    from lathesim.experiments.design_experiment import DesignWish
    from lathesim.experiments.discrimination import Ablation
    from lathesim.units import quantity

    try:
        limit = quantity(means.at_most, "s")
    except UnitError as error:
        raise UnitError(error.fact, place="--at-most", remedy=error.remedy) from None
    if limit < 2.0:
        raise LatheSimError(f"a program of {limit:g} s is too short to decide anything.", place="--at-most", remedy="Allow 2 s or more.")
    if (aim.between is not None) + bool(aim.wanted) + (aim.diagnosis is not None and not aim.wanted) != 1:
        raise click.UsageError("Name the rivals with --between, give a DIAGNOSIS.json, or name values with --for: one of the three.")
    if limit > _LONGEST:
        raise LatheSimError(f"a program of {limit:g} s is too long to be designed.", place="--at-most", remedy="Allow an hour or less.")
    per_second = quantity(means.rate, "Hz") if means.rate else 0.0
    if means.rate and per_second <= 0.0:
        raise LatheSimError(
            f"a recording cannot take a row {per_second:g} times a second.", place="--rate", remedy="Give a rate above 0 Hz."
        )
    conditions = Ablation(*(name not in means.left_out for name in ("average", "refit", "price", "floor")))
    return DesignWish(limit, means.programs, seed=means.seed, conditions=conditions, rate=per_second, criterion=aim.criterion)


def _for_values(chosen: ChosenLesson, aim: AimOptions, wish: DesignWish, out: Path, as_json: bool, say: Callable[[str], None]) -> int:
    """Design the program by which values get known as well as possible."""
    from lathesim.experiments.precision import before_design, design_for_precision, precision_lines, write_precision
    from lathesim.experiments.replica import Listener

    registry = chosen.registry
    before = before_design(aim.diagnosis, chosen.loaded) if aim.diagnosis is not None else None
    names = read_names(aim.wanted)
    with interruptible() as stop:
        precise = design_for_precision(chosen.loaded, names, registry, wish, chosen.variant, Listener(say, stop), before)
    data = write_precision(precise, out)
    return write(
        CommandResult("lathesim-precision/1", data, precision_lines(precise, out), code=STOPPED if precise.search.stopped else 0), as_json
    )


def _rivals(chosen: ChosenLesson, aim: AimOptions) -> list[NamedRival]:
    from lathesim.experiments.rivals import named_between, named_in_diagnosis

    return named_between(aim.between) if aim.between is not None else named_in_diagnosis(aim.diagnosis or Path(), chosen.loaded.title)


def _in_rounds(
    chosen: ChosenLesson, aim: AimOptions, wish: DesignWish, out: Path, rounds: int, machine: str | None, say: Callable[[str], None]
) -> int:
    """Design, run on the machine of another lesson, diagnose, and again."""
    from functools import partial

    from lathesim.experiments.design_experiment import design_experiment
    from lathesim.experiments.replica import Listener
    from lathesim.experiments.sequence import run_rounds
    from lathesim.lessons.lesson import load_lesson

    registry, named = chosen.registry, _rivals(chosen, aim)
    if machine is None:
        raise click.UsageError("--rounds runs its programs on a machine: name the lesson that plays it with --machine.")
    with interruptible() as stop:
        design = partial(design_experiment, chosen.loaded, named, registry, place=aim.place, listener=Listener(say, stop))
        ran = run_rounds(design, load_lesson(machine), registry, wish, rounds, out, say)
    for number, item in enumerate(ran.rounds, 1):
        click.echo(f"Round {number}: {item.seconds:.1f} s, {item.verdict} {', '.join(item.named)}".rstrip())
    click.echo(f"{ran.ended} {ran.seconds:.1f} s of programs in all.")
    return 0


def _for_rivals(
    chosen: ChosenLesson, aim: AimOptions, wish: DesignWish, out: Path, as_json: bool, say: Callable[[str], None], *, is_tried: bool
) -> int:
    """Design the program that tells rivals apart, and try it on simulated recordings of each."""
    import contextlib

    from lathesim.experiments.design_experiment import design_experiment
    from lathesim.experiments.experiment_files import as_json as as_json_of
    from lathesim.experiments.experiment_files import told_lines, tried_design, write_experiment, write_program_and_lesson
    from lathesim.experiments.replica import Listener

    registry, named = chosen.registry, _rivals(chosen, aim)
    with interruptible() as stop:
        found = design_experiment(chosen.loaded, named, registry, wish, chosen.variant, aim.place, Listener(say, stop))
        write_program_and_lesson(found, out)
        foretold: list[Foretold] = []
        if is_tried and not found.search.stopped and found.decidable:
            with contextlib.suppress(KeyboardInterrupt):
                found, foretold = tried_design(found, lambda design: write_program_and_lesson(design, out), registry, wish.seed, say)
    write(CommandResult("lathesim-experiment/1", as_json_of(found, foretold), told_lines(found, foretold, out)), as_json)
    write_experiment(found, foretold, out)
    return STOPPED if found.search.stopped else 0
