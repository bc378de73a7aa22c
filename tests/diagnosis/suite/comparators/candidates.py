"""The grey boxes of the three rigs with their candidates: every catalogued effect the suite may hide, and where a fit of it starts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from tests.diagnosis.suite.comparators.axis_model import AxisNumbers, simulate_axis_numbers
from tests.diagnosis.suite.comparators.cutting_model import CHANNELS, Cut, simulate_cut
from tests.diagnosis.suite.comparators.equation_error import axis_signals, spindle_signals, strongest_periods
from tests.diagnosis.suite.comparators.raw_bic import Candidate
from tests.diagnosis.suite.comparators.read_case import PERIOD, Case
from tests.diagnosis.suite.comparators.spindle_model import SpindleNumbers, simulate_spindle_numbers

_ROWS = ("command", "encoder", "scale", "current")
_AT_ALL = 1e9


class _Box:
    """What the three have in common: a case and one of its recordings."""

    def __init__(self, case: Case, columns: dict[str, np.ndarray]) -> None:
        self.case, self.columns = case, columns
        self.uncertain = {name: (case.given[name], sigma) for name, sigma in case.sigma.items()}
        self.observed = np.array([columns[channel] for channel in case.channels])


class AxisBox(_Box):
    """An axis in closed loop."""

    @cached_property
    def _base(self) -> AxisNumbers:
        known = {name: value for name, value in self.case.given.items() if name in AxisNumbers._fields}
        return AxisNumbers(**{**known, "pid": float(self.case.pid)})

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        """Simulate the compared channels; the scale may be logged by another clock (``shift``, ``skew``)."""
        numbers = self._base._replace(**{name: value for name, value in values.items() if name in AxisNumbers._fields})
        reference = self.columns["reference"]
        out = simulate_axis_numbers(numbers, reference, float(reference[0]))
        shift, skew = values.get("shift", 0.0), values.get("skew", 0.0)
        if shift or skew:
            time = np.arange(len(reference)) * PERIOD
            out[2] = np.interp(time - shift - skew * time, time, out[2])
        return out[[_ROWS.index(channel) for channel in self.case.channels]]


class SpindleBox(_Box):
    """A spindle driven by the logged torque."""

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        """Simulate both channels."""
        given = {name: value for name, value in {**self.case.given, **values}.items() if name in SpindleNumbers._fields}
        out = simulate_spindle_numbers(SpindleNumbers(**given), self.columns["torque"], self.columns["load"])
        return out[[("encoder", "tachometer").index(channel) for channel in self.case.channels]]


class CuttingBox(_Box):
    """A cut driven by feed, depth and speed."""

    @cached_property
    def _cut(self) -> Cut:
        return Cut(self.columns["feed"], self.columns["depth"], self.columns["speed"], self.case.given["radius"])

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        """Simulate the compared forces."""
        return simulate_cut(self._cut, {**self.case.given, **values})[[CHANNELS.index(channel) for channel in self.case.channels]]


def box_of(case: Case, columns: dict[str, np.ndarray]) -> AxisBox | SpindleBox | CuttingBox:
    """Return the grey box of a case with one of its recordings."""
    if case.template == "cascade_axis":
        return AxisBox(case, columns)
    return SpindleBox(case, columns) if case.template == "torque_spindle" else CuttingBox(case, columns)


def candidates_of(case: Case) -> list[Candidate]:
    """Return the candidates of a case; where an effect repeats, the recording's strongest wavelengths are the starts."""
    return {"cascade_axis": _axis, "torque_spindle": _spindle, "cutting_process": _cutting}[case.template](case)


def _size(key: str, name: str, typical: float, *, low: float = -_AT_ALL, high: float = _AT_ALL, told: str = "") -> Candidate:
    """One number, neutral at zero, whose response grows with it."""
    return Candidate(key, (name,), (((0.0,), ((typical,),)),), (low,), (high,), told={told or name: (name,)})


def _shaped(key: str, size: str, shape: str, typical: float, shapes: tuple[float, ...], bounds: tuple[float, float]) -> Candidate:
    """A size with the number that shapes it, started at some shapes."""
    groups = tuple(((0.0, value), ((typical, value),)) for value in shapes)
    return Candidate(key, (size, shape), groups, (-_AT_ALL, bounds[0]), (_AT_ALL, bounds[1]), told={size: (size,), shape: (shape,)})


def _wave(key: str, stem: str, period: str, typical: float, periods: list[float], size: str = "amplitude", length: str = "") -> Candidate:
    names = (f"{stem}_sin", f"{stem}_cos", period)
    groups = tuple(((0.0, 0.0, one), ((typical, 0.0, one), (0.0, typical, one))) for one in periods)
    low = (-_AT_ALL, -_AT_ALL, 0.9 * min(periods))
    high = (_AT_ALL, _AT_ALL, 1.1 * max(periods))
    return Candidate(key, names, groups, low, high, told={size: names[:2], length or period: (period,)})


def _fixed(
    key: str, names: tuple[str, ...], starts: list[tuple[float, ...]], low: tuple[float, ...], high: tuple[float, ...], told: str = ""
) -> Candidate:
    """Numbers whose response does not grow in proportion to them (levels, steps); ``told`` is the catalogue's name of the first one."""
    groups = tuple((start, (start,)) for start in starts)
    return Candidate(key, names, groups, low, high, False, {told or names[0]: names[:1], **{name: (name,) for name in names[1:]}})


def _axis(case: Case) -> list[Candidate]:
    given, signals = case.given, axis_signals(case, case.fitted)
    rated, peak = 10.0 * given["conductance"] * given["effort_constant"], float(np.max(np.abs(case.fitted["command"])))
    beside = np.column_stack([signals[name] for name in ("v", "a", "sign", "applied")])
    x, sign = signals["x"], signals["sign"]
    forces = strongest_periods(x, signals["force"], 0.6e-3, 0.012, 3, beside)
    spots = strongest_periods(x, signals["force"] * sign, 0.015, 0.15, 2, beside * sign[:, None])
    step = 0.02 * rated
    found = [
        _size("coulomb", "dry", step, low=0.0, told="level"),
        _shaped("stribeck", "excess", "stribeck_velocity", step, (3e-3, 10e-3), (5e-4, 0.05)),
        _fixed("bristles", ("level", "distance"), [(step, 3e-6), (step, 2e-5), (3 * step, 1e-5)], (0.0, 1e-6), (rated, 1e-4)),
        Candidate(
            "asymmetric", ("dry", "dry_difference", "viscous_difference"),
            (((0.0, 0.0, 0.0), ((step, 0.0, 0.0), (0.0, 0.3 * step, 0.0), (0.0, 0.0, 0.1 * given["viscous"]))),),
            (0.0, -rated, -10.0 * given["viscous"]), (rated, rated, 10.0 * given["viscous"]),
            told={"viscous_difference": ("viscous_difference",)},
        ),
        _size("gravity", "offset", step),
        _wave("tight_spots", "spots", "spots_period", step, spots, length="period"),
        _size("inductance", "lag", 2e-3, low=0.0, high=0.03, told="time_constant"),
        Candidate("current_loop", ("loop_time", "loop_damping"), (((1.5e-3, 0.7), ((1.5e-3, 0.7),)), ((3e-3, 0.7), ((3e-3, 0.7),))),
                  (4e-4, 0.3), (0.01, 1.5), False, {"time_constant": ("loop_time",), "damping": ("loop_damping",)}),
        _size("dead_zone", "half_width", 0.1, low=0.0),
        _fixed("saturation", ("saturation",), [(n * peak,) for n in (0.97, 0.9, 0.75, 0.6, 0.45, 0.3)], (0.2 * peak,), (peak,), "level"),
        _wave("ripple", "share", "share_period", 0.04, forces, "share", "period"),
        _wave("cogging", "force", "force_period", 0.02 * rated, forces, "amplitude", "period"),
        _size("converter_offset", "converter_offset", 0.1, told="offset"),
        _fixed("converter_step", ("converter_step",), [(20.0 / 255.0,), (20.0 / 1023.0,)], (0.01,), (0.4,), "resolution"),
        _size("delay", "delay", 1e-3, low=0.0, high=0.02),
        _fixed("coarse_encoder", ("coarse",), [(given["encoder_resolution"] * n,) for n in (8.0, 16.0, 32.0)], (1e-7,), (1e-4,), "count"),
        Candidate("resonance", ("table_share", "frequency", "damping"),
                  tuple(((s, f, 0.05), ((s, f, 0.05),)) for s, f in ((0.4, 50.0), (0.4, 75.0), (0.4, 110.0), (0.4, 160.0))),
                  (0.05, 25.0, 0.005), (0.8, 300.0, 0.3), False, {name: (name,) for name in ("table_share", "frequency", "damping")}),
    ]  # fmt: skip
    return found + (_screw(case, signals) if "scale" in case.channels else [])


def _screw(case: Case, signals: dict[str, np.ndarray]) -> list[Candidate]:
    x, screw = signals["x"], signals["sharp_screw"]
    leads = strongest_periods(x, screw, 3e-3, 0.015, 2, np.column_stack([signals[name] for name in ("v", "a", "sign", "applied")]))
    steps = np.abs(np.convolve(screw, np.r_[np.ones(40), -np.ones(40)] / 40.0, mode="valid"))
    instant = float(signals["time"][int(np.argmax(steps)) + 40])
    return [
        _size("backlash", "width", 10e-6, low=0.0),
        _size("pitch", "slope", 1e-4),
        _wave("pitch_wave", "pitch", "lead", 3e-6, leads),
        _shaped("screw_growth", "strain", "growth_time", 1e-4, (10.0, 40.0), (2.0, 200.0)),
        _size("wind_up", "compliance", 1e-8),
        _wave("eccentricity", "turn", "turn", 3e-6, leads, "amplitude", "turn"),
        _wave("interpolation", "fine", "fine_period", 2e-7, [20e-6], "amplitude", "signal_period"),
        Candidate("lost_counts", ("jump", "instant"), (((0.0, instant), ((5e-6, instant),)),),
                  (-1e-3, instant - 0.2), (1e-3, instant + 0.2), told={"jump": ("jump",), "instant": ("instant",)}),
        _size("clock_skew", "skew", 1e-4),
        _size("channel_shift", "shift", 5e-3),
    ]  # fmt: skip


def _spindle(case: Case) -> list[Candidate]:
    signals = spindle_signals(case, case.fitted)
    peak = float(np.max(np.abs(case.fitted["torque"])))
    load = max(float(np.max(np.abs(case.fitted["load"]))), 1e-6)
    beside = np.column_stack([signals[name] for name in ("v", "a", "sign", "applied")])
    turns = strongest_periods(signals["x"], signals["force"], 1.4, 7.0, 1, beside)
    orders = [1.0, 2.0, 4.0, *[2.0 * np.pi / one for one in turns]]
    return [
        _size("spindle_coulomb", "dry", 0.05 * peak, low=0.0, told="level"),
        Candidate("spindle_asymmetric", ("dry", "dry_difference"), (((0.0, 0.0), ((0.05 * peak, 0.0), (0.0, 0.02 * peak))),),
                  (0.0, -peak), (peak, peak)),
        _fixed("torque_limit", ("limit",), [(share * peak,) for share in (0.97, 0.85, 0.7)], (0.2 * peak,), (peak,), "level"),
        _orders("spindle_ripple", "share", 0.1, orders, "share"),
        _orders("spindle_cogging", "ripple", 0.03 * peak, orders, "amplitude"),
        Candidate("disc_eccentricity", ("disc_sin", "disc_cos"), (((0.0, 0.0), ((3e-3, 0.0), (0.0, 3e-3))),), (-1.0, -1.0), (1.0, 1.0),
                  told={"amplitude": ("disc_sin", "disc_cos")}),
        _orders("tacho_ripple", "tacho", 0.02, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], "ripple"),
        _size("tacho_gain", "gain_error", 0.02),
        _size("belt_slip", "creep", 0.02 / load),
        _shaped("speed_droop", "droop", "response", 1.0 / load, (0.12, 0.35), (0.02, 2.0)),
        _size("tacho_filter", "filter_time", 5e-3, low=0.0, high=0.1, told="time_constant"),
    ]  # fmt: skip


def _orders(key: str, stem: str, typical: float, orders: list[float], size: str) -> Candidate:
    """A wave of whole order over the turn: the order is tried, not fitted."""
    names = (f"{stem}_sin", f"{stem}_cos", f"{stem}_order")
    groups = tuple(((0.0, 0.0, one), ((typical, 0.0, one), (0.0, typical, one))) for one in orders)
    return Candidate(key, names, groups, (-_AT_ALL, -_AT_ALL, 0.9), (_AT_ALL, _AT_ALL, 12.0), told={size: names[:2]})


def _cutting(case: Case) -> list[Candidate]:
    angles = [float(one) for one in np.linspace(-np.pi, np.pi, 12, endpoint=False)]
    half, at_all = np.pi, 10.0
    return [
        _size("edge_force", "edge", 3e4, low=0.0, told="coefficient"),
        _size("size_effect", "exponent", 0.1),
        _size("speed_effect", "speed_exponent", -0.1, told="exponent"),
        Candidate("speed_hump", ("hump", "hump_speed", "hump_width"),
                  tuple(((0.0, place, 0.3), ((0.2, place, 0.3),)) for place in (0.6, 0.85, 1.1)), (-0.9, 0.2, 0.05), (3.0, 2.0, 1.0),
                  told={"hump": ("hump",), "hump_speed": ("hump_speed",)}),
        _shaped("softening", "softening", "time_constant", 0.1, (0.7, 2.5), (0.1, 30.0)),
        Candidate("wear", ("wear_rate", "break_in", "break_in_time"),
                  (((0.0, 0.0, 6.0), ((5e-3, 0.0, 6.0), (0.0, 0.05, 6.0))),), (-1.0, -1.0, 0.5), (1.0, 5.0, 60.0)),
        Candidate("slot", ("missing", "slot_width", "slot_middle"),
                  tuple(((0.0, w, m), ((0.5, w, m),)) for w in (0.08, 0.2) for m in angles), (0.0, 0.01, -at_all), (1.0, 0.6, at_all),
                  told={"missing": ("missing",), "width": ("slot_width",)}),
        Candidate("hard_spot", ("rise", "spot_width", "spot_middle"),
                  tuple(((0.0, 0.08, m), ((0.3, 0.08, m),)) for m in angles), (0.0, 0.01, -2 * half), (3.0, 0.3, 2 * half),
                  told={"rise": ("rise",)}),
        Candidate("runout", ("out_sin", "out_cos", "out_order"),
                  tuple(((0.0, 0.0, n), ((2e-5, 0.0, n), (0.0, 2e-5, n))) for n in (1.0, 2.0, 3.0)), (-1e-3, -1e-3, 0.9), (1e-3, 1e-3, 4.1),
                  told={"eccentricity": ("out_sin", "out_cos"), "order": ("out_order",)}),
        _size("drift", "drift", 1.0),
        _size("leak", "leak", 0.03, low=0.0, high=10.0),
    ]  # fmt: skip
