"""``lathesim bench``: how fast this machine simulates, beside other ways to simulate the same lathe."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath
from lathesim.whole_file import make_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lathesim.cli.speed.bench_rows import Row, Skipped
    from lathesim.cli.speed.bench_work import Work

SCHEMA = "lathesim-bench/1"
AGREEMENT = 1.0
"""Encoder counts by which a peer may differ."""


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-bench/1) and nothing else.")
@click.option("--quick", is_flag=True, help="Measure fewer times, and leave out what is slow.")
@click.option("--scale", is_flag=True, help="Measure how the cost grows with axes, program time and runs, and draw it.")
@click.option("--table1", is_flag=True, help="Print the means of Table 1 over small changes, beside a reference.")
@click.option("--tui", "terminal", is_flag=True, help="Measure the terminal app: first paint, answers to keys, drawing.")
@click.option("--stability", is_flag=True, help="Measure stability maps, as ratios: collocation, measured responses, the next cut.")
@click.option("--lanes", is_flag=True, help="Measure runs side by side, as ratios: against one by one, and against C where gcc is here.")
@click.option("--save", type=OutputPath(makes_folder=True), metavar="F.png", help="Where --scale draws [default: lathesim_runs/scale.png].")
def bench(as_json: bool, quick: bool, scale: bool, table1: bool, terminal: bool, stability: bool, lanes: bool, save: Path | None) -> int:
    """Measure how fast this machine simulates: the median CPU time of a run, its ratio to the compiled engine, and peers where installed.

    The work is an 18 s part program on the two-axis lathe with spindle, cutting force, wear, contour and force control, tachometer noise
    and 12-bit converters; 10 RK4 steps every 5 ms, 30 channels. From a checkout the same lathe is measured by hand in C and by other
    simulators, which must agree to one encoder count.
    """
    import json

    if table1:
        return _table1(as_json, quick)
    if terminal:
        return _terminal(as_json, quick)
    if stability:
        return _stability(as_json)
    if lanes:
        return _lanes(as_json, quick)
    from lathesim.cli.speed.bench_work import lathe_work

    _tell("preparing the work ...")
    work = lathe_work()
    if scale:
        return _scale(work, as_json, quick, save)
    from lathesim.cli.speed.bench_rows import start_rows, work_rows

    rounds = 5 if quick else 25
    rows, skipped = work_rows(work, rounds, slow=not quick, tell=_tell)
    starts = start_rows(3 if quick else 7, _tell)
    off = [row for row in rows if row.difference is not None and row.difference > AGREEMENT]
    if as_json:
        left_out = [{"name": item.name, "reason": item.reason} for item in skipped]
        result = {"schema": SCHEMA, "rows": _as_json([*rows, *starts], rows[0].median_s), "skipped": left_out, "machine": _machine()}
        click.echo(json.dumps(result, indent=2))
    else:
        click.echo(_table(rows, starts, work))
        _echo_rest(skipped)
    for row in off:
        click.echo(f"{row.name} differs from the engine by {row.difference:.3g} encoder counts.", err=True)
    return 1 if off else 0


def _scale(work: Work, as_json: bool, quick: bool, save: Path | None) -> int:
    """Measure and draw how the cost grows."""
    import json

    from lathesim.cli.speed.bench_scale import batch_memory, hour, scale_series, thread_gain, told

    series = scale_series(work, 2 if quick else 5, quick=quick, tell=_tell)
    gain = thread_gain(work, 3 if quick else 5, _tell)
    long, memory = hour(_tell), batch_memory(_tell)
    place = _draw(series, save or Path("lathesim_runs") / "scale.png")
    if as_json:
        rows = [row for item in series for row in item.rows()]
        compiled = next(row.median_s for row in series[-1].rows())
        slopes = {item.name: {"all": item.slope, "upper": item.upper_slope} for item in series}
        result = {"schema": SCHEMA, "rows": _as_json(rows, compiled), "slopes": slopes, "two_threads": gain, "hour": vars(long)}
        result |= {"batch_memory_mb": memory, "figure": str(place), "machine": _machine()}
        click.echo(json.dumps(result, indent=2))
        return 0
    for item in series:
        click.echo("\n".join(f"{row.name:<28} {_seconds(row.median_s)}" for row in item.rows()))
    click.echo("\n" + "\n".join(told(series)))
    click.echo(f"two threads are {gain:.2f} times as fast as one")
    click.echo(
        f"an hour of program at 5 ms: {long.unrecorded_cpu_s:.2f} s of CPU compiled, {long.cpu_s:.2f} s with 30 channels recorded to disk "
        f"({long.file_mb:.0f} MB), {long.memory_mb:.0f} MB of memory"
    )
    sizes = ", ".join(f"{size:.0f} MB for {runs} runs" for runs, size in memory.items())
    click.echo(f"a batch that keeps one cost a run: {sizes}")
    click.echo(f"\n{_machine_line()}\nFigure: {place}")
    return 0


def _draw(series: Sequence[Any], place: Path) -> Path:
    from lathesim.analysis.figures.plots import save_figure
    from lathesim.analysis.figures.scale_plot import scale_figure

    make_folder(place.parent)
    save_figure(scale_figure({item.name: (item.sizes, item.seconds, item.slope) for item in series}), place)
    return place


def _table1(as_json: bool, quick: bool) -> int:
    """Print the means of Table 1 beside the reference."""
    import dataclasses
    import json

    from lathesim.cli.speed.bench_table1 import DRAWS, LIMITS, table1

    draws = 10 if quick else DRAWS
    means = table1(draws, _tell)
    if as_json:
        rows = [{**dataclasses.asdict(mean), "deviation_percent": mean.deviation, "limit_percent": LIMITS[mean.metric]} for mean in means]
        click.echo(json.dumps({"schema": "lathesim-table1/1", "draws": draws, "rows": rows}, indent=2))
    else:
        click.echo(f"Means over {draws} draws of gain, time constant and proportional gain of both axes, each within 1 %.\n")
        click.echo("| case | metric | mean | reference | deviation |\n|---|---|---:|---:|---:|")
        for mean in means:
            shown = f"{mean.mean:.5g} {mean.unit} | {mean.reference:.5g} {mean.unit} | {mean.deviation:+.2f} %"
            click.echo(f"| {mean.case} | {mean.metric} | {shown} |")
    off = [mean for mean in means if not mean.is_within]
    for mean in off:
        click.echo(f"{mean.case}: {mean.metric} is {mean.deviation:+.2f} % off, more than {LIMITS[mean.metric]:g} %.", err=True)
    return 1 if off else 0


def _stability(as_json: bool) -> int:
    """Measure stability maps."""
    import json

    from lathesim.cli.speed.bench_stability import stability_figures

    figures = stability_figures(_tell)
    if as_json:
        rows = [{**vars(figure), "is_within": figure.is_within} for figure in figures]
        click.echo(json.dumps({"schema": "lathesim-bench-stability/1", "rows": rows, "machine": _machine()}, indent=2))
    else:
        for figure in figures:
            word, sign = "least" if figure.is_at_least else "most", "kept" if figure.is_within else "MISSED"
            click.echo(f"{figure.name}: {figure.value:.3g} (at {word} {figure.bar:g}: {sign})")
        click.echo(f"\n{_machine_line()}")
    return int(any(not figure.is_within for figure in figures))


def _lanes(as_json: bool, quick: bool) -> int:
    """Measure runs side by side."""
    import json

    from lathesim.cli.speed.bench_lanes import lane_figures

    figures, left_out = lane_figures(3 if quick else 5, quick=quick, tell=_tell)
    if as_json:
        rows = [{**vars(figure), "is_within": figure.is_within} for figure in figures]
        click.echo(json.dumps({"schema": "lathesim-bench-lanes/1", "rows": rows, "skipped": left_out, "machine": _machine()}, indent=2))
    else:
        click.echo("| ratio | before | after | value | bar | |\n|---|---:|---:|---:|---:|---|")
        for figure in figures:
            word, sign = "at least" if figure.is_at_least else "at most", "kept" if figure.is_within else "MISSED"
            before, after = ("" if value is None else _seconds(value) for value in (figure.alone_s, figure.together_s))
            click.echo(f"| {figure.name} | {before} | {after} | {figure.value:.3g} | {word} {figure.bar:g} | {sign} |")
        click.echo("\n".join(["", *(f"Left out: {item}." for item in left_out), _machine_line()]))
    return int(any(not figure.is_within for figure in figures))


def _terminal(as_json: bool, quick: bool) -> int:
    """Measure the terminal app."""
    import json

    from lathesim.cli.speed.bench_tui import tui_figures

    figures = tui_figures(1 if quick else 5, _tell)
    if as_json:
        rows = [{**vars(figure), "is_within": figure.is_within} for figure in figures]
        click.echo(json.dumps({"schema": "lathesim-bench-tui/1", "rows": rows, "machine": _machine()}, indent=2))
    else:
        for figure in figures:
            sign = "kept" if figure.is_within else "MISSED"
            click.echo(f"{figure.name}: {figure.value:.3g} {figure.unit}".strip() + f" (at most {figure.bar:g}: {sign})")
        click.echo(f"\n{_machine_line()}")
    return int(any(not figure.is_within for figure in figures))


def _table(rows: list[Row], starts: list[Row], work: Work) -> str:
    """Return the table as the README shows it."""
    compiled = rows[0].median_s
    lines = [f"A program of {work.duration:.3f} s, {work.samples} samples; median CPU time.", ""]
    lines += ["| one run | median | ratio to compiled | times real time | largest difference |", "|---|---:|---:|---:|---:|"]
    for row in rows:
        difference = "" if row.difference is None else "none" if row.difference == 0.0 else f"{row.difference:.1g} counts"
        speed, ratio = _figure(work.duration / row.median_s), _figure(row.median_s / compiled)
        lines.append(f"| {row.name} | {_seconds(row.median_s)} | {ratio} | {speed} | {difference} |")
    lines += ["", "| from nothing | median |", "|---|---:|"]
    lines += [f"| {row.name} | {_seconds(row.median_s)} |" for row in starts]
    return "\n".join([*lines, "", _machine_line()])


def _as_json(rows: list[Row], compiled: float) -> list[dict[str, Any]]:
    return [{"name": row.name, "median_s": row.median_s, "ratio_to_compiled": row.median_s / compiled} for row in rows]


def _echo_rest(skipped: list[Skipped]) -> None:
    for item in skipped:
        click.echo(f"Left out: {item.name}: {item.reason}.")


def _figure(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def _seconds(value: float) -> str:
    return f"{value * 1e3:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def _machine() -> dict[str, str]:
    """Return what the figures depend on."""
    import datetime
    import os
    import platform
    from importlib.metadata import version

    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "load": f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown",
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "numba": version("numba"),
        "date": datetime.date.today().isoformat(),
    }


def _machine_line() -> str:
    machine = _machine()
    versions = ", ".join(f"{name} {machine[name]}" for name in ("python", "numpy", "numba"))
    busy = f"load {machine['load']}"
    return f"{machine['processor']}, {machine['cores']} cores, {busy}, {machine['system']}; {versions}; {machine['date']}."


def _processor() -> str:
    import platform

    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _tell(sentence: str) -> None:
    click.echo(sentence, err=True)
