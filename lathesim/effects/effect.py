"""What an effect is: physics a simulation may leave out, as a component that sits on one wire of a machine.

An effect takes what the wire carries (``incoming``) and gives what arrives instead (``outgoing``)::

    class CoulombFriction(Effect):
        \"\"\"Friction of constant size against the motion:  F_out = F_in + level tanh(v / smoothing).\"\"\"
        catalogue, family, site = 1, "reversal", "effort"
        neutral = {"level": 0.0}
        ...
        incoming = Input("{signal}", doc="disturbance before the friction")
        flow = Input("{flow}", doc="velocity of the host")
        outgoing = Output("{signal}", doc="disturbance with the friction")
        level = Parameter("{signal}", 20.0, low=0.0, doc="size of the friction")

A lesson places it with ``insert: [{effect: CoulombFriction, at: x_axis, level: 20 N}]``. ``at`` names a part, whose port of the role
``site`` carries the effect, or one ``part.name`` (an input, a parameter or an output). What an input of the effect is called says where
it is wired: the role of a port of the host (``flow``, ``displacement``, ``applied``, ``inertia`` ...); any input may be given another
source in the lesson. Units may hold the placeholder ``{signal}``, the unit of the wire, and ``{role}``, the unit of the host's port
of that role, so one class serves a table [N, m] and a spindle [N*m, rad].

With its ``neutral`` parameters an effect gives ``outgoing == incoming`` bit for bit: the run is the run without it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.elementary import cos, sin
from lathesim.errors import ComponentError, nearest


@dataclass(frozen=True)
class Identification:
    """How an effect is looked for in recordings.

    Most effects give ``typical`` and no more. Every other entry is for an effect that is special in one way, which its text says.
    """

    typical: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Parameter -> range met on small lathes, where a search starts; in the declared units."""
    typical_rotary: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """The same where the host turns: torque, angle, angular velocity instead of force, position, velocity. Empty: as ``typical``."""
    nuisance: tuple[str, ...] = ()
    """Parameters that belong to one recording and not to the machine (a phase moves when an encoder's zero moves)."""
    size_of_recording: tuple[str, ...] = ()
    """Those of the ``nuisance`` that are sizes, reported as they were on the estimation recording: no two losses of counts are alike."""
    history: tuple[str, ...] = ()
    """Parameters or states of the time before a recording began (how long an edge had cut). They are zero at the start of the estimation
    recording, which shows only what changes from then on, and are fitted anew on another one."""
    orders: tuple[str, ...] = ("order",)
    """Parameters that count repetitions a turn: whole numbers."""
    phases: tuple[str, ...] = ("phase", "second_phase")
    """Parameters that are the phase of a wave, whose best value follows from a few responses."""
    instants: tuple[str, ...] = ("instant",)
    """Parameters, or endings of such as in ``second_instant``, that are the time of an event; its size is called ``jump``."""
    resonance: str = ""
    """Parameter that is the frequency of a resonance [Hz]: a search begins at several, as a fit finds back only from nearby."""
    damping: str = ""
    """Parameter that is the damping ratio of that resonance: from 1/sqrt(2) on nothing resonates, and a search goes no further."""
    delay: str = ""
    """Parameter by which a reading is late [s], or by which its clock is wrong [1]; a small part of a sample is how a simulation steps."""
    whole_samples: str = ""
    """Parameter that makes what is read at the sample instants late by whole samples [s]: a fit finds no way across one."""
    held_flag: str = ""
    """Parameter that is 1 where what the wire carries is held from one sample to the next, and 0 where it moves: set when placed."""
    spacing: str = ""
    """Parameter that shows as the spacing of the recorded values themselves."""
    starts: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Values from which a search begins, the first of each parameter together, where a spread over the typical ranges would pass by what
    comes in steps only: converters have whole bits."""
    along: str = ""
    """Output that gives the way along which it repeats, where no sensor of the host shows it: the length that was cut."""
    products: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Parameter -> others that show only as their product with it."""
    extended: tuple[str, ...] = ()
    """Parameters of an extended shape (harmonics of a wave, how softly a limit sets in, a peak at low speed). The effect is looked for with
    their defaults; they are fitted once it was found, where they explain much of what is left."""
    generalises: tuple[str, ...] = ()
    """Simpler effects that this one contains: it is tried in their place where one of them was found."""
    prerequisites: tuple[str, ...] = ()
    """Effects it stands on top of: it is tried only where one of them, or a generalisation of one, was found at the same host."""
    needs_both_ways: bool = False
    """Whether one direction of motion shows it only as what it generalises, or as a value of the host."""
    between_sensors: bool = False
    """Whether it sits between two sensors of one motion: where they cannot show which of them is wrong it is reported at the second."""
    senses_elsewhere: Mapping[str, str] = field(default_factory=dict)
    """Input -> role of the port of another part that feeds it: an axis out of square senses the place of each other one."""
    senses_beside: str = ""
    """Input that another channel of the same sensor feeds: a dynamometer's thrust in its feed force."""
    as_simulated: bool = False
    """Whether it senses the motion as simulated in a replay too: what it adds of a velocity has to cancel what its host takes away, and the
    noise of an encoder does not."""
    sticks: bool | None = None
    """Whether it may hold its host still, as a dry friction does; none: as its family does."""
    periodic: bool | None = None
    """Whether it repeats along the way, the angle or the time; none: as its family does."""
    full_band: bool | None = None
    """Whether it shows above the frequencies of the motion, so that it is fitted on all; none: as its family does."""
    against_motion: bool = False
    """Whether a periodic effect changes its sign with the direction, as a friction that is larger at some places."""
    middles: tuple[str, ...] = ("middle",)
    """Parameters that are the angle of the middle of a narrow place, as of a slot."""
    carried: tuple[str, ...] | None = None
    """Units of the wires on which it is looked for; none where the unit does not matter."""
    of_any_reading: bool = False
    """Whether whatever is recorded may have it, though it sits elsewhere by itself."""


@dataclass(frozen=True)
class Family:
    """What the effects of a family have in common for a search, where an effect does not say otherwise."""

    sticks: bool = False
    periodic: bool = False
    full_band: bool = False


FAMILIES = {
    "reversal": Family(sticks=True),
    "once per turn": Family(periodic=True, full_band=True),
    "lag": Family(full_band=True),
    "structure": Family(full_band=True),
    "encoder": Family(full_band=True),
    "drive range": Family(full_band=True),
    "recording": Family(full_band=True),
}
"""Families that are searched for in a way of their own; any other, as one of a plug-in, in the band of the motion."""

COMPUTED = -1.0
"""The value of the setting :attr:`Identification.held_flag` where a firmware computes the effect from readings."""

FORMER_NAMES = {
    "typical": "typical", "typical_rotary": "typical_rotary", "nuisance": "nuisance", "told_of_one": "size_of_recording",
    "remembers": "history", "resonance": "resonance", "late_by": "delay", "in_samples": "whole_samples", "told_if_held": "held_flag",
    "spacing": "spacing", "along": "along", "only_products": "products", "finer_shape": "extended",
    "refines": "generalises", "needs": "prerequisites", "needs_both_ways": "needs_both_ways", "between_sensors": "between_sensors",
    "elsewhere": "senses_elsewhere", "from_beside": "senses_beside", "carried": "carried", "of_any_reading": "of_any_reading",
}  # fmt: skip
"""Names of class attributes that plug-ins gave before there was this record -> its entries; they are taken over."""


SHAPE = ("second_sine", "second_cosine", "third_sine", "third_cosine")
"""Parameters of an effect that repeats: its second and third harmonics, as shares of the first."""
SHAPE_RANGES = dict.fromkeys(SHAPE, (-0.5, 0.5))
"""Their usual ranges. Assumed."""


def harmonic_parameters() -> tuple[Parameter, Parameter, Parameter, Parameter]:
    """Declare the parameters of :data:`SHAPE`: ``second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()``."""

    def share(text: str) -> Parameter:
        return Parameter("1", 0.0, low=-2.0, high=2.0, doc=text)

    return (
        share("second harmonic over the first, in step with it"),
        share("second harmonic over the first, a quarter of its own period ahead"),
        share("third harmonic over the first, in step with it"),
        share("third harmonic over the first, a quarter of its own period ahead"),
    )


def harmonics(angle: float, second_sine: float, second_cosine: float, third_sine: float, third_cosine: float) -> float:
    """Return the second and the third harmonic [of the first] at an angle of the first one [rad]: sin 2a = 2 sin a cos a ..."""
    sine, cosine = sin(angle), cos(angle)
    second = second_sine * (2.0 * sine * cosine) + second_cosine * (1.0 - 2.0 * sine * sine)
    third = third_sine * (3.0 - 4.0 * sine * sine) * sine + third_cosine * (4.0 * cosine * cosine - 3.0) * cosine
    return second + third


class Effect(Component):
    """Physics that may be left out. Subclass it, say what it is known by, and write its laws as for any component."""

    catalogue: ClassVar[int] = 0
    """Number in the catalogue of effects; 0 for one outside it."""
    family: ClassVar[str] = ""
    """Effects of one family leave like traces: what cannot be told apart is reported as a tie within it."""
    site: ClassVar[str] = "effort"
    """Role of the host's port the effect sits on where the lesson names only a part."""
    also_at: ClassVar[dict[str, tuple[str, str]]] = {}
    """Further ports it sits on at the same time: role -> (input, output) of the effect (a spring acts on both of its ends)."""
    beyond: ClassVar[str] = ""
    """Output that sensors of the host's displacement see added to it where they close no loop: a scale at the table, behind the spring."""
    seen_from: ClassVar[str] = ""
    """Side of a spring, ``motor`` or ``load``, on which a sensor sees what sits on its way; empty where it does on both."""
    behind: ClassVar[dict[str, str]] = {}
    """Input of a friction -> output of this effect that takes its place, where the friction comes before it and so holds what is behind the
    spring; what takes the place of ``flow`` is added to it."""
    near_side: ClassVar[dict[str, str]] = {}
    """Input of a friction -> output of this effect that takes its place, where the friction is on the host's side of the spring."""
    proportional: ClassVar[bool] = False
    """Whether what leaves it is a multiple of what enters: of a reading that is true a share, and so nothing of a table that stands."""
    stage: ClassVar[int] = 0
    """Where among effects of one port it acts: 0 what makes the force of a chip, or any force; 1 what the edge adds to that; 2 what takes
    a share of both as the cut grows deeper or opens; 3 what a sensor feels and the cut knows nothing of."""
    identification: ClassVar[Identification] = Identification()
    """How a diagnosis looks for it in recordings."""
    neutral: ClassVar[dict[str, float]] = {}
    """Parameter values that make the effect vanish, in the declared units."""
    fingerprint: ClassVar[str] = ""
    """What it looks like in a recording."""
    confused_with: ClassVar[tuple[str, ...]] = ()
    """What leaves a trace much like it."""
    experiment: ClassVar[str] = ""
    """What to run to tell it from those."""
    source: ClassVar[str] = ""
    """Where the equation and the usual sizes are published, or that they are assumed."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        former = {entry: vars(cls)[name] for name, entry in FORMER_NAMES.items() if name in vars(cls)}
        family, how = FAMILIES.get(cls.family, Family()), replace(cls.identification, **former)
        of_family = {name: getattr(family, name) for name in ("sticks", "periodic", "full_band") if getattr(how, name) is None}
        cls.identification = replace(how, **of_family)
        _check_effect(cls)

    @classmethod
    def pairs(cls) -> dict[str, tuple[str, str]]:
        """Return role -> (input, output) for every port the effect sits on, the main one first."""
        return {cls.site: ("incoming", "outgoing"), **cls.also_at}

    @classmethod
    def idle(cls) -> tuple[dict[str, float], dict[str, str]]:
        """Return the neutral values, with which every output on a port is what its input carries."""
        return dict(cls.neutral), {given: taken for taken, given in cls.pairs().values()}


def _check_effect(cls: type[Effect]) -> None:
    place = f"{cls.__module__}.{cls.__qualname__}"
    for role, (taken, given) in cls.pairs().items():
        for name, kind in ((taken, Input), (given, Output)):
            if type(cls.declarations.get(name)) is not kind:
                raise ComponentError(
                    f"the effect declares no {kind.kind} '{name}' for the port '{role}'.",
                    place=place,
                    remedy=f"Declare it with {kind.__name__}(...).",
                )
    for attribute in ("family", "fingerprint", "experiment", "source"):
        if not getattr(cls, attribute).strip():
            raise ComponentError(f"the effect says nothing as its {attribute}.", place=place, remedy=f'Write {attribute} = "...".')
    parameters = cls.declared(Parameter)
    if not cls.neutral:
        remedy = 'Name the parameter values with which it vanishes, as in neutral = {"level": 0.0}.'
        raise ComponentError("the effect has no neutral values.", place=place, remedy=remedy)
    how = cls.identification
    named: dict[str, Collection[str]] = {
        "neutral": cls.neutral, "typical": how.typical, "typical_rotary": how.typical_rotary, "nuisance": how.nuisance,
        "extended": how.extended, "products": how.products,
    }  # fmt: skip
    named |= {name: (value,) for name in ("delay", "whole_samples", "resonance", "spacing", "held_flag") if (value := getattr(how, name))}
    for entry, names in named.items():
        for name in names:
            if name not in parameters:
                raise ComponentError(f"{entry} names '{name}', which is no parameter.", place=place, remedy=nearest(name, parameters))
    if not set(how.size_of_recording) <= set(how.nuisance):
        raise ComponentError("size_of_recording names what is not among the nuisance.", place=place, remedy="Name it in nuisance too.")
    for name in how.history:
        if name not in parameters and name not in cls.declared(State):
            raise ComponentError(
                f"history names '{name}', which is no parameter and no state.", place=place, remedy=nearest(name, parameters)
            )
    if how.along and type(cls.declarations.get(how.along)) is not Output:
        remedy = nearest(how.along, cls.declared(Output))
        raise ComponentError(f"along names '{how.along}', which is no output.", place=place, remedy=remedy)
    for name, value in cls.neutral.items():
        if not parameters[name].low <= value <= parameters[name].high:
            bounds = f"{parameters[name].low:g} to {parameters[name].high:g}"
            raise ComponentError(f"the neutral value of {name}, {value:g}, lies outside {bounds}.", place=place, remedy="Move one of them.")


class OnCommand:
    """What an effect on a command takes and gives."""

    incoming = Input("{signal}", doc="command")
    outgoing = Output("{signal}", doc="command that acts")
