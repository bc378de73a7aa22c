"""A delay that ended at a whole number of samples is looked at in the middle between two."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.time_shift import TransportDelay
from lathesim.identification.estimation.fractional_delay import between_samples
from lathesim.identification.records.fit import Free

PERIOD = 1e-3


class _White:
    """Noise that is white and of size one."""

    def whiten(self, row: np.ndarray, *, full_band: bool) -> np.ndarray:
        return row


def experiment(true: float) -> Any:
    """A channel that is read at the samples, late by whole ones, beside one that moves between them."""

    def residuals(names: list[str], rows: np.ndarray) -> np.ndarray:
        delays = rows[:, names.index("try.delay")]
        whole = 10.0 * (np.floor(delays / PERIOD) != np.floor(true / PERIOD))
        return np.stack([whole, (delays - true) / PERIOD], axis=1)[:, :, None] * np.ones(5)

    machine = SimpleNamespace(assembly=SimpleNamespace(sample_period=PERIOD))
    return SimpleNamespace(machine=machine, sensed=SimpleNamespace(residuals=residuals))


def fitted(delay: float) -> Any:
    values = {"x_axis.mass": 40.0, "try.delay": delay}
    free = [Free(name, value, 1.0) for name, value in values.items()]
    return SimpleNamespace(by_name=values, free=free, values=list(values.values()), noise=(_White(), _White()))


@pytest.mark.parametrize(
    ("ended", "start"), [(2.999e-3, 2.5e-3), (3.001e-3, 2.5e-3), (2.5e-3, None), (2.6e-3, None)], ids=["before", "after", "there", "near"]
)
def test_a_delay_that_is_stuck_at_a_sample_starts_again_between_two(ended: float, start: float | None) -> None:
    candidate: Any = SimpleNamespace(part="try", effect=TransportDelay)
    found = between_samples(experiment(2.55e-3), fitted(ended), [candidate], full_band=True)
    assert (found is None) == (start is None)
    if found is not None:
        assert [item.start for item in found] == pytest.approx([40.0, start])


def test_what_acts_at_once_is_left_alone() -> None:
    candidate: Any = SimpleNamespace(part="try", effect=ForceOffset)
    assert between_samples(experiment(2.55e-3), fitted(2.999e-3), [candidate], full_band=True) is None
