"""Two effects that do the same are tied, whatever an effect that no machine has gains beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.verdict import ranked
from lathesim.effects.drive_errors import Cogging, TorqueRipple
from lathesim.effects.offset_and_gain import ConverterOffset, ForceOffset
from lathesim.effects.structure import AxialResonance
from tests.diagnosis.pushed_table import PERIOD, Hidden, experiments, force, recording, study

PULL, SEED, COUNT = 9.484265, 760549367, 1000


def test_an_offset_of_the_force_and_one_of_its_converter_are_tied() -> None:
    hidden = Hidden(law=lambda v, q, t: PULL, mass=41.290368, viscous=189.297051)
    recordings = (recording(hidden, seed=SEED), recording(hidden, seed=SEED + 1))
    asked = study(*experiments(*recordings, effects=(ForceOffset, ConverterOffset, AxialResonance)))
    found = explain(asked)
    (offset,) = found.model.candidates
    assert offset.name == "ForceOffset"
    assert [rival.candidate.name for rival in found.rivals[offset.part]] == ["ConverterOffset"]
    # each is judged at frequencies of its own, where it may gain more or less over the lesson: pair by pair they are as good
    (rival,) = found.rivals[offset.part]
    half = replace(rival, predicted=replace(rival.predicted, nats=0.5 * rival.predicted.nats))
    (sure,) = ranked(asked, replace(found, rivals={offset.part: (half,)}))
    assert 0.5 <= sure.probability < 0.75


@pytest.mark.parametrize(("second", "parameters"), [(0.0, ["amplitude", "period", "phase"]), (3.0, [])])
def test_a_ripple_that_does_not_grow_with_the_drive_is_a_cogging(second: float, parameters: list[str]) -> None:
    """A torque ripple with a constant part does the same, and has a value more; a second harmonic is looked for afterwards."""

    def teeth(speed: float, place: float, time: float) -> float:
        return float(8.0 * np.sin(2.0 * np.pi * place / 0.008 + 0.5) + second * np.sin(4.0 * np.pi * place / 0.008))

    recordings = (recording(Hidden(law=teeth), seed=seed) for seed in (1, 2))
    found = explain(study(*experiments(*recordings, effects=(TorqueRipple, Cogging))))
    (cogging,) = found.model.candidates
    assert cogging.name == "Cogging"
    assert [name.partition(".")[2] for name in cogging.parameters] == (
        parameters or ["amplitude", "second", "period", "phase", "second_phase"]
    )
    assert [rival.candidate.name for rival in found.rivals[cogging.part]] == (["TorqueRipple"] if parameters else [])


def test_a_cogging_is_held_against_a_ripple_with_its_second_harmonic_too() -> None:
    """A share of a drive that answers to the ripple does what a second harmonic does."""

    def driven(seed: int) -> Hidden:
        pushed = force(COUNT, seed)

        def teeth(speed: float, place: float, time: float) -> float:
            now = min(int(time / PERIOD), COUNT - 1)
            return float((8.0 + 0.1 * pushed[now]) * np.sin(2.0 * np.pi * place / 0.008 + 0.5))

        return Hidden(law=teeth)

    recordings = (recording(driven(seed), count=COUNT, seed=seed) for seed in (1, 2))
    found = explain(study(*experiments(*recordings, effects=(TorqueRipple, Cogging))))
    (ripple,) = found.model.candidates
    assert ripple.name == "TorqueRipple"
    held = {len(one.candidate.parameters) for one in found.tried if one.candidate.name == "Cogging"}
    assert held == {3, 5}
    # the drive of this table knows nothing of the ripple
    assert not found.rivals[ripple.part]
