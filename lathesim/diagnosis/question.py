"""What a diagnosis is asked."""

from __future__ import annotations

from dataclasses import dataclass, field

from lathesim.diagnosis.method import Settings
from lathesim.effects.effect import Effect
from lathesim.identification.replay.experiment import Machine
from lathesim.identification.replay.loading import Recorded


@dataclass(frozen=True)
class Question:
    """What a diagnosis is asked: a machine, the recording it is fitted to, the one it is judged on, and the effects to be tried."""

    lesson: str
    machine: Machine
    fitted: Recorded
    validation: Recorded | None
    effects: tuple[type[Effect], ...]
    settings: Settings = field(default_factory=Settings)
