"""How far a replay draws the values fitted to it: told where parts feel what was recorded, nothing where none does."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.cli.options import open_registry
from lathesim.identification.estimation.bootstrap_bias import replay_bias
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment, baseline_free, build_experiments
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from tests.diagnosis.pushed_table import Hidden, baselines, pair
from tests.diagnosis.small_case import write_lesson

RUBBING = "insert: [{effect: CoulombFriction, at: x_axis, level: 20 N}]\n"


def replayed(folder: Path, noise: str) -> tuple[Experiment, Fitted]:
    """Return a controlled axis that rubs, with a recording of it, and its values fitted to that."""
    case = folder / f"case_{noise}"
    asked = ["--effect", "none", "--seed", "3", "--noise", noise, "--out", str(case)]
    assert run_command_line(["conceal", str(write_lesson(folder, extra=RUBBING)), *asked]) == 0
    loaded = load_case(load_lesson(case / "lesson.yaml"), [case / "recording.csv"], open_registry(()))
    recorded = loaded.recordings[0]
    experiment = build_experiments(loaded.machine, [(recorded.name, recorded.record)], ())[0]
    free = [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)]
    return experiment, fit(experiment.sensed, free, rounds=2, coloured=True)


@pytest.fixture(scope="module")
def quiet_and_noisy(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, float]]:
    folder = tmp_path_factory.mktemp("replayed")
    return [dict(replay_bias(*replayed(folder, noise), full_band=False)) for noise in ("0.5", "200")]


def test_the_systematic_error_of_a_quiet_recording_is_small_and_told(quiet_and_noisy: list[dict[str, float]]) -> None:
    quiet, _ = quiet_and_noisy
    assert 0.0 < quiet["x_axis.mass"] < 0.5
    assert all(np.isfinite(list(quiet.values())))


def test_what_noise_alone_may_have_made_is_not_told(quiet_and_noisy: list[dict[str, float]]) -> None:
    _, noisy = quiet_and_noisy
    assert set(noisy.values()) == {0.0}


def test_a_machine_that_nothing_feeds_back_has_no_bias() -> None:
    assert replay_bias(pair(Hidden())[0], baselines(Hidden())[0], full_band=False) == {}
