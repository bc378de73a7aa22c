"""A search by the error of the simulation is made where unmeasured forces would be as large as those that act, and for the motion alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.explaining.search import explain, explains_the_motion
from lathesim.diagnosis.records.found import Found
from lathesim.effects.friction import CoulombFriction
from lathesim.identification.replay.loading import Recorded
from tests.diagnosis.pushed_table import Hidden, experiments, machine, recording, study


def swinging(speed: float, place: float, time: float) -> float:
    """Return a force that swings slowly [N]; it moves the table further than the recorded force does."""
    return float(18.0 * np.sin(0.8 * np.pi * time * (1.0 + 0.2 * time)))


def test_what_does_not_explain_the_motion_has_no_rivals() -> None:
    hidden = Hidden(dry=30.0, law=swinging)
    halves = experiments(*(recording(hidden, count=1000, seed=seed) for seed in (1, 2)), effects=(CoulombFriction,))
    asked = study(*(half.by_output_error() for half in halves))
    found, whole = explain(asked, of_motion=True), explain(asked)
    assert [one.name for one in found.model.candidates] == [one.name for one in whole.model.candidates] == ["CoulombFriction"]
    assert not explains_the_motion(asked, found.model)
    assert found.complete
    assert (len(found.worth), len(whole.worth)) == (0, 1)


def test_what_explains_the_motion_ends_a_search_before_rivals_are_compared() -> None:
    """Pairs and rivals take the longest part of a search, and none of it is of use once another way has explained the motion."""
    asked = study(*experiments(*(recording(Hidden(dry=30.0), seed=seed) for seed in (1, 2)), effects=(CoulombFriction,)))
    shown: list[Found] = []

    def instead(found: Found) -> Found | None:
        shown.append(found)
        return replace(found, history=()) if len(shown) == 2 else None

    whole, ended = (explain(asked, instead=instead) for _ in range(2))
    names = [[one.name for one in found.model.candidates] for found in (*shown, whole, ended)]
    assert names == [["CoulombFriction"]] * 4
    assert [len(found.worth) for found in (*shown, whole, ended)] == [0, 0, 1, 0]
    assert ended.complete and ended.history == ()
    # what a round has fitted is not fitted, or counted, twice
    assert len({id(one) for one in whole.tried}) == len(whole.tried)


@pytest.mark.parametrize(("swing", "searched"), [(4.0, False), (15.0, True), (60.0, True)])
def test_a_small_force_that_moves_a_free_body_far_is_searched_under_the_noise_of_forces(swing: float, searched: bool) -> None:
    hidden = Hidden(viscous=4.0, law=lambda v, q, t: float(swing * np.sin(0.4 * np.pi * t * (1.0 + 0.1 * t))))
    recordings = tuple(Recorded(name, recording(hidden, count=1000, seed=seed), ()) for seed, name in enumerate(("fit", "check"), 1))
    lines: list[str] = []
    diagnose(ask("table", machine(viscous=4.0), recordings, (CoulombFriction,)), lines.append)
    assert any("the error of the simulation" in line for line in lines) == searched
