"""An assembly file: cylinders and prisms in a row from the tip on, with their materials and the joints between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from lathesim.errors import LessonError
from lathesim.json_text import parsed_json
from lathesim.lessons.part_values import si_of
from lathesim.lessons.schema import FileModel, Quantity, Text
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import read_source
from lathesim.limit import Limit
from lathesim.record import FloatArray
from lathesim.stability.beams import MODELS, Beam, Material, assembly_tip, base_from_tip, cylinder, prism
from lathesim.stability.stability_thresholds import ROUNDING
from lathesim.stability.tool_point import Complex, FrequencyResponse
from lathesim.units import in_unit


class MaterialEntry(FileModel):
    """A material; steel with a loss factor of 0.01 where nothing is said."""

    modulus: Quantity = "200 GPa"
    density: Quantity = "7800 kg/m^3"
    loss: Quantity = "0.01"
    poisson: Quantity = "0.3"


class JointEntry(FileModel):
    """An elastic joint behind a part; ``loss`` is its loss factor, and ``uncertain`` one standard deviation of both stiffnesses."""

    translation: Quantity
    rotation: Quantity
    loss: Quantity = "0"
    uncertain: Quantity = "0 %"


class BeamEntry(FileModel):
    """A part: a cylinder (diameter, perhaps a bore) or a prism (width and height). ``start`` is where it begins, for checking."""

    length: Quantity
    diameter: Quantity | None = None
    bore: Quantity = "0 mm"
    width: Quantity | None = None
    height: Quantity | None = None
    start: Quantity | None = None
    material: MaterialEntry = MaterialEntry()
    joint: JointEntry | None = None


class AssemblySettings(FileModel):
    """The file: a title and the parts from the tip on, and what the last part is fixed to."""

    assembly: Text
    model: Literal["euler_bernoulli", "timoshenko"] = "timoshenko"
    parts: list[BeamEntry]
    base: Text = Field(default="free", description="free, wall, or a file of receptances as 'lathesim couple --json' writes it")


_GAP = Limit(1e-9, "m", "two parts that lie further apart do not touch", "derived", "coordinates are rounded")
_GAP_SHARE = Limit(1e-6, "of the place", "the same, of large coordinates", "derived", "coordinates have 6 digits at least")


@dataclass(frozen=True)
class Joint:
    """Stiffness of an elastic joint [N/m] and [N*m/rad], its loss factor, and the relative standard deviation of both."""

    translation: float
    rotation: float
    loss: float = 0.0
    deviation: float = 0.0

    @property
    def stiffness(self) -> Complex:
        """The stiffness matrix (2, 2)."""
        return np.diag([self.translation, self.rotation]) * (1.0 + 1j * self.loss)


@dataclass(frozen=True, eq=False)
class ToolAssembly:
    """Beams from the tip on, the joint behind each (None: rigid), the beam model, and what the last beam is fixed to (None: free)."""

    title: str
    beams: tuple[Beam, ...]
    joints: tuple[Joint | None, ...]
    model: str
    base: Base | None = None

    def tip(self, frequency: Any) -> Complex:
        """Return the receptance of the tip at frequencies [Hz], (..., 2, 2)."""
        base = None if self.base is None else self.base.at(frequency)
        links = [None if joint is None else joint.stiffness for joint in self.joints]
        return assembly_tip(self.beams, frequency, model=self.model, base=base, joints=links)


@dataclass(frozen=True, eq=False)
class Base:
    """Receptances (lines, 2, 2) of what an assembly is fixed to, at rising frequencies [Hz]; none of both for a wall."""

    frequency: Any = None
    receptance: Any = None
    name: str = "wall"

    def at(self, frequency: Any) -> Complex:
        """Return the receptance at frequencies inside the band, linear between its lines; :class:`LessonError` outside."""
        asked = np.asarray(frequency, dtype=np.float64)
        if self.receptance is None:
            return np.zeros((*asked.shape, 2, 2), dtype=np.complex128)
        if asked.min() < self.frequency[0] * (1.0 - ROUNDING) or asked.max() > self.frequency[-1] * (1.0 + ROUNDING):
            known = f"{self.frequency[0]:g} to {self.frequency[-1]:g} Hz"
            fact = f"the base is known from {known}, and {asked.min():g} to {asked.max():g} Hz are requested."
            raise LessonError(fact, place=self.name, remedy="Ask for frequencies inside.")
        found = np.zeros((*asked.shape, 2, 2), dtype=np.complex128)
        for row in (0, 1):
            for column in (0, 1):
                values = self.receptance[:, row, column]
                found[..., row, column] = np.interp(asked, self.frequency, values.real) + 1j * np.interp(asked, self.frequency, values.imag)
        return found


def load_assembly(path: Path) -> ToolAssembly:
    """Return the assembly in a file; :class:`LessonError` with its place where it cannot be."""
    source = read_source(path, what="assembly")
    settings = validated(AssemblySettings, source)
    beams: list[Beam] = []
    joints: list[Joint | None] = []
    reached = 0.0
    for number, entry in enumerate(settings.parts):
        place = source.place(("parts", number))
        try:
            beam = _beam(entry, place)
            if entry.start is not None:
                _check_start(si_of(entry.start, "m", place), reached, number, place)
            joints.append(_joint(entry.joint, place))
        except LessonError as error:
            raise error if error.place else LessonError(error.fact, place=place, remedy=error.remedy) from None
        beams.append(beam)
        reached += beam.length
    if not beams:
        raise LessonError("the assembly has no parts.", place=str(path), remedy="Give at least one under 'parts:'.")
    base = {"free": None, "wall": Base()}.get(settings.base, "file")
    if base == "file":
        base = read_base(path.parent / settings.base)
    elif base is None and joints[-1] is not None:
        raise LessonError(
            "the last part has a joint, and nothing follows.", place=str(path), remedy="Name a 'base:', or leave the joint out."
        )
    return ToolAssembly(settings.assembly, tuple(beams), tuple(joints), settings.model, base)  # type: ignore[arg-type]


def read_base(path: Path) -> Base:
    """Return receptances as ``lathesim couple --json`` writes them; :class:`LessonError` where the file holds none."""
    if not path.is_file():
        raise LessonError(
            "there is no such file.", place=str(path), remedy="Write it with 'lathesim couple --json'; or say 'free' or 'wall'."
        )
    try:
        rows = parsed_json(path.read_text(encoding="utf-8"))["rows"]
        frequency = np.array([row["frequency_hz"] for row in rows], dtype=np.float64)
        numbers = np.array([row["receptance"] for row in rows], dtype=np.float64)
        receptance = numbers[..., 0] + 1j * numbers[..., 1]
    except (ValueError, KeyError, TypeError, IndexError):
        raise LessonError("the file holds no receptances.", place=str(path), remedy="Write it with 'lathesim couple --json'.") from None
    if receptance.shape[1:] != (2, 2) or len(frequency) < 1 or (np.diff(frequency) <= 0.0).any():
        raise LessonError(
            "the receptances are not 2 by 2 at rising frequencies.", place=str(path), remedy="Give all four terms of each line."
        )
    return Base(frequency, receptance, str(path))


def _beam(entry: BeamEntry, place: str) -> Beam:
    material = Material(
        si_of(entry.material.modulus, "Pa", place),
        si_of(entry.material.density, "kg/m^3", place),
        si_of(entry.material.loss, "1", place),
        si_of(entry.material.poisson, "1", place),
    )
    for word, value in (("modulus", material.modulus), ("density", material.density)):
        if not value > 0.0:
            raise LessonError(f"the {word} of the material is {value:g}.", place=place, remedy="Give a value above 0.")
    if material.loss < 0.0:
        raise LessonError(f"the loss factor is {material.loss:g}.", place=place, remedy="Give 0 or more.")
    length = si_of(entry.length, "m", place)
    if entry.diameter is not None and entry.width is None and entry.height is None:
        return cylinder(si_of(entry.diameter, "m", place), length, material, si_of(entry.bore, "m", place))
    if entry.width is not None and entry.height is not None and entry.diameter is None:
        return prism(si_of(entry.width, "m", place), si_of(entry.height, "m", place), length, material)
    raise LessonError("the part is neither a cylinder nor a prism.", remedy="Give its diameter, or its width and height.")


def _check_start(start: float, reached: float, number: int, place: str) -> None:
    if abs(start - reached) > _GAP + _GAP_SHARE * abs(reached):
        word = "a gap" if start > reached else "an overlap"
        places = f"starts at {in_unit(start, 'mm', 'g')} and the parts before end at {in_unit(reached, 'mm', 'g')}"
        fact = f"part {number + 1} {places}: the assembly has {word}."
        raise LessonError(fact, place=place, remedy="Correct a length or the start, or put a part between.")


def _joint(entry: JointEntry | None, place: str) -> Joint | None:
    if entry is None:
        return None
    joint = Joint(
        si_of(entry.translation, "N/m", place),
        si_of(entry.rotation, "N*m/rad", place),
        si_of(entry.loss, "1", place),
        si_of(entry.uncertain, "1", place),
    )
    for word, value in (("translation", joint.translation), ("rotation", joint.rotation)):
        if not value > 0.0:
            raise LessonError(f"the joint has the {word} stiffness {value:g}.", place=place, remedy="Give a value above 0, or no joint.")
    return joint


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


def tip_response(assembly: ToolAssembly) -> FrequencyResponse:
    """Return displacement over force at the tip."""
    low, high = LOWEST, HIGHEST
    if assembly.base is not None and assembly.base.frequency is not None:
        low, high = float(assembly.base.frequency[0]), float(assembly.base.frequency[-1])
    frequency = np.linspace(low, high, LINES)
    return FrequencyResponse(frequency, assembly.tip(frequency)[..., 0, 0], title=assembly.title)


def base_share(artefact: ToolAssembly, frequency: FloatArray, tip: Complex) -> Complex:
    """Return the receptance (lines, 2, 2) of what an artefact was fixed to, from the measured receptance of its tip, all four terms.

    The parts are taken off one after another from the tip on, each with its joint.
    """
    found = tip
    for beam, joint in zip(artefact.beams, artefact.joints, strict=True):
        found = base_from_tip(MODELS[artefact.model](beam, frequency), found)
        if joint is not None:
            found = found - np.linalg.inv(joint.stiffness)
    return found


def overhangs(assembly: ToolAssembly, lengths: Sequence[float]) -> list[Overhang]:
    """Return what the tip is at each length [m] of its first part."""
    found = []
    for length in lengths:
        if not length > 0.0:
            raise LessonError(f"an overhang is {length:g} m.", remedy="Give lengths above 0.")
        response = tip_response(with_overhang(assembly, length))
        size, real = np.abs(response.receptance_values), response.receptance_values.real
        inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1
        top = int(inner[np.argmax(size[inner])]) if len(inner) else int(np.argmax(size))
        start = int(np.argmax(np.arange(len(size)) >= 1)) if assembly.base is not None else max(0, (int(inner[0]) if len(inner) else 0))
        low = start + int(np.argmin(real[start:]))
        found.append(Overhang(length, float(response.frequency[top]), float(size[top]), float(real[low]), float(response.frequency[low])))
    return found


def with_overhang(assembly: ToolAssembly, length: float) -> ToolAssembly:
    """Return an assembly whose first part has another length [m]."""
    return replace(assembly, beams=(replace(assembly.beams[0], length=length), *assembly.beams[1:]))


def is_uncertain(assembly: ToolAssembly) -> bool:
    """Whether a joint of the assembly has a standard deviation."""
    return any(joint is not None and joint.deviation > 0.0 for joint in assembly.joints)


def tip_draws(assembly: ToolAssembly, frequency: Any) -> Complex:
    """Return displacement over force at the tip (draws, lines) with the joints drawn within their uncertainty, log-normally."""
    chance = np.random.Generator(np.random.Philox(1))
    rows = []
    for _ in range(_DRAWS):
        joints = []
        for joint in assembly.joints:
            if joint is None or joint.deviation == 0.0:
                joints.append(joint)
                continue
            along, turning = np.exp(math.sqrt(math.log1p(joint.deviation**2)) * chance.standard_normal(2))
            joints.append(replace(joint, translation=joint.translation * along, rotation=joint.rotation * turning))
        rows.append(replace(assembly, joints=tuple(joints)).tip(frequency)[..., 0, 0])
    return np.stack(rows)
