"""The hooks through which parts, effects, metrics, recording readers, commands and screens come in; stock ones and guests alike.

A plug-in is a Python file with functions of these names, each marked ``@hookimpl``::

    from lathesim.hookspecs import hookimpl

    @hookimpl
    def register_components():
        return [MyForce]
"""

from __future__ import annotations

import functools
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar, overload

from lathesim.errors import PluginError

if TYPE_CHECKING:
    from lathesim.component import Component

PROJECT = "lathesim"
ENTRY_POINTS = "lathesim.plugins"
"""The group of entry points by which an installed package announces a plug-in."""
MARK = f"{PROJECT}_impl"
"""The attribute of a hook by which pluggy knows it."""
Hook = TypeVar("Hook", bound=Callable[..., Any])


class _Marker:
    """Marks a function as a hook, with options of pluggy, as its own marker does, but without the time that it takes to import pluggy."""

    @overload
    def __call__(self, function: Hook) -> Hook: ...

    @overload
    def __call__(self, **options: bool) -> Callable[[Hook], Hook]: ...

    def __call__(self, function: Any = None, **options: bool) -> Any:
        if function is None:
            return functools.partial(self, **options)
        setattr(function, MARK, options)
        return function


hookimpl = _Marker()


@dataclass(frozen=True)
class DoorEntry:
    """A name with its ``target``, ``module:attribute``, which is imported when it is first used; a plug-in names its own ``__name__``."""

    name: str
    target: str

    def load(self) -> Any:
        """Return the target; :class:`PluginError` where it is not there."""
        module, _, attribute = self.target.partition(":")
        try:
            return getattr(importlib.import_module(module), attribute)
        except (ModuleNotFoundError, AttributeError) as error:
            if isinstance(error, ModuleNotFoundError) and error.name != module:
                raise
            raise PluginError(f"there is no '{self.target}', from which '{self.name}' is to come.") from None


@dataclass(frozen=True)
class CommandEntry(DoorEntry):
    """A command of ``lathesim``; its target is a command of click. ``--help`` lists it with its ``sentence`` under a ``heading``."""

    sentence: str
    heading: str = "Plug-ins"


@dataclass(frozen=True)
class ScreenEntry(DoorEntry):
    """A screen of the app that a ``key`` opens; calling its target gives a screen of Textual.

    A screen ``over`` another one opens over that; its target is called with the lesson on the bench. ``about`` says what its key does.
    """

    key: str
    title: str
    over: str = ""
    about: str = ""


def register_components() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return component classes; a machine names each by its class name."""


def register_effects() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return effect classes; a lesson inserts each by its class name."""


def register_remedies() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return remedy classes: effects that compensate another one; a lesson inserts each by its class name."""


def register_metrics() -> Sequence[Any]:  # type: ignore[empty-body]
    """Return metrics: what a number is called, its unit, how it is measured on a Record, and whether it is one ``of_cutting``."""


def register_recording_readers() -> Sequence[Any]:  # type: ignore[empty-body]
    """Return readers: which files each reads, and how it makes a Record of one."""


def register_commands() -> Sequence[CommandEntry]:  # type: ignore[empty-body]
    """Return commands; a command line calls each by its name."""


def register_screens() -> Sequence[ScreenEntry]:  # type: ignore[empty-body]
    """Return screens of the app; those of plug-ins come in when the app is opened."""


HOOKS = (
    "register_components", "register_effects", "register_remedies", "register_metrics", "register_recording_readers", "register_commands",
    "register_screens",
)  # fmt: skip


def no_package_has_plugins() -> bool:
    """Return whether no installed package announces plug-ins for certain, at a tenth of what the library takes that reads packages."""
    for folder in dict.fromkeys(sys.path):
        if os.path.isfile(folder):  # noqa: PTH113 - in a third of the time
            return False  # an archive, which the library can read
        if any(_announces(package) for package in _packages_in(folder or ".")):
            return False
    return True


def _packages_in(folder: str) -> list[str]:
    """Return the folders that describe the installed packages of a folder."""
    try:
        with os.scandir(folder) as entries:
            return [entry.path for entry in entries if entry.name.endswith((".dist-info", ".egg-info"))]
    except OSError:
        return []


def _announces(package: str) -> bool:
    try:
        with open(f"{package}/entry_points.txt", "rb") as file:  # noqa: PTH123 - in a third of the time
            return f"[{ENTRY_POINTS}]".encode() in file.read()
    except OSError:
        return False
