"""Forces that no cut makes: what the specific cutting force and the ratio of its components say about units and columns."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.faults.common_motion import correlated
from lathesim.recordings.faults.recorded_channel import RecordedChannel
from lathesim.recordings.finding import Finding

_SPECIFIC = (5e7, 2e10)
"""Specific cutting force of anything that is turned [N/m^2], from plastics to hardened steel at small feeds. Range assumed."""
_RATIO = 50.0
"""Components of one cutting force differ less than this."""
_COARSEST_FEED = 1e-3
"""Feeds per revolution above this [m] are not turned with a smaller depth of cut. Assumed."""


def senseless_forces(channels: list[RecordedChannel]) -> list[Finding]:
    """Find forces, feeds and depths of a cut that cannot be as they are mapped."""
    found = _unlike_components(channels)
    by_item = {channel.name.rpartition(".")[2]: channel for channel in channels if channel.driven}
    feed, depth = by_item.get("feed"), by_item.get("depth")
    if feed is None or depth is None or feed.group != depth.group or feed.unit != "m" or depth.unit != "m":
        return found
    cutting = (feed.values > 0.0) & (depth.values > 0.0)
    if np.count_nonzero(cutting) < 20:
        return found
    ratio = float(np.median(feed.values[cutting] / depth.values[cutting]))
    if ratio > 2.0 and float(feed.values.max()) > _COARSEST_FEED:
        largest = feed.values.max() * 1e3
        fact = f"the feed is {ratio:.3g} times the depth of cut (median), up to {largest:.3g} mm, so the two columns look swapped"
        return [*found, Finding("swapped", f"{feed.name}, {depth.name}", fact, "exchange them in the lesson", True)]
    forces = [channel for channel in channels if channel.unit == "N" and not channel.driven and not channel.constant]
    if forces and not found:
        found += _specific_force(feed.values * depth.values, max(forces, key=lambda force: force.span))
    return found


def _specific_force(area: FloatArray, force: RecordedChannel) -> list[Finding]:
    """Hold the force against the area of cut: their ratio is the specific cutting force."""
    if correlated(area, force.values) < 0.5:
        return []
    specific = float(area @ force.values) / float(area @ area)
    if _SPECIFIC[0] < specific < _SPECIFIC[1]:
        return []
    fact = f"it makes a specific cutting force of {specific * 1e-6:.4g} N/mm^2, and no material has that"
    return [Finding("unit", force.name, fact, "check its unit and scale, and those of feed and depth, in the lesson", True)]


def _unlike_components(channels: list[RecordedChannel]) -> list[Finding]:
    """Find one of several forces of one instrument that is far larger or smaller than the others."""
    forces = [channel for channel in channels if channel.unit == "N" and not channel.driven and not channel.constant]
    for one in forces:
        others = [other for other in forces if other is not one and other.part == one.part]
        if not others:
            continue
        sizes = [one.span / other.span for other in others]
        if all(size > _RATIO for size in sizes) or (len(others) > 1 and all(size < 1.0 / _RATIO for size in sizes)):
            size = float(np.median(sizes))
            fact = f"its range is {size:.4g} times that of {', '.join(other.name for other in others)}, too far apart for one cut"
            return [Finding("unit", one.name, fact, "check its unit and scale in the lesson", True)]
    return []
