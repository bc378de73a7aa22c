"""Why a model is not adequate: what it leaves that follows the motion, values it needs that cannot be, what still swings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.location.missing_share import FORCES
from lathesim.diagnosis.location.narrow_band import NarrowBand
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import BaselineValue, ChannelFit, Evidence, MissingSignal, with_unit


def shortfalls(
    evidence: Evidence,
    channels: Sequence[str],
    implausible: Sequence[str],
    baseline: Mapping[str, BaselineValue],
    bands: Sequence[NarrowBand],
    fit: Mapping[str, ChannelFit],
    method: Method = STANDARD,
) -> list[str]:
    """Return the reasons for which a model is not adequate, each the rest of a sentence; none where it is. More than half of all that
    acts is missing where the noise of a sensor is made into a force: that is no reason while the lesson's own simulation is at the floor
    there."""
    reasons = []
    for channel, missing in zip(channels, evidence.missing, strict=True):
        if missing.share_after > method.verdict.half and fit[channel].after < method.verdict.channel_worse * fit[channel].floor:
            continue
        if structured(evidence, channel, missing.share_after, method=method) >= method.verdict.adequate:
            strongest = max((bar for bar in evidence.bars if bar.channel == channel), key=lambda bar: bar.after)
            left = f"{missing.share_after:.1%} of what acts at {missing.at} is still missing"
            reasons.append(f"{left}, and goes with {strongest.variable}")
    for name in implausible:
        value = baseline[name]
        reasons.append(f"it needs {name} at {with_unit(f'{value.refit_with:.4g}', value.unit)}, further off than the lesson holds possible")
    reasons += [f"{band.channel} still swings {band.place}" for band in bands]
    return list(dict.fromkeys(reasons))


@dataclass(frozen=True)
class LeftOver:
    """What effects leave of what was missing behind a channel, as far as a variable tells it: a share of what was there before."""

    share: float
    at: str
    variable: str


def left_over(evidence: Evidence, channels: Sequence[str], method: Method = STANDARD) -> LeftOver | None:
    """Return the largest share of what was missing that effects leave and that still follows the motion on the validation recording, among
    channels where they took something away; none where nothing follows it, or no more than stepping leaves of a force."""
    found = []
    for channel, missing in zip(channels, evidence.missing, strict=True):
        before, after = (float(np.sqrt(np.mean(np.square(values)))) for values in (missing.before, missing.after))
        bar = max((bar for bar in evidence.bars if bar.channel == channel), key=lambda bar: bar.after, default=None)
        stepping = (
            missing.unit in FORCES and bar is not None and missing.share_after * np.sqrt(bar.after) < method.location.integration_error
        )
        if bar is not None and bar.after > 0.0 and 0.0 < after < method.location.unexplained_share * before and not stepping:
            found.append(LeftOver(after / before * float(np.sqrt(bar.after)), missing.at, bar.variable))
    return max(found, key=lambda item: item.share, default=None)


def of_another_form(left: LeftOver | None, method: Method = STANDARD) -> list[str]:
    """Return the reason where effects leave so much that follows the motion that they are of another form than what is there."""
    if left is None or left.share < method.verdict.other_form:
        return []
    return [f"{left.share:.0%} of what was missing at {left.at} is left and goes with {left.variable}"]


def too_little(evidence: Evidence, taken: float, *, waves: bool = False, method: Method = STANDARD) -> list[str]:
    """Return the reason where effects explain less than half of the error on the validation recording, ``taken``, and leave more than half
    of what is missing wherever it is: something of their shape may be there, and most of it is something else. A line of each turn beside
    a load that wanders far is no such thing: it is all that followed the motion, and what is left follows nothing. Nor are ``waves`` that
    were much of it, whether the motion's band showed them or not."""
    if taken <= 0.0:
        return ["it takes away nothing of what is missing on the recording that judges"]
    halved = any(missing.share_after < method.verdict.half * missing.share_before for missing in evidence.missing)
    if taken >= method.verdict.half or halved or _is_all_that_followed(evidence, waves=waves, method=method):
        return []
    return [f"it takes away only {taken:.0%} of the error on the recording that judges"]


def is_missing_for_sure(evidence: Evidence, fit: Mapping[str, ChannelFit], method: Method = STANDARD) -> list[str]:
    """Return the reason where so much is missing that something is, though it follows nothing that the machine was doing. What is as large
    whether little acts or much is a load that nobody measured: physics of the machine grows with what acts."""
    pairs = zip(fit.values(), evidence.missing, strict=True)
    large = [
        missing
        for channel, missing in pairs
        if missing.share_after > method.verdict.small_load and channel.after > method.verdict.load_shows * channel.floor
    ]
    large = [missing for missing in large if not _is_a_load(missing, method=method)]
    worst = max(large, key=lambda missing: missing.share_after, default=None)
    return [f"{worst.share_after:.0%} of what acts at {worst.at} is still missing"] if worst else []


def mostly_follows(evidence: Evidence, channels: Sequence[str], method: Method = STANDARD) -> list[str]:
    """Return the reason where no effect was found and most of a force that is missing follows what the machine was doing, though it is
    small beside all that acts: a load that nobody measured follows nothing. On concealed cases a sixth of one did by chance."""
    reasons = []
    for channel, missing in zip(channels, evidence.missing, strict=True):
        bar = max((bar for bar in evidence.bars if bar.channel == channel), key=lambda bar: bar.after, default=None)
        follows = (
            bar is not None
            and bar.after > method.verdict.half
            and missing.share_after * np.sqrt(bar.after) >= method.verdict.follows_motion
        )
        if bar is not None and follows and missing.unit in FORCES:
            reasons.append(f"{missing.share_after:.1%} of what acts at {missing.at} is still missing, and goes with {bar.variable}")
    return reasons


def still_follows(evidence: Evidence, channels: Sequence[str], fit: Mapping[str, ChannelFit], method: Method = STANDARD) -> list[str]:
    """Return the reason where a value that explains most of what an impossible machine is off by leaves as much of what was missing as an
    effect of another form, and most of that follows what the machine was doing, far over the floor: a drag that grows with the square of
    the speed is no larger viscosity."""
    reasons = []
    for channel, missing in zip(channels, evidence.missing, strict=True):
        bar = max((bar for bar in evidence.bars if bar.channel == channel), key=lambda bar: bar.after, default=None)
        much = (
            _counted(missing) > method.verdict.leaves_much * missing.share_before
            and fit[channel].after > method.verdict.load_shows * fit[channel].floor
        )
        if bar is not None and bar.after > method.verdict.half and much and missing.share_after >= method.location.integration_error:
            share = _counted(missing) / missing.share_before
            reasons.append(f"{share:.0%} of what was missing at {missing.at} is left, and goes with {bar.variable}")
    return reasons


def _is_a_load(missing: MissingSignal, method: Method = STANDARD) -> bool:
    """Return whether what is missing is as large in the third of the samples in which least acts as in that in which most does."""
    least, most = np.quantile(np.abs(missing.total), (1.0 / 3.0, 2.0 / 3.0))
    thirds = (np.abs(missing.total) <= least, np.abs(missing.total) > most)
    little, much = (float(np.sqrt(np.mean(np.square(missing.after[third])))) if third.any() else 0.0 for third in thirds)
    return missing.unit in FORCES and most > least and min(little, much) > method.verdict.same_at_load * max(little, much)


def _is_all_that_followed(evidence: Evidence, *, waves: bool, method: Method = STANDARD) -> bool:
    """Return whether something followed the motion before, or ``waves`` are known that did, nothing does now, and what is left is little of
    all that acts."""
    before, after = (max((getattr(bar, side) for bar in evidence.bars), default=0.0) for side in ("before", "after"))
    little = not any(missing.share_after >= method.verdict.adequate for missing in evidence.missing)
    return (before > method.verdict.followed or waves) and after < method.verdict.follows_no_more and little


def leaves_much(evidence: Evidence, taken: float, method: Method = STANDARD) -> list[str]:
    """Return the reason where effects do not explain most of the error, ``taken``, and leave more of what is missing, wherever it is, than
    an effect in its own form does: right as far as it goes, perhaps, and not all there is."""
    if taken >= method.verdict.explains_most or any(
        _counted(missing) < method.verdict.leaves_much * missing.share_before for missing in evidence.missing
    ):
        return []
    return [f"it takes away no more than {taken:.0%} of the error on the recording that judges"]


def _counted(missing: MissingSignal) -> float:
    return missing.share_after if np.isnan(missing.counted) else missing.counted


def degrades_every_channel(fit: Mapping[str, ChannelFit], method: Method = STANDARD) -> bool:
    """Return whether the lesson's own simulation is further off with the effects than without them in every channel: effects that only
    together are like what is missing, each far larger than it, drift away from it as soon as nothing recorded holds them, and a replay that
    runs away is held by whatever keeps the machine at rest."""
    return bool(fit) and all(item.after > method.verdict.every_channel_worse * item.before for item in fit.values())


def degrades_a_channel(fit: Mapping[str, ChannelFit], method: Method = STANDARD) -> bool:
    """Return whether the lesson's own simulation is further off with the effects than without them in some channel."""
    return any(item.after > method.verdict.channel_worse * item.before for item in fit.values())


def hardly_missed(evidence: Evidence, channels: Sequence[str], at: str = "", method: Method = STANDARD) -> bool:
    """Return whether what was missing before any effect was found, and followed the motion, is little of all that acts, wherever it is;
    with a part, what force ``at`` it: of a position any error is little."""
    asked = [
        structured(evidence, channel, missing.share_before, before=True, method=method)
        for channel, missing in zip(channels, evidence.missing, strict=True)
        if not at or (missing.at.partition(".")[0] == at and missing.unit in FORCES)
    ]
    return bool(asked) and max(asked) < method.verdict.adequate


def structured(evidence: Evidence, channel: str, share: float, *, before: bool = False, method: Method = STANDARD) -> float:
    """Return the size of what is still missing behind a channel, or was ``before``, and depends on the motion, as a ``share`` of what acts
    there."""
    bars = (bar.before if before else bar.after for bar in evidence.bars if bar.channel == channel)
    explained = max(bars, default=0.0)
    if explained < method.verdict.follows_no_more:
        return 0.0
    return float(share * np.sqrt(explained)) if np.isfinite(share) else 0.0


def not_adequate(reasons: Sequence[str]) -> str:
    """Return the reasons in one sentence; empty where there are none."""
    return f"The model is not adequate: {'; '.join(reasons)}." if reasons else ""
