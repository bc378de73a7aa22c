"""A finer shape of an effect that was found: the harmonics of a wave, how softly a limit or a play sets in.

An effect is looked for in its plain shape, with as few values as tell it from others. What is left of it then looks like something else:
the second harmonic of a screw like a loss of counts, the rounded edge of a play like a friction before it slides. So where the finer shape
scores as much as anything new, it is tried first. The name stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.screening import screened_instead
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import SearchResult, credited
from lathesim.diagnosis.selection.acceptance import believable
from lathesim.diagnosis.selection.compare_models import Gains, compare_models
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.trials import told
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate, instants_of, jump_at
from lathesim.identification.records.model import Model
from lathesim.identification.signal.analysis import strongest_jumps


def extend_parameters(laboratory: Laboratory, found: SearchResult, method: Method, promised: float = 0.0) -> SearchResult:
    """Return the search with the finer shape of an effect of the model, where that scores more than ``promised`` [nats] and is
    believable."""
    asked = [
        (candidate, shaped, _starts(laboratory, candidate, shaped, found.model))
        for candidate in found.model.candidates
        if (shaped := _shape_of(candidate))
    ]
    promises = [(*item, screened_instead(laboratory.experiment.sensed, found.model.fitted, *item[:2], item[2][1:])) for item in asked]
    promises.sort(key=lambda item: -item[3].gain)
    for candidate, shaped, starts, screening_score in promises:
        if screening_score.gain < promised or not _is_worth_asking(screening_score, method):
            return found
        laboratory.progress(
            f"asking whether {candidate.name} at {candidate.at} has a finer shape, which promises {screening_score.gain:.0f} nats"
        )
        kept = tuple(other for other in found.model.candidates if other is not candidate)
        free = [item for item in found.model.free if item.name not in candidate.parameters]
        best = min(starts[1:], key=lambda start: _left(laboratory, found.model, shaped, start))
        trial = told(laboratory, laboratory.trial(found.model, shaped, kept, free, [starts[0], best]))
        found, first = found.having_tried([trial]), found.trial_of(candidate)
        much = first is not None and min(trial.gain, trial.validation_gain) > method.selection.hopeless * first.gain
        if believable(trial, replace(method, share_of_all=method.selection.small_effect), 0.0) or (
            much and trial.moves > method.small_move
        ):
            # what was as good and may take the same shape is as good still: a screw and an encoder's disc
            alike = [
                one
                for one in found.trials.get(candidate.part, ())
                if one.candidate.effect.identification.extended == candidate.effect.identification.extended
            ]
            trials = {**found.trials, candidate.part: credited(alike, trial.share_of_all)}
            return found.accepted(laboratory.settled(trial.model), "extend", f"{candidate.name} has an extended shape", trials=trials)
    return found


def _starts(laboratory: Laboratory, candidate: Candidate, shaped: Candidate, model: Model) -> Sequence[FloatArray]:
    plain, *others = shape_starts(candidate, shaped, model)
    events = [name for name in instants_of(shaped) if name not in candidate.parameters]
    return [plain, *(_with_events(laboratory, model, shaped, plain, events) if events else others)]


def _with_events(laboratory: Laboratory, model: Model, shaped: Candidate, plain: FloatArray, events: Sequence[str]) -> list[FloatArray]:
    """Return the plain shape with one more event after the other, each where it leaves least: among the steps of what is left."""
    names, found = list(shaped.parameters), [plain]
    for event in events:
        residual = laboratory.experiment.sensed.one(_with(model, shaped, found[-1]))
        jumps = [jump for row in residual for jump in strongest_jumps(row, laboratory.experiment.machine.assembly.sample_period)]
        tried = []
        for instant, size in dict.fromkeys(jumps):
            start = found[-1].copy()
            start[names.index(event)], start[names.index(jump_at(event))] = instant, size
            tried.append(np.clip(start, shaped.low, shaped.high))
        found.append(min(tried, key=lambda start: _left(laboratory, model, shaped, start)))
    return found[1:]


def shape_starts(candidate: Candidate, shaped: Candidate, model: Model) -> Sequence[FloatArray]:
    """Return the values of a candidate as fitted with its plain shape, and then with each value of the finer shape by itself at a usual
    size."""
    values = model.fitted.by_name
    plain = np.array([values.get(name, neutral) for name, neutral in zip(shaped.parameters, shaped.neutral, strict=True)])
    starts = [plain]
    for place, name in enumerate(shaped.parameters):
        if name not in candidate.parameters and name.partition(".")[2] in shaped.effect.identification.extended:
            start = plain.copy()
            start[place] = 0.5 * shaped.usual[place]
            starts.append(start)
    return starts


def _shape_of(candidate: Candidate) -> Candidate | None:
    """Return the finer shape of a candidate that has only its plain one."""
    return candidate.shaped if candidate.shaped is not None and not set(candidate.shaped.parameters) <= set(candidate.parameters) else None


def _is_worth_asking(screening_score: Screened, method: Method) -> bool:
    worth = screening_score.share > method.shared.larger_part * method.share_of_rest
    return worth and compare_models(Gains(screening_score.gain), method, effects=1).better


def _left(laboratory: Laboratory, model: Model, candidate: Candidate, start: FloatArray) -> float:
    """Return what is left of the whitened residual with a candidate at its starting values."""
    residual = laboratory.experiment.sensed.one(_with(model, candidate, start))
    return sum(float(np.sum(noise.whiten(row, full_band=True) ** 2)) for noise, row in zip(model.fitted.noise, residual, strict=True))


def _with(model: Model, candidate: Candidate, start: FloatArray) -> dict[str, float]:
    """Return the values of a model with those of a candidate."""
    return {**model.fitted.by_name, **dict(zip(candidate.parameters, start.tolist(), strict=True))}
