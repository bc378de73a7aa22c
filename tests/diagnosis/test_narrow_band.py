"""What swings in a narrow band of frequencies and belongs to nothing of the machine is told, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.diagnosis.fit import Fitted, fit
from lathesim.diagnosis.narrow_band import narrow_bands
from lathesim.diagnosis.problem import Rig
from tests.diagnosis.pushed_table import Hidden, baseline, baselines, pair, recording, rigs

SQUEAL = Hidden(law=lambda v, q, t: 6.0 * math.sin(2.0 * math.pi * 55.0 * t) if 0.05 < abs(v) < 0.2 else 0.0)


def fitted_to(hidden: Hidden) -> tuple[Rig, Fitted]:
    (rig,) = rigs(recording(hidden, count=4000))
    return rig, fit(rig.sensed, baseline(rig))


def test_a_squeal_is_told_with_its_frequency() -> None:
    (band,) = narrow_bands(*fitted_to(SQUEAL))
    assert band.channel == "x_encoder.position"
    assert band.frequency == pytest.approx(55.0, abs=1.0)
    assert band.share > 0.3
    assert "55" in str(band)
    assert " m (rms)" in str(band)


@pytest.mark.parametrize("hidden", [Hidden(), Hidden(dry=8.0)], ids=["sound", "dry friction"])
def test_the_rhythm_of_a_motion_is_no_squeal(hidden: Hidden) -> None:
    assert narrow_bands(*fitted_to(hidden)) == []


def test_a_short_recording_tells_nothing() -> None:
    (rig,) = rigs(recording(SQUEAL, count=400))
    assert narrow_bands(rig, fit(rig.sensed, baseline(rig))) == []


def test_noise_alone_has_no_bands() -> None:
    rig, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    noise = np.random.default_rng(3).standard_normal(fitted.residual.shape) * 1e-6
    assert narrow_bands(rig, Fitted(**{**fitted.__dict__, "residual": noise})) == []
