"""``lathesim run LESSON``: the main job, from a lesson to numbers, plots and a record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import (
    STOPPED,
    ChosenLesson,
    OutputPath,
    grouped,
    json_option,
    plugins_option,
    program_option,
    set_option,
    variant_option,
)  # fmt: skip
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from lathesim.analysis.metric import Measurements
    from lathesim.cli.lessons.run_tables import Outcome
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry
    from lathesim.record import Record


@dataclass(frozen=True)
class RunOptions:
    """How the cases are run, and what is written of them."""

    as_json: bool
    engine: str | None
    seed: int | None
    no_plots: bool


@click.command()
@click.argument("lesson")
@variant_option
@program_option
@set_option
@click.option("--recording", type=click.Path(path_type=Path), metavar="FILE", help="What drives a lesson with 'recordings: drive:'.")
@click.option("--seed", type=click.IntRange(min=0), help="Another seed of the noise.")
@click.option("--out", type=OutputPath(makes_folder=True), metavar="RUN.h5", help="Where the record goes [default: lathesim_runs/LESSON/].")
@json_option("lathesim-run/1")
@click.option("--plain", "engine", flag_value="plain", help="Run in plain Python, without the compiler.")
@click.option("--compiled", "engine", flag_value="compiled", help="Compile first, however short the run.")
@click.option("--no-plots", is_flag=True, help="Draw no plots.")
@plugins_option
@grouped(chosen=ChosenLesson, how=RunOptions)
def run(chosen: ChosenLesson, how: RunOptions, recording: Path | None, out: Path | None) -> int:
    """Run LESSON (a file, or the name of a shipped one): a table of results, plots, and a record beside them.

    Without --variant all variants of the lesson run, and a table compares them with the published values. With --recording, FILE
    drives the inputs that the lesson names under 'recordings: drive:', for as long as it lasts. The motion starts as FILE shows. 'lathesim
    compare' compares the same run with it. Ctrl-C ends a run and keeps what was simulated until then (exit code 130).
    """
    runs = _Runs(chosen, chosen.registry, how)
    names: list[str | None] = [chosen.variant] if chosen.variant is not None else list(chosen.loaded.variants) or [None]
    prepared = [chosen.prepared_as(name) for name in names]
    _tell_odd_programs(prepared)
    if recording is not None:
        prepared = [runs.driven(case, recording) for case in prepared]
    for case in prepared:
        runs.one(case, _record_path(out, case, chosen.program_file, recording, alone=len(prepared) == 1))
        if runs.stopped:
            break
    return write(runs.result(), how.as_json)


def _tell_odd_programs(prepared: list[Prepared]) -> None:
    """Print what is odd in the programs of machines that cut, once each."""
    from lathesim.lessons.program_path import run_warnings

    for sentence in dict.fromkeys(sentence for case in prepared for sentence in run_warnings(case.case, case.plan)):
        click.echo(sentence, err=True)


def _record_path(out: Path | None, case: Prepared, *read: Path | None, alone: bool) -> Path:
    """Return where the record goes; with several cases and one ``--out`` each gets the name of its variant."""
    from lathesim.lessons.kept_run import record_path

    if out is None:
        return record_path(case, *read)
    return out if alone else out.with_name(f"{out.stem}_{case.case.variant}{out.suffix}")


@dataclass
class _Runs:
    """The runs of one call: each is made, kept, measured and drawn."""

    chosen: ChosenLesson
    registry: Registry
    how: RunOptions
    stopped: bool = False
    failed: bool = False
    outcomes: list[Outcome] = field(default_factory=list)
    results: list[dict[str, Any]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    findings: dict[str, None] = field(default_factory=dict)

    def driven(self, case: Prepared, recording: Path) -> Prepared:
        """Return a case driven by a recording, and keep what was found in that."""
        from lathesim.identification.replay.loading import driven_by

        found = driven_by(case, recording, self.registry)
        self.findings |= dict.fromkeys(found.findings)
        return found.prepared

    def one(self, case: Prepared, path: Path) -> None:
        """Run one case and keep what it gives."""
        from lathesim.cli.lessons.run_tables import Outcome
        from lathesim.cli.progress import progress_bar
        from lathesim.engine.run import Attendance
        from lathesim.lessons.kept_run import run_and_keep

        with progress_bar(case.name, case.expected_time, shown=not self.how.as_json) as progress:
            kept = run_and_keep(case, self.registry, path, engine=self.how.engine, seed=self.how.seed, attended=Attendance(progress))
        record, measurements = kept.record, kept.measurements
        if kept.failure:
            click.echo(f"{case.name}: {kept.failure} See {path}.", err=True)
            self.failed = self.failed or not case.breaks_down
        self.files.append(path)
        self.stopped = kept.stopped
        if self.stopped:
            last = float(record.time[-1]) if len(record) else 0.0
            click.echo(f"Stopped at {last:.4g} s of simulated time; what was simulated until then is kept in {path}.", err=True)
        lesson, variant = self.chosen.loaded, case.case.variant
        published = {**lesson.settings.published, **(lesson.settings.variants[variant].published if variant else {})}
        without = {name: measurements.skipped[name] for name in measurements.without}
        told = kept.nothing_cut
        self.outcomes.append(Outcome(variant or "", measurements.values, published, record.status, list(kept.goals), without, told))
        self.results.append(_result(case, record, path, measurements, told))
        if case.recording:
            self.results[-1] |= {"recording": case.recording, "recording_findings": list(self.findings)}
        if not self.how.no_plots and len(record) > 1:
            from lathesim.analysis.plots import save_run_plots

            self.files += save_run_plots(record, path, f"{lesson.title}{f', case {variant}' if variant else ''}")

    def result(self) -> CommandResult:
        """Return the result of all cases; of several the first stands at the top of the JSON and all of them under ``variants``."""
        data = dict(self.results[0]) if self.results else {}
        if len(self.results) != 1 or self.stopped:
            data["variants"] = {str(result["variant"]): result for result in self.results}
        return CommandResult("lathesim-run/1", data, self._lines(), code=STOPPED if self.stopped else int(self.failed))

    def _lines(self) -> Iterator[str]:
        """Yield what was found in the recording, tables with the goals, and where everything is."""
        from lathesim.cli.lessons.run_tables import case_table, goals_text, nothing_cut_text, variants_table

        yield from [f"Recording: {finding}" for finding in self.findings] + [""] * bool(self.findings)
        if len(self.outcomes) > 1:
            yield variants_table(self.outcomes, {goal.metric for goal in self.chosen.loaded.settings.goals})
        elif self.outcomes:
            yield case_table(self.outcomes[0])
            if self.outcomes[0].goals:
                yield f"\n{goals_text(self.outcomes[0].goals)}"
        told = nothing_cut_text(self.outcomes)
        if told:
            yield f"\n{told}"
        folders = dict.fromkeys(str(path.parent) for path in self.files)
        records = len(self.results)
        yield f"\n{_counted(records, 'record')} and {_counted(len(self.files) - records, 'plot')} in {', '.join(folders)}"


def _counted(number: int, what: str) -> str:
    return f"{number or 'no'} {what}{'' if number == 1 else 's'}"


def _result(case: Prepared, record: Record, path: Path, measurements: Measurements, nothing_cut: str) -> dict[str, Any]:
    return {
        "schema": "lathesim-run/1",
        "lesson": case.case.lesson.name,
        "variant": case.case.variant,
        "engine": record.meta["engine"],
        "status": record.meta["status"],
        "wall_time_s": record.meta["wall_time"],
        "record": path,
        "metrics": measurements.as_json(),
        **({"nothing_cut": nothing_cut} if nothing_cut else {}),
    }
