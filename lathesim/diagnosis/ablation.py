"""A diagnosis with a step of the method left out, to see what the step is good for: the answer gets worse, and each in its own way.

    replay     the effects are fitted in the lesson's own simulation, where a controller hides a fault in its command
    baseline   the uncertain values stay as given, so that an effect has to repair what is only a wrong mass
    null       the residual is taken for white noise, and the due of an explanation is the Bayesian penalty, (k/2) ln n, of its k parameters
               and the n recorded values; whether a size is met on machines, and whether an effect or other values explain enough of
               the error, is not asked; a gain still has to exceed 3 standard errors
    held-out   the recording that was fitted is its own judge

Source of the penalty: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

from lathesim.diagnosis.preparation import Question
from lathesim.recordings.raw_table import Finding

LEFT_OUT = {
    "replay": "effects were fitted in the lesson's own simulation, not by replaying what was recorded",
    "baseline": "the uncertain values stayed as the lesson gives them",
    "null": "the residual was taken for white noise, and an effect had to gain no more than the Bayesian penalty and 3 standard errors",
    "held-out": "the recording that was fitted judged itself",
}
"""The steps that may be left out, and what an answer without them says of itself."""


def without(question: Question, steps: Collection[str]) -> Question:
    """Return the question to be answered without some steps of :data:`LEFT_OUT`; the answer's findings say so."""
    unknown = sorted(set(steps) - set(LEFT_OUT))
    if unknown:
        raise ValueError(f"there is no step {unknown[0]!r} to leave out; there are {', '.join(LEFT_OUT)}")
    asked = question
    if "replay" in steps:
        asked = replace(asked, machine=replace(asked.machine, replay=False))
    if "baseline" in steps:
        asked = replace(asked, machine=replace(asked.machine, uncertain={}))
    if "null" in steps:
        numbers = len(asked.machine.compare) * len(asked.fitted.record)
        method = replace(asked.method, margin=0.0, per_parameter=0.5 * math.log(numbers), material=0.0, share_of_rest=0.0)
        method = replace(method, sizes=replace(method.sizes, largest=math.inf))
        asked = replace(asked, machine=replace(asked.machine, white=True), method=method)
    if "held-out" in steps:
        asked = replace(asked, validation=replace(asked.fitted, findings=()))
    said = tuple(Finding("left out", "", f"Answered without {step}: {LEFT_OUT[step]}", "") for step in LEFT_OUT if step in steps)
    return replace(asked, fitted=replace(asked.fitted, findings=(*said, *asked.fitted.findings)))
