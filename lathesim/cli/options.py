"""The options that several commands share, the groups in which a command takes them, and the lesson and the registry they choose."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lathesim.cli import STOPPED as STOPPED
from lathesim.cli import tell_problems as tell_problems
from lathesim.workspace import load_with_workspace

if TYPE_CHECKING:
    from lathesim.lessons.lesson import Lesson
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry

Command = TypeVar("Command", bound=Callable[..., Any])


class OutputPath(click.Path):
    """A file to be written, or a ``folder``; with ``makes_folder`` missing folders above a file are made.

    Raises :class:`lathesim.errors.WriteError` if it cannot be written, see :func:`lathesim.whole_file.check_place`.
    """

    def __init__(self, *, folder: bool = False, makes_folder: bool = False, allow_dash: bool = False) -> None:
        super().__init__(path_type=Path, allow_dash=allow_dash)
        self._folder = folder
        self._makes_folder = makes_folder

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path once it is known that it can be written."""
        from lathesim.whole_file import check_folder, check_output, check_place

        path: Any = super().convert(value, param, ctx)
        if self.allow_dash and str(path) == "-":
            return path
        check = check_folder if self._folder else check_output if self._makes_folder else check_place
        check(path)
        return path


variant_option = click.option("--variant", metavar="NAME", help="One of the lesson's variants.")
program_option = click.option("--program", type=click.Path(path_type=Path), metavar="FILE", help="Another part program.")
set_option = click.option(
    "--set", "settings", multiple=True, metavar="PART.NAME=VALUE", help="Another value of a parameter, or start of a state; with its unit."
)
plugins_option = click.option(
    "--plugins",
    "plugin_folders",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Load the plug-ins of this folder too (they are code: load only what you trust).",
)
host_option = click.option(
    "--host", default="127.0.0.1", show_default=True, help="Another address of this machine, so that others can connect."
)
cluster_option = click.option(
    "--cluster", callback=lambda context, option, value: cluster_address(value), metavar="tcp://HOST:PORT", help="Work on a Dask cluster."
)
axis_option = click.option("--axis", "axis_texts", multiple=True, metavar="NAME=PART.INPUT", help="What follows an axis of the set-points.")


def cluster_address(text: str | None) -> str | None:
    """Return the address of a cluster; :class:`click.UsageError` where it is none."""
    if text is not None and not text.startswith(("tcp://", "dask://")):
        raise click.UsageError(f"--cluster {text}: write it as tcp://host:port.")
    return text


def cluster_at(address: str | None, plugins: Sequence[str]) -> contextlib.AbstractContextManager[Any]:
    """Return the cluster of ``--cluster``, whose lost workers are said on the error stream; None without the option."""
    if address is None:
        return contextlib.nullcontext()
    from lathesim.cluster import Cluster

    return Cluster(address, plugins, lambda text: click.echo(text, err=True))


def json_option(schema: str, what: str = "the result") -> Callable[[Command], Command]:
    """Return the option ``--json`` of a command whose result has a schema."""
    return click.option("--json", "as_json", is_flag=True, help=f"Write {what} as JSON (schema {schema}) and nothing else.")


def save_option(what: str) -> Callable[[Command], Command]:
    """Return the option ``--save`` of a command that draws its result."""
    return click.option("--save", type=OutputPath(), metavar="F.png", help=what)


def option(sentence: str, *names: str, **how: Any) -> Any:
    """Return the field of a group that is an option of the same name, unless it has other ``names`` on the command line.

    ``sentence`` is its help. It shows its default, and the type of the field says whether it is a flag, a path, or may be given again;
    ``how`` is what else :func:`click.option` takes.
    """
    return dataclasses.field(metadata={"names": names, "help": sentence, "show_default": "default" in how, **how})


def _declared(field: dataclasses.Field[Any]) -> Callable[[Command], Command]:
    """Return the option that a field of a group is."""
    how = dict(field.metadata)
    names = how.pop("names") or (f"--{field.name.replace('_', '-')}",)
    kind = str(field.type)
    if kind.startswith("Path"):
        how.setdefault("type", click.Path(path_type=Path))
    return click.option(*names, field.name, is_flag=kind == "bool", multiple=kind.startswith("tuple"), **how)


def grouped(**groups: type) -> Callable[[Command], Command]:
    """Return what hands a command its options in groups: each a dataclass whose fields have the names of the options.

    The fields that are an :func:`option` declare it too, in the place of the decorator.
    """

    def decorated(command: Command) -> Command:
        @functools.wraps(command)
        def call(**given: Any) -> Any:
            for name, group in groups.items():
                fields = [field.name for field in dataclasses.fields(group) if field.name in given]
                given[name] = group(**{field: given.pop(field) for field in fields})
            return command(**given)

        for field in (field for group in reversed(groups.values()) for field in reversed(dataclasses.fields(group)) if field.metadata):
            call = _declared(field)(call)
        return call  # type: ignore[return-value]

    return decorated


@dataclass(frozen=True)
class ChosenLesson:
    """The case of a lesson that a command line chooses. Each thing is read when it is first needed, and once."""

    lesson: str
    variant: str | None = None
    program: Path | None = None
    settings: tuple[str, ...] = ()
    plugin_folders: tuple[Path, ...] = ()

    @cached_property
    def registry(self) -> Registry:
        """The registry with the plug-ins of the command line."""
        return open_registry(self.plugin_folders)

    @cached_property
    def loaded(self) -> Lesson:
        """The lesson."""
        from lathesim.lessons.lesson import load_lesson

        return load_lesson(self.lesson)

    @cached_property
    def overrides(self) -> dict[str, str | float]:
        """What ``--set`` changes: ``part.name`` -> quantity."""
        return read_settings(self.settings)

    @cached_property
    def program_file(self) -> Path | None:
        """The file of ``--program``: as given, else in the lesson's folder, else the shipped one of that name."""
        from lathesim.errors import ProgramError
        from lathesim.lessons.lesson import find_program

        if self.program is None or self.program.is_file():
            return self.program
        found = find_program(self.program, self.loaded.path.parent)
        if found is None:
            raise ProgramError(f"there is no part program '{self.program}'.")
        return found

    @cached_property
    def prepared(self) -> Prepared:
        """The chosen case, ready to run."""
        return self.prepared_as(self.variant)

    def prepared_as(self, variant: str | None) -> Prepared:
        """Return the case of another variant, ready to run."""
        from lathesim.lessons.simulate import prepare

        return prepare(self.loaded, self.registry, variant, self.overrides, program=self.program_file)


def _choosing(*options: Callable[[Callable[..., Any]], Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return what hands a command the lesson it chooses, by the last options of its help."""

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        call = grouped(chosen=ChosenLesson)(command)
        for declare in (plugins_option, *reversed(options)):
            call = declare(call)
        return call

    return decorated


of_lesson = _choosing()
of_variant = _choosing(variant_option)
of_case = _choosing(variant_option, set_option)
of_program = _choosing(variant_option, program_option, set_option)


def read_settings(settings: tuple[str, ...]) -> dict[str, str | float]:
    """Return ``part.name`` -> quantity for the options ``--set part.name=quantity``."""
    found: dict[str, str | float] = {}
    for text in settings:
        name, equals, value = text.partition("=")
        if not equals or name.count(".") != 1 or not value.strip():
            raise click.UsageError(f"--set {text}: write it as --set x_axis.time_constant='24 ms'.")
        if name.strip() in found:
            raise click.UsageError(f"--set {text}: {name.strip()} is set twice.")
        found[name.strip()] = value.strip()
    return found


def read_axes(texts: tuple[str, ...]) -> dict[str, str]:
    """Return ``name -> part.item`` for the options ``--axis x=x_controller.reference``."""
    found = {}
    for text in texts:
        name, equals, item = text.partition("=")
        if not equals or not name.strip() or item.count(".") != 1:
            raise click.UsageError(f"--axis {text}: write it as --axis x=x_controller.reference.")
        found[name.strip()] = item.strip()
    return found


def read_names(texts: tuple[str, ...]) -> list[str]:
    """Return the names of an option that takes several, with commas between them or given again and again."""
    return [name.strip() for text in texts for name in text.split(",") if name.strip()]


_MOST_VALUES = 100_000
"""Values of a range at most, assumed: more of them are a slip of the pen."""


def read_range(option: str, text: str) -> list[float]:
    """Read ``500..8000:76`` of an option: the ends and how many values, evenly spaced."""
    ends, _, count = text.partition(":")
    low, dots, high = ends.partition("..")
    try:
        first, last, number = float(low), float(high if dots else low), int(count) if count else (2 if dots else 1)
    except ValueError:
        raise click.UsageError(f"{option} {text}: write it as {option} 500..8000:76.") from None
    if not 0.0 < first <= last < math.inf or not 1 <= number <= _MOST_VALUES:
        raise click.UsageError(f"{option} {text}: values rise from above 0, and there is at least one.")
    return [first + (last - first) * place / max(1, number - 1) for place in range(number)]


def read_ends(option: str, text: str) -> tuple[float, float]:
    """Read ``50..2000`` of an option."""
    low, dots, high = text.partition("..")
    try:
        first, last = float(low), float(high)
    except ValueError:
        raise click.UsageError(f"{option} {text}: write it as {option} 50..2000.") from None
    if not dots or not 0.0 <= first < last:
        raise click.UsageError(f"{option} {text}: the ends rise from 0 on.")
    return first, last


def open_registry(plugin_folders: tuple[Path, ...], *, tell: bool = True) -> Registry:
    """Return the registry with the user's plug-in folders and that of the workspace; tell each plug-in at fault in one line."""
    from lathesim.engine.module_cache import tell_compiling_to

    tell_compiling_to(_told_once())
    registry = load_with_workspace(plugin_folders)
    if tell:
        tell_problems(registry)
    return registry


def _told_once() -> Callable[[str], None]:
    """Return what writes sentences of the compiler to the error stream, of each kind ("Compiling once ...") only the first."""
    told: set[str] = set()

    def tell(sentence: str) -> None:
        kind = sentence.partition(",")[0]
        if kind not in told:
            told.add(kind)
            click.echo(sentence, err=True)

    return tell
