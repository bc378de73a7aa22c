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

from collections.abc import Collection
from dataclasses import replace
from typing import Any, ClassVar

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.effects.identification import FAMILIES, FORMER_NAMES, Family, Identification
from lathesim.errors import ComponentError, nearest


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
