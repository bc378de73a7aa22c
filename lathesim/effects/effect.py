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

from typing import Any, ClassVar

from lathesim.component import Component, Input, Output, Parameter, State
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
    behind: ClassVar[dict[str, str]] = {}
    """Input of a friction -> output of this effect that takes its place, where the friction comes before it and so holds what is behind the
    spring; what takes the place of ``flow`` is added to it."""
    between_sensors: ClassVar[bool] = False
    """Whether it sits between two sensors of one motion: where they cannot tell which of them is wrong it is told at the second."""
    proportional: ClassVar[bool] = False
    """Whether what leaves it is a multiple of what enters: of a reading that is true a share, and so nothing of a table that stands."""
    along: ClassVar[str] = ""
    """Output that tells the way along which it repeats, where no sensor of the host shows it: the length that was cut."""
    elsewhere: ClassVar[dict[str, str]] = {}
    """Input -> role of the port of another part that feeds it, for a diagnosis to look for: an axis out of square senses the place of each
    other one."""
    from_beside: ClassVar[str] = ""
    """Input that another channel of the same sensor feeds, for a diagnosis to look for: a dynamometer's thrust in its feed force."""
    stage: ClassVar[int] = 0
    """Where among effects of one port it acts: 0 what makes the force of a chip, or any force; 1 what the edge adds to that; 2 what takes
    a share of both as the cut grows deeper or opens; 3 what a sensor feels and the cut knows nothing of."""
    carried: ClassVar[tuple[str, ...] | None] = None
    """Units of the wires on which a diagnosis looks for it; none where the unit does not matter."""
    of_any_reading: ClassVar[bool] = False
    """Whether whatever is recorded may have it, though it sits elsewhere by itself."""
    late_by: ClassVar[str] = ""
    """Parameter by which a reading is late [s], or by which its clock is wrong [1]; a small part of a sample is how a simulation steps."""
    in_samples: ClassVar[str] = ""
    """Parameter that makes what is read at the sample instants late by whole samples [s]: a fit finds no way across one."""
    resonance: ClassVar[str] = ""
    """Parameter that is the frequency of its resonance [Hz]: a search begins at several, as a fit finds back only from nearby."""
    neutral: ClassVar[dict[str, float]] = {}
    """Parameter values that make the effect vanish, in the declared units."""
    typical: ClassVar[dict[str, tuple[float, float]]] = {}
    """Parameter -> range met on small lathes, where a search starts; in the declared units."""
    typical_rotary: ClassVar[dict[str, tuple[float, float]]] = {}
    """The same where the host turns: torque, angle, angular velocity instead of force, position, velocity. Empty: as ``typical``."""
    nuisance: ClassVar[tuple[str, ...]] = ()
    """Parameters that belong to one recording and not to the machine (a phase moves when an encoder's zero moves)."""
    told_of_one: ClassVar[tuple[str, ...]] = ()
    """Those of the ``nuisance`` that are sizes, and so are told as they were on the fitted recording: no two losses of counts are alike."""
    remembers: ClassVar[tuple[str, ...]] = ()
    """Parameters or states that tell what had happened before a recording began (how long an edge had cut, how long a screw had been
    warming up), from zero on: zero on the fitted recording, which shows only what changes from then on, and fitted anew on another one."""
    bare: ClassVar[tuple[str, ...]] = ()
    """Parameters of its simplest form, where the others may be left at their defaults: tried beside the whole form."""
    finer_shape: ClassVar[tuple[str, ...]] = ()
    """Parameters of a finer shape (harmonics of a wave, how softly a limit sets in). At their defaults the effect has its plain shape, in
    which it is looked for; they are fitted once it was found, where they take away much of what is left."""
    only_products: ClassVar[dict[str, tuple[str, ...]]] = {}
    """Parameter -> others of which nothing but their product with it shows."""
    told_if_held: ClassVar[str] = ""
    """Parameter that is 1 where what the wire carries is held from one sample to the next, and 0 where it moves: set where it is put in."""
    spacing: ClassVar[str] = ""
    """Parameter that shows as the spacing of the recorded values themselves."""
    refines: ClassVar[tuple[str, ...]] = ()
    """Simpler effects that this one contains: it is tried where one of them was found, in its place."""
    needs_both_ways: ClassVar[bool] = False
    """Whether it is nothing but what it refines, or repeats along the way like another one, and a value of the host, as long as the host
    moves in one direction only."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Effects it stands on top of: it is tried only where one of them, or a refinement of one, was found at the same host."""
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
        _check_effect(cls)

    @classmethod
    def pairs(cls) -> dict[str, tuple[str, str]]:
        """Give role -> (input, output) for every port the effect sits on, the main one first."""
        return {cls.site: ("incoming", "outgoing"), **cls.also_at}

    @classmethod
    def idle(cls) -> tuple[dict[str, float], dict[str, str]]:
        """Give the neutral values, with which every output on a port is what its input carries."""
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
    for attribute in ("neutral", "typical", "typical_rotary", "nuisance", "finer_shape", "only_products"):
        for name in getattr(cls, attribute):
            if name not in parameters:
                raise ComponentError(f"{attribute} names '{name}', which is no parameter.", place=place, remedy=nearest(name, parameters))
    if not set(cls.told_of_one) <= set(cls.nuisance):
        raise ComponentError("told_of_one names what is not among the nuisance.", place=place, remedy="Name it in nuisance too.")
    for attribute in ("late_by", "in_samples", "resonance", "spacing", "told_if_held"):
        name = getattr(cls, attribute)
        if name and name not in parameters:
            raise ComponentError(f"{attribute} names '{name}', which is no parameter.", place=place, remedy=nearest(name, parameters))
    for name in cls.remembers:
        if name not in parameters and name not in cls.declared(State):
            raise ComponentError(
                f"remembers names '{name}', which is no parameter and no state.", place=place, remedy=nearest(name, parameters)
            )
    if cls.along and type(cls.declarations.get(cls.along)) is not Output:
        remedy = nearest(cls.along, cls.declared(Output))
        raise ComponentError(f"along names '{cls.along}', which is no output.", place=place, remedy=remedy)
    for name, value in cls.neutral.items():
        if not parameters[name].low <= value <= parameters[name].high:
            bounds = f"{parameters[name].low:g} to {parameters[name].high:g}"
            raise ComponentError(f"the neutral value of {name}, {value:g}, lies outside {bounds}.", place=place, remedy="Move one of them.")
