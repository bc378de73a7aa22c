"""A value of a controller that the recording contradicts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lathesim.diagnosis.records.diagnosis import with_unit
from lathesim.identification.replay.experiment import Machine


@dataclass(frozen=True)
class ControllerValue:
    """A parameter (``part.parameter``) of a controller with the value the lesson gives and the one its command follows from [``unit``]."""

    name: str
    unit: str
    given: float
    value: float
    command: str
    share: float
    """Share of the command that does not follow from the lesson's value."""
    error: float = 0.0
    """One standard error."""

    def __str__(self) -> str:
        off = f"{self.value / self.given - 1.0:+.0%}"
        value, given = (with_unit(f"{one:.4g}", self.unit) for one in (self.value, self.given))
        follows = f"{self.command} follows from what its controller was given with {self.name} of {value} ({off})"
        return f"{follows}; with the lesson's {given} {self.share:.0%} of it does not. Taken so for the rest."

    def in_machine(self, machine: Machine) -> Machine:
        """Return the machine with the value that was found."""
        part, _, item = self.name.partition(".")
        parts = tuple(
            replace(one, parameters={**one.parameters, item: self.value}) if one.name == part else one for one in machine.assembly.parts
        )
        return replace(machine, assembly=replace(machine.assembly, parts=parts))
