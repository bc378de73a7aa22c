"""``lathesim diagnose LESSON RECORDING``: what physics the lesson's simulation left out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, cluster_at, cluster_option, grouped, of_variant, option
from lathesim.cli.progress import interruptible, steps, terminated_as_interrupted
from lathesim.whole_file import check_output, write_text

if TYPE_CHECKING:
    from lathesim.diagnosis.preparation import Question
    from lathesim.diagnosis.records.diagnosis import Diagnosis
    from lathesim.identification.execution import Deadline
    from lathesim.identification.replay.loading import LoadedCase


@dataclass(frozen=True)
class RecordingOptions:
    """The recordings that are explained and those that judge."""

    recording: Path
    others: tuple[tuple[str, str], ...]
    cluster: str | None
    validate: Path | None = option("The recording that judges RECORDING [default: its second half].", metavar="FILE")
    before: Path | None = option(
        "A recording from before the machine changed: what changed since is named, however small, and not what the lesson left out.",
        metavar="FILE",
    )

    def check(self) -> None:
        """Raise where a recording is given without an option, or two of them ask different questions."""
        if further := click.get_current_context().args:
            fact = f"'{further[0]}' is a second recording, and one is fitted."
            raise click.UsageError(f"{fact} Give it with --validate {further[0]}, and it judges, or with --with LESSON {further[0]}.")
        if self.others and self.validate is not None:
            raise click.UsageError("--with and --validate both judge: give one of them. --with may stand several times.")
        if self.cluster is not None and not self.others:
            raise click.UsageError("--cluster shares out the recordings of --with: give some.")
        if self.others and self.before is not None:
            raise click.UsageError("--with and --before ask two questions: give one of them.")


@dataclass(frozen=True)
class SearchOptions:
    """What is searched for, and for how long."""

    left_out: tuple[str, ...]
    only: tuple[str, ...] = option("Try only these effects.", "--effect", metavar="NAME")
    at_most: str | None = option(
        "Longest time of the whole answer, as '2 min'; it then holds what is known so far [default: none].", metavar="TIME"
    )


@dataclass(frozen=True)
class ReportOptions:
    """What is written of the answer."""

    json_file: Path | None
    explained: bool = option("Print every explanation that was tried, and why it was kept or not.", "--explain-decision")
    no_report: bool = option("Write no report.")

    @property
    def is_quiet(self) -> bool:
        """Whether JSON is printed, and nothing else."""
        return self.json_file is not None and str(self.json_file) == "-"


@click.command(context_settings={"allow_extra_args": True})
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@grouped(files=RecordingOptions)
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where report and lesson go [default: lathesim_runs/LESSON/].")
@click.option("--json", "json_file", type=OutputPath(allow_dash=True), metavar="FILE", help="Write JSON ('-': print it).")
@grouped(search=SearchOptions)
@click.option(
    "--with",
    "others",
    nargs=2,
    multiple=True,
    metavar="LESSON RECORDING",
    help="A further recording of the same machine, with its lesson; several times, and not with --validate. RECORDING is fitted, each of "
    "these judges, and one verdict comes of all.",
)
@cluster_option
@click.option("--design", is_flag=True, help="Where the answer is tied, write the program whose run would tell, to DIR/next.")
@grouped(report=ReportOptions)
@click.option(
    "--without",
    "left_out",
    multiple=True,
    type=click.Choice(("replay", "baseline", "null", "held-out")),
    help="Leave a step of the method out, to see what it is good for: the answer gets worse, and says so.",
)
@of_variant
def diagnose(
    chosen: ChosenLesson, files: RecordingOptions, search: SearchOptions, report: ReportOptions, out: Path | None, design: bool
) -> int:
    """Hold RECORDING against the simulation of LESSON, find what the lesson left out, and show that the fit improves.

    The lesson says in ``recordings:`` what the columns mean and in ``uncertain:`` how sure its values are. The answer is judged on a
    recording that was not fitted. Ctrl-C, or a request to terminate, ends the search and keeps what is known (exit code 130).
    """
    import os

    # the runs of a batch share the cores already: threads of the linear algebra would only fight them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    ends = _deadline(search.at_most)
    from lathesim.diagnosis.ablation import without
    from lathesim.diagnosis.diagnose import ask
    from lathesim.diagnosis.reporting.answer_files import report_place
    from lathesim.identification.replay.loading import load_case
    from lathesim.lessons.lesson import results_folder

    registry = chosen.registry
    effects = [registry.effect(name) for name in search.only] if search.only else list(registry.effects.values())
    files.check()
    given = (files.recording, files.validate, files.before)
    folder = out or results_folder(chosen.loaded, *given, *(Path(file) for _, file in files.others), variant=chosen.variant)
    if not report.no_report:
        check_output(report_place(folder))
    case = load_case(chosen.loaded, [file for file in given if file is not None], registry, variant=chosen.variant)
    asked = ask(chosen.loaded.title, case.machine, case.recordings, effects, changed=files.before is not None)  # type: ignore[arg-type]
    diagnosis = _answer(replace(without(asked, search.left_out), ends=ends), case, files, chosen, quiet=report.is_quiet)
    if design:
        from lathesim.experiments.sequence import with_designed_program

        with interruptible() as stop:
            diagnosis = with_designed_program(
                diagnosis, chosen.loaded, registry, folder / "next", chosen.variant, lambda text: click.echo(text, err=True), stop
            )
    _write(diagnosis, case, folder, report)
    return 0 if diagnosis.complete or search.at_most is not None else STOPPED


def _answer(question: Question, case: LoadedCase, files: RecordingOptions, chosen: ChosenLesson, *, quiet: bool) -> Diagnosis:
    """Search for the answer, with the further recordings where there are any."""
    from lathesim.diagnosis.diagnose import diagnose as answer

    with steps(shown=not quiet, first="reading the recording") as tell, terminated_as_interrupted():
        if not files.others:
            return answer(question, tell)
        from lathesim.experiments.sequence import Other, diagnose_together

        further = [Other(name, Path(file)) for name, file in files.others]
        with cluster_at(files.cluster, chosen.registry.plugins) as cluster:
            return diagnose_together(case, further, chosen.registry, lambda loaded_case: question, tell, cluster)


def _write(diagnosis: Diagnosis, case: LoadedCase, folder: Path, report: ReportOptions) -> None:
    """Print the answer, then write its files: the disk may be full."""
    import json

    from lathesim.diagnosis.reporting.answer_files import answer_json, report_place, write_answer
    from lathesim.diagnosis.reporting.explanations import explanation_lines
    from lathesim.diagnosis.reporting.terminal_text import answer_lines

    answer_in_json = json.dumps({**answer_json(diagnosis), "report": None if report.no_report else str(report_place(folder))}, indent=2)
    answer_text = [*answer_lines(diagnosis), *(explanation_lines(diagnosis) if report.explained else []), ""]
    click.echo(answer_in_json if report.is_quiet else "\n".join(answer_text))
    files = [] if report.no_report else write_answer(diagnosis, case.lesson, folder)
    if not report.is_quiet:
        files += [write_text(report.json_file, answer_in_json + "\n")] if report.json_file is not None else []
        see = f" See {', '.join(map(str, files))}." if files else ""
        click.echo(f"{diagnosis.search.wall_time:.1f} s.{see}")


def _deadline(at_most: str | None) -> Deadline:
    """Return the deadline of the answer, counted from now: reading, compiling and reporting are included."""
    from lathesim.identification.execution import Deadline
    from lathesim.units import quantity

    return Deadline() if at_most is None else Deadline.after(quantity(at_most, "s"))
