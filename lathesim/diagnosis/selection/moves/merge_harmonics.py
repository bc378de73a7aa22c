"""A wave and its second harmonic as one effect that has both: the force of magnets on teeth is no pure sine.

A ripple of one line came in for a cogging of two; its second line is no further effect, and the ripple has no shape that would take it. An
effect of both lines then takes the place of the ripple.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.harmonics import second_line
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import merit
from lathesim.diagnosis.selection.compare_models import compare_models, gains_over
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.trials import told
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial

_LINES = ("amplitude", "second", "period", "phase", "second_phase")


def merge_harmonics(laboratory: Laboratory, found: SearchResult, method: Method, harmonics: Sequence[Trial]) -> SearchResult:
    """Return the search with an effect of two lines in the place of a wave of the model, where what was tried beside it is its second line
    and both recordings are explained better for what the further values cost."""
    for trial in sorted(harmonics, key=lambda one: -merit(one, method)):
        wave = second_line(trial, found.model, method=method)
        whole = _of_two_lines(laboratory, wave, found.model.candidates) if wave is not None else None
        if wave is None or whole is None:
            continue
        laboratory.progress(f"asking whether {wave.name} at {wave.at} and its second harmonic are one {whole.name}")
        before = fewer(laboratory, found.model, wave)
        one = told(laboratory, laboratory.trial(before, whole, before.candidates, before.free, _starts(trial, wave, whole)))
        more = max(0, len(whole.parameters) - len(wave.parameters))
        if compare_models(gains_over(one.model, found.model, full_band=True), method, effects=1, parameters=more).better:
            laboratory.progress(f"{whole.name} takes the place of {wave.name}")
            both = replace(one, share_of_all=min(1.0, found.removed_by(wave) + trial.share_of_all))
            return found.accepted(
                laboratory.settled(one.model),
                "merge harmonics",
                "a wave and its second harmonic are one effect",
                trials=found.trials_with({whole.part: [both]}, wave),
                before={**found.before, whole.part: before},
            )
    return found


def _of_two_lines(laboratory: Laboratory, wave: Candidate, there: Sequence[Candidate]) -> Candidate | None:
    """Return the effect of two lines at the place of a wave, if that is of one; none where the model has it."""
    if wave.named(wave.effect.identification.second_harmonic):
        return None
    forms = (
        candidate
        for candidate in laboratory.experiment.candidates
        if candidate.at == wave.at and {f"{candidate.part}.{line}" for line in _LINES} == set(candidate.parameters)
    )
    return next((candidate for candidate in forms if candidate not in there), None)


def _starts(trial: Trial, wave: Candidate, whole: Candidate) -> list[FloatArray]:
    """Return what the two lines were found with; a ripple takes from the force what a cogging adds."""
    values = trial.model.fitted.by_name
    first, second = ({line: values.get(f"{candidate.part}.{line}", 0.0) for line in _LINES} for candidate in (wave, trial.candidate))
    lines = {"amplitude": first["amplitude"], "period": first["period"], "phase": first["phase"]}
    lines |= {"second": second["amplitude"], "second_phase": second["phase"]}
    start = np.array([lines[name.partition(".")[2]] for name in whole.parameters])
    names = [name.partition(".")[2] for name in whole.parameters]
    turned = start.copy()
    turned[names.index("amplitude")] *= -1.0
    return [turned, start]
