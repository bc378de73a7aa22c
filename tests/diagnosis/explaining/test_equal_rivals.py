"""Two effects that do the same are tied, whatever an effect that no machine has gains beside them."""

from dataclasses import replace

from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.verdict import ranked
from lathesim.effects.offset_and_gain import ConverterOffset, ForceOffset
from lathesim.effects.structure import AxialResonance
from tests.diagnosis.pushed_table import Hidden, experiments, recording, study

PULL, SEED = 9.484265, 760549367


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
