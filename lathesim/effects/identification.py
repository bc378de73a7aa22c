"""What a search needs to know of an effect to look for it in a recording. Nothing of it changes how the effect acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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
    delay: str = ""
    """Parameter by which a reading is late [s], or by which its clock is wrong [1]; a small part of a sample is how a simulation steps."""
    whole_samples: str = ""
    """Parameter that makes what is read at the sample instants late by whole samples [s]: a fit finds no way across one."""
    held_flag: str = ""
    """Parameter that is 1 where what the wire carries is held from one sample to the next, and 0 where it moves: set when placed."""
    spacing: str = ""
    """Parameter that shows as the spacing of the recorded values themselves."""
    along: str = ""
    """Output that gives the way along which it repeats, where no sensor of the host shows it: the length that was cut."""
    products: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Parameter -> others that show only as their product with it."""
    minimal_form: tuple[str, ...] = ()
    """Parameters of its simplest form, where the others may stay at their defaults: tried beside the whole form."""
    extended: tuple[str, ...] = ()
    """Parameters of an extended shape (harmonics of a wave, how softly a limit sets in). The effect is looked for with their defaults; they
    are fitted once it was found, where they explain much of what is left."""
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
    second_harmonic: tuple[str, ...] = ("second", "second_sine", "second_cosine")
    """Parameters that are the size of a second harmonic, which keeps its sign where the wave is turned by half a period."""
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

FORMER_NAMES = {
    "typical": "typical", "typical_rotary": "typical_rotary", "nuisance": "nuisance", "told_of_one": "size_of_recording",
    "remembers": "history", "resonance": "resonance", "late_by": "delay", "in_samples": "whole_samples", "told_if_held": "held_flag",
    "spacing": "spacing", "along": "along", "only_products": "products", "bare": "minimal_form", "finer_shape": "extended",
    "refines": "generalises", "needs": "prerequisites", "needs_both_ways": "needs_both_ways", "between_sensors": "between_sensors",
    "elsewhere": "senses_elsewhere", "from_beside": "senses_beside", "carried": "carried", "of_any_reading": "of_any_reading",
}  # fmt: skip
"""Names of class attributes that plug-ins gave before there was this record -> its entries; they are taken over."""
