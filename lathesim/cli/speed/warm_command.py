"""``lathesim warm``: compile what the lessons need, ahead of the first run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import open_registry, plugins_option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lathesim.engine.fuse import FusedModule
    from lathesim.errors import LatheSimError
    from lathesim.plugins import Registry


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
    ready = len(seen) - compiled
    click.echo(f"{compiled} compiled in {time.perf_counter() - begun:.1f} s, {ready} before; kept in {cache_folder()}.")
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
