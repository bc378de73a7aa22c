"""Screening: which candidate's response the residual has in it, before anything is fitted."""

import numpy as np
import pytest

from lathesim.diagnosis.candidates.periodic_starts import wave_points
from lathesim.diagnosis.candidates.screening import _Absorber, is_limit, screen
from lathesim.effects.drive_errors import DriveSaturation
from lathesim.effects.offset_and_gain import ForceOffset
from tests.diagnosis.pushed_table import Hidden, baselines, experiments, pair, recording

RIPPLE = Hidden(law=lambda v, q, t: 8.0 * np.sin(2.0 * np.pi * q / 0.008 + 0.5))
OFFSET = Hidden(law=lambda v, q, t: 12.0)


@pytest.mark.parametrize(
    ("hidden", "effect"),
    [(Hidden(dry=8.0), "CoulombFriction"), (OFFSET, "ForceOffset"), (RIPPLE, "TorqueRipple")],
    ids=["friction", "offset", "ripple"],
)
def test_the_hidden_effect_promises_most(hidden: Hidden, effect: str) -> None:
    experiment, fitted = pair(hidden)[0], baselines(hidden)[0]
    candidates = list(experiment.candidates)
    screening = screen(experiment.sensed, fitted, candidates, wave_points(experiment, fitted, candidates))
    first, second = screening[:2]
    assert first.candidate.name == effect
    assert first.gain > 2.0 * second.gain
    assert first.gain > 100.0


def test_a_wave_starts_at_its_best_phase_whichever_phases_were_tried() -> None:
    experiment, fitted = pair(RIPPLE)[0], baselines(RIPPLE)[0]
    candidates = [candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple"]
    best = screen(experiment.sensed, fitted, candidates, wave_points(experiment, fitted, candidates))[0]
    start = dict(zip((name.partition(".")[2] for name in best.candidate.parameters), best.starts[0], strict=True))
    # the hidden force acts against the motion, the ripple of the catalogue with it
    off = (start["phase"] - 0.5 - np.pi) % (2.0 * np.pi)
    assert min(off, 2.0 * np.pi - off) < 0.2
    assert start["amplitude"] == pytest.approx(8.0, rel=0.2)
    assert start["period"] == pytest.approx(0.008, rel=0.02)


def test_no_two_starts_differ_in_their_phase_alone() -> None:
    experiment, fitted = pair(RIPPLE)[0], baselines(RIPPLE)[0]
    candidates = [candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple"]
    best = screen(experiment.sensed, fitted, candidates, wave_points(experiment, fitted, candidates))[0]
    place = [name.endswith("phase") for name in best.candidate.parameters].index(True)
    others = [tuple(np.delete(start, place)) for start in best.starts]
    assert len(set(others)) == len(others)


def test_nothing_promises_much_where_nothing_is_hidden() -> None:
    """Noise alone reaches a few nats with three candidates of at most three directions each, not hundreds."""
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    screening = screen(experiment.sensed, fitted, experiment.candidates)
    assert len(screening) == 3
    assert screening[0].gain < 30.0


@pytest.mark.parametrize("force", [12.0, 2000.0], ids=["small machine", "heavy machine"])
def test_the_start_is_near_the_size_that_is_hidden(force: float) -> None:
    hidden = Hidden(law=lambda v, q, t: force)
    experiment, fitted = pair(hidden)[0], baselines(hidden)[0]
    best = screen(experiment.sensed, fitted, experiment.candidates)[0]
    assert any(start[0] == pytest.approx(force, rel=0.1) for start in best.starts)


def test_a_friction_does_not_start_below_zero() -> None:
    driven = Hidden(law=lambda v, q, t: -8.0 * np.sign(v))
    experiment, fitted = pair(driven)[0], baselines(driven)[0]
    coulomb = next(item for item in screen(experiment.sensed, fitted, experiment.candidates) if item.candidate.name == "CoulombFriction")
    assert all(np.all(start >= 0.0) for start in coulomb.starts)


def test_screening_is_the_same_twice() -> None:
    experiment, fitted = pair(OFFSET)[0], baselines(OFFSET)[0]
    first, second = (screen(experiment.sensed, fitted, experiment.candidates) for _ in range(2))
    assert [item.gain for item in first] == [item.gain for item in second]


def test_without_candidates_nothing_is_screened() -> None:
    experiment, fitted = pair(OFFSET)[0], baselines(OFFSET)[0]
    assert screen(experiment.sensed, fitted, []) == ()


def test_a_limit_begins_at_its_usual_sizes() -> None:
    """A saturation vanishes far beyond any voltage: what lies between is no measure of it."""
    (experiment,) = experiments(recording(), effects=(DriveSaturation, ForceOffset))
    limits = {candidate.name: is_limit(candidate).tolist() for candidate in experiment.candidates}
    assert limits == {"DriveSaturation": [True], "ForceOffset": [False]}


def test_screening_sees_the_residual_as_a_fit_does() -> None:
    """In single precision, and each real part beside its imaginary one: what it weighs is the same."""
    experiment, fitted = pair(RIPPLE)[0], baselines(RIPPLE)[0]
    seen = _Absorber(experiment.sensed, fitted)
    white = np.concatenate([model.whiten(row, full_band=True) for row, model in zip(fitted.residual, fitted.noise, strict=True)])
    power = float(white @ white)
    again = seen._whiten(seen.tapered(fitted.residual))
    assert float(again @ again) == pytest.approx(power, rel=1e-4)
    assert float(seen.residual @ seen.residual) <= power * (1.0 + 1e-4)
