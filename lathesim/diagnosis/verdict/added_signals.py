"""The answer where a signal that nobody recorded is added to a command: the place, the signal itself, and what is told of the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.records.added_signal import UnrecordedInput
from lathesim.diagnosis.records.diagnosis import Diagnosis, Location, MissingSignal

RULE = "a command does not follow from its controller, and everything else agrees"


def agrees(answer: Diagnosis) -> bool:
    """Return whether the rest of the machine agrees with its recordings once the added signals are known: nothing speaks against the model,
    or effects are named."""
    return answer.verdict != "recording_fault" and (answer.adequate or answer.names)


def with_added_signals(answer: Diagnosis, added: Sequence[UnrecordedInput]) -> Diagnosis:
    """Return the answer with the signals that are added to commands; where no effect is named, they are what is unknown."""
    if not added or answer.verdict == "recording_fault":
        return answer
    told = [f"{one}." for one in added]
    evidence = replace(answer.evidence, missing=(*map(_missing, added[-1:]), *answer.evidence.missing))
    answer = replace(answer, left=(*told, *answer.left), evidence=evidence)
    if answer.names:
        return answer
    parts = tuple(dict.fromkeys(one.wire.partition(".")[0] for one in added))
    location = Location(parts, tuple(dict.fromkeys(one.command for one in added)), added[-1].shape.windows)
    rest = "Everything else agrees with the lesson." if answer.adequate else "Physics is missing besides."
    sentence = f"{added[0]}. {rest}"
    not_told = (*answer.not_told, f"Record what is added to {added[0].command}, or switch it off, and ask again.")
    return replace(answer, verdict="unknown", sentence=sentence, location=location, rule=RULE, not_told=not_told)


def _missing(one: UnrecordedInput) -> MissingSignal:
    size, all_of_it = (float(np.sqrt(np.mean(np.square(values)))) for values in (one.values, one.total))
    share = size / all_of_it if all_of_it > 0.0 else np.nan
    return MissingSignal(one.wire, one.unit, one.time, one.values, one.values, one.total, share, share)
