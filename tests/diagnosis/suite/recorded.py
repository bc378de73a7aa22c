"""What a case is made of: recordings as named columns, and what the lesson is told of the machine."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from tests.diagnosis.suite.concealed import Hidden


@dataclass(frozen=True)
class Recording:
    """Columns of one recording: name -> (unit written in the header, values in that unit), time first."""

    columns: dict[str, tuple[str, np.ndarray]]

    def write(self, path: Path) -> None:
        """Write it as CSV with the header ``time [s],name [unit],...``."""
        header = ",".join(f"{name} [{unit}]" for name, (unit, _) in self.columns.items())
        rows = np.column_stack([values for _, values in self.columns.values()])
        np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.10g")

    def with_values(self, name: str, values: np.ndarray) -> Recording:
        """Return the recording with other values in one column."""
        return Recording({**self.columns, name: (self.columns[name][0], values)})


@dataclass(frozen=True)
class Told:
    """What the lesson says of the machine [SI]: ``given`` values, their declared standard deviations (shares), the channels there are."""

    template: str
    given: dict[str, float]
    sigma: dict[str, float]
    channels: tuple[str, ...]
    settings: dict[str, float] = field(default_factory=dict)
    known_coulomb: float = 0.0
    pid: bool = False


@dataclass(frozen=True)
class Sizes:
    """How much an effect moves the channels of one recording, each over its own floor.

    ``plain`` is the noise-free difference with and without it; ``refitted`` what is left of that once the baseline's uncertain values are
    re-tuned within three declared deviations (linearised), which is what can be found at all.
    """

    plain: dict[str, float]
    refitted: dict[str, float]

    @property
    def largest(self) -> float:
        """Largest size after the refit, in floors."""
        return max(self.refitted.values(), default=0.0)


@dataclass(frozen=True)
class MadeCase:
    """A finished case before it is written."""

    told: Told
    recordings: dict[str, Recording]
    hidden: tuple[Hidden, ...]
    true_values: dict[str, float]
    sizes: dict[str, dict[str, Sizes]]
    floors: dict[str, dict[str, float]]


def sizes_of(
    with_it: dict[str, np.ndarray], without: dict[str, np.ndarray], slopes: list[dict[str, np.ndarray]], floor: dict[str, float]
) -> Sizes:
    """Return the sizes from noise-free channels; ``slopes`` are the changes of the channels by one declared deviation of each value."""
    channels = [c for c in floor if floor[c] > 0.0]
    difference = np.concatenate([(with_it[c] - without[c]) / floor[c] for c in channels])
    plain = {c: float(np.sqrt(np.mean(((with_it[c] - without[c]) / floor[c]) ** 2))) for c in channels}
    if not slopes:
        return Sizes(plain, dict(plain))
    rows = np.column_stack([np.concatenate([slope[c] / floor[c] for c in channels]) for slope in slopes])
    fitted = lsq_linear(rows, difference, bounds=(-3.0, 3.0)).x
    left = (difference - rows @ fitted).reshape(len(channels), -1)
    return Sizes(plain, {c: float(np.sqrt(np.mean(row * row))) for c, row in zip(channels, left, strict=True)})


def with_differences(channels: dict[str, np.ndarray], conductance: float) -> dict[str, np.ndarray]:
    """Add what two channels say together: scale less encoder (the screw), current less command (amplifier). Noise of the loop cancels."""
    added = dict(channels)
    if "scale" in channels:
        added["scale-encoder"] = channels["scale"] - channels["encoder"]
    if "current" in channels and "command" in channels:
        added["current-command"] = channels["current"] - conductance * channels["command"]
    return added


def with_fast_part(channels: dict[str, np.ndarray], gain: float, width: int = 250) -> dict[str, np.ndarray]:
    """Add what the channels of a spindle say beside the wandering of an open loop, which both of them see.

    The encoder less its mean over a quarter of a second, and the tachometer less the speed that the encoder shows over 50 ms.
    """
    encoder = channels["encoder"]
    speed = np.convolve(np.gradient(encoder, 1e-3), np.ones(50) / 50, mode="same")
    fast, apart = encoder - np.convolve(encoder, np.ones(width) / width, mode="same"), channels["tachometer"] - gain * speed
    for values in (fast, apart):
        values[:width] = 0.0
        values[-width:] = 0.0
    return {**channels, "encoder-fast": fast, "tachometer-encoder": apart}


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
