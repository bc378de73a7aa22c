"""What a table on a spring does is no noise: it answers to what the axis is asked to do."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.diagnosis.location.command_coherence import command_coherence, foretold
from lathesim.identification.replay.experiment import Experiment
from lathesim.record import Record
from tests.diagnosis.controlled_axis import POSITION, REFERENCE, controlled_axis
from tests.diagnosis.pushed_table import Hidden, pair

SAMPLES, LENGTH = 20_000, 1_000


def resonance(asked: np.ndarray) -> np.ndarray:
    """A mass on a spring, 20 Hz at 1 kHz, that answers to what is asked."""
    pole = 0.98 * np.exp(2j * np.pi * 20.0 / 1000.0)
    return np.asarray(lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], asked))


def test_a_resonance_is_foretold_from_the_command_and_noise_is_not() -> None:
    rng = np.random.default_rng(1)
    asked = [np.diff(lfilter([1e-2], [1.0, -0.99], rng.standard_normal(SAMPLES + 1)), 1) for _ in range(2)]
    answered = [resonance(one) for one in asked]
    assert foretold(asked[0], answered[0], asked[1], answered[1], LENGTH) > 0.9
    noises = [np.std(one) * lfilter([1e-1], [1.0, -0.9], rng.standard_normal(SAMPLES)) for one in answered]
    assert foretold(asked[0], noises[0], asked[1], noises[1], LENGTH) < 0.02
    assert foretold(asked[0], answered[0], asked[1], 0.0 * answered[1], LENGTH) == 0.0


@pytest.mark.parametrize("swings", [True, False])
def test_a_recording_that_swings_with_its_command_tells_so(swings: bool, tmp_path: Path) -> None:
    machine, record = controlled_axis(tmp_path)
    rng = np.random.default_rng(2)
    experiments = []
    for _ in range(2):
        asked = np.diff(record[REFERENCE], 2, prepend=[0.0, 0.0])
        more = 0.3 * resonance(asked) if swings else 4e-7 * lfilter([1e-1], [1.0, -0.9], rng.standard_normal(len(record)))
        noise = 2e-8 * rng.standard_normal(len(record))
        seen = record.with_channel(POSITION, "m", record[POSITION] + more + noise)
        experiments.append(Experiment(machine, Record(record.time, seen.channels, {}), "run", (), machine.assembly))
    told = command_coherence((experiments[0], experiments[1]), ({}, {}))
    if not swings:
        assert told is None
        return
    assert told is not None
    assert (told.channel, told.driven) == (POSITION, REFERENCE)
    assert told.over_floor > 100.0
    said = f"{told.share:.0%} of what is left of {POSITION} answers to {REFERENCE}, as a spring, a resonance or a filter does"
    assert str(told) == said
    some = np.r_[np.zeros(100), np.ones(len(record) - 100)]
    assert command_coherence((replace(experiments[0], weights=some), experiments[1]), ({}, {})) is None


def test_without_a_controller_a_simulation_drifts_and_nothing_is_asked() -> None:
    first, second = pair(Hidden(dry=20.0))
    assert command_coherence((first, second), ({}, {})) is None
