"""The tip of an assembly as a frequency response, its band where joints are uncertain, and how it moves with the overhang."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.assembly.assembly_file import Assembly
from lathesim.stability.assembly.beams import Complex
from lathesim.stability.assembly.receptance_coupling import MODELS, base_from_tip
from lathesim.stability.tool_point.frequency_response import FrequencyResponse

LOWEST, HIGHEST, LINES = 10.0, 5000.0, 5000
"""Frequencies [Hz] of a response computed from an assembly: a cut hardly chatters above."""
_DRAWS = 200


@dataclass(frozen=True)
class Overhang:
    """What a tip is at a length [m] of its first part: the frequency of the largest peak [Hz] and its height [m/N], and the lowest real
    part [m/N], which sets the limit of the chip width."""

    length: float
    peak_frequency: float
    peak: float
    lowest_real: float
    lowest_frequency: float


def tip_response(assembly: Assembly, frequency: FloatArray | None = None) -> FrequencyResponse:
    """Return displacement over force at the tip."""
    if frequency is None:
        low, high = LOWEST, HIGHEST
        if assembly.base is not None and assembly.base.frequency is not None:
            low, high = float(assembly.base.frequency[0]), float(assembly.base.frequency[-1])
        frequency = np.linspace(low, high, LINES)
    return FrequencyResponse(frequency, assembly.tip(frequency)[..., 0, 0], title=assembly.title)


def base_share(artefact: Assembly, frequency: FloatArray, tip: Complex) -> Complex:
    """Return the receptance (lines, 2, 2) of what an artefact was fixed to, from the measured receptance of its tip, all four terms.

    The parts are taken off one after another from the tip on, each with its joint.
    """
    found = tip
    for beam, joint in zip(artefact.beams, artefact.joints, strict=True):
        found = base_from_tip(MODELS[artefact.model](beam, frequency), found)
        if joint is not None:
            found = found - np.linalg.inv(joint.stiffness)
    return found


def overhangs(assembly: Assembly, lengths: Sequence[float], frequency: FloatArray | None = None) -> list[Overhang]:
    """Return what the tip is at each length [m] of its first part."""
    found = []
    for length in lengths:
        if not length > 0.0:
            raise LessonError(f"an overhang is {length:g} m.", remedy="Give lengths above 0.")
        response = tip_response(with_overhang(assembly, length), frequency)
        size, real = np.abs(response.receptance_values), response.receptance_values.real
        inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1
        top = int(inner[np.argmax(size[inner])]) if len(inner) else int(np.argmax(size))
        start = int(np.argmax(np.arange(len(size)) >= 1)) if assembly.base is not None else max(0, (int(inner[0]) if len(inner) else 0))
        low = start + int(np.argmin(real[start:]))
        found.append(Overhang(length, float(response.frequency[top]), float(size[top]), float(real[low]), float(response.frequency[low])))
    return found


def with_overhang(assembly: Assembly, length: float) -> Assembly:
    """Return an assembly whose first part has another length [m]."""
    return replace(assembly, beams=(replace(assembly.beams[0], length=length), *assembly.beams[1:]))


def is_uncertain(assembly: Assembly) -> bool:
    """Whether a joint of the assembly has a standard deviation."""
    return any(joint is not None and joint.deviation > 0.0 for joint in assembly.joints)


def tip_draws(assembly: Assembly, frequency: Any, seed: int = 1, draws: int = _DRAWS) -> Complex:
    """Return displacement over force at the tip (draws, lines) with the joints drawn within their uncertainty, log-normally."""
    chance = np.random.Generator(np.random.Philox(seed))
    rows = []
    for _ in range(draws):
        joints = []
        for joint in assembly.joints:
            if joint is None or joint.deviation == 0.0:
                joints.append(joint)
                continue
            spread = math.sqrt(math.log1p(joint.deviation**2))
            along, turning = np.exp(spread * chance.standard_normal(2))
            joints.append(replace(joint, translation=joint.translation * along, rotation=joint.rotation * turning))
        rows.append(replace(assembly, joints=tuple(joints)).tip(frequency)[..., 0, 0])
    return np.stack(rows)
