"""THE CONTRACT: what a machine part is. The first file a newcomer reads.

A component declares names, each with a unit, and up to three pure laws whose *argument names are those declarations*::

    class ViscousAxis(Component):
        \"\"\"A table pushed by a force against viscous friction:  m dv/dt = F - b v.\"\"\"
        velocity = State("m/s", doc="table velocity")
        travel = State("m", doc="table position")
        force = Input("N", doc="force of the drive on the table")
        position = Output("m", doc="table position")
        mass = Parameter("kg", 95.0, low=0.1, doc="moving mass")
        viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction")

        @staticmethod
        def derivative(velocity, force, mass, viscous):
            return (force - viscous * velocity) / mass, velocity

        @staticmethod
        def output(travel):
            return travel

``derivative`` gives the rates of the states, ``output`` the outputs, ``update`` the next discrete states, each in the order of
declaration (one value alone, several as a tuple). An output that answers at once to an input may have a law of its own,
``output_<its name>``, so that the other outputs need not wait for that input; ``output`` then gives the rest. Floats in, floats out, SI,
``math`` only. A law may also take an output of its own part, so that each equation stands once: ``output_torque(current,
torque_constant)``. What a law depends on is its signature: evaluation order, algebraic loops and unit checks follow from it. Three names
need no declaration: ``time`` [s], ``sample_period`` [s] (of this part) and ``step`` [s].

A unit may hold a *placeholder* in braces, for example ``"{signal}"`` or ``"{effort}*s/{displacement}"``; it is replaced when the
part is placed in a machine (:meth:`Component.with_units`). That is how one effect serves a table [N, m] and a spindle [N*m, rad].
``class Accelerometer(SampledSensor, units={"signal": "m/s^2"})`` is a part of its own with the declarations and laws of another.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any, ClassVar, TypeVar

from lathesim.errors import ComponentError, nearest

Law = Callable[..., Any]
Kind = TypeVar("Kind", bound="Declaration")

BUILT_IN_ARGUMENTS = {
    "time": "simulated time [s]",
    "sample_period": "time between two updates of this part [s]",
    "step": "length of one integration step [s]",
}
GROUPS = ("interpolator", "controllers", "converters", "axes", "spindle", "process", "tool and part")
"""The groups of a machine's parts, in the order of the shop: from what is asked for to what is cut."""
LAW_NAMES = ("derivative", "output", "update")
ON = 0.5
"""A flag is a number of 0 or 1, as laws know floats alone: above this it is on, and below it off."""
_BESIDE = 5
"""Samples that a ring holds beside its delay: what is read lies between up to four of them."""
_PLACEHOLDER = re.compile(r"\{(\w+)\}")


class Declaration:
    """A declared name of a component: its unit and one sentence about it."""

    kind: ClassVar[str] = "declaration"

    def __init__(self, unit: str, *, doc: str) -> None:
        self.unit = unit
        self.doc = doc
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def with_units(self, units: Mapping[str, str]) -> Declaration:
        """Return a copy with the placeholders of the unit replaced."""
        copy = object.__new__(type(self))
        copy.__dict__.update(self.__dict__)
        copy.unit = _PLACEHOLDER.sub(lambda match: f"({units[match[1]]})" if match[1] in units else match[0], self.unit)
        if copy.unit != self.unit:
            copy.unit = _without_needless_brackets(copy.unit)
        return copy


def _without_needless_brackets(unit: str) -> str:
    """Return ``N/s`` for ``((N))/s``, and ``m/s`` for ``(m/s)``: a person reads it, and pastes it into a lesson."""
    before = ""
    while before != unit:
        before = unit
        unit = re.sub(r"\(\(([^()]*)\)\)", r"(\1)", unit)
        unit = re.sub(r"(?<!\w)\((\w+)\)", r"\1", unit)
        whole = re.fullmatch(r"\(([^()]*)\)", unit)
        unit = whole[1] if whole else unit
    return unit


class Parameter(Declaration):
    """Fixed during a run. ``low`` and ``high`` bound what a person may set; ``default`` is in the declared unit."""

    kind = "parameter"

    def __init__(self, unit: str, default: float, *, doc: str, low: float = -float("inf"), high: float = float("inf")) -> None:
        super().__init__(unit, doc=doc)
        self.default = float(default)
        self.low = float(low)
        self.high = float(high)


class Input(Declaration):
    """Arrives by a wire.

    ``previous=True``: an ``update`` that reads it sees the value of the sample instant before, so a loop among sampled parts may close
    here. ``default``: the value where no wire arrives; without a default an unconnected input is refused. ``shown=False``: the default is
    a sign of the law's own and no value for a person.
    """

    kind = "input"

    def __init__(self, unit: str, *, doc: str, previous: bool = False, default: float | None = None, shown: bool = True) -> None:
        super().__init__(unit, doc=doc)
        self.previous = previous
        self.default = default
        self.shown = shown


class Output(Declaration):
    """Leaves by a wire, and can be recorded."""

    kind = "output"


class State(Declaration):
    """Continuous, integrated by RK4 from ``start``. ``shown=False``: its start is a sign of the law's own and no value for a person."""

    kind = "state"

    def __init__(self, unit: str, start: float = 0.0, *, doc: str, shown: bool = True) -> None:
        super().__init__(unit, doc=doc)
        self.start = float(start)
        self.shown = shown


class DiscreteState(State):
    """Changes only in ``update``, at the sample period of its part."""

    kind = "discrete state"


class Memory(Declaration):
    """A ring or map of ``length`` numbers written in place by ``update`` (the surface left by the last revolution).

    ``holds`` gives the seconds that a ring of samples must hold, a function whose argument names are parameters, or ``duration`` [s], the
    length of the run where it is known and 0 elsewhere. Where ``length`` samples are too few, the ring is as long as that takes.
    """

    kind = "memory"

    def __init__(self, unit: str, length: int, start: float = 0.0, *, doc: str, holds: Callable[..., float] | None = None) -> None:
        super().__init__(unit, doc=doc)
        self.length = int(length)
        self.start = float(start)
        self.holds = holds
        self.held_by = tuple(inspect.signature(holds).parameters) if holds is not None else ()

    def samples(self, given: Mapping[str, float], period: float) -> float:
        """Return how many samples of a period [s] it must hold with the values of ``held_by``; 0 where it says none."""
        return self.holds(**{name: given[name] for name in self.held_by}) / period + _BESIDE if self.holds is not None else 0.0


class Table(Declaration):
    """A read-only array ``table[row][column]`` given by the machine or the lesson (the path, a recorded signal)."""

    kind = "table"

    def __init__(self, unit: str, columns: tuple[str, ...], *, doc: str) -> None:
        super().__init__(unit, doc=doc)
        self.columns = columns


class Noise(Declaration):
    """A standard normal number, new at every sample; drawn beforehand, so every run can be repeated."""

    kind = "noise"

    def __init__(self, *, doc: str) -> None:
        super().__init__("1", doc=doc)


class Component:
    """A machine part. Subclass it, declare names, write laws; see the module's text."""

    declarations: ClassVar[dict[str, Declaration]] = {}
    _by_kind: ClassVar[dict[type[Declaration], dict[str, Any]]] = {}
    laws: ClassVar[dict[str, Law]] = {}
    arguments: ClassVar[dict[str, tuple[str, ...]]] = {}
    law_order: ClassVar[tuple[str, ...]] = ()
    """The laws, each after those that give what it takes."""
    ports: ClassVar[dict[str, str]] = {}
    """Role -> declared name, for effects that attach to this part and for whoever looks for a channel of a record by its role. Any declared
    name plays the role of its own name too. Roles of effects: ``effort`` (input that takes a disturbance), ``flow``, ``displacement``
    (outputs), ``drive`` (command input), ``inertia`` (parameter), ``reading`` (output of a sensor), ``rate`` (output: what it makes of its
    counts), ``resolution``, ``bits`` (parameters: how finely it reads), ``gain`` (parameter: by what a reading is divided to be what is
    measured), ``dry_friction`` (parameter of a part that has its own), and of a controller ``loop_gain``, ``inner_gain``, ``integral_gain``
    (parameters, above zero in a loop that holds) and ``error`` (output: by how much what it measures falls short of its command) ... Roles
    of metrics: ``in_contact``, ``feed_per_revolution``, ``cutting_force``, ``cutting_torque``, ``cutting_power``, ``spindle_speed`` ..."""

    outputs_are_held: ClassVar[bool] = False
    """Whether its outputs are computed at the sample instants only and held in between, though they take what moves there."""

    group: ClassVar[str] = ""
    """Where a person looks for the part: one of :data:`GROUPS`; empty for one that stands among "further parts"."""

    def __init_subclass__(cls, units: Mapping[str, str] | None = None, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        for name, item in _collect(cls).items() if units else ():
            setattr(cls, name, item.with_units(units or {}))
        cls.declarations = _collect(cls)
        cls._by_kind = {}
        for name, item in cls.declarations.items():
            cls._by_kind.setdefault(type(item), {})[name] = item
        own = [f"output_{name}" for name in cls.declared(Output)]
        cls.laws = {name: getattr(cls, name) for name in (*LAW_NAMES, *own) if hasattr(cls, name)}
        cls.arguments = {name: _argument_names(cls, name) for name in cls.laws}
        _check_definition(cls)
        cls.law_order = _law_order(cls)

    @classmethod
    def declared(cls, kind: type[Kind]) -> dict[str, Kind]:
        """Return the declarations of exactly one kind, in order: ``declared(State)`` does not hold the discrete states."""
        return dict(cls._by_kind.get(kind, {}))

    @classmethod
    def output_laws(cls) -> dict[str, tuple[str, ...]]:
        """Return for each output law the outputs it gives: ``output`` those that have no law of their own."""
        single = {f"output_{name}": (name,) for name in cls.declared(Output) if f"output_{name}" in cls.laws}
        rest = tuple(name for name in cls.declared(Output) if f"output_{name}" not in cls.laws)
        return ({"output": rest} if "output" in cls.laws else {}) | single

    @classmethod
    def idle(cls) -> tuple[dict[str, float], dict[str, str]]:
        """Return the parameter values with which the part only passes on what it is given, and which input each output then is.

        The engine leaves an idle part out. Most parts have no such values: both are empty.
        """
        return {}, {}

    @classmethod
    def law_of(cls, output: str) -> str:
        """Return the law that gives an output."""
        return f"output_{output}" if f"output_{output}" in cls.laws else "output"

    @classmethod
    def taken_for(cls, output: str) -> tuple[str, ...]:
        """Return what an output depends on: the arguments of its law, and for an output among them those of that one's law."""
        outputs, arguments = cls.declared(Output), cls.arguments[cls.law_of(output)]
        found = [cls.taken_for(name) if name in outputs else (name,) for name in arguments]
        return tuple(dict.fromkeys(name for names in found for name in names))

    @classmethod
    def law_answer(cls, law: str, given: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return what a law gives where all that it depends on has the values ``given``; outputs that it takes are computed."""
        outputs = cls.declared(Output)
        answer = cls.laws[law](*(cls.value_of(name, given) if name in outputs else given[name] for name in cls.arguments[law]))
        return answer if isinstance(answer, tuple) else (answer,)

    @classmethod
    def value_of(cls, output: str, given: Mapping[str, Any]) -> float:
        """Return an output where what it depends on (:meth:`taken_for`) has the values ``given``."""
        law = cls.law_of(output)
        return float(cls.law_answer(law, given)[cls.output_laws()[law].index(output)])

    @classmethod
    def placeholders(cls) -> set[str]:
        """Return the unit placeholders that are still open."""
        return {match for item in cls.declarations.values() for match in _PLACEHOLDER.findall(item.unit)}

    @classmethod
    def with_units(cls, units: Mapping[str, str]) -> type[Component]:
        """Return the same part with its unit placeholders replaced, for example ``{"effort": "N", "flow": "m/s"}``."""
        if not cls.placeholders():
            return cls
        key = cls, frozenset(units.items())
        if key not in _WITH_UNITS:
            body = {"__doc__": cls.__doc__, "__module__": cls.__module__, "__qualname__": cls.__qualname__}
            _WITH_UNITS[key] = type(cls.__name__, (cls,), body, units=units)
        return _WITH_UNITS[key]


_WITH_UNITS: dict[tuple[type[Component], frozenset[tuple[str, str]]], type[Component]] = {}
"""What :meth:`Component.with_units` made; a catalogue is placed in each machine that is asked about, with the same units."""


def _collect(cls: type[Component]) -> dict[str, Declaration]:
    found: dict[str, Declaration] = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Declaration):
                found.pop(name, None)
                found[name] = value
            elif name in found:
                del found[name]
    return found


def _argument_names(cls: type[Component], law: str) -> tuple[str, ...]:
    function = inspect.getattr_static(cls, law)
    place = f"{cls.__module__}.{cls.__qualname__}"
    if not isinstance(function, staticmethod):
        raise ComponentError(f"{law} is a method; a law is a pure function.", place=place, remedy="Put @staticmethod above it.")
    signature = inspect.signature(function.__func__)
    for parameter in signature.parameters.values():
        if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.POSITIONAL_ONLY) or parameter.default is not parameter.empty:
            raise ComponentError(
                f"{law} takes '{parameter}'.", place=place, remedy="A law takes declared names only, without defaults or stars."
            )
    return tuple(signature.parameters)


def _check_definition(cls: type[Component]) -> None:
    place = f"{cls.__module__}.{cls.__qualname__}"
    if cls.group and cls.group not in GROUPS:
        remedy = nearest(cls.group, GROUPS) or f"Groups: {', '.join(GROUPS)}."
        raise ComponentError(f"there is no group '{cls.group}'.", place=place, remedy=remedy)
    names = cls.declarations
    for name, item in names.items():
        if not item.doc.strip():
            raise ComponentError(f"{name} has no doc.", place=place, remedy="Say in one sentence what it is.")
        if not item.unit.strip():
            raise ComponentError(f"{name} has no unit.", place=place, remedy='Give one, "1" for a pure number.')
        if name in BUILT_IN_ARGUMENTS or name in LAW_NAMES or name.startswith("output_"):
            raise ComponentError(f"'{name}' is a name the engine gives itself.", place=place, remedy="Choose another name.")
        if isinstance(item, Parameter) and not item.low <= item.default <= item.high:
            raise ComponentError(
                f"{name} has the default {item.default:g}, outside {item.low:g} to {item.high:g}.", place=place, remedy="Move one of them."
            )
    needs: dict[str, type[Declaration]] = {"derivative": State, "output": Output, "update": DiscreteState}
    for law, kind in needs.items():
        declared = [name for name in cls.declared(kind) if kind is not Output or f"output_{name}" not in cls.laws]
        if declared and law not in cls.laws:
            raise ComponentError(f"the {kind.kind} '{declared[0]}' has no law.", place=place, remedy=f"Write {law}(...), which gives it.")
        if law in cls.laws and not declared and not (law == "update" and cls.declared(Memory)):
            raise ComponentError(
                f"{law} gives nothing that is declared.", place=place, remedy=f"Declare a {kind.__name__}, or leave {law} out."
            )
    for law, arguments in cls.arguments.items():
        for argument in arguments:
            if argument in BUILT_IN_ARGUMENTS:
                continue
            if argument not in names:
                raise ComponentError(
                    f"{law} takes '{argument}', which is not declared.",
                    place=place,
                    remedy=nearest(argument, [*names, *BUILT_IN_ARGUMENTS]) or f"Declare '{argument}', or take it out.",
                )
            if isinstance(names[argument], Noise) and law != "update":
                raise ComponentError(f"{law} takes the noise '{argument}'.", place=place, remedy="Noise is sampled: take it in update.")


def _law_order(cls: type[Component]) -> tuple[str, ...]:
    """Return the laws in an order in which each finds what it takes. Raises :class:`ComponentError` where there is none."""
    needs: dict[str, list[str]] = {}
    for law, arguments in cls.arguments.items():
        items = [cls.declarations[name] for name in arguments if name in cls.declarations]
        needs[law] = [cls.law_of(item.name) for item in items if isinstance(item, Output)]
        if law != "update" and "update" in cls.laws and any(isinstance(item, (DiscreteState, Memory)) for item in items):
            needs[law].append("update")
    try:
        return tuple(TopologicalSorter(needs).static_order())
    except CycleError as error:
        raise ComponentError(
            f"the laws {' -> '.join(error.args[1])} wait for one another.",
            place=f"{cls.__module__}.{cls.__qualname__}",
            remedy="Compute one of them from states, inputs and parameters.",
        ) from None
