"""A diagnosis with a step left out goes wrong, each in its own way, and says what was left out."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.diagnosis.ablation import LEFT_OUT, without
from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.preparation import Question
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.loading import Recorded
from lathesim.record import Record
from tests.diagnosis.pushed_table import EFFECTS, PERIOD, Hidden, baseline, experiments, machine, recording

PUSHED = Hidden(law=lambda v, q, t: 6.0)


def question(*steps: str) -> Question:
    """Ask of one recording of a sound table, with the given steps left out."""
    return without(ask("A table that is pushed", machine(), (Recorded("fit.csv", recording(), ()),), EFFECTS), steps)


def answered(first: Record, second: Record, *steps: str) -> Diagnosis:
    """Diagnose two recordings with the given steps left out."""
    recordings = (Recorded("fit.csv", first, ()), Recorded("check.csv", second, ()))
    return diagnose(without(ask("A table that is pushed", machine(), recordings, EFFECTS), steps))


def named(diagnosis: Diagnosis) -> list[str]:
    return [effect.effect for effect in diagnosis.effects] if diagnosis.verdict in ("named", "tied") else []


def test_without_the_baseline_a_wrong_mass_is_no_longer_only_a_wrong_mass() -> None:
    heavier = Hidden(mass=43.0, viscous=230.0)
    fitted = {}
    for steps in ((), ("baseline",)):
        (experiment,) = experiments(recording(heavier), of=question(*steps).machine)
        free = baseline(experiment)
        fitted[steps] = float(np.std(fit(experiment.sensed, free).residual)), {item.name for item in free}
    assert fitted[()][0] < 2e-6
    assert fitted[("baseline",)][0] > 50.0 * fitted[()][0]
    assert fitted[()][1] - fitted[("baseline",)][1] == {"x_axis.mass", "x_axis.viscous"}


def restless(seed: int) -> Record:
    """A sound table on which a slow force acts that nobody modelled."""
    noise = lfilter([1.0], [1.0, -0.99], 0.05 * np.random.default_rng(seed).standard_normal(2001))
    return recording(Hidden(law=lambda v, q, t: float(noise[int(t / PERIOD)])), seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [(), ("null",)], ids=["whole", "without the null"])
def test_a_slow_disturbance_is_no_missing_physics(steps: tuple[str, ...]) -> None:
    """It takes away next to nothing on the recording that judges, whatever the noise is taken for."""
    found = answered(restless(3), restless(4), *steps)
    assert found.verdict in ("no_mismatch", "parameters_only")
    assert found.effects == ()


def test_without_a_held_out_recording_an_effect_of_one_recording_alone_is_believed() -> None:
    first, second = recording(PUSHED, seed=1), recording(seed=2)
    assert named(answered(first, second)) == []
    alone = answered(first, second, "held-out")
    assert named(alone) == ["ForceOffset"]
    assert alone.question.validation == "fit.csv"


def test_without_replay_the_search_works_in_the_simulation_of_the_lesson() -> None:
    (experiment,) = experiments(recording(), of=dataclasses.replace(machine(), replay=False))
    assert experiment.sensed is experiment.replayed


def test_an_answer_says_what_was_left_out() -> None:
    (finding,) = question("null").fitted.findings
    assert str(finding) == f"Answered without null: {LEFT_OUT['null']}."
    assert question().fitted.findings == ()


def test_there_is_no_other_step_to_leave_out() -> None:
    with pytest.raises(ValueError, match="no step 'luck' to leave out; there are replay, baseline, null, held-out"):
        question("luck")
