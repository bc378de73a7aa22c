"""How each remedy is sized for an effect that it answers, and what no software mends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.control_lines import Control
from lathesim.compensation.diagnosed_machine import Bench, Diagnosed, InsertedRemedy, NamedEffect
from lathesim.component import Input, Parameter
from lathesim.effects.remedy import EffectAtLoop, ModelledRemedy, Remedy
from lathesim.engine.assembly import FloatArray, Place
from lathesim.errors import PluginError
from lathesim.identification.position_loops import Loop
from lathesim.lessons.insertion import effect_part_name
from lathesim.plugins import Registry

_PROBE_VOLTAGE, _PROBE_FORCE = 1e-3, 0.1
"""Sizes of the two small disturbances [V, N] by which a force is told as a voltage."""
TIMES = ("lead", "spread", "fade")
"""What is tuned by steps of one size."""
FIRST_CHANGES = {
    "velocity_gain": 1e-2, "acceleration_gain": 1e-3, "jerk_gain": 1e-5, "per_speed": 1e-6, "per_acceleration": 1e-7, "drag": 0.2,
    "gain": 1e-2, "level": 1e-3, "bias": 1e-4, "excess": 1e-3, "amplitude": 1e-4, "width": 1e-7, "distance": 1e-7,
}  # fmt: skip
"""First change of a value that may begin at zero [its SI unit]."""


@dataclass(frozen=True)
class LoopToSize:
    """What is known of a loop for sizing: its model T, T_i [s], volts per newton, mass over gain, and how far it travels [m]."""

    loop: Loop
    lag: float
    inner: float
    low: float
    high: float
    per_force: float


@dataclass(frozen=True)
class Sized:
    """An effect with its values [SI] as it is placed on the bench, and the loop that it belongs to."""

    named: NamedEffect
    values: Mapping[str, float]
    axis: LoopToSize
    axes: tuple[LoopToSize, ...]

    @property
    def part(self) -> str:
        """The name of the effect on the bench."""
        return self.named.entry.get("name") or effect_part_name(self.named.at, self.named.effect)

    @property
    def host(self) -> str:
        """The part it sits on."""
        return Place.of(self.named.at).part

    @property
    def closes(self) -> bool:
        """Whether it falsifies the reading that closes the loop; else it moves the table behind the loop's back."""
        return self.host == self.axis.loop.sensor


def axes_of(diagnosed: Diagnosed, bench: Bench, *, with_force: bool) -> tuple[LoopToSize, ...]:
    """Return what sizing needs of each loop, from runs of the sound machine."""
    record = bench.runs([bench.sound], exact=True)[0]
    axes = []
    for loop in bench.loops:
        asked = bench.channel(record, loop.reference)
        place = bench.channel(record, f"{loop.axis}.position")
        speed = bench.channel(record, f"{loop.axis}.velocity")
        assert asked is not None and place is not None and speed is not None
        lag, inner = loop_model(asked, place, speed, bench.period)
        ratio = _per_force(diagnosed, loop) if with_force else 0.0
        axes.append(LoopToSize(loop, lag, inner, float(np.min(asked)), float(np.max(asked)), ratio))
    return tuple(axes)


def loop_model(asked: FloatArray, place: FloatArray, speed: FloatArray, period: float) -> tuple[float, float]:
    """Return T and T_i [s] of  T T_i m'' + T m' + m = r  by least squares over a run; none below zero."""
    slope = np.gradient(speed, period)
    behind = asked[:-2] - place[1:-1]
    shape = np.stack([speed[1:-1], slope[1:-1]], axis=1)
    scale = np.maximum(np.sqrt(np.mean(shape**2, axis=0)), 1e-12)
    solved = np.linalg.lstsq(shape / scale, behind, rcond=None)[0] / scale
    lag = max(float(solved[0]), 0.0)
    return lag, max(float(solved[1]) / lag, 0.0) if lag > 0.0 else 0.0


def _per_force(diagnosed: Diagnosed, loop: Loop) -> float:
    """Return the volts at the controller that hold a newton at the axis: which voltage moves the table as a force does."""
    probe = InsertedRemedy("CommandBias", f"{loop.controller}", "probe_bias", {"bias": _PROBE_VOLTAGE})
    entry = {"effect": "ForceOffset", "at": loop.axis, "name": "probe_force", "offset": f"{_PROBE_FORCE} N"}
    bench = Diagnosed(diagnosed.lesson, diagnosed.registry, (entry,), diagnosed.values, diagnosed.folder, diagnosed.variant,
                      diagnosed.samples).bench([probe])  # fmt: skip
    rest, pushed, biased = bench.runs([bench.sound, bench.bare, {**bench.sound, "probe_bias.share": 1.0}], exact=True)
    row = [other.axis for other in bench.loops].index(loop.axis)
    by_force, by_bias = (bench.table(item)[row] - bench.table(rest)[row] for item in (pushed, biased))
    size = float(by_bias @ by_bias)
    return -float(by_force @ by_bias) / size * _PROBE_VOLTAGE / _PROBE_FORCE if size > 0.0 else 0.0


def sized_effects(bench: Bench, effects: Sequence[NamedEffect], axes: tuple[LoopToSize, ...]) -> list[Sized | NamedEffect]:
    """Return each effect with its loop, or as it is where it belongs to none."""
    found: list[Sized | NamedEffect] = []
    for named in effects:
        part = bench.machinery.by_name[named.entry.get("name") or effect_part_name(named.at, named.effect)]
        host = Place.of(named.at).part
        axis = next((item for item in axes if host in item.loop.parts), None)
        found.append(Sized(named, part.values, axis, axes) if axis is not None else named)
    return found


def remedies_for(sized: Sized, registry: Registry, control: Control | None = None) -> list[InsertedRemedy]:
    """Return the remedies that answer to an effect and can be sized, those made for the fewest effects first; none where none does.

    With a ``control``, those that it holds, with the values that it fixes.
    Raises :class:`PluginError` where a plug-in sizes values that its remedy does not have.
    """
    effect = sized.named.effect
    answering = [kind for kind in _remedies(registry) if effect in kind.answers and (control is not None or not kind.typed_in)]
    found = [_line(sized, kind) for kind in sorted(answering, key=lambda kind: len(kind.answers))]
    lines = [line for line in found if line is not None]
    return lines if control is None else [held for line in lines if (held := control.fitted(line, registry)) is not None]


def answered(registry: Registry) -> set[str]:
    """Return the effects that some remedy answers to."""
    return {effect for kind in _remedies(registry) for effect in kind.answers}


def _remedies(registry: Registry) -> list[type[Remedy]]:
    return [kind for kind in registry.remedies.values() if issubclass(kind, Remedy)]


def _line(sized: Sized, kind: type[Remedy]) -> InsertedRemedy | None:
    """Return a remedy with the sizes that its class declares."""
    axis, loop, effect = sized.axis, sized.axis.loop, sized.named.effect
    is_led = not loop.sensor
    if is_led and kind.site != "drive":
        return None
    across = next((other for other in sized.axes if other.loop.axis != loop.axis), None)
    other = (across.loop.reference, (across.low, across.high)) if across is not None else ("", (0.0, 0.0))
    travel = (axis.low, axis.high)
    sizes = kind.sized_for(EffectAtLoop(effect, sized.values, axis.lag, axis.inner, axis.per_force, travel, sized.closes, *other))
    if sizes is None:
        return None
    unknown = [name for name in (*sizes.values, *sizes.tuned, *sizes.one_sided) if name not in kind.declared(Parameter)]
    if unknown:
        raise PluginError(f"the remedy '{kind.__name__}' sizes '{unknown[0]}', which is no parameter of it.", remedy="Give one of its own.")
    if not all(sizes.values.get(name) or name in FIRST_CHANGES or name in TIMES for name in sizes.tuned):
        raise PluginError(f"the remedy '{kind.__name__}' tunes a value that starts at zero.", remedy="Start it at another value.")
    model = {"lag": axis.lag, "inner": axis.inner} if issubclass(kind, ModelledRemedy) else {}
    asked = {"drive": loop.reference} if is_led and "drive" in kind.declared(Input) else {}
    return InsertedRemedy(
        kind.__name__, loop.controller, f"{loop.controller.replace('.', '_')}_{effect_part_name('', kind.__name__).strip('_')}",
        {**model, **sizes.values}, {**asked, **sizes.sources}, sizes.tables, (effect,), sizes.tuned, sizes.one_sided, sizes.begins,
        {f"{sized.part}.{name}": ends for name, ends in sizes.free.items()}, sizes.share,
    )  # fmt: skip


REPAIRS = {
    "LostCounts": "counts are lost at random: repair the encoder's cable, plug or supply, or take a slower edge",
    "Quantisation": "a reading cannot be finer than its steps: take a finer encoder",
    "ConverterResolution": "a voltage cannot be finer than its levels: take a converter of more bits",
    "SampleJitter": "the instants are random: mend the clock of the control",
    "BeltSlip": "the belt slips at random: tension or replace it",
    "ChannelTimeShift": "a recorded channel is late, the machine is not: correct it in the recording",
    "ClockSkew": "the recorder's clock is off, the machine's is not: correct it in the recording",
    "DriveSaturation": "a drive gives no more than it can: lower feed or acceleration, or take a larger drive",
    "CurrentLimit": "a motor gets no more current than its amplifier gives: accelerate less, or take a larger amplifier",
    "SlewLimit": "a drive changes no faster than it can: lower the jerk, or take a faster amplifier",
    "RegenerativeChatter": "cut at another speed: 'lathesim lobes' shows where the cut is stable, or vary the speed",
    "WorkpieceDeflection": "support the part, take less depth, or write the remedy as a program, which mirrors what bends into its path",
    "ToolCompliance": "take a stiffer tool or less depth, or write the remedy as a program, which mirrors what bends into its path",
    "SpeedDroop": "give the spindle's controller an integral part, or program as much more speed as the load takes",
    "ViscousWarmUp": "run the machine warm before it works, or give the loop an integral part",
    "Unbalance": "balance the spindle",
    "Runout": "true the part or turn it round in the chuck",
    "SensorFilter": "take a faster sensor, or lower the gain that its lag allows",
    "TachometerRipple": "take a better tachometer, or the difference of the encoder's readings",
    "DynamometerDrift": "reset the force sensor; the machine is not at fault",
    "DynamometerCrosstalk": "calibrate the force sensor; the machine is not at fault",
    "DynamometerResonance": "filter the force sensor; the machine is not at fault",
}
"""Effect -> what to do. A remedy in software would hide it or make it worse."""
OF_THE_CUT = "it is of the cut: change tool, feed or speed"


def repair_of(effect: str, family: str) -> str:
    """Return what to repair where no remedy answers to an effect."""
    if effect in REPAIRS:
        return REPAIRS[effect]
    if family in ("force law", "force", "force over time", "process"):
        return OF_THE_CUT
    return "no remedy of a control answers to it: see what 'lathesim effects' says of its cause"
