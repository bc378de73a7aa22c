"""Two effects that do the same are tied, whatever an effect that no machine has gains beside them."""

from lathesim.diagnosis.explaining.search import explain
from lathesim.effects.offset_and_gain import ConverterOffset, ForceOffset
from lathesim.effects.structure import AxialResonance
from tests.diagnosis.pushed_table import Hidden, experiments, recording, study

PULL, SEED = 9.484265, 760549367


def test_an_offset_of_the_force_and_one_of_its_converter_are_tied() -> None:
    hidden = Hidden(law=lambda v, q, t: PULL, mass=41.290368, viscous=189.297051)
    recordings = (recording(hidden, seed=SEED), recording(hidden, seed=SEED + 1))
    found = explain(study(*experiments(*recordings, effects=(ForceOffset, ConverterOffset, AxialResonance))))
    (offset,) = found.model.candidates
    assert offset.name == "ForceOffset"
    assert [rival.candidate.name for rival in found.rivals[offset.part]] == ["ConverterOffset"]
