"""A grey box of a cut, coded by hand: feed, depth and speed in, forces out; all samples at once, memories as first-order filters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from tests.diagnosis.suite.comparators.read_case import PERIOD

CHANNELS = ("main", "thrust", "feed_force")


class Cut:
    """What a recording says of the cut before any parameter: chip, angle of the spindle, time in the cut; each (samples,)."""

    def __init__(self, feed: np.ndarray, depth: np.ndarray, speed: np.ndarray, radius: float) -> None:
        self.cuts = (feed > 0.0) & (depth > 0.0) & (speed > 0.0)
        self.area = np.where(self.cuts, feed * depth, 0.0)
        self.feed, self.depth = np.where(self.cuts, feed, 1e-4), np.where(self.cuts, depth, 1e-3)
        self.speed = np.where(speed > 0.0, speed, 1.0)
        self.angle = np.r_[0.0, np.cumsum(np.maximum(speed, 0.0))[:-1]] * PERIOD / radius
        self.time = np.arange(len(feed)) * PERIOD
        self.cut_time = np.r_[0.0, np.cumsum(self.cuts)[:-1]] * PERIOD

    def warmth(self, time_constant: float) -> np.ndarray:
        """Return what goes to 1 in the cut and back to 0 out of it."""
        keep = float(np.exp(-PERIOD / max(time_constant, 1e-4)))
        return np.asarray(lfilter([0.0, 1.0 - keep], [1.0, -keep], self.cuts.astype(float)))


def simulate_cut(cut: Cut, value: Mapping[str, float]) -> np.ndarray:
    """Return main, thrust and feed force [N], shape (3, samples); effects that ``value`` does not name are absent."""
    get = value.get
    stress = value["specific_force"] * np.ones_like(cut.area)
    if get("exponent"):
        stress = stress * (cut.feed / 1e-3) ** -value["exponent"]
    if get("speed_exponent"):
        stress = stress * (cut.speed / 2.0) ** value["speed_exponent"]
    if get("hump"):
        stress = stress * (1.0 + value["hump"] * np.exp(-(((cut.speed - value["hump_speed"]) / max(value["hump_width"], 0.05)) ** 2)))
    if get("softening"):
        stress = stress * (1.0 - value["softening"] * cut.warmth(value["time_constant"]))
    if get("wear_rate"):
        stress = stress * (1.0 + value["wear_rate"] * cut.cut_time)
    if get("break_in"):
        stress = stress * (1.0 + value["break_in"] * (1.0 - np.exp(-cut.cut_time / max(value["break_in_time"], 0.1))))
    main = stress * cut.area
    edge = get("edge", 0.0) * cut.depth * cut.cuts
    shape = np.ones_like(main)
    if get("missing"):
        shape = shape - value["missing"] * (_away(cut.angle - value["slot_middle"]) < np.pi * value["slot_width"])
    if get("rise"):
        shape = shape + value["rise"] * np.exp(-0.5 * (_away(cut.angle - value["spot_middle"]) / (np.pi * value["spot_width"])) ** 2)
    if get("out_cos") or get("out_sin"):
        turned = value["out_order"] * cut.angle
        shape = shape * np.maximum(0.0, 1.0 + (get("out_cos", 0.0) * np.cos(turned) + get("out_sin", 0.0) * np.sin(turned)) / cut.depth)
    thrust, feed = value["thrust_ratio"], value["feed_ratio"]
    forces = (main + edge) * shape * np.array([[1.0], [thrust], [feed]])
    if get("drift"):
        forces[0] += value["drift"] * cut.time
    if get("leak"):
        keep = float(np.exp(-value["leak"] * PERIOD))
        forces[0] -= lfilter([0.0, 1.0 - keep], [1.0, -keep], forces[0])
    return forces


def _away(angle: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(angle - 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5)))
