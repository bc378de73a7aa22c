"""Rigs to put effects on: the shipped templates, driven by something that moves."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.lessons.assemble import assemble
from lathesim.lessons.insertion import Machinery, insert_effect
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record

PERIOD = 1e-3


@functools.cache
def registry() -> Registry:
    return load_registry(installed=False)


def rig(template: str, folder: Path, drive: dict[str, FloatArray] | None = None) -> Machinery:
    """Return a shipped template in which recorded signals (one value each 1 ms) replace what feeds some inputs."""
    lesson = folder / f"{template}_lesson.yaml"
    lesson.write_text(f"lesson: rig\nmachine: {template}\n")
    machinery = assemble(load_lesson(lesson), registry())
    for target, values in (drive or {}).items():
        part, _, item = target.partition(".")
        host = next(known for known in machinery.parts if known.name == part)
        unit = host.component.declarations[item].unit
        player = registry().component("RecordedSignal").with_units({"signal": unit})
        name = f"recorded_{part}_{item}"
        samples = np.column_stack([np.arange(len(values)) * PERIOD, values])
        machinery = dataclasses.replace(
            machinery,
            parts=(Part(name, player, tables={"samples": samples}), *machinery.parts),
            wires=(*(known for known in machinery.wires if known.target != target), Wire(target, f"{name}.signal")),
        )
    return machinery


def time(duration: float) -> FloatArray:
    return np.arange(round(duration / PERIOD) + 1) * PERIOD


def moving_axis(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the cascade axis on its way to and fro, 2 mm each way."""
    reference = 1e-3 * (1.0 - np.cos(2.0 * math.pi * 5.0 * time(duration)))
    return rig("cascade_axis", folder, {"x_controller.reference": reference})


def pushed_axis(folder: Path, force: FloatArray) -> Machinery:
    return rig("force_axis", folder, {"x_axis.force": force})


def led_along(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the axis that is led along its reference, to and fro, 2 mm each way."""
    rate = 2.0 * math.pi * 5.0
    turned = rate * time(duration)
    motion = (1e-3 * (1.0 - np.cos(turned)), 1e-3 * rate * np.sin(turned), 1e-3 * rate**2 * np.cos(turned))
    return rig("led_axis", folder, dict(zip(("x_axis.reference", "x_axis.reference_velocity", "x_axis.acceleration"), motion, strict=True)))


def turning_spindle(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the spindle under a torque that swings about 0.02 N m."""
    return rig("torque_spindle", folder, {"spindle.torque": 0.02 + 0.03 * np.sin(2.0 * math.pi * 8.0 * time(duration))})


def cutting(folder: Path, duration: float = 0.2) -> Machinery:
    """Return the process with two cuts and a pause between them."""
    passed = time(duration)
    depth = np.where((passed > 0.02) & (passed < 0.09) | (passed > 0.12), 1e-3, 0.0)
    return rig("cutting_process", folder, {"cutting.depth": depth})


def with_effect(machinery: Machinery, name: str, at: str, **settings: float | str) -> Machinery:
    """Insert a stock effect; a text is the source of an input, a number a parameter (or a constant for an input)."""
    effect = registry().effect(name)
    assert issubclass(effect, Effect)
    inputs = {key for key, item in effect.declarations.items() if item.kind == "input"}
    sources = {key: value for key, value in settings.items() if key in inputs}
    parameters = {key: float(value) for key, value in settings.items() if key not in inputs}
    return insert_effect(machinery, effect, at, parameters=parameters, sources=sources)


def record(machinery: Machinery, duration: float = 0.2, **overrides: float) -> Record:
    named = {key.replace("__", "."): value for key, value in overrides.items()}
    return run(wire(machinery), duration=duration, engine="plain", overrides=named)
