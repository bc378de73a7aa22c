"""Which effects tie: families of ties, each with groups of two to four rivals, and the order in which cases are drawn from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tie:
    """One case: its rig, its family, the keys of its rivals, and which of them is true."""

    rig: str
    family: str
    rivals: tuple[str, ...]
    truth: int


TIES: dict[tuple[str, str], tuple[tuple[str, ...], ...]] = {
    ("axis", "reversal"): (
        ("coulomb", "bristles"), ("coulomb", "asymmetric"), ("backlash", "bristles"), ("backlash", "wind_up"), ("coulomb", "stribeck"),
        ("coulomb", "dead_zone"), ("backlash", "coulomb", "bristles"), ("coulomb", "bristles", "stribeck", "asymmetric"),
    ),
    ("axis", "lag"): (
        ("delay", "current_loop"), ("delay", "inductance"), ("current_loop", "inductance"), ("resonance", "delay"),
        ("resonance", "current_loop"), ("delay", "current_loop", "inductance"),
    ),
    ("axis", "once per turn"): (
        ("ripple", "cogging"), ("pitch_wave", "eccentricity"), ("cogging", "tight_spots"), ("ripple", "pitch_wave"),
        ("ripple", "cogging", "tight_spots"),
    ),
    ("axis", "slow"): (("screw_growth", "pitch"), ("screw_growth", "clock_skew"), ("screw_growth", "pitch", "wind_up")),
    ("axis", "constants"): (("gravity", "converter_offset"), ("gravity", "asymmetric"), ("gravity", "converter_offset", "asymmetric")),
    ("cut", "force law"): (("edge_force", "size_effect"), ("speed_effect", "softening"), ("edge_force", "size_effect", "speed_effect")),
    ("cut", "spindle-synchronous"): (("runout", "hard_spot"), ("hard_spot", "slot"), ("runout", "hard_spot", "slot")),
    ("spindle", "once per turn"): (("spindle_ripple", "spindle_cogging"), ("spindle_ripple", "tacho_ripple")),
    ("spindle", "reversal"): (("spindle_coulomb", "spindle_asymmetric"),),
}  # fmt: skip
"""(rig, family) -> groups of rivals."""


CONTAINED = {("cogging", "ripple"), ("spindle_cogging", "spindle_ripple")}
"""(truth, rival): the rival has a parameter that makes exactly this truth, so no run tells them; such a truth is hidden in no case."""


TERMS: dict[str, frozenset[str]] = {
    "CoulombFriction": frozenset({"level sgn v"}),
    "ForceOffset": frozenset({"offset"}),
    "AsymmetricFriction": frozenset({"level sgn v", "offset"}),
}
"""Effect -> the terms of its equation while the axis moves. An asymmetric friction is level (1 + a sgn v) sgn v = level sgn v + level a,
so that two effects of one term each are together the same equation. An effect that does not stand here is a term of its own."""


def terms(effects: Iterable[str]) -> frozenset[str]:
    """Return the terms of the sum of effects."""
    return frozenset().union(*(TERMS.get(name, frozenset({name})) for name in effects))


def _truths(group: tuple[str, ...]) -> list[int]:
    """Return which rivals of a group may be hidden."""
    return [place for place, key in enumerate(group) if not any((key, other) in CONTAINED for other in group)]


def schedule(seed: int, rigs: tuple[str, ...]) -> list[Tie]:
    """Return cases without end in sight: one of each family in turn, so that any first N of them are spread over the families."""
    random = np.random.default_rng([seed, 31])
    families = [key for key in TIES if key[0] in rigs]
    orders = {key: [TIES[key][int(place)] for place in random.permutation(len(TIES[key]))] for key in families}
    found = []
    for turn in range(40):
        for place in random.permutation(len(families)):
            key = families[int(place)]
            group = orders[key][turn % len(orders[key])]
            found.append(Tie(*key, group, int(random.choice(_truths(group)))))
    return found
