"""Forces that no effect of the catalogue makes: none is named for them, and the answer says on what they depend."""

import math
from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.explaining.plausible import repeats
from lathesim.diagnosis.explaining.trial import tried
from lathesim.diagnosis.explanations.held_out import Worth
from lathesim.diagnosis.records.found import Screened
from lathesim.diagnosis.verdict import doubts, outdone
from lathesim.effects.drive_errors import Cogging
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.record import Record
from tests.diagnosis.pushed_table import (
    FORCE,
    POSITION,
    RESOLUTION,
    Hidden,
    Law,
    as_record,
    experiments,
    force,
    recording,
    searched,
    study,
    travel,
)  # fmt: skip


def shaken(v: float, q: float, t: float) -> float:
    """Return the force of a neighbour that shakes the machine at 6.2 Hz [N]."""
    return 15.0 * math.sin(2.0 * math.pi * 6.2 * t + 0.3)


def buffer(v: float, q: float, t: float) -> float:
    """Return the force of a buffer near one end of the way [N]."""
    return 30e3 * max(0.0, q - 0.012)


@pytest.mark.parametrize(("law", "on"), [(shaken, "is periodic in time, at 6.2"), (buffer, "depends on position of x_axis")])
def test_a_force_outside_the_catalogue_gets_no_name(law: Law, on: str) -> None:
    records = [recording(Hidden(law=law), seed=seed) for seed in (1, 2)]
    first, second = experiments(*records, effects=(CoulombFriction, ForceOffset, Cogging))
    asked, found = study(first, second), searched(first, second)
    found, left = outdone(asked, found, doubts(asked, found.model))
    assert not found.model.candidates
    assert any(one.clear and one.depends_on[0].startswith(on) for one in left)


def test_an_offset_that_adds_next_to_nothing_to_smooth_functions_gets_no_name() -> None:
    """A constant force is the mean of a buffer, and takes 2 % of the power of what functions of the place leave."""
    records = [recording(Hidden(law=lambda v, q, t: 10e3 * max(0.0, q - 0.004)), seed=seed) for seed in (7, 8)]
    first, second = experiments(*records, effects=(ForceOffset,))
    asked, found = study(first, second), searched(first, second)
    assert not found.model.candidates
    offset = tried(asked, found.model, Screened(first.candidates[0], 0.0, (np.array([5.0]),)), None)
    found = replace(found, model=offset.model)
    found, left = outdone(asked, found, doubts(asked, found.model))
    assert not found.model.candidates
    assert any(one.clear and one.depends_on[0].startswith("depends on position of x_axis") for one in left)


def test_a_dry_friction_that_makes_a_function_needless_keeps_its_name_beside_a_larger_force() -> None:
    records = [recording(Hidden(dry=8.0, law=shaken), seed=seed) for seed in (1, 2)]
    first, second = experiments(*records, effects=(CoulombFriction,))
    asked, found = study(first, second), searched(first, second)
    found, left = outdone(asked, found, doubts(asked, found.model))
    assert [one.name for one in found.model.candidates] == ["CoulombFriction"]
    assert any(one.clear for one in left)


def test_a_weight_keeps_its_name_beside_a_force_outside_the_catalogue() -> None:
    """Functions have a constant of their own, so that a weight adds nothing to them: it is most of what the lesson leaves."""
    first, second = experiments(*(hung_up(seed) for seed in (1, 2)), effects=(ForceOffset,))
    asked, found = study(first, second), searched(first, second)
    found, left = outdone(asked, found, doubts(asked, found.model))
    assert [one.name for one in found.model.candidates] == ["ForceOffset"]
    assert any(one.clear for one in left)


def hung_up(seed: int, weight: float = 40.0) -> Record:
    """Return a recording of a table whose weight the force holds, with a force along the way that no effect here makes."""
    pushed = force(2000, seed) + weight
    place = travel(pushed, Hidden(law=lambda v, q, t: weight + 10.0 * math.sin(q / 0.01)))
    noise = 0.3e-6 * np.random.default_rng(seed).standard_normal(len(place))
    return as_record({FORCE: ("N", pushed), POSITION: ("m", np.round((place + noise) / RESOLUTION) * RESOLUTION)})


def test_half_a_wave_on_the_way_is_no_wave() -> None:
    first, second = experiments(recording(seed=1), recording(seed=2), effects=(Cogging,))
    (cogging,) = first.candidates
    (length,) = cogging.named(("period",))
    way = float(np.ptp(first.record["x_encoder.position"]))
    assert [repeats(study(first, second), cogging, {length: share * way}) for share in (0.1, 0.9, 2.0)] == [True, True, False]


def test_what_acts_in_few_blocks_is_as_sure_as_what_acts_in_all() -> None:
    """Chance makes blocks lose too."""
    few, all_alike = np.r_[100.0, 120.0, 140.0, np.tile([1.0, -1.0], 18)], np.tile([8.0, 10.0, 12.0], 13)
    by_chance = np.r_[np.tile([30.0, -30.0], 18), 60.0, 60.0, 60.0]
    assert all(Worth.of(gains).errors > 10.0 for gains in (few, all_alike))
    assert Worth.of(by_chance).errors < 1.0
