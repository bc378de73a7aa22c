"""``lathesim diagnose LESSON RECORDING``: what physics the lesson's simulation left out."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.case_options import variant_option
from lathesim.cli.options import plugins_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry
from lathesim.whole_file import check_output, write_text

if TYPE_CHECKING:
    from lathesim.identification.execution.budget import Deadline

STOPPED = 130
_EVERY = 10.0
"""Time between two lines of progress without a terminal [s]."""


@click.command()
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--validate", type=click.Path(path_type=Path), metavar="FILE", help="The recording that judges [default: the second half].")
@click.option(
    "--before",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A recording from before the machine changed: what changed since is named, however small, and not what the lesson left out.",
)
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where report and lesson go [default: lathesim_runs/LESSON/].")
@click.option("--json", "json_file", type=OutputPath(allow_dash=True), metavar="FILE", help="Write JSON ('-': print it).")
@click.option("--effect", "only", multiple=True, metavar="NAME", help="Try only these effects.")
@click.option(
    "--at-most", metavar="TIME", help="Longest time of the whole answer, as '2 min'; it then holds what is known so far [default: none]."
)
@click.option(
    "--with",
    "others",
    nargs=2,
    multiple=True,
    metavar="LESSON RECORDING",
    help="A further recording of the same machine, with the lesson that maps it; several times. One verdict comes of all.",
)
@click.option("--design", is_flag=True, help="Where the answer is tied, write the program whose run would tell, to DIR/next.")
@click.option("--explain-decision", "explained", is_flag=True, help="Print every explanation that was tried, and why it was kept or not.")
@click.option("--no-report", is_flag=True, help="Write no report.")
@click.option(
    "--without",
    "left_out",
    multiple=True,
    type=click.Choice(("replay", "baseline", "null", "held-out")),
    help="Leave a step of the method out, to see what it is good for: the answer gets worse, and says so.",
)
@variant_option
@plugins_option
def diagnose(
    lesson: str,
    recording: Path,
    validate: Path | None,
    before: Path | None,
    out: Path | None,
    json_file: Path | None,
    only: tuple[str, ...],
    at_most: str | None,
    others: tuple[tuple[str, str], ...],
    design: bool,
    explained: bool,
    no_report: bool,
    left_out: tuple[str, ...],
    variant: str | None,
    plugin_folders: tuple[Path, ...],
) -> int:
    """Hold RECORDING against the simulation of LESSON, find what the lesson left out, and show that the fit improves.

    The lesson says in ``recordings:`` what the columns mean and in ``uncertain:`` how sure its values are. The answer is judged on a
    recording that was not fitted. Ctrl-C, or a request to terminate, ends the search and keeps what is known (exit code 130).
    """
    import json
    import os

    # the runs of a batch share the cores already: threads of the linear algebra would only fight them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    ends = _deadline(at_most)
    from lathesim.diagnosis.ablation import without
    from lathesim.diagnosis.diagnose import ask
    from lathesim.diagnosis.diagnose import diagnose as answer
    from lathesim.diagnosis.records.diagnosis import as_json
    from lathesim.diagnosis.reporting.answer_files import report_place, write_answer
    from lathesim.diagnosis.reporting.explanations import explanation_lines
    from lathesim.diagnosis.reporting.number_text import plain
    from lathesim.diagnosis.reporting.summary import headline, summary_lines
    from lathesim.diagnosis.reporting.terminal_text import answer_lines
    from lathesim.identification.replay.loading import load_case
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.results_folder import results_folder

    registry = open_registry(plugin_folders)
    effects = [registry.effect(name) for name in only] if only else list(registry.effects.values())
    loaded = load_lesson(lesson)
    quiet = json_file is not None and str(json_file) == "-"
    folder = out or results_folder(loaded, recording, validate, before, *(Path(file) for _, file in others), variant=variant)
    if not no_report:
        check_output(report_place(folder))
    if others and validate is not None:
        raise click.UsageError("--with and --validate both judge: give one of them.")
    if others and before is not None:
        raise click.UsageError("--with and --before ask two questions: give one of them.")
    case = load_case(loaded, [file for file in (recording, validate, before) if file is not None], registry, variant=variant)
    question = without(ask(loaded.title, case.machine, case.recordings, effects, changed=before is not None), left_out)  # type: ignore[arg-type]
    question = replace(question, method=replace(question.method, ends=ends))
    with _progress(shown=not quiet) as tell, _terminated_as_interrupted():
        if others:
            from lathesim.experiments.evidence import Other, diagnose_together

            further = [Other(name, Path(file)) for name, file in others]
            diagnosis = diagnose_together(case, further, registry, lambda loaded_case: question, tell)
        else:
            diagnosis = answer(question, tell)
    if design:
        from lathesim.cli.progress import interruptible
        from lathesim.experiments.design.for_diagnosis import with_designed_program

        with interruptible() as stop:
            diagnosis = with_designed_program(
                diagnosis, loaded, registry, folder / "next", variant, lambda text: click.echo(text, err=True), stop
            )
    told = {"sentence": plain(headline(diagnosis)), "summary": [plain(line) for line in summary_lines(diagnosis)]}
    answer_json = json.dumps({**as_json(diagnosis), **told, "report": None if no_report else str(report_place(folder))}, indent=2)
    answer_text = [*answer_lines(diagnosis), *(explanation_lines(diagnosis) if explained else []), ""]
    click.echo(answer_json if quiet else "\n".join(answer_text))  # printed before files are written: the disk may be full
    files = [] if no_report else write_answer(diagnosis, case.lesson, folder)
    if not quiet:
        files += [write_text(json_file, answer_json + "\n")] if json_file is not None else []
        see = f" See {', '.join(map(str, files))}." if files else ""
        click.echo(f"{diagnosis.wall_time:.1f} s.{see}")
    return 0 if diagnosis.complete or at_most is not None else STOPPED


def _deadline(at_most: str | None) -> Deadline:
    """Return the deadline of the answer, counted from now: reading, compiling and reporting are included."""
    from lathesim.identification.execution.budget import Deadline
    from lathesim.units import quantity

    return Deadline() if at_most is None else Deadline.after(quantity(at_most, "s"))


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Take a request to terminate (of a batch system, of ``timeout``) for Ctrl-C; only the main thread can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _progress(*, shown: bool) -> Iterator[Callable[[str], None]]:
    """Yield a function that takes the text of each step: a terminal shows the last one, elsewhere it is printed every ten seconds."""
    if not shown:
        yield lambda text: None
        return
    if not sys.stderr.isatty():
        with progress_lines() as tell:
            yield tell
        return
    from rich.console import Console

    with Console(stderr=True).status("reading the recording") as status:
        yield lambda text: status.update(text.strip())


@contextmanager
def progress_lines(waited: Callable[[float], bool] | None = None) -> Iterator[Callable[[str], None]]:
    """Yield a function that takes the text of each step, and print the last text every ten seconds.

    ``waited`` replaces the wait: it takes seconds and returns whether the work was done before they had passed.
    """
    done, last, began = threading.Event(), [""], time.monotonic()

    def write() -> None:
        while not (waited or done.wait)(_EVERY):
            click.echo(f"After {time.monotonic() - began:.0f} s: {last[0] or 'reading the recording'}.", err=True)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield lambda text: last.__setitem__(0, text.strip())
    finally:
        done.set()
        writer.join()
