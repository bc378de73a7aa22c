"""Why a model is not adequate: what it leaves that follows the motion, values it needs that cannot be, what still swings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.diagnosis.diagnosis import BaselineValue, ChannelFit, Evidence
from lathesim.diagnosis.narrow_band import NarrowBand

ADEQUATE = 0.025
"""A model is inadequate where a part of the missing signal larger than this share of all that acts there is explained, on the held-out
recording, by what the machine was doing."""

_HALF = 0.5
_WORSE = 1.5


def shortfalls(
    evidence: Evidence,
    channels: Sequence[str],
    strained: Sequence[str],
    baseline: Mapping[str, BaselineValue],
    bands: Sequence[NarrowBand],
) -> list[str]:
    """Give the reasons for which a model is not adequate, each the rest of a sentence; none where it is."""
    reasons = []
    for channel, missing in zip(channels, evidence.missing, strict=True):
        if structured(evidence, channel, missing.share_after) >= ADEQUATE:
            strongest = max((bar for bar in evidence.bars if bar.channel == channel), key=lambda bar: bar.after)
            left = f"{missing.share_after:.1%} of what acts at {missing.at} is still missing"
            reasons.append(f"{left}, and goes with {strongest.variable}")
    for name in strained:
        value = baseline[name]
        reasons.append(f"it needs {name} at {value.refit_with:.4g} {value.unit}, further off than the lesson holds possible")
    reasons += [f"{band.channel} still swings {band.place}" for band in bands]
    return list(dict.fromkeys(reasons))


def too_little(evidence: Evidence, taken: float) -> list[str]:
    """Give the reason where effects take away less than half of the error on the recording that judges, ``taken``, and leave more than half
    of what is missing wherever it is: something of their shape may be there, and most of it is something else."""
    if taken <= 0.0:
        return ["it takes away nothing of what is missing on the recording that judges"]
    halved = any(missing.share_after < _HALF * missing.share_before for missing in evidence.missing)
    if taken >= _HALF or halved:
        return []
    return [f"it takes away only {taken:.0%} of the error on the recording that judges"]


def spoils_everything(fit: Mapping[str, ChannelFit]) -> bool:
    """Say whether the lesson's own simulation is further off with the effects than without them in every channel: effects that only
    together are like what is missing, each far larger than it, drift away from it as soon as nothing recorded holds them."""
    return bool(fit) and all(item.after > _WORSE * item.before for item in fit.values())


def structured(evidence: Evidence, channel: str, share: float) -> float:
    """Give the size of what is still missing behind a channel and depends on the motion, as a ``share`` of what acts there."""
    explained = max((bar.after for bar in evidence.bars if bar.channel == channel), default=0.0)
    return float(share * np.sqrt(explained)) if np.isfinite(share) else 0.0


def not_adequate(reasons: Sequence[str]) -> str:
    """Give the reasons in one sentence; empty where there are none."""
    return f"The model is not adequate: {'; '.join(reasons)}." if reasons else ""
