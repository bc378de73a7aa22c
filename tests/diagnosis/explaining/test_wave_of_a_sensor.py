"""A sensor whose error repeats along the way, on a table that an open loop lets drift by many of its periods."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.effects.backlash_and_screw import PeriodicPitchError
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.sensor_errors import EncoderEccentricity
from tests.diagnosis.pushed_table import POSITION, Hidden, experiments, recording, searched

PERIOD, PHASE = 0.8e-3, 0.7
LEFT_OUT = Hidden(law=lambda v, q, t: 1.5 * np.sin(2.0 * t))
"""A slow force that no effect of these tests has, so that a simulation drifts by millimetres."""


@pytest.mark.parametrize("amplitude", [5e-6, 52e-6])
def test_the_wave_is_found_at_the_sensor_with_its_size_and_phase(amplitude: float) -> None:
    records = [recording(LEFT_OUT, seed=seed) for seed in (1, 2)]
    for record in records:
        place = record.channels[POSITION].values
        place += np.round(amplitude * np.sin(2.0 * np.pi * place / PERIOD + PHASE), 6)
    found = searched(*experiments(*records, effects=(PeriodicPitchError, EncoderEccentricity, CoulombFriction)))
    (candidate,) = found.model.candidates
    values = {name.rsplit(".")[-1]: value for name, value in found.model.fitted.by_name.items() if name in candidate.parameters}
    assert candidate.name == "PeriodicPitchError"
    assert values["amplitude"] == pytest.approx(amplitude, rel=0.02)
    assert values["lead"] == pytest.approx(PERIOD, rel=1e-3)
    judged = found.model.validation_fit.by_name[f"{candidate.part}.phase"]
    assert np.angle(np.exp(1j * (judged - PHASE))) == pytest.approx(0.0, abs=0.1)
