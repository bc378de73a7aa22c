"""The hooks through which machine parts, effects, metrics and recording readers come in; stock ones and guests alike.

A plug-in is a Python file with functions of these names, each marked ``@hookimpl``::

    from lathesim.hookspecs import hookimpl

    @hookimpl
    def register_components():
        return [MyForce]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import pluggy

if TYPE_CHECKING:
    from lathesim.component import Component

PROJECT = "lathesim"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


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


HOOKS = ("register_components", "register_effects", "register_remedies", "register_metrics", "register_recording_readers")
