"""The hooks through which parts, effects, metrics, recording readers, commands and screens come in; stock ones and guests alike.

A plug-in is a Python file with functions of these names, each marked ``@hookimpl``::

    from lathesim.hookspecs import hookimpl

    @hookimpl
    def register_components():
        return [MyForce]
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pluggy

from lathesim.errors import PluginError

if TYPE_CHECKING:
    from lathesim.component import Component

PROJECT = "lathesim"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


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


@hookspec
def register_components() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return component classes; a machine names each by its class name."""


@hookspec
def register_effects() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return effect classes; a lesson inserts each by its class name."""


@hookspec
def register_remedies() -> Sequence[type[Component]]:  # type: ignore[empty-body]
    """Return remedy classes: effects that compensate another one; a lesson inserts each by its class name."""


@hookspec
def register_metrics() -> Sequence[Any]:  # type: ignore[empty-body]
    """Return metrics: what a number is called, its unit, how it is measured on a Record, and whether it is one ``of_cutting``."""


@hookspec
def register_recording_readers() -> Sequence[Any]:  # type: ignore[empty-body]
    """Return readers: which files each reads, and how it makes a Record of one."""


@hookspec
def register_commands() -> Sequence[CommandEntry]:  # type: ignore[empty-body]
    """Return commands; a command line calls each by its name."""


@hookspec
def register_screens() -> Sequence[ScreenEntry]:  # type: ignore[empty-body]
    """Return screens of the app; those of plug-ins come in when the app is opened."""


HOOKS = (
    "register_components", "register_effects", "register_remedies", "register_metrics", "register_recording_readers", "register_commands",
    "register_screens",
)  # fmt: skip
