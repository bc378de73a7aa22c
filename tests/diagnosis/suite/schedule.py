"""Which case is what: a fixed list of categories, rigs and hidden effects, shuffled by the seed of the suite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.diagnosis.suite.concealed import Draw
from tests.diagnosis.suite.hidden_axis import AXIS_EFFECTS
from tests.diagnosis.suite.hidden_outside import OTHER_FORM, OUTSIDE
from tests.diagnosis.suite.hidden_turning import CUTTING_EFFECTS, CUTTING_OUTSIDE, SPINDLE_EFFECTS, SPINDLE_OUTSIDE

DRAWS: dict[str, Draw] = {
    **AXIS_EFFECTS, **OUTSIDE, **OTHER_FORM, **SPINDLE_EFFECTS, **SPINDLE_OUTSIDE, **CUTTING_EFFECTS, **CUTTING_OUTSIDE,
}  # fmt: skip

CONTROLS = {"axis": 40, "spindle": 12, "cutting": 12}
PARAMETERS = {"axis": 28, "spindle": 8, "cutting": 8}

PAIRS: dict[str, tuple[tuple[str, ...], ...]] = {
    "axis": (
        ("coulomb", "gravity"), ("coulomb", "stribeck"), ("coulomb", "backlash"), ("coulomb", "cogging"), ("backlash", "pitch_wave"),
        ("gravity", "ripple"), ("coulomb", "dead_zone"), ("pitch", "backlash"), ("wind_up", "screw_growth"), ("coulomb", "delay"),
        ("saturation", "gravity"), ("inductance", "pitch_wave"), ("tight_spots", "cogging"), ("resonance", "converter_offset"),
        ("eccentricity", "coulomb"), ("lost_counts", "gravity"),
    ),
    "spindle": (("spindle_coulomb", "tacho_ripple"), ("spindle_coulomb", "belt_slip"), ("torque_limit", "tacho_filter")),
    "cutting": (("edge_force", "runout"), ("size_effect", "charge_leak"), ("speed_effect", "softening"), ("hard_spot", "wear"),
                ("size_effect", "slot")),
}  # fmt: skip
TRIPLES: dict[str, tuple[tuple[str, ...], ...]] = {
    "axis": (
        ("coulomb", "gravity", "backlash"), ("coulomb", "stribeck", "pitch_wave"), ("coulomb", "cogging", "pitch"),
        ("coulomb", "delay", "backlash"), ("gravity", "wind_up", "saturation"), ("asymmetric", "pitch_wave", "cogging"),
    ),
    "spindle": (("spindle_coulomb", "tacho_ripple", "belt_slip"),),
    "cutting": (("size_effect", "runout", "charge_leak"),),
}  # fmt: skip
POOR: tuple[tuple[str, str, str], ...] = (
    ("axis", "one_direction", "coulomb"), ("axis", "one_direction", "gravity"), ("axis", "one_direction", "coulomb"),
    ("axis", "one_speed", "stribeck"), ("axis", "one_speed", "cogging"), ("axis", "one_speed", "bristles"),
    ("axis", "one_direction", "dead_zone"), ("spindle", "one_direction", "spindle_asymmetric"), ("cutting", "one_setting", "edge_force"),
    ("cutting", "one_setting", "size_effect"),
)  # fmt: skip
FAULTS: tuple[tuple[str, str], ...] = (
    ("axis", "unit_1000"), ("axis", "unit_25.4"), ("axis", "swapped"), ("axis", "frozen"), ("axis", "shifted"), ("axis", "wrong_period"),
    ("axis", "dropped"), ("axis", "clipped"), ("spindle", "unit_2pi"), ("spindle", "frozen"), ("cutting", "unit_1000"),
    ("cutting", "swapped"),
)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """One line of the schedule."""

    rig: str
    category: str
    keys: tuple[str, ...] = ()
    poor: str = ""
    fault: str = ""


def _all() -> list[Entry]:
    entries = [Entry(rig, "control") for rig, count in CONTROLS.items() for _ in range(count)]
    entries += [Entry(rig, "parameters") for rig, count in PARAMETERS.items() for _ in range(count)]
    entries += [Entry("axis", "single", (key,)) for key in AXIS_EFFECTS for _ in range(2)]
    entries += [Entry("spindle", "single", (key,)) for key in SPINDLE_EFFECTS]
    entries += [Entry("cutting", "single", (key,)) for key in CUTTING_EFFECTS]
    entries += [Entry(rig, "pair", keys) for rig, pairs in PAIRS.items() for keys in pairs]
    entries += [Entry(rig, "triple", keys) for rig, triples in TRIPLES.items() for keys in triples]
    entries += [Entry("axis", "outside", (key,)) for key in OUTSIDE for _ in range(2)]
    entries += [Entry("spindle", "outside", (key,)) for key in SPINDLE_OUTSIDE for _ in range(2)]
    entries += [Entry("cutting", "outside", (key,)) for key in CUTTING_OUTSIDE for _ in range(2)]
    entries += [Entry("axis", "other_form", (key,)) for key in OTHER_FORM for _ in range(2)]
    entries += [Entry(rig, "poor", (key,), poor=poor) for rig, poor, key in POOR]
    entries += [Entry(rig, "fault", fault=fault) for rig, fault in FAULTS]
    return entries


def schedule(seed: int) -> list[Entry]:
    """Return every case of the suite, in an order that mixes the categories: any first N of it are a small suite."""
    rng = np.random.default_rng([seed, 999])
    groups: dict[str, list[Entry]] = {}
    for entry in _all():
        groups.setdefault(entry.category, []).append(entry)
    spread = []
    for group in groups.values():
        order = [group[int(i)] for i in rng.permutation(len(group))]
        spread += [((place + rng.uniform(0.2, 0.8)) / len(group), number, entry) for number, (place, entry) in enumerate(enumerate(order))]
    return [entry for _, _, entry in sorted(spread, key=lambda item: item[:2])]
