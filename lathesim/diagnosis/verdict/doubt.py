"""What an explanation leaves that could be predicted: for each channel, whether the flexible explanation predicts it clearly better."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.diagnosis.explaining.chance import is_clear
from lathesim.diagnosis.explaining.resolution import least_size
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explanations.of_recording import of_channels
from lathesim.diagnosis.records.search import Gain
from lathesim.identification.records.model import Model


@dataclass(frozen=True)
class Doubt:
    """What the flexible explanation makes of what a model leaves behind a channel.

    ``gain`` with its ``error`` is what it predicts better [nats]. ``before`` and ``after`` are root mean squares of what is lacking ``at``
    a port, without and with it [unit]; ``depends_on`` says on what, and ``variables`` names it. It is ``clear`` where something is left
    that an effect should explain.
    """

    channel: str
    at: str
    unit: str
    gain: float
    error: float
    before: float
    after: float
    depends_on: tuple[str, ...]
    variables: tuple[str, ...]
    clear: bool

    @property
    def structured(self) -> float:
        """The size of what could be predicted, one root mean square [unit]."""
        return math.sqrt(max(self.before**2 - self.after**2, 0.0))


def doubts(study: Study, model: Model) -> tuple[Doubt, ...]:
    """Return what the flexible explanation makes of each compared channel that no controller gives."""
    validation, found = study.validation, []
    asked = of_channels(study.estimation, model.fitted, validation, model.validation_fit)
    for channel, (lacking, made) in asked.items():
        row = study.estimation.machine.compare.index(channel)
        # lines over time are what a loop makes that swings by itself
        gain, error = made.without_lines, made.standard_error
        size = math.sqrt(max(made.before**2 - made.after**2, 0.0))
        least = least_size(study, model, row) if lacking.is_force else float(validation.sensed.seen_floors[row])
        clear = is_clear(Gain(gain, error), study.method) and size > least
        on, variables = tuple(map(str, made.parts)), tuple(term.variable for term in made.terms)
        found.append(Doubt(channel, lacking.at, lacking.unit, gain, error, made.before, made.after, on, variables, clear))
    return tuple(found)
