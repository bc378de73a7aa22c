"""What a diagnosis is asked."""

from __future__ import annotations

from dataclasses import dataclass, field

from lathesim.diagnosis.method import Method
from lathesim.effects.effect import Effect
from lathesim.identification.replay.experiment import Machine
from lathesim.identification.replay.loading import Recorded


@dataclass(frozen=True)
class Question:
    """What a diagnosis is asked: a machine, the recording it is fitted to, the one it is judged on, and the effects to be tried.

    With a recording from ``before`` the machine changed the question is what changed, and no longer what the lesson left out.
    """

    lesson: str
    machine: Machine
    fitted: Recorded
    validation: Recorded | None
    effects: tuple[type[Effect], ...]
    method: Method = field(default_factory=Method)
    before: Recorded | None = None
