"""What is beyond belief on a small lathe is usual on a large machine: bounds are taken from what acts there."""

import numpy as np
import pytest

from lathesim.diagnosis.candidates.plausible_sizes import possible_sizes
from lathesim.diagnosis.explaining.plausible import of_usual_size
from lathesim.diagnosis.method import Method
from lathesim.effects.force_law import WearForceGrowth
from lathesim.effects.friction import PreslidingFriction, StribeckFriction
from lathesim.identification.catalogue.placement import insert_candidates
from tests.diagnosis.one_cut import cut_machine
from tests.diagnosis.pushed_table import FORCE, POSITION, Hidden, experiments, recording

RUBBING = Hidden(dry=15.0)


def test_a_friction_may_be_as_large_as_what_pushes() -> None:
    (experiment, _) = experiments(recording(RUBBING), recording(RUBBING, seed=2))
    sizes = possible_sizes(experiment)
    level = next(name for name in sizes if name.endswith("coulomb_friction.level"))
    assert sizes[level] == pytest.approx(float(np.max(np.abs(experiment.record[FORCE]))))
    assert not any("period" in name or "phase" in name for name in sizes)
    assert POSITION in experiment.machine.compare


def test_a_friction_may_rise_over_the_whole_way() -> None:
    (experiment, _) = experiments(recording(RUBBING), recording(RUBBING, seed=2), effects=(PreslidingFriction, StribeckFriction))
    sizes = {name.partition("friction.")[2]: size for name, size in possible_sizes(experiment).items()}
    assert sizes["distance"] == pytest.approx(float(np.ptp(experiment.record[POSITION])), rel=0.01)
    assert 0.0 < sizes["stribeck_velocity"] < 1.0


@pytest.mark.parametrize(("possible", "believed"), [(0.0, False), (1e5, True)], ids=["a small machine", "a large one"])
def test_a_size_is_believed_where_that_much_acts(possible: float, believed: bool) -> None:
    (experiment, _) = experiments(recording(RUBBING), recording(RUBBING, seed=2))
    candidate = next(candidate for candidate in experiment.candidates if candidate.name == "CoulombFriction")
    (level,) = candidate.parameters
    assert of_usual_size(candidate, {level: 50_000.0}, Method(possible={level: possible})) == believed


@pytest.mark.parametrize(
    ("growth", "rate", "usual"), [(800.0, 8e-5, True), (3000.0, 1e-3, False)], ids=["a usual product", "no wear at all"]
)
def test_of_a_growth_and_a_rate_of_wear_only_the_product_is_judged(growth: float, rate: float, usual: bool) -> None:
    """A rate of wear eighty times beyond any with a small growth is a usual wear that nobody can take apart."""
    _, candidates = insert_candidates(cut_machine().assembly, [WearForceGrowth])
    (candidate,) = candidates
    values = {
        f"{candidate.part}.{name}": value
        for name, value in (("growth", growth), ("rate", rate), ("break_in", 1e-5), ("break_in_time", 30.0))
    }
    assert of_usual_size(candidate, values, Method()) == usual
