"""Friction that dies out with speed stands on dry friction: where that is not in the model, the model began wrongly."""

import numpy as np

from lathesim.diagnosis.candidates.eligibility import stands
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory, candidate_free
from lathesim.diagnosis.selection.moves.prerequisite import add_prerequisites
from lathesim.effects.friction import CoulombFriction, StribeckFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording

RUBBING_AND_PUSHED = Hidden(dry=8.0, law=lambda v, q, t: 6.0)


def test_dry_friction_takes_the_place_of_an_excess_that_has_nothing_to_stand_on() -> None:
    records = [recording(RUBBING_AND_PUSHED, seed=seed) for seed in (1, 2)]
    experiment, validation = experiments(*records, effects=(CoulombFriction, StribeckFriction, ForceOffset))
    told: list[str] = []
    laboratory = Laboratory(experiment, validation, told.append)
    fitted = fit(experiment.sensed, baseline(experiment), rounds=3)
    laboratory.weigh(fitted)
    by_name: dict[str, Candidate] = {candidate.name: candidate for candidate in experiment.candidates}
    offset, excess, dry = (by_name[name] for name in ("ForceOffset", "StribeckFriction", "CoulombFriction"))
    starts = ((offset, np.array([5.0])), (excess, np.array([5.0, 0.05, 1.0])))
    free = [*baseline(experiment), *(item for candidate, start in starts for item in candidate_free(candidate, start))]
    model = laboratory.model((offset, excess), fit(experiment.sensed, free, rounds=2))
    found = SearchResult(laboratory.model((), fitted), model)
    assert not stands(excess, found.model, experiment)
    found = add_prerequisites(laboratory, found, Method())
    assert {candidate.name for candidate in found.model.candidates} == {"ForceOffset", "CoulombFriction"}
    assert told[-1] == "CoulombFriction at x_axis takes the place of StribeckFriction"
    assert abs(found.model.fitted.by_name[f"{dry.part}.level"] - 8.0) < 0.5
    assert add_prerequisites(laboratory, found, Method()) is found


def peak(v: float, q: float, t: float) -> float:
    """A friction that dies out with speed."""
    return 6.0 * float(np.tanh(v / 1e-4)) * float(np.exp(-((v / 0.02) ** 2)))


def test_dry_friction_comes_in_beside_an_excess_that_took_it_for_its_own() -> None:
    records = [recording(Hidden(dry=8.0, law=peak), seed=seed) for seed in (1, 2)]
    experiment, validation = experiments(*records, effects=(CoulombFriction, StribeckFriction))
    told: list[str] = []
    laboratory = Laboratory(experiment, validation, told.append)
    fitted = fit(experiment.sensed, baseline(experiment), rounds=3)
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    by_name: dict[str, Candidate] = {candidate.name: candidate for candidate in experiment.candidates}
    dry, excess = by_name["CoulombFriction"], by_name["StribeckFriction"]
    trial = laboratory.trial(before, excess, (), before.free, [np.array([15.0, 0.2, 1.0])])
    found = SearchResult(before, trial.model, {excess.part: [trial]})
    found = add_prerequisites(laboratory, found, Method())
    assert told[-1] == "CoulombFriction at x_axis is there too"
    values = found.model.fitted.by_name
    assert abs(values[f"{dry.part}.level"] - 8.0) < 0.5
    assert abs(values[f"{excess.part}.excess"] - 6.0) < 0.5
    # what the excess took away at first was for the most part not its own
    assert found.removed_by(dry) > 0.8 > 0.2 > found.removed_by(excess)
