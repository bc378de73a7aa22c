"""Friction that dies out with speed stands on dry friction: where that is not in the model, the model began wrongly."""

import numpy as np

from lathesim.diagnosis.candidates.eligibility import stands
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.laboratory import Bench, term_free
from lathesim.diagnosis.selection.moves.prerequisite import put_on_ground
from lathesim.effects.friction import CoulombFriction, StribeckFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Term
from tests.diagnosis.pushed_table import Hidden, baseline, recording, rigs

RUBBING_AND_PUSHED = Hidden(dry=8.0, law=lambda v, q, t: 6.0)


def test_dry_friction_takes_the_place_of_an_excess_that_has_nothing_to_stand_on() -> None:
    records = [recording(RUBBING_AND_PUSHED, seed=seed) for seed in (1, 2)]
    rig, held_out = rigs(*records, effects=(CoulombFriction, StribeckFriction, ForceOffset))
    told: list[str] = []
    bench = Bench(rig, held_out, told.append)
    fitted = fit(rig.sensed, baseline(rig), rounds=3)
    bench.weigh(fitted)
    found = Found(bench.model((), fitted), bench.model((), fitted))
    by_name: dict[str, Term] = {term.name: term for term in rig.candidates}
    offset, excess, dry = (by_name[name] for name in ("ForceOffset", "StribeckFriction", "CoulombFriction"))
    starts = ((offset, np.array([5.0])), (excess, np.array([5.0, 0.05, 1.0])))
    free = [*baseline(rig), *(item for term, start in starts for item in term_free(term, start))]
    found.model = bench.model((offset, excess), fit(rig.sensed, free, rounds=2))
    assert not stands(excess, found.model, rig)
    assert put_on_ground(bench, found, Settings())
    assert {term.name for term in found.model.terms} == {"ForceOffset", "CoulombFriction"}
    assert told[-1] == "CoulombFriction at x_axis takes the place of StribeckFriction"
    assert abs(found.model.fitted.by_name[f"{dry.part}.level"] - 8.0) < 0.5
    assert not put_on_ground(bench, found, Settings())


def peak(v: float, q: float, t: float) -> float:
    """A friction that dies out with speed."""
    return 6.0 * float(np.tanh(v / 1e-4)) * float(np.exp(-((v / 0.02) ** 2)))


def test_dry_friction_comes_in_beside_an_excess_that_took_it_for_its_own() -> None:
    records = [recording(Hidden(dry=8.0, law=peak), seed=seed) for seed in (1, 2)]
    rig, held_out = rigs(*records, effects=(CoulombFriction, StribeckFriction))
    told: list[str] = []
    bench = Bench(rig, held_out, told.append)
    fitted = fit(rig.sensed, baseline(rig), rounds=3)
    bench.weigh(fitted)
    before = bench.model((), fitted)
    by_name: dict[str, Term] = {term.name: term for term in rig.candidates}
    dry, excess = by_name["CoulombFriction"], by_name["StribeckFriction"]
    trial = bench.trial(before, excess, (), before.free, [np.array([15.0, 0.2, 1.0])])
    found = Found(before, trial.model, {excess.part: [trial]})
    assert put_on_ground(bench, found, Settings())
    assert told[-1] == "CoulombFriction at x_axis is there too"
    values = found.model.fitted.by_name
    assert abs(values[f"{dry.part}.level"] - 8.0) < 0.5
    assert abs(values[f"{excess.part}.excess"] - 6.0) < 0.5
    # what the excess took away at first was for the most part not its own
    assert found.removed_by(dry) > 0.8 > 0.2 > found.removed_by(excess)
