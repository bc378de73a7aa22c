"""``lathesim bench`` and ``warm``: how fast this machine simulates, beside other ways to do it, and compiling ahead of the first run."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import OutputPath, open_registry, plugins_option
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lathesim.cli.speed.bench_rows import Row, Skipped, Work
    from lathesim.engine.fuse import FusedModule
    from lathesim.errors import LatheSimError
    from lathesim.plugins import Registry


SCHEMA = "lathesim-bench/1"
AGREEMENT = 1.0
"""Encoder counts by which a peer may differ."""


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-bench/1) and nothing else.")
@click.option("--quick", is_flag=True, help="Measure fewer times, and leave out what is slow.")
@click.option("--scale", "what", flag_value="scale", help="Measure how the cost grows with axes, program time and runs, and draw it.")
@click.option("--table1", "what", flag_value="table1", help="Print the means of Table 1 over small changes, beside a reference.")
@click.option("--tui", "what", flag_value="tui", help="Measure the terminal app: first paint, answers to keys, drawing.")
@click.option(
    "--stability", "what", flag_value="stability", help="Measure stability maps, as ratios: collocation, measured responses, the next cut."
)
@click.option(
    "--lanes", "what", flag_value="lanes", help="Measure runs side by side, as ratios: against one by one, and against C where gcc is here."
)
@click.option("--save", type=OutputPath(makes_folder=True), metavar="F.png", help="Where --scale draws [default: lathesim_runs/scale.png].")
def bench(as_json: bool, quick: bool, what: str | None, save: Path | None) -> int:
    """Measure how fast this machine simulates: the median CPU time of a run, its ratio to the compiled engine, and peers where installed.

    The work is a part program of 18 s on the two-axis lathe, with 10 RK4 steps every 5 ms and 30 channels. The lathe has spindle, cutting
    force, wear, contour and force control, tachometer noise and 12-bit converters. From a checkout the same lathe is measured by hand in C
    and by other simulators, which must agree to one encoder count.
    """
    if what is None:
        result, faults = _one_run(quick)
    else:
        result, faults = _of_the_checkout(what, quick, save)
    code = write(result, as_json)
    for sentence in faults:
        click.echo(sentence, err=True)
    return 1 if faults else code


def _of_the_checkout(what: str, quick: bool, save: Path | None) -> tuple[CommandResult, list[str]]:
    """Measure with one of the modules of ``tests/benchmarks``: its ``measured(quick, save, tell)`` gives the result and what is at fault.

    Raises :class:`LatheSimError` where there is no checkout.
    """
    from lathesim.cli.speed.bench_rows import checkout
    from lathesim.errors import LatheSimError

    if checkout() is None:
        fact = f"--{what} is measured from a checkout, with its folder tests/benchmarks."
        raise LatheSimError(fact, remedy="Without an option, the command measures everywhere.")
    result, faults = importlib.import_module(f"tests.benchmarks.{what}").measured(quick, save, _tell)
    return result, faults


def _one_run(quick: bool) -> tuple[CommandResult, list[str]]:
    """Measure the work by the engine and by its peers, and how long commands take from nothing."""
    from lathesim.cli.speed.bench_rows import lathe_work, measured_on, row_data, start_rows, work_rows

    _tell("preparing the work ...")
    work = lathe_work()
    rows, skipped = work_rows(work, 5 if quick else 25, slow=not quick, tell=_tell)
    starts = start_rows(3 if quick else 7, _tell)
    data = {"rows": row_data([*rows, *starts], rows[0].median_s), "skipped": skipped, "machine": measured_on()}
    off = [row for row in rows if row.difference is not None and row.difference > AGREEMENT]
    faults = [f"{row.name} differs from the engine by {row.difference:.3g} encoder counts." for row in off]
    return CommandResult(SCHEMA, data, _lines(rows, starts, skipped, work)), faults


def _lines(rows: list[Row], starts: list[Row], skipped: list[Skipped], work: Work) -> Iterator[str]:
    """Yield the tables as the README shows them."""
    from lathesim.cli.speed.bench_rows import measured_on_line, seconds_text

    compiled = rows[0].median_s
    yield f"A program of {work.duration:.3f} s, {work.samples} samples; median CPU time.\n"
    yield "| one run | median | ratio to compiled | times real time | largest difference |\n|---|---:|---:|---:|---:|"
    for row in rows:
        difference = "" if row.difference is None else "none" if row.difference == 0.0 else f"{row.difference:.1g} counts"
        speed, ratio = _figure(work.duration / row.median_s), _figure(row.median_s / compiled)
        yield f"| {row.name} | {seconds_text(row.median_s)} | {ratio} | {speed} | {difference} |"
    yield "\n| from nothing | median |\n|---|---:|"
    yield from (f"| {row.name} | {seconds_text(row.median_s)} |" for row in starts)
    yield f"\n{measured_on_line()}"
    yield from (f"Left out: {item.name}: {item.reason}." for item in skipped)


_THREE_DIGITS = 100.0
"""From here on a number written without places has three digits."""


def _figure(value: float) -> str:
    return f"{value:.0f}" if value >= _THREE_DIGITS else f"{value:.3g}"


def _tell(sentence: str) -> None:
    click.echo(sentence, err=True)


@click.command()
@click.argument("lessons", nargs=-1)
@plugins_option
def warm(lessons: tuple[str, ...], plugin_folders: tuple[Path, ...]) -> int:
    """Compile the machines of LESSONS (by default of all lessons that came with lathesim and those in ./lesson_configs).

    What was compiled is kept between starts; changed parameters, programs and seeds never compile again, a changed part compiles only
    itself and the wiring. Without this command a run compiles what it needs when that pays.
    """
    import time

    from lathesim.cache_folder import cache_folder
    from lathesim.engine.module_cache import compile_time, compiled_machine, is_compiled, tell_compiling_to
    from lathesim.errors import LatheSimError, SimulationError

    registry = open_registry(plugin_folders)
    tell_compiling_to(None)
    seen: dict[str, str] = {}
    compiled, faults, begun = 0, 0, time.perf_counter()
    for name, case in _cases(lessons, registry):
        if isinstance(case, LatheSimError):
            click.echo(f"{name}: left out. {case}", err=True)
            faults += 1
            continue
        if case.digest in seen:
            click.echo(f"{name}: the same machine as {seen[case.digest]}.")
            continue
        seen[case.digest] = name
        if is_compiled(case):
            click.echo(f"{name}: was compiled already.")
            continue
        click.echo(f"{name}: compiling, about {max(1.0, compile_time(case)):.0f} s ...", nl=False)
        start = time.perf_counter()
        try:
            compiled_machine(case)
        except SimulationError as error:
            click.echo(f" {error.fact} It runs plain.")
            continue
        compiled += 1
        click.echo(f" took {time.perf_counter() - start:.1f} s.")
    click.echo(f"{compiled} compiled in {time.perf_counter() - begun:.1f} s, {len(seen) - compiled} before; kept in {cache_folder()}.")
    return 1 if faults else 0


def _cases(lessons: tuple[str, ...], registry: Registry) -> Iterator[tuple[str, FusedModule | LatheSimError]]:
    """Return each case of the lessons by name, as the module it becomes, or what is wrong with it."""
    from lathesim.engine.fuse import fuse
    from lathesim.errors import LatheSimError
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare

    for path in lessons or _known_lessons():
        try:
            lesson = load_lesson(path)
        except LatheSimError as error:
            yield str(path), error
            continue
        for variant in lesson.variants or (None,):
            name = f"{lesson.name} {variant}" if variant else lesson.name
            try:
                yield name, fuse(prepare(lesson, registry, variant).plan)
            except LatheSimError as error:
                yield name, error


def _known_lessons() -> list[Path]:
    from lathesim.shipped import shipped_folder

    folders = [Path("lesson_configs"), shipped_folder("lesson_configs")]
    found = {path.name: path for folder in reversed(folders) for path in sorted(folder.glob("*.yaml"))}
    return [found[name] for name in sorted(found)]
