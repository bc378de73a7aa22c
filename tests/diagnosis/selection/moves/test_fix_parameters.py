"""Values of an effect that neither recording needs are held at nothing."""

import dataclasses

import numpy as np
import pytest

from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory, candidate_free
from lathesim.diagnosis.selection.moves.fix_parameters import fix_parameters
from lathesim.diagnosis.selection.search import search
from lathesim.effects.force_law import SpeedDependence
from lathesim.effects.presliding import PreslidingFriction
from lathesim.identification.estimation.least_squares import fit
from lathesim.record import Record
from tests.diagnosis.one_cut import DEPTH, FEED, FORCE, SPECIFIC, cut_machine
from tests.diagnosis.pushed_table import Hidden, as_record, baseline, experiments, recording

LEVEL, EXCESS, SLOW = 8.0, 6.0, 0.02


def peaked(v: float, q: float, t: float) -> float:
    """A friction with a peak at low speed."""
    return float(np.tanh(v / 1e-4)) * (LEVEL + EXCESS * float(np.exp(-abs(v) / SLOW)))


@pytest.mark.parametrize(
    ("hidden", "needed"),
    [(Hidden(dry=LEVEL), {"level", "distance"}), (Hidden(law=peaked), {"level", "distance", "excess", "stribeck_velocity"})],
    ids=["a plain friction", "one with a peak at low speed"],
)
def test_a_friction_keeps_the_values_that_the_recordings_need(hidden: Hidden, needed: set[str]) -> None:
    """A peak that is not there goes, with the speed at which it would have fallen, and so does the damping of the bristles."""
    experiment, validation = experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=(PreslidingFriction,))
    laboratory = Laboratory(experiment, validation, lambda text: None)
    fitted = fit(experiment.sensed, baseline(experiment))
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    (friction,) = experiment.candidates
    start = {"level": 10.0, "distance": 1e-6, "excess": 2.0, "stribeck_velocity": 0.01, "bristle_damping": 50.0}
    values = np.array([start[name.partition(".")[2]] for name in friction.parameters])
    model = laboratory.model((friction,), fit(experiment.sensed, [*before.free, *candidate_free(friction, values)], rounds=4))
    found = SearchResult(before, model)
    found = fix_parameters(laboratory, found)
    (lean,) = found.model.candidates
    assert {name.partition(".")[2] for name in lean.parameters} == needed
    assert found.model.fitted.by_name[f"{lean.part}.level"] == pytest.approx(LEVEL, rel=0.1)
    held = {name for name in friction.parameters if name not in lean.parameters}
    assert all(found.model.fitted.constant[name] == 0.0 for name in held if not name.endswith("velocity"))


def passes(seed: int) -> Record:
    """Return a recording of passes at speeds from 1 to 4 m/s, in which the force falls straight over them and no hump is anywhere near."""
    rng = np.random.default_rng(seed)
    speed = np.repeat(rng.uniform(1.0, 4.0, 12), 200)
    depth = np.where(np.arange(2400) % 200 < 40, 0.0, 1e-3)
    force = SPECIFIC * FEED * depth / (1.0 + (speed - 2.0) / 7.0) + 3.0 * rng.standard_normal(2400)
    return as_record({DEPTH: ("m", depth), "cutting.speed": ("m/s", speed), FORCE: ("N", force)})


def test_a_hump_outside_the_speeds_that_were_cut_is_taken_off_the_law_it_bends() -> None:
    of = dataclasses.replace(cut_machine(), drive=(DEPTH, "cutting.speed"))
    found = search(*experiments(passes(1), passes(2), effects=(SpeedDependence,), of=of))
    (law,) = found.model.candidates
    assert [name.partition(".")[2] for name in law.parameters] == ["exponent"]
    # d log F / d log V of 1 / (1 + (V - 2) / 7) is -V / (V + 5)
    assert -0.45 < found.model.fitted.by_name[law.parameters[0]] < -0.15
