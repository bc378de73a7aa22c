"""The guard of an axis: a replayed lap is told by the watermark, and never without."""

import numpy as np
import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry

LESSON = "32_the_forged_sensor"
BEGIN = 5.0


def first_alarm(registry: Registry, variant: str, seed: int = 1, engine: str = "plain") -> float:
    """Return when the guard first alarms [s]; NaN where it never does. A few runs take less than the compiler."""
    record = run_prepared(prepare(load_lesson(LESSON), registry, variant), engine=engine, seed=seed)
    alarms = record.time[record["guard.alarm"] > 0.5]
    return float(alarms[0]) if len(alarms) else float("nan")


def test_replayed_laps_are_told_within_a_second(registry: Registry) -> None:
    delays = [first_alarm(registry, "replay", seed, "compiled") - BEGIN for seed in range(20)]
    assert min(delays) > 0.0
    assert max(delays) < 1.0


def test_honest_laps_raise_no_alarm_and_lose_less_than_two_micrometres(registry: Registry) -> None:
    assert np.isnan([first_alarm(registry, "honest", seed, "compiled") for seed in range(5)]).all()
    lesson = load_lesson(LESSON)
    marked = run_prepared(prepare(lesson, registry, "honest"), engine="compiled")["x_axis.position"]
    plain = run_prepared(prepare(lesson, registry, "honest", {"watermark.size": 0.0}), engine="compiled")["x_axis.position"]
    assert 0.1e-6 < np.std(marked - plain) < 1e-6
    assert np.max(np.abs(marked - plain)) < 2.2e-6


def test_without_a_watermark_a_replay_is_never_told(registry: Registry) -> None:
    assert np.isnan(first_alarm(registry, "replay_without"))


@pytest.mark.parametrize("variant", ["offset", "scale", "delay"])
def test_coarse_forgeries_are_told_by_the_innovation_too(registry: Registry, variant: str) -> None:
    assert BEGIN <= first_alarm(registry, variant) < BEGIN + 0.1
