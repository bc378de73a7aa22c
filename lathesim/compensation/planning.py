"""How each remedy is sized for an effect that it answers, and what no software mends."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.diagnosed_machine import Bench, Diagnosed, InsertedRemedy
from lathesim.compensation.diagnosis_file import NamedEffect
from lathesim.component import Parameter
from lathesim.effects.remedy import EffectAtLoop, ModelledRemedy, Remedy
from lathesim.engine.assembly import FloatArray, Place
from lathesim.errors import PluginError
from lathesim.identification.position_loops import Loop
from lathesim.lessons.insertion import effect_part_name
from lathesim.plugins import Registry

DEAD_ZONE_SHARE = 0.9
"""Share of a dead zone that is stepped over: the whole of it swings about rest."""
_SPREADS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Lags over which the shift of a play is tried to turn over."""
_ANYWHERE_IN_GAP = (-1.0, 1.0)
_POINTS_PER_PERIOD = 24
_FEWEST_POINTS = 33
_MOST_POINTS = 4000
_BEYOND_TRAVEL = 0.02
_PROBE_VOLTAGE, _PROBE_FORCE = 1e-3, 0.1
"""Sizes of the two small disturbances [V, N] by which a force is told as a voltage."""


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
    parts = {part.name: part for part in bench.machinery.parts}
    found: list[Sized | NamedEffect] = []
    for named in effects:
        part = parts[named.entry.get("name") or effect_part_name(named.at, named.effect)]
        values = {name: part.parameters.get(name, item.default) for name, item in part.component.declared(Parameter).items()}
        host = Place.of(named.at).part
        axis = next((item for item in axes if host in item.loop.parts), None)
        found.append(Sized(named, values, axis, axes) if axis is not None else named)
    return found


def remedies_for(sized: Sized, registry: Registry) -> list[InsertedRemedy]:
    """Return the remedies that answer to an effect and can be sized, those made for the fewest effects first; none where none does.

    Raises :class:`PluginError` where a plug-in sizes values that its remedy does not have.
    """
    effect = sized.named.effect
    answering = sorted((kind for kind in _remedies(registry) if effect in kind.answers), key=lambda kind: len(kind.answers))
    found = [SIZINGS[kind.__name__](sized) if kind.__name__ in SIZINGS else _as_declared(sized, kind) for kind in answering]
    return [line for line in found if line is not None]


def answered(registry: Registry) -> set[str]:
    """Return the effects that some remedy answers to."""
    return {effect for kind in _remedies(registry) for effect in kind.answers}


def _remedies(registry: Registry) -> list[type[Remedy]]:
    return [kind for kind in registry.remedies.values() if issubclass(kind, Remedy)]


def _as_declared(sized: Sized, kind: type[Remedy]) -> InsertedRemedy | None:
    """Return a remedy with the sizes that its class declares."""
    axis = sized.axis
    sizes = kind.sized_for(
        EffectAtLoop(sized.named.effect, sized.values, axis.lag, axis.inner, axis.per_force, (axis.low, axis.high), sized.closes)
    )
    if sizes is None:
        return None
    unknown = [name for name in (*sizes.values, *sizes.tuned, *sizes.one_sided) if name not in kind.declared(Parameter)]
    if unknown:
        raise PluginError(f"the remedy '{kind.__name__}' sizes '{unknown[0]}', which is no parameter of it.", remedy="Give one of its own.")
    if not all(sizes.values.get(name) for name in sizes.tuned):
        raise PluginError(f"the remedy '{kind.__name__}' lets zero be tuned.", remedy="Give what is tuned a start that is not zero.")
    values = {**(_modelled(sized) if issubclass(kind, ModelledRemedy) else {}), **sizes.values}
    return _line(sized, kind.__name__, values, tuned=tuple(sizes.tuned), one_sided=tuple(sizes.one_sided), tables=dict(sizes.tables))


def _line(sized: Sized, remedy: str, values: Mapping[str, float], **further: object) -> InsertedRemedy:
    loop = sized.axis.loop
    name = f"{loop.controller}_{effect_part_name('', remedy).strip('_')}"
    return InsertedRemedy(remedy, loop.controller, name, dict(values), answers=(sized.named.effect,), **further)  # type: ignore[arg-type]


def _modelled(sized: Sized) -> dict[str, float]:
    return {"lag": sized.axis.lag, "inner": sized.axis.inner}


def _friction(sized: Sized) -> InsertedRemedy | None:
    p, volts = sized.values, sized.axis.per_force
    if volts == 0.0:
        return None
    effect = sized.named.effect
    values, tuned, sided = _modelled(sized), ["lead"], []
    if "level" in p and p["level"] != 0.0:
        values["level"] = volts * p["level"]
        tuned.append("level")
        sided.append("level")
    if effect == "AsymmetricFriction":
        values |= {"asymmetry": p["asymmetry"], "difference": volts * p["viscous_difference"]}
    if p.get("excess"):
        values |= {"excess": volts * p["excess"], "stribeck_velocity": p["stribeck_velocity"], "shape": p.get("shape", 1.0)}
        tuned.append("excess")
        sided.append("excess")
    if effect == "PositionDependentFriction":
        values |= {name: p[name] for name in ("period", "phase", "second_sine", "second_cosine", "third_sine", "third_cosine")}
        values |= {"amplitude": volts * p["amplitude"]}
    if effect == "PreslidingFriction":
        values |= {"distance": p["distance"]}
        tuned.append("distance")
    return _line(sized, "FrictionFeedforward", values, tuned=tuple(tuned), one_sided=tuple(sided))


def _bias(sized: Sized) -> InsertedRemedy:
    if sized.named.effect == "ForceOffset":
        return _line(sized, "CommandBias", {"bias": sized.axis.per_force * sized.values["offset"]}, tuned=("bias",))
    return _line(sized, "CommandBias", {"bias": -sized.values["offset"]})


def _gain(sized: Sized) -> InsertedRemedy:
    return _line(sized, "CommandGain", {name: sized.values[name] for name in ("error", "sag")})


def _dead_zone(sized: Sized) -> InsertedRemedy:
    values = {"half_width": sized.values["half_width"], "soft": max(1e-3, 0.02 * sized.values["half_width"])}
    return _line(sized, "InverseDeadZone", values, one_sided=("half_width",), share=DEAD_ZONE_SHARE)


def _in_gap(sized: Sized) -> dict[str, tuple[float, float]]:
    """Return on which side of its play an axis was left: nobody knows that at the start."""
    return {f"{sized.part}.start_in_gap": _ANYWHERE_IN_GAP}


def _play_of_reading(sized: Sized) -> InsertedRemedy | None:
    if not sized.closes:
        return None
    values = {**_modelled(sized), "width": sized.values["width"]}
    return _line(sized, "PlayReading", values, one_sided=("width",), free=_in_gap(sized))


def _play(sized: Sized) -> InsertedRemedy | None:
    if sized.closes:
        return None
    values = {**_modelled(sized), "width": sized.values["width"], "spread": max(0.3 * sized.axis.lag, 1e-3)}
    begins = {"spread": tuple(times * max(sized.axis.lag, 1e-3) for times in _SPREADS)}
    return _line(sized, "BacklashShift", values, tuned=("spread", "width"), one_sided=("width",), begins=begins, free=_in_gap(sized))


def _errors(sized: Sized) -> FloatArray:
    """Return places over the travel and the error at each, (points, 2) [m]."""
    low, high = sized.axis.low, sized.axis.high
    margin = max(_BEYOND_TRAVEL * (high - low), 1e-4)
    period = sized.values.get("lead") or sized.values.get("turn") or sized.values.get("signal_period") or 0.0
    width = high - low + 2.0 * margin
    count = _FEWEST_POINTS if period <= 0.0 else int(min(max(_FEWEST_POINTS, width / period * _POINTS_PER_PERIOD), _MOST_POINTS))
    places = np.linspace(low - margin, high + margin, count)
    return np.stack([places, _error_law(sized)(places)], axis=1)


def _reading_table(sized: Sized) -> InsertedRemedy | None:
    """The table of the loop's own encoder, of what it reads."""
    return _line(sized, "ReadingTable", {}, tables={"points": (("position", "error"), _errors(sized))}) if sized.closes else None


def _pitch_table(sized: Sized) -> InsertedRemedy | None:
    """The table of a screw, of where the table is."""
    if sized.closes:
        return None
    tables = {"points": (("position", "forward", "backward"), _errors(sized)[:, [0, 1, 1]])}
    return _line(sized, "PitchTable", _modelled(sized), tables=tables)


def _error_law(sized: Sized) -> Callable[[FloatArray], FloatArray]:
    p, effect = sized.values, sized.named.effect
    if effect == "CumulativePitchError":
        return lambda x: p["slope"] * (x - p["origin"])
    if effect == "ScaleFactorError":
        return lambda x: (p["factor"] - 1.0) * x
    if effect == "EncoderInterpolationError":
        return lambda x: (
            p["amplitude"] * np.sin(_turns(x, p["signal_period"]) + p["phase"])
            + p["second"] * np.sin(2.0 * _turns(x, p["signal_period"]) + p["phase"])
        )
    length = p["lead"] if "lead" in p else p["turn"]

    def wave(x: FloatArray) -> FloatArray:
        angle = _turns(x, length) + p["phase"]
        second = p["second_sine"] * np.sin(2.0 * angle) + p["second_cosine"] * np.cos(2.0 * angle)
        third = p["third_sine"] * np.sin(3.0 * angle) + p["third_cosine"] * np.cos(3.0 * angle)
        return np.asarray(p["amplitude"] * (np.sin(angle) + second + third))

    return wave


def _turns(x: FloatArray, length: float) -> FloatArray:
    return 2.0 * math.pi * x / length


def _square(sized: Sized) -> InsertedRemedy | None:
    others = [axis for axis in sized.axes if axis.loop.axis != sized.axis.loop.axis]
    if not others:
        return None
    other = others[0]
    places = np.linspace(other.low - 1e-3, other.high + 1e-3, _FEWEST_POINTS)
    side = -1.0 if sized.closes else 1.0
    errors = side * (sized.values["slope"] + sized.values["bow"] * places) * places
    tables = {"points": (("position", "error"), np.stack([places, errors], axis=1))}
    return _line(sized, "AcrossTable", {}, tables=tables, sources={"other": other.loop.reference})


def _growth(sized: Sized) -> InsertedRemedy:
    side = -1.0 if sized.closes else 1.0
    values = {name: sized.values[name] for name in ("time_constant", "fixed_end", "warmed_before")}
    return _line(sized, "GrowthModel", {"strain": side * sized.values["strain"], **values})


def _spindle_growth(sized: Sized) -> InsertedRemedy:
    side = -1.0 if sized.closes else 1.0
    values = {name: sized.values[name] for name in ("time_constant", "full_speed")}
    return _line(sized, "SpindleGrowthModel", {"growth": side * sized.values["growth"], **values})


def _motion(sized: Sized) -> InsertedRemedy:
    gains = ("velocity_gain", "acceleration_gain", "jerk_gain")
    return _line(sized, "MotionFeedforward", {**_modelled(sized), **dict.fromkeys(gains, 0.0)}, tuned=gains)


def _swing(sized: Sized) -> InsertedRemedy:
    values = {**_modelled(sized), "frequency": sized.values["frequency"], "damping": sized.values["damping"], "gain": 0.0, "drag": 0.0}
    return _line(sized, "SwingModel", values, tuned=("gain", "drag"))


def _wind_up(sized: Sized) -> InsertedRemedy:
    values = {**_modelled(sized), "per_speed": 0.0, "per_acceleration": 0.0}
    return _line(sized, "ComplianceShift", values, tuned=("per_speed", "per_acceleration"))


def _ripple(sized: Sized) -> InsertedRemedy | None:
    p, volts = sized.values, sized.axis.per_force
    if volts == 0.0:
        return None
    values = {"amplitude": volts * p["amplitude"], "period": p["period"], "phase": p["phase"]}
    if sized.named.effect == "TorqueRipple":
        values["amplitude"] = -values["amplitude"]
    else:
        values |= {"second": volts * p["second"], "second_phase": p["second_phase"]}
    return _line(sized, "RippleFeedforward", values, tuned=("amplitude", "lead"))


SIZINGS: dict[str, Callable[[Sized], InsertedRemedy | None]] = {
    "FrictionFeedforward": _friction,
    "CommandBias": _bias,
    "CommandGain": _gain,
    "InverseDeadZone": _dead_zone,
    "PlayReading": _play_of_reading,
    "BacklashShift": _play,
    "ReadingTable": _reading_table,
    "PitchTable": _pitch_table,
    "AcrossTable": _square,
    "GrowthModel": _growth,
    "SpindleGrowthModel": _spindle_growth,
    "SwingModel": _swing,
    "ComplianceShift": _wind_up,
    "MotionFeedforward": _motion,
    "RippleFeedforward": _ripple,
}
"""Stock remedy -> how it is sized; one of a plug-in has its own :meth:`Remedy.sized_for`."""


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
