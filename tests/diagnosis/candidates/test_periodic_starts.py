"""Where a periodic effect is looked for: the wavelength that the missing force has over the place."""

import numpy as np
import pytest

from lathesim.diagnosis.candidates.periodic_starts import wave_points
from lathesim.effects.force_over_turn import ChipSegmentation
from lathesim.effects.friction import PositionDependentFriction
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import baseline_free, build_experiments
from tests.diagnosis.one_cut import CHIP, cut_machine, cut_record
from tests.diagnosis.pushed_table import Hidden, baselines, machine, pair, recording


def ripple(size: float, period: float) -> Hidden:
    return Hidden(law=lambda v, q, t: size * np.sin(2.0 * np.pi * q / period + 0.5))


@pytest.mark.parametrize("period", [0.012, 0.016])
def test_the_period_of_a_hidden_ripple_is_found(period: float) -> None:
    hidden = ripple(8.0, period)
    experiment, fitted = pair(hidden)[0], baselines(hidden)[0]
    points = wave_points(experiment, fitted, list(experiment.candidates))
    assert list(points) == ["try_x_axis_torque_ripple"]
    candidate = next(candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple")
    names = [name.partition(".")[2] for name in candidate.parameters]
    found = points[candidate.part][:, names.index("period")]
    assert found[0] == pytest.approx(period, rel=0.05)
    assert len(np.unique(points[candidate.part][:3, names.index("phase")])) == 3
    sizes = points[candidate.part][:, [names.index("amplitude"), names.index("share")]]
    assert np.all(sizes.max(axis=1) > 0.0)


def test_a_ripple_is_looked_for_as_large_as_what_is_missing() -> None:
    """Beside the friction of a heavy axis a ripple of the usual size moves nothing, and its response tells nothing."""
    hidden = ripple(30.0, 0.016)
    experiment, fitted = pair(hidden)[0], baselines(hidden)[0]
    candidate = next(candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple")
    column = [name.partition(".")[2] for name in candidate.parameters].index("amplitude")
    sizes = wave_points(experiment, fitted, [candidate])[candidate.part][:, column]
    assert np.median(candidate.points[:, column]) < 5.0
    assert sizes.max() == pytest.approx(30.0, rel=0.2)


def test_effects_that_do_not_repeat_get_no_points() -> None:
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    others = [candidate for candidate in experiment.candidates if candidate.name != "TorqueRipple"]
    assert wave_points(experiment, fitted, others) == {}


def test_wavelengths_stay_where_the_effect_may_have_them() -> None:
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    candidate = next(candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple")
    column = [name.partition(".")[2] for name in candidate.parameters].index("period")
    low, high = candidate.effect.identification.typical["period"]
    for point in wave_points(experiment, fitted, [candidate])[candidate.part]:
        assert low / 1.3 <= point[column] <= 1.3 * high


def test_chips_are_looked_for_over_the_length_that_was_cut() -> None:
    """No sensor shows that length: the effect's own output tells it."""
    experiment = build_experiments(cut_machine(), [("cut", cut_record(["chips"]))], [ChipSegmentation])[0]
    fitted = fit(experiment.sensed, [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)], rounds=2)
    (candidate,) = experiment.candidates
    column = [name.partition(".")[2] for name in candidate.parameters].index("length")
    assert wave_points(experiment, fitted, [candidate])[candidate.part][0, column] == pytest.approx(CHIP, rel=0.02)


def test_a_wave_as_long_as_the_way_is_tried_too() -> None:
    """One turn or two along the way are no line of a periodogram."""
    experiment = build_experiments(machine(), [("a", recording(Hidden()))], [PositionDependentFriction])[0]
    fitted = fit(experiment.sensed, [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)], rounds=2)
    (candidate,) = experiment.candidates
    column = [name.partition(".")[2] for name in candidate.parameters].index("period")
    way = float(np.ptp(experiment.record["x_encoder.position"]))
    lengths = wave_points(experiment, fitted, [candidate])[candidate.part][:, column]
    assert {1.0, 1.5, 2.0, 3.0} <= set(np.round(way / lengths, 3))
