"""A lesson for a recording that nobody has described yet: what its columns are, from units and names, and the machine that they fit.

Nothing here is certain: each column is named with what it was taken for, and each value that no file gives is listed as assumed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.lessons.schema import UNKNOWN
from lathesim.record import FloatArray
from lathesim.recordings.raw_table import ENOUGH_SAMPLES, USUAL_PERIOD, Finding, RawTable, is_unit
from lathesim.recordings.sample_grid import SampleGrid, even_grid
from lathesim.units import conversion, convertible, is_count

IGNORE, TIME, COMPARE, DRIVE = "ignore", "time", "compare", "drive"


@dataclass(frozen=True)
class ColumnMeaning:
    """A column, what it is used for, the channel or input it stands for, its unit and scale, and whether it is held until the next row."""

    column: str
    role: str = IGNORE
    target: str = ""
    unit: str = ""
    scale: float = 1.0
    held: bool = False


def recordings_entry(columns: Sequence[ColumnMeaning], rate: str = "") -> dict[str, Any]:
    """Return the ``recordings:`` entry of a lesson; raises :class:`RecordingError` where time or every other column is missing."""
    time = next((item for item in columns if item.role == TIME), None)
    if time is None and not rate:
        raise RecordingError("no column is the time.", remedy="Give one column the role 'time', or a sample rate.")
    used = [item for item in columns if item.role in (COMPARE, DRIVE)]
    if not any(item.role == COMPARE for item in used):
        raise RecordingError("no column is compared with a channel.", remedy="Give at least one column the role 'compare'.")
    for item in used:
        if not item.target or not item.unit:
            raise RecordingError(f"column '{item.column}' needs a channel and a unit.", remedy="Write both, or ignore the column.")
    entry: dict[str, Any] = {"time": {"column": time.column, "unit": time.unit or "s"} if time is not None else {"rate": rate}}
    for role in (DRIVE, COMPARE):
        of_role = {item.target: _signal(item) for item in used if item.role == role}
        if of_role:
            entry[role] = of_role
    return entry


def _signal(item: ColumnMeaning) -> dict[str, Any]:
    found: dict[str, Any] = {"column": item.column, "unit": item.unit}
    return found | ({"scale": item.scale} if item.scale != 1.0 else {}) | ({"held": True} if item.held else {})


_KINDS = (
    ("s", "time"), ("m", "position"), ("rad", "position"), ("m/s", "speed"), ("rad/s", "speed"), ("m/s^2", "acceleration"),
    ("rad/s^2", "acceleration"), ("A", "current"), ("V", "voltage"), ("N", "force"), ("N*m", "torque"),
)  # fmt: skip
_TURNS = re.compile(r"deg|rad|rev|turn|rpm|1/min")
_WORDS = {
    "time": "time t zeit timestamp timestamps sec",
    "error": "err error flw dev diff deviation lag ferror ffw feedforward",
    "position": "pos position positions place angle theta enc encoder weg lage winkel displacement s",
    "speed": "vel velocity velocities speed v omega drehzahl geschwindigkeit rpm",
    "acceleration": "acc accel acceleration a",
    "current": "curr current currents iq i strom amps q",
    "torque": "torque torques moment trq effort efforts",
    "force": "force forces kraft f load",
    "voltage": "volt voltage u spannung vbus pwm duty",
}
_QUANTITIES = {word: quantity for quantity, words in _WORDS.items() for word in words.split()}
_MOTIONS = ("position", "speed")
_SET_POINT = frozenset(
    "cmd command commanded set setpoint sp soll des desired ref reference target goal demand nominal nom noml".split()  # noqa: SIM905
)
_COMMANDED = _SET_POINT | {"input", "pwm", "duty"}
_MEASURED = frozenset(
    "act actual present ist meas measured estimate estimated feedback fb fbk real".split()  # noqa: SIM905
)
_FILLING = frozenset(
    "nck servo data ctrl in mot motor nd main state states joint joints value val controller end side ec".split()  # noqa: SIM905
)
_UNIT_IN_NAME = re.compile(r"(?:_|^(?=rpm))((?:um|mm|m|deg|rad|rev)(?:_s)?|rpm|k?N|Nm|m?A|m?V|[mu]?s)$")
_TURNING_WORDS = frozenset(("rpm", "angle", "winkel", "drehzahl", "theta", "omega"))
_SLIDING_AXES = re.compile(r"[xyzuvw]\d?")
_TURNING_AXES = re.compile(r"[abc]\d?|sp\d?|spindle")
_SPLIT = re.compile(r"[A-Za-z]\d+(?![A-Za-z\d])|[A-Z]{2}[a-z]+|[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")


@dataclass(frozen=True)
class ColumnSense:
    """What a column seems to be: its quantity, whether it was commanded, its axis, whether that turns, and whether its unit is known."""

    column: str
    unit: str
    quantity: str
    commanded: bool
    axis: str
    turning: bool | None
    span: float
    of_motion: str = ""
    """The column of the motion that it is taken to command, where its own name does not say what it commands."""

    @property
    def is_bare_command(self) -> bool:
        """Whether it is called a set-point and nothing else."""
        return not (self.unit or self.quantity) and bool(_SET_POINT & set(_words_of(self.column)))

    @property
    def key(self) -> str:
        """The quantity, with whether it was commanded: a command of a force or current pushes as one."""
        return f"commanded {self.quantity}" if self.commanded and self.quantity in _MOTIONS else self.quantity

    def may_be(self, unit: str) -> bool:
        """Return whether it can be a channel of a unit: by its own unit, or else by its quantity, where one is known."""
        return is_count(self.unit) or convertible(self.unit, unit) if self.unit else self.quantity in ("", "error", _kind(unit))


def sense_of(name: str, unit: str, values: FloatArray) -> ColumnSense:
    """Return what a column seems to be: by its unit, in the head or at the end of its name, and by the words in its name."""
    bare, match = name, _UNIT_IN_NAME.search(name)
    if not is_unit(unit):
        unit = match[1].replace("_", "/").replace("Nm", "N*m") if match else ""
        named = [_QUANTITIES[word] for word in _words_of(name) if word in _QUANTITIES]
        if match and named and named[0] not in ("error", _kind(unit)):
            unit = ""
        bare = name[: match.start()] if match and unit else name
    words = _words_of(bare)
    named = [_QUANTITIES[word] for word in words if word in _QUANTITIES]
    axis = name.rpartition("|")[2] if "|" in name else " ".join(
        word for word in words if word not in _QUANTITIES and word not in _COMMANDED | _MEASURED | _FILLING
    )  # fmt: skip
    turns = True if _TURNING_AXES.fullmatch(axis) or _TURNING_WORDS & set(words) else False if _SLIDING_AXES.fullmatch(axis) else None
    turning = bool(_TURNS.search(unit)) if unit else turns
    quantity = "error" if "error" in named else _kind(unit) if unit else named[0] if named else ""
    finite = values[np.isfinite(values)]
    span = float(np.ptp(finite)) if len(finite) else 0.0
    return ColumnSense(name, unit, quantity, bool(_COMMANDED & set(words)), axis, turning, span)


def _words_of(name: str) -> list[str]:
    """Return the words of a name; what stands as current before a place or speed is no electric one."""
    words = [word.lower() for word in _SPLIT.findall(name)]
    moves = [len(word) > 1 and _QUANTITIES.get(word) in _MOTIONS for word in words]
    return ["present" if word == "current" and any(moves[place : place + 1]) else word for place, word in enumerate(words, start=1)]


def _kind(unit: str) -> str:
    """Return the quantity that a unit measures; an angle must be written as one."""
    for wanted, quantity in _KINDS:
        if convertible(unit, wanted) and (_TURNS.search(unit) is not None) == ("rad" in wanted):
            return quantity
    return ""


@dataclass(frozen=True)
class TemplateRule:
    """A machine template: what must be in a recording for it, what of it drives and is compared, and which values are uncertain.

    ``scale`` is the unit of the factor that makes the driven quantity of what was recorded, and ``constant`` its assumed value.
    """

    machine: str
    turning: bool
    needs: tuple[str, ...]
    drive: Mapping[str, str]
    compare: Mapping[str, str]
    uncertain: tuple[str, ...] = ()
    unit: str = ""
    scale: str = ""
    constant: float = 1.0


_TABLE = {"x_axis.current": "current", "x_encoder.position": "position"}
_ROTARY = {"table.current": "current", "table_encoder.angle": "position"}
_AXIS = {"x_encoder.position": "position", "x_axis.velocity": "speed"}
_SPINDLE = {"spindle_encoder.angle": "position", "spindle.speed": "speed"}
_MASS, _INERTIA = ("x_axis.mass", "x_axis.viscous"), ("spindle.inertia", "spindle.viscous")
_COMMAND = "commanded position"
RULES = (
    TemplateRule("voltage_axis", False, ("voltage",), {"x_dac.command": "voltage"}, _AXIS, _MASS),
    TemplateRule("led_axis", False, (_COMMAND, "current"), {"x_axis.reference": _COMMAND}, _TABLE, _MASS),
    TemplateRule("led_rotary_table", True, (_COMMAND, "current"), {"table.reference": _COMMAND}, _ROTARY,
                 ("table.turned_inertia", "table.viscous")),
    TemplateRule("force_axis", False, ("force",), {"x_axis.force": "force"}, _AXIS, _MASS),
    TemplateRule("torque_spindle", True, ("torque",), {"spindle.torque": "torque"}, _SPINDLE, _INERTIA),
    TemplateRule("torque_spindle", True, ("voltage",), {"spindle.torque": "voltage"}, _SPINDLE, _INERTIA, "N*m", "N*m/V", 0.01),
    TemplateRule("led_axis", False, (_COMMAND, "position"), {"x_axis.reference": _COMMAND}, _TABLE),
    TemplateRule("led_rotary_table", True, (_COMMAND, "position"), {"table.reference": _COMMAND}, _ROTARY),
    TemplateRule("torque_spindle", True, ("current",), {"spindle.torque": "current"}, _SPINDLE, _INERTIA, "N*m", "N*m/A", 0.1),
    TemplateRule("force_axis", False, ("current",), {"x_axis.force": "current"}, _AXIS, _MASS, "N", "N/A", 35.0),
)  # fmt: skip
"""The templates in the order in which they are tried: what says most of a machine first. The factors are assumed, as in the templates."""
_ASSUMED_UNITS = {
    ("position", False): "mm", ("position", True): "rad", ("speed", False): "mm/s", ("speed", True): "rad/s",
    ("current", None): "A", ("torque", None): "N*m", ("force", None): "N", ("voltage", None): "V",
}  # fmt: skip
_EFFORTS = ("current", "torque", "force", "voltage")
"""Quantities that push, measured as a rule: where a name says that one was commanded, it is held until the next row."""
_PERIOD = 1e-3
"""Period [s] that is assumed for a file without a clock, unless the program that wrote it has a usual one."""
_ALL_OPEN = f"{100.0 * UNKNOWN:g} %"
"""The uncertainty of a value that is as the template has it: nothing is known of it."""
_LED = ("led_axis", "led_rotary_table")
"""Templates that follow their reference at once, and take one step a sample."""


@dataclass(frozen=True)
class OpenQuestion:
    """The one thing to ask: which value of :class:`ProposedLesson` it fills in, the words, and what is assumed without an answer."""

    field: str
    text: str
    default: str


@dataclass(frozen=True)
class ProposedLesson:
    """What a recording seems to hold. ``axis``, ``rate`` [Hz] and ``scale`` are what a person said of it."""

    table: RawTable
    axis: str | None = None
    rate: float | None = None
    scale: float | None = None

    @cached_property
    def time(self) -> str | None:
        """The column of times: one called so, or else one with a unit of time that rises."""
        columns = self.table.columns
        senses = [sense_of(name, unit, columns[name]) for name, unit in self.table.units.items() if name in columns]
        named = [item.column for item in senses if item.quantity == "time" and item.span > 0.0]
        return next((name for name in named if 2 * np.count_nonzero(np.diff(columns[name]) >= 0.0) > len(columns[name])), None)

    @cached_property
    def clock(self) -> tuple[SampleGrid, tuple[Finding, ...]] | None:
        """The even clock behind the times [s], with what was found about it; None without times."""
        if self.time is None:
            return None
        values = self.table.columns[self.time] * conversion(self._time_unit or "s", "s")
        finite = values[np.isfinite(values)]
        findings: list[Finding] = []
        return even_grid(values - (finite[0] if len(finite) else 0.0), findings), tuple(findings)

    @cached_property
    def senses(self) -> tuple[ColumnSense, ...]:
        """What the columns on the clock seem to be, those with numbers."""
        rows = len(self.table.columns[self.time]) if self.time is not None else max(map(len, self.table.columns.values()))
        usable = {name: v for name, v in self.table.columns.items() if name != self.time and len(v) == rows and np.isfinite(v).any()}
        found = self._with_bare_commands([sense_of(name, self.table.units[name], values) for name, values in usable.items()])
        rotary = any(item.quantity in ("torque", "current") for item in found)  # of a motor, unless an axis is known to slide
        rotary &= not any(item.turning is False and item.quantity in ("position", "speed") for item in found)
        return tuple(replace(item, turning=True) if item.turning is None and rotary else item for item in found)

    @staticmethod
    def _with_bare_commands(found: Sequence[ColumnSense]) -> list[ColumnSense]:
        """Return columns of which one that is only called a set-point commands the first motion of its axis that was measured, in its
        unit."""
        shown = sorted((item for item in found if item.key in _MOTIONS), key=lambda item: _MOTIONS.index(item.key))
        result = []
        for item in found:
            of = next((one for one in shown if item.is_bare_command and item.axis in ("", one.axis)), None)
            if of is not None:
                item = replace(item, unit=of.unit, quantity=of.quantity, turning=of.turning, of_motion=of.column)
            result.append(item)
        return result

    @cached_property
    def fitting(self) -> dict[str, tuple[TemplateRule, dict[str, ColumnSense]]]:
        """For each axis the first template that fits it, with the column of each quantity; those that move come first.

        Columns whose names have no axis count first, and otherwise belong to each axis. If no axis fits, all columns count as one.
        Too few rows fit nothing.
        """
        if not self.senses or len(self.table.columns[self.senses[0].column]) < ENOUGH_SAMPLES:
            return {}
        if (fit := self._fit([item for item in self.senses if not item.axis])) is not None:
            return {"": fit}
        axes = dict.fromkeys(item.axis for item in self.senses if item.axis) or {"": None}
        found = {axis: fit for axis in axes if (fit := self._fit([item for item in self.senses if item.axis in (axis, "")])) is not None}
        if not found and (fit := self._fit(self.senses)) is not None:
            found = {"all": fit}
        still = {axis: not any(item.span > 0.0 for key, item in columns.items() if "position" in key or "speed" in key)
                 for axis, (_, columns) in found.items()}  # fmt: skip
        return dict(sorted(found.items(), key=lambda pair: (still[pair[0]], RULES.index(pair[1][0]))))

    @staticmethod
    def _fit(items: Sequence[ColumnSense]) -> tuple[TemplateRule, dict[str, ColumnSense]] | None:
        """Return the first template that fits columns, with the first column of each quantity."""
        columns: dict[str, ColumnSense] = {}
        for item in items:
            columns.setdefault(item.key, item)
        turning = any(item.turning for item in columns.values() if item.quantity in ("position", "speed", "torque"))
        rules = (rule for rule in RULES if rule.turning == turning and all(need in columns for need in rule.needs))
        return next(((rule, columns) for rule in rules if any(key in columns for key in rule.compare.values())), None)

    @property
    def chosen(self) -> tuple[TemplateRule, dict[str, ColumnSense]] | None:
        """The template of the chosen axis, or of the first that fits; raises :class:`RecordingError` for an axis that is not there."""
        if self.axis is None:
            return next(iter(self.fitting.values()), None)
        if self.axis not in self.fitting:
            names = ", ".join(f"'{axis}'" for axis in self.fitting) or "none"
            raise RecordingError(f"no axis '{self.axis}' fits a machine.", place=str(self.table.source), remedy=f"Those that do: {names}.")
        return self.fitting[self.axis]

    @property
    def question(self) -> OpenQuestion | None:
        """What to ask a person, if anything: the clock first, then the axis, then the factor of a drive."""
        if self.chosen is None:
            return None
        if self.time is None and self.rate is None:
            return OpenQuestion("rate", "The file has no clock. Rows per second", f"{1.0 / self.period:g}")
        if len(self.fitting) > 1 and self.axis is None:
            return OpenQuestion("axis", f"Which axis: {', '.join(self.fitting)}", next(iter(self.fitting)))
        rule = self.chosen[0]
        if rule.scale and self.scale is None:
            return OpenQuestion("scale", f"What the {rule.needs[-1]} makes, in {rule.scale}", f"{rule.constant:g}")
        return None

    @cached_property
    def meanings(self) -> tuple[ColumnMeaning, ...]:
        """The columns of the lesson, the time first; none without a machine."""
        if self.chosen is None:
            return ()
        rule, columns = self.chosen
        found = [] if self.time is None else [ColumnMeaning(self.time, TIME, "", self._time_unit or "s")]
        for role, targets in ((DRIVE, rule.drive), (COMPARE, rule.compare)):
            for target, key in targets.items():
                if key in columns:
                    unit, scale = columns[key].unit or self._assumed_unit(columns[key]), 1.0
                    if role == DRIVE and rule.scale:
                        unit, scale = rule.unit, self.scale if self.scale is not None else rule.constant
                    held = role == DRIVE and key in _EFFORTS and columns[key].commanded
                    found.append(ColumnMeaning(columns[key].column, role, target, unit, scale, held))
        return tuple(found)

    @property
    def _time_unit(self) -> str:
        name = self.time or ""
        unit = sense_of(name, self.table.units.get(name, ""), np.zeros(0)).unit
        return unit if unit and convertible(unit, "s") else ""

    def _assumed_unit(self, item: ColumnSense) -> str:
        turning = self.chosen is not None and self.chosen[0].turning
        return _ASSUMED_UNITS.get((item.quantity, None)) or _ASSUMED_UNITS[item.quantity, turning]

    def assumed(self) -> Iterator[str]:
        """Yield in sentences what no file told and no person said."""
        if self.chosen is None:
            return
        rule, columns = self.chosen
        used = {*rule.drive.values(), *rule.compare.values()}
        if self.time is not None and not self._time_unit:
            yield f"'{self.time}' is in s"
        for key, item in columns.items():
            if key in used and not item.unit:
                yield f"'{item.column}' is in {self._assumed_unit(item)}"
        for item in columns.values():
            if item.key in used and item.of_motion:
                yield f"'{item.column}' commands what '{item.of_motion}' shows"
        if self.time is None and self.rate is None:
            yield f"the rows come at {1.0 / self.period:g} Hz"
        if len(self.fitting) > 1 and self.axis is None:
            yield f"axis '{next(iter(self.fitting))}' is meant; others that fit: {', '.join(list(self.fitting)[1:])}"
        if rule.scale and self.scale is None:
            yield f"the {rule.needs[-1]} makes {rule.constant:g} {rule.scale}"
        if rule.uncertain:
            yield f"{' and '.join(rule.uncertain)} are as in the template, and unknown: uncertain by {_ALL_OPEN}"

    @property
    def period(self) -> float:
        """The sample period [s]."""
        if self.clock is not None:
            return self.clock[0].period
        return 1.0 / self.rate if self.rate else self.table.constants.get(USUAL_PERIOD, _PERIOD)

    def lesson(self, title: str) -> dict[str, Any]:
        """Return the lesson; raises :class:`RecordingError` where no machine fits."""
        if self.chosen is None:
            fact = "no machine fits what is in the file: a lesson needs what drives a motion, and the motion."
            remedy = (
                "Record a force, torque, voltage, current or command beside a position or speed; 'help your_recording' lists the machines."
            )
            raise RecordingError(fact, place=str(self.table.source), remedy=remedy)
        rule = self.chosen[0]
        rate = "" if self.time is not None else f"{1.0 / self.period:.10g} Hz"
        step = self.period if rule.machine in _LED else self.period / 4.0
        lesson: dict[str, Any] = {
            "lesson": title, "machine": rule.machine, "sample_period": f"{1e3 * self.period:.10g} ms", "step": f"{1e3 * step:.10g} ms",
            "recordings": recordings_entry(self.meanings, rate),
        }  # fmt: skip
        if rule.uncertain:
            lesson["uncertain"] = dict.fromkeys(rule.uncertain, _ALL_OPEN)
        return lesson
