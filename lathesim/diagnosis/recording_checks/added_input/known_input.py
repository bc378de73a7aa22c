"""A signal that is added to a command on its way, and that is known: an input which nobody recorded, once it has been worked out.

    u = u_controller + s

It sits behind the controller's output, so a compared command is the sum, and what the command feeds takes the sum. The signal is driven as
a recorded input is. Left out: what is added behind a converter or behind the drive.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Machine
from lathesim.lessons.insertion import insert_effect
from lathesim.record import Record


class AddedSignal(Effect):
    """A known signal added to a command:  u_out = u_in + share s."""

    family, site = "constants", "reading"
    neutral = {"share": 0.0}
    fingerprint = "A command differs from what its controller makes of its inputs, and the drive follows it."
    experiment = "Record what is added to the command, or switch it off."
    source = "Equation of a summing point: Ljung, System Identification, 2nd ed. 1999, section 13.1 (extra inputs in closed loop)."

    incoming = Input("{signal}", doc="command of the controller")
    added = Input("{signal}", default=0.0, doc="signal that is added")
    outgoing = Output("{signal}", doc="sum of both")
    share = Parameter("1", 1.0, doc="how much of it is added")

    @staticmethod
    def output(incoming: float, added: float, share: float) -> float:
        """The sum of both."""
        return incoming + share * added


@dataclass(frozen=True)
class AddedInput:
    """Where a signal is added: behind the output ``channel`` (``part.output``), as the part ``name``."""

    channel: str

    @property
    def name(self) -> str:
        """The name of the part that adds it."""
        return f"added_{self.channel.replace('.', '_')}"

    @property
    def target(self) -> str:
        """The input that the signal drives."""
        return f"{self.name}.added"


def with_added_input(machine: Machine, added: AddedInput) -> Machine:
    """Return the machine with a driven input behind a command; its recordings need that channel (:func:`with_signal`)."""
    assembly = insert_effect(machine.assembly, AddedSignal, added.channel, name=added.name, sources={"added": 0.0})
    return replace(machine, assembly=assembly, drive=(*machine.drive, added.target))


def with_signal(record: Record, added: AddedInput, values: FloatArray) -> Record:
    """Return the record with the signal (samples,) [unit of the command] as the channel that drives the added input."""
    return record.with_channel(added.target, record.unit(added.channel), values)
