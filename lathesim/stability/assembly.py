"""An assembly file: cylinders and prisms in a row from the tip on, with their materials and the joints between them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from lathesim.errors import LessonError
from lathesim.lessons.case import Given
from lathesim.lessons.part_values import si_value
from lathesim.lessons.schema import Quantity, Text
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import read_source
from lathesim.stability.beams import Beam, Complex, Material, cylinder, prism


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MaterialEntry(_Model):
    """A material; steel with a loss factor of 0.01 where nothing is said."""

    modulus: Quantity = "200 GPa"
    density: Quantity = "7800 kg/m^3"
    loss: Quantity = "0.01"
    poisson: Quantity = "0.3"


class JointEntry(_Model):
    """An elastic joint behind a part."""

    translation: Quantity
    rotation: Quantity


class BeamEntry(_Model):
    """A part: a cylinder (diameter, perhaps a bore) or a prism (width and height)."""

    length: Quantity
    diameter: Quantity | None = None
    bore: Quantity = "0 mm"
    width: Quantity | None = None
    height: Quantity | None = None
    material: MaterialEntry = MaterialEntry()
    joint: JointEntry | None = None


class AssemblySettings(_Model):
    """The file: a title and the parts from the tip on."""

    assembly: Text
    model: Literal["euler_bernoulli", "timoshenko"] = "timoshenko"
    parts: list[BeamEntry]


@dataclass(frozen=True)
class Assembly:
    """Beams from the tip on, the stiffness of the joint behind each (None: rigid), and the beam model."""

    title: str
    beams: tuple[Beam, ...]
    joints: tuple[Complex | None, ...]
    model: str


def load_assembly(path: Path) -> Assembly:
    """Return the assembly in a file; :class:`LessonError` with its place where it cannot be."""
    source = read_source(path, what="assembly")
    settings = validated(AssemblySettings, source)
    beams: list[Beam] = []
    joints: list[Complex | None] = []
    for number, entry in enumerate(settings.parts):
        place = source.place(("parts", number))

        def value(text: str, unit: str, place: str = place) -> float:
            return si_value(Given(text, place, place), unit)

        material = Material(
            value(entry.material.modulus, "Pa"),
            value(entry.material.density, "kg/m^3"),
            value(entry.material.loss, "1"),
            value(entry.material.poisson, "1"),
        )
        length = value(entry.length, "m")
        try:
            if entry.diameter is not None and entry.width is None and entry.height is None:
                beams.append(cylinder(value(entry.diameter, "m"), length, material, value(entry.bore, "m")))
            elif entry.width is not None and entry.height is not None and entry.diameter is None:
                beams.append(prism(value(entry.width, "m"), value(entry.height, "m"), length, material))
            else:
                raise LessonError("the part is neither a cylinder nor a prism.", remedy="Give its diameter, or its width and height.")
        except LessonError as error:
            raise error if error.place else LessonError(error.fact, place=place, remedy=error.remedy) from None
        joint = entry.joint
        joints.append(np.diag([value(joint.translation, "N/m"), value(joint.rotation, "N*m/rad")]).astype(complex) if joint else None)
    if not beams:
        raise LessonError("the assembly has no parts.", place=str(path), remedy="Give at least one under 'parts:'.")
    return Assembly(settings.assembly, tuple(beams), tuple(joints), settings.model)
