"""``lathesim sweep LESSON --vary PART.NAME=LOW..HIGH:N``: one lesson over ranges of its parameters, to a table and a plot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import STOPPED, ChosenLesson, OutputPath, cluster_address, cluster_at, grouped, of_program, option
from lathesim.cli.progress import count_bar

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared
    from lathesim.lessons.sweep_runs import Member, Members
    from lathesim.lessons.sweep_table import SweepTable, SweptRange


@dataclass(frozen=True)
class SweepOptions:
    """What is varied and measured, where table and plot go, and where the runs are made."""

    varied: tuple[str, ...] = option(
        "N values from LOW to HIGH, or a list: x_dac.bits=8,10,12. Parameters joined with + move together.", "--vary", required=True,
        metavar="PART.NAME=LOW..HIGH[ UNIT]:N[log]",
    )  # fmt: skip
    metrics: tuple[str, ...] = option("What is measured [default: the metrics of the lesson's goals].", "--metric", metavar="NAME")
    out: Path | None = option("The table [default: lathesim_runs/LESSON/sweep.csv].", type=OutputPath(makes_folder=True), metavar="F.csv")
    plot: Path | None = option("The plot [default: beside the table].", type=OutputPath(), metavar="F.png")
    no_plot: bool = option("Draw no plot.")
    threads: int | None = option("Runs at the same time [default: as many as there are cores].", type=click.IntRange(min=1))
    executor: str | None = option("Make the runs on a Dask cluster.", "--cluster", "--executor", metavar="tcp://HOST:PORT")


@click.command()
@click.argument("lesson")
@grouped(wish=SweepOptions)
@of_program
def sweep(chosen: ChosenLesson, wish: SweepOptions) -> int:
    """Run LESSON over all combinations of the --vary ranges and write one row a run.

    The table grows as runs end. Stopped (Ctrl-C, exit code 130) and started again, the same command goes on where it was; it refuses a
    table of another sweep. A run that breaks down has the reason in its row.
    """
    from lathesim.errors import LatheSimError
    from lathesim.lessons.lesson import results_folder
    from lathesim.lessons.sweep_runs import Members
    from lathesim.lessons.sweep_table import default_metrics, grid, read_range, values_at

    cluster_address(wish.executor)
    registry, loaded = chosen.registry, chosen.loaded
    prepared = chosen.prepared
    ranges = [read_range(text, prepared) for text in wish.varied]
    for item in ranges:
        if item.remark:
            click.echo(item.remark, err=True)
    points = grid(ranges)
    names = tuple(name for item in ranges for name in item.names)
    wanted = {name: registry.metric(name) for name in wish.metrics or default_metrics(prepared)}
    if not wanted:
        raise LatheSimError("the lesson has no goals.", place=str(loaded.path), remedy="Say what to measure with --metric.")
    members = Members(prepared, names, wanted)
    place = wish.out or results_folder(loaded, chosen.program_file, variant=chosen.variant) / "sweep.csv"
    table = _sweep_table(place, prepared, members, ranges, points)
    done = table.open()
    there = len(done)
    jobs = [(number, values_at(ranges, point)) for number, point in enumerate(points) if number not in done]
    try:
        with count_bar(prepared.name, len(points), there) as tell:
            for member in _runs(members, jobs, wish, chosen):
                table.add(member)
                done[member.number] = member
                tell()
    except KeyboardInterrupt:
        click.echo(f"Stopped after {len(done)} of {len(points)} runs; the same command goes on from there.", err=True)
        return STOPPED
    done = dict(sorted(done.items()))
    table.finish(done)
    click.echo(f"{len(points)} runs, {len(points) - there} of them made now; the table is {table.path}")
    for line in _extremes(ranges, points, members, done):
        click.echo(line)
    if not wish.no_plot:
        _draw(wish.plot or table.path.with_suffix(".png"), loaded.title, ranges, members, done)
    return 0


def _sweep_table(
    path: Path, prepared: Prepared, members: Members, ranges: Sequence[SweptRange], points: Sequence[tuple[int, ...]]
) -> SweepTable:
    from lathesim.lessons.sweep_table import SweepTable

    case = prepared.case
    header = [f"lesson: {case.lesson.name}{f', variant {case.variant}' if case.variant else ''}", f"machine: {members.digest}"]
    header += [f"vary: {item.text}" for item in ranges]
    columns = ["run", *(f"{item.label} [{item.unit}]" for item in ranges)]
    columns += [f"{name} [{metric.unit}]" for name, metric in members.metrics.items()]
    shown = [[repr(value) for value in item.shown] for item in ranges]
    given = tuple(tuple(texts[place] for texts, place in zip(shown, point, strict=True)) for point in points)
    return SweepTable(path, tuple(header), (*columns, "status"), given)


def _runs(members: Members, jobs: Sequence[tuple[int, tuple[float, ...]]], wish: SweepOptions, chosen: ChosenLesson) -> Iterator[Member]:
    from lathesim.lessons.sweep_executors import run_here, run_on_cluster

    if not jobs:
        return
    with cluster_at(wish.executor, chosen.registry.plugins) as cluster:
        yield from run_here(members, jobs, wish.threads or 0) if cluster is None else run_on_cluster(cluster, members, jobs)


def _extremes(ranges: Sequence[SweptRange], points: Sequence[tuple[int, ...]], members: Members, done: dict[int, Member]) -> Iterator[str]:
    """Return a line for each metric: its least and largest value and where they are; and how many runs gave none."""
    from lathesim.analysis.display_unit import shown_with_unit

    for place, (name, metric) in enumerate(members.metrics.items()):
        found = {number: member.metrics[place] for number, member in done.items() if member.metrics[place] == member.metrics[place]}
        if not found:
            continue
        if min(found.values()) == max(found.values()):
            value = shown_with_unit(next(iter(found.values())), metric.unit)
            yield f"{name.replace('_', ' ')}: {value} in {'all runs' if len(found) == len(done) else 'every run that has it'}"
            continue
        told = []
        for word, number in (("least", min(found, key=found.__getitem__)), ("most", max(found, key=found.__getitem__))):
            at = ", ".join(f"{item.label} = {item.told(spot)}" for item, spot in zip(ranges, points[number], strict=True))
            told.append(f"{word} {shown_with_unit(found[number], metric.unit)} at {at}")
        yield f"{name.replace('_', ' ')}: {'; '.join(told)}"
    bad = [member.status for _, member in sorted(done.items()) if member.status != "complete"]
    if bad:
        yield (
            f"1 run has no complete result: {bad[0]}" if len(bad) == 1 else f"{len(bad)} runs have no complete result, the first: {bad[0]}"
        )


def _draw(path: Path, title: str, ranges: Sequence[SweptRange], members: Members, done: dict[int, Member]) -> None:
    import numpy as np

    from lathesim.analysis.experiment_figures import SweepAxis, sweep_figure
    from lathesim.analysis.plots import save_figure

    if len(ranges) > 2:
        click.echo("No plot: more than two ranges are varied.")
        return
    axes = [SweepAxis(item.label, item.shown, item.unit, item.logarithmic) for item in ranges]
    values = np.array([done[number].metrics for number in sorted(done)], dtype=float)
    metrics = [(name, metric.unit, values[:, place]) for place, (name, metric) in enumerate(members.metrics.items())]
    save_figure(sweep_figure(axes, metrics, title), path)
    click.echo(f"The plot is {path}")
