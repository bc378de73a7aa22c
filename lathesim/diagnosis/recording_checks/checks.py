"""All checks of a recording by itself."""

from __future__ import annotations

from collections.abc import Mapping

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.exchanged_channels import exchanged_with, swapped
from lathesim.diagnosis.recording_checks.mistaken_unit import in_another_unit
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.identification.replay.experiment import Experiment


def at_odds(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> tuple[str, ...]:
    """Return the sentences in which a recording contradicts itself with the machine at ``values``, as far as no other law of a controller
    would be behind that."""
    asked = (exchanged_with, of_another_period, swapped, in_another_unit)
    return tuple(sentence for one in asked if (sentence := one(experiment, values, method=method)))
