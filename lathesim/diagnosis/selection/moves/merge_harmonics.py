"""A wave and its second harmonic as one effect that has both: the force of magnets on teeth is no pure sine.

A ripple of one line came in for a cogging of two; its second line is no further effect, and the ripple has no shape that would take it. An
effect of both lines then takes the place of the ripple.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.harmonics import second_line
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import merit
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.diagnosis.selection.trials import told
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Trial

_LINES = ("amplitude", "second", "period", "phase", "second_phase")


def take_whole_wave(bench: Bench, found: Found, settings: Settings, harmonics: Sequence[Trial]) -> bool:
    """Put an effect of two lines in the place of a wave of the model, where what was tried beside it is its second line and both recordings
    are explained better for what the further values cost; say whether one was put."""
    for trial in sorted(harmonics, key=lambda one: -merit(one, settings)):
        wave = second_line(trial, found.model)
        whole = _of_two_lines(bench, wave, found.model.terms) if wave is not None else None
        if wave is None or whole is None:
            continue
        bench.say(f"asking whether {wave.name} at {wave.at} and its second harmonic are one {whole.name}")
        before = fewer(bench, found.model, wave)
        one = told(bench, bench.trial(before, whole, before.terms, before.free, _starts(trial, wave, whole)))
        due = settings.margin + settings.per_parameter * max(0, len(whole.parameters) - len(wave.parameters))
        model, old = one.model, found.model
        better = model.score.above(old.score, wide=True) > due
        if better and model.held_out.above(old.held_out, wide=True) > settings.held_out_margin:
            bench.say(f"{whole.name} takes the place of {wave.name}")
            found.trials[whole.part] = [replace(one, share_of_all=min(1.0, found.removed_by(wave) + trial.share_of_all))]
            found.before[whole.part] = before
            found.trials.pop(wave.part, None)
            found.model = bench.settled(one.model)
            return True
    return False


def _of_two_lines(bench: Bench, wave: Term, there: Sequence[Term]) -> Term | None:
    """Give the effect of two lines at the place of a wave, if that is of one; none where the model has it."""
    if any(name.endswith(".second") or "second_sine" in name for name in wave.parameters):
        return None
    forms = (
        term for term in bench.rig.candidates if term.at == wave.at and {f"{term.part}.{line}" for line in _LINES} == set(term.parameters)
    )
    return next((term for term in forms if term not in there), None)


def _starts(trial: Trial, wave: Term, whole: Term) -> list[FloatArray]:
    """Give what the two lines were found with; a ripple takes from the force what a cogging adds."""
    values = trial.model.fitted.by_name
    first, second = ({line: values.get(f"{term.part}.{line}", 0.0) for line in _LINES} for term in (wave, trial.term))
    lines = {"amplitude": first["amplitude"], "period": first["period"], "phase": first["phase"]}
    lines |= {"second": second["amplitude"], "second_phase": second["phase"]}
    start = np.array([lines[name.partition(".")[2]] for name in whole.parameters])
    names = [name.partition(".")[2] for name in whole.parameters]
    turned = start.copy()
    turned[names.index("amplitude")] *= -1.0
    return [turned, start]
