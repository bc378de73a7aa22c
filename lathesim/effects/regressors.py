"""Linear forms of the effects, by class name: quick starts for a fit, not what is finally believed."""

from __future__ import annotations

import math

import numpy as np

from lathesim.effects.linear_form import (
    Coefficients,
    Columns,
    LinearForm,
    Shape,
    Signal,
    Signals,
    dahl,
    first_order,
    last_direction,
    rate,
    second_order,
    sine_columns,
    sine_parameters,
    size_and_phase,
    spent,
)


def regressors(effect: str, signals: Signals, shape: Shape | None = None) -> Columns:
    """Give the columns of an effect: name -> array of the length of the signals. ``KeyError`` where it has none."""
    return LINEAR_FORMS[effect].columns(signals, shape or {})


def _turns(signals: Signals, period: float, name: str = "position") -> Signal:
    found: Signal = 2.0 * math.pi * signals[name] / period
    return found


def _stribeck(signals: Signals, shape: Shape) -> Columns:
    velocity = signals["velocity"]
    falling = np.exp(-((np.abs(velocity) / shape["stribeck_velocity"]) ** shape.get("shape", 1.0)))
    return {"excess": falling * np.sign(velocity)}


def _presliding(signals: Signals, shape: Shape) -> Columns:
    return {"level": dahl(signals["position"], shape["distance"])}


def _asymmetric(signals: Signals, shape: Shape) -> Columns:
    velocity = signals["velocity"]
    return {"level": np.sign(velocity), "level*asymmetry": np.abs(np.sign(velocity)), "viscous_difference": np.abs(velocity)}


def _asymmetric_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    level = max(found["level"], 1e-12)
    asymmetry = min(max(found["level*asymmetry"] / level, -0.95), 0.95)
    return {"level": level, "asymmetry": asymmetry, "viscous_difference": found["viscous_difference"]}


def _positional(signals: Signals, shape: Shape) -> Columns:
    sign = np.sign(signals["velocity"])
    return sine_columns(_turns(signals, shape["period"]), "wave", sign)


def _positional_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    size, phase = size_and_phase(found, "wave")
    return {"amplitude": size, "phase": phase}


def _resonance(signals: Signals, shape: Shape) -> Columns:
    _, curved = second_order(-signals["acceleration"], signals["time"], shape["frequency"], shape.get("damping", 0.05))
    return {"table_share": signals["inertia"] * curved}


def _rocking(signals: Signals, shape: Shape) -> Columns:
    followed, _ = second_order(-signals["force"], signals["time"], shape["frequency"], shape.get("damping", 0.05))
    return {"mobility": -followed}


def _late(name: str, times: float = 1.0) -> LinearForm:
    def columns(signals: Signals, shape: Shape) -> Columns:
        return {name: -times * rate(signals["incoming"], signals["time"])}

    return LinearForm(("time", "incoming"), columns)


def _ripple(signals: Signals, shape: Shape) -> Columns:
    angle = _turns(signals, shape["period"])
    return {**sine_columns(angle, "amplitude", -1.0), **sine_columns(angle, "share", -signals["force"])}


def _ripple_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    size, phase = size_and_phase(found)
    share, share_phase = size_and_phase(found, "share")
    return {"amplitude": size, "share": share * math.cos(share_phase - phase), "phase": phase}


def _cogging(signals: Signals, shape: Shape) -> Columns:
    angle = _turns(signals, shape["period"])
    return {**sine_columns(angle), **sine_columns(2.0 * angle, "second")}


def _cogging_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    size, phase = size_and_phase(found)
    second, second_phase = size_and_phase(found, "second")
    return {"amplitude": size, "phase": phase, "second": second, "second_phase": second_phase}


def _sine_along(period: str, signal: str = "incoming") -> LinearForm:
    def columns(signals: Signals, shape: Shape) -> Columns:
        return sine_columns(_turns(signals, shape[period], signal))

    return LinearForm((signal,), columns, (period,), sine_parameters())


def _tachometer(signals: Signals, shape: Shape) -> Columns:
    incoming = signals["incoming"]
    return {"gain_error": incoming, **sine_columns(shape["order"] * signals["angle"], "ripple", incoming)}


def _tachometer_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    size, phase = size_and_phase(found, "ripple")
    return {"gain_error": found["gain_error"], "ripple": size, "phase": phase}


def _runout(signals: Signals, shape: Shape) -> Columns:
    depth = signals["depth"]
    weight = np.where(depth > 0.0, signals["incoming"] / np.where(depth > 0.0, depth, 1.0), 0.0)
    return sine_columns(shape.get("order", 1.0) * signals["angle"], "eccentricity", weight)


def _unbalance(signals: Signals, shape: Shape) -> Columns:
    return sine_columns(signals["angle"], "moment", signals["spindle_speed"] ** 2)


def _growth(signals: Signals, shape: Shape) -> Columns:
    full = np.abs(signals["spindle_speed"]) / shape.get("full_speed", 300.0)
    return {"growth": first_order(full, signals["time"], shape["time_constant"])}


def _edge(signals: Signals, shape: Shape) -> Columns:
    cutting = (signals["depth"] > 0.0) & (signals["feed"] > 0.0)
    return {"coefficient": np.where(cutting, signals["depth"], 0.0)}


def _logarithm(signal: Signal, reference: float) -> Signal:
    found: Signal = np.log(np.where(signal > 0.0, signal, reference) / reference)
    return found


def _thickness(signals: Signals, shape: Shape) -> Columns:
    return {"exponent": -signals["incoming"] * _logarithm(signals["feed"], shape.get("reference", 1e-3))}


def _speed(signals: Signals, shape: Shape) -> Columns:
    speed = np.abs(signals["speed"])
    beside = (speed - shape["hump_speed"]) / shape["hump_width"]
    incoming = signals["incoming"]
    return {"exponent": incoming * _logarithm(speed, shape.get("reference", 2.0)), "hump": incoming * np.exp(-beside * beside)}


def _softening(signals: Signals, shape: Shape) -> Columns:
    incoming = signals["incoming"]
    return {"softening": -incoming * first_order((incoming != 0.0).astype(float), signals["time"], shape["time_constant"])}


def _wear(signals: Signals, shape: Shape) -> Columns:
    incoming = signals["incoming"]
    age = spent(np.abs(incoming), signals["time"])
    return {"growth*rate": incoming * age, "growth*break_in": incoming * (1.0 - np.exp(-age / shape["break_in_time"]))}


def _wear_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    growth = 1500.0
    return {"growth": growth, "rate": max(found["growth*rate"], 0.0) / growth, "break_in": max(found["growth*break_in"], 0.0) / growth}


def _entry(signals: Signals, shape: Shape) -> Columns:
    incoming = signals["incoming"]
    cutting = (incoming != 0.0).astype(float)
    age = spent(cutting, signals["time"])
    entered = np.maximum.accumulate(np.where(cutting == 0.0, age, 0.0))
    return {"lacking": -incoming * np.exp(-(age - entered) / shape["time_constant"])}


def _slot(signals: Signals, shape: Shape) -> Columns:
    away = np.remainder(signals["angle"] - shape["middle"] + math.pi, 2.0 * math.pi) - math.pi
    return {"missing": -signals["incoming"] * (np.abs(away) < math.pi * shape["width"])}


def _hard(signals: Signals, shape: Shape) -> Columns:
    spread = math.pi * shape["width"]
    return {"rise": signals["incoming"] * np.exp((np.cos(signals["angle"] - shape["middle"]) - 1.0) / (2.0 * spread * spread))}


def _segments(signals: Signals, shape: Shape) -> Columns:
    incoming, time = signals["incoming"], signals["time"]
    run = np.abs(signals["speed"]) * (incoming != 0.0)
    slid = np.concatenate([[0.0], np.cumsum(run[:-1] * np.diff(time))])
    return sine_columns(2.0 * math.pi * slid / shape["length"], "share", incoming)


def _dynamometer(signals: Signals, shape: Shape) -> Columns:
    incoming, time = signals["incoming"], signals["time"]
    leaked = np.concatenate([[0.0], np.cumsum(incoming[:-1] * np.diff(time))])
    return {"leak": -leaked, "drift": time - time[0], "offset": np.ones_like(time)}


def _ringing(signals: Signals, shape: Shape) -> Columns:
    incoming = signals["incoming"]
    followed, _ = second_order(incoming, signals["time"], shape["frequency"], shape.get("damping", 0.02))
    angular = 2.0 * math.pi * shape["frequency"]
    return {"coupling": angular * angular * followed - incoming}


def _thermal(signals: Signals, shape: Shape) -> Columns:
    warm = 1.0 - np.exp(-signals["time"] / shape["time_constant"])
    return {"strain": warm * signals["incoming"], "strain*fixed_end": -warm}


def _thermal_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    strain = found["strain"]
    return {"strain": strain, "fixed_end": found["strain*fixed_end"] / strain if strain else 0.0}


def _pitch_parameters(found: Coefficients, shape: Shape) -> dict[str, float]:
    slope = found["slope"]
    return {"slope": slope, "origin": found["slope*origin"] / slope if slope else 0.0}


LINEAR_FORMS: dict[str, LinearForm] = {
    "CoulombFriction": LinearForm(("velocity",), lambda s, p: {"level": np.sign(s["velocity"])}),
    "StribeckFriction": LinearForm(("velocity",), _stribeck, ("stribeck_velocity", "shape")),
    "PreslidingFriction": LinearForm(("position",), _presliding, ("distance",)),
    "AsymmetricFriction": LinearForm(("velocity",), _asymmetric, (), _asymmetric_parameters),
    "ForceOffset": LinearForm(("time",), lambda s, p: {"offset": np.ones_like(s["time"])}),
    "PositionDependentFriction": LinearForm(("velocity", "position"), _positional, ("period",), _positional_parameters),
    "ViscousWarmUp": LinearForm(
        ("time", "velocity"), lambda s, p: {"change": (1.0 - np.exp(-s["time"] / p["time_constant"])) * s["velocity"]}, ("time_constant",)
    ),
    "Backlash": LinearForm(("velocity",), lambda s, p: {"width": -0.5 * last_direction(s["velocity"])}),
    "CumulativePitchError": LinearForm(
        ("incoming",), lambda s, p: {"slope": s["incoming"], "slope*origin": -np.ones_like(s["incoming"])}, (), _pitch_parameters
    ),
    "PeriodicPitchError": _sine_along("lead"),
    "ThermalScrewGrowth": LinearForm(("time", "incoming"), _thermal, ("time_constant",), _thermal_parameters),
    "SquarenessError": LinearForm(("other_position",), lambda s, p: {"slope": s["other_position"], "bow": s["other_position"] ** 2}),
    "AxialResonance": LinearForm(("time", "acceleration", "inertia"), _resonance, ("frequency", "damping")),
    "TorsionalWindUp": LinearForm(("force",), lambda s, p: {"compliance": -s["force"]}),
    "BaseRocking": LinearForm(("time", "force"), _rocking, ("frequency", "damping")),
    "MotorInductance": _late("time_constant"),
    "CurrentLoopLag": _late("time_constant", 1.4),
    "SensorFilter": _late("time_constant"),
    "TransportDelay": _late("delay"),
    "ChannelTimeShift": _late("shift"),
    "ClockSkew": LinearForm(("time", "incoming"), lambda s, p: {"skew": -s["time"] * rate(s["incoming"], s["time"])}),
    "AmplifierDeadZone": LinearForm(("incoming",), lambda s, p: {"half_width": -np.sign(s["incoming"])}),
    "DriveGainError": LinearForm(("incoming",), lambda s, p: {"error": s["incoming"], "sag": -s["incoming"] * np.abs(s["incoming"])}),
    "ConverterOffset": LinearForm(("incoming",), lambda s, p: {"offset": np.ones_like(s["incoming"])}),
    "ScaleFactorError": LinearForm(
        ("incoming",), lambda s, p: {"factor-1": s["incoming"]}, (), lambda found, p: {"factor": 1.0 + found["factor-1"]}
    ),
    "TorqueRipple": LinearForm(("position", "force"), _ripple, ("period",), _ripple_parameters),
    "Cogging": LinearForm(("position",), _cogging, ("period",), _cogging_parameters),
    "EncoderEccentricity": _sine_along("turn"),
    "EncoderInterpolationError": _sine_along("signal_period"),
    "LostCounts": LinearForm(("time",), lambda s, p: {"jump": (s["time"] >= p["instant"]).astype(float)}, ("instant",)),
    "TachometerRipple": LinearForm(("incoming", "angle"), _tachometer, ("order",), _tachometer_parameters),
    "Runout": LinearForm(("incoming", "angle", "depth"), _runout, ("order",), sine_parameters("eccentricity", "phase", math.pi / 2)),
    "Unbalance": LinearForm(("angle", "spindle_speed"), _unbalance, (), sine_parameters("moment", "phase", math.pi / 2)),
    "BeltSlip": LinearForm(("incoming", "load"), lambda s, p: {"slip": -s["incoming"], "creep": -s["incoming"] * np.abs(s["load"])}),
    "SpeedDroop": LinearForm(("time", "load"), lambda s, p: {"droop": -first_order(s["load"], s["time"], p["response"])}, ("response",)),
    "SpindleGrowth": LinearForm(("time", "spindle_speed"), _growth, ("time_constant",)),
    "EdgeForce": LinearForm(("depth", "feed"), _edge),
    "ChipThicknessExponent": LinearForm(("incoming", "feed"), _thickness),
    "SpeedDependence": LinearForm(("incoming", "speed"), _speed, ("hump_speed", "hump_width")),
    "TemperatureSoftening": LinearForm(("time", "incoming"), _softening, ("time_constant",)),
    "WearForceGrowth": LinearForm(("time", "incoming"), _wear, ("break_in_time",), _wear_parameters),
    "EntryBuildUp": LinearForm(("time", "incoming"), _entry, ("time_constant",)),
    "InterruptedCut": LinearForm(("incoming", "angle"), _slot, ("width", "middle")),
    "HardSpot": LinearForm(("incoming", "angle"), _hard, ("width", "middle")),
    "ChipSegmentation": LinearForm(("time", "incoming", "speed"), _segments, ("length",), sine_parameters("share")),
    "DynamometerDrift": LinearForm(("time", "incoming"), _dynamometer),
    "DynamometerCrosstalk": LinearForm(("other_force",), lambda s, p: {"share": s["other_force"]}),
    "DynamometerResonance": LinearForm(("time", "incoming"), _ringing, ("frequency", "damping")),
}
"""Effect -> its linear form. Effects that have none: saturation, slew limit, quantisation, jitter, built-up edge, chatter, deflection."""
