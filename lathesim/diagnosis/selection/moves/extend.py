"""A finer shape of an effect that was found: the harmonics of a wave, how softly a limit or a play sets in.

An effect is looked for in its plain shape, with as few values as tell it from others. What is left of it then looks like something else:
the second harmonic of a screw like a loss of counts, the rounded edge of a play like a friction before it slides. So where the finer shape
promises as much as anything new, it is tried first. The name stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.screening import screened_instead
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import believable
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.diagnosis.selection.trials import told
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Term, instants_of, jump_at
from lathesim.identification.records.model import Model
from lathesim.identification.signal.analysis import strongest_jumps

_WORTH_ASKING = 0.5
"""Share of the margin of belief, and of the share of the error an effect has to remove, that a shape must promise to be fitted."""

_OF_ALL = 0.01
"""Share of all the error that a shape must remove: less than an effect, as no new name is at stake, and more than the recorded motion of a
replay, which has the error of its sensor in it, makes of a pure sine."""

_OF_FIRST = 0.2
"""The same as a share of the nats that the plain shape gained: beside a load that drifts no share of the error tells."""


def take_finer_shape(bench: Bench, found: Found, settings: Settings, promised: float = 0.0) -> bool:
    """Give an effect of the model its finer shape where that promises more than ``promised`` [nats] and is believable; say whether one was
    given."""
    asked = [(term, shaped, _starts(bench, term, shaped, found.model)) for term in found.model.terms if (shaped := _shape_of(term))]
    promises = [(*item, screened_instead(bench.rig.sensed, found.model.fitted, *item[:2], item[2][1:])) for item in asked]
    promises.sort(key=lambda item: -item[3].gain)
    for term, shaped, starts, promise in promises:
        if promise.gain < promised or not _is_worth_asking(promise, settings):
            return False
        bench.say(f"asking whether {term.name} at {term.at} has a finer shape, which promises {promise.gain:.0f} nats")
        kept = tuple(other for other in found.model.terms if other is not term)
        free = [item for item in found.model.free if item.name not in term.parameters]
        best = min(starts[1:], key=lambda start: _left(bench, found.model, shaped, start))
        trial = told(bench, bench.trial(found.model, shaped, kept, free, [starts[0], best]))
        found.tried.append(trial)
        first = next((one for one in found.trials.get(term.part, ()) if one.term.part == term.part), None)
        much = first is not None and min(trial.gain, trial.held_out_gain) > _OF_FIRST * first.gain
        if believable(trial, replace(settings, share_of_all=_OF_ALL), 0.0) or (much and trial.moves > settings.small_move):
            # what was as good and may take the same shape is as good still: a screw and an encoder's disc
            alike = [one for one in found.trials.get(term.part, ()) if one.term.effect.finer_shape == term.effect.finer_shape]
            found.trials[term.part] = [replace(one, share_of_all=min(one.share_of_all + trial.share_of_all, 1.0)) for one in alike]
            found.model = bench.settled(trial.model)
            return True
    return False


def _starts(bench: Bench, term: Term, shaped: Term, model: Model) -> Sequence[FloatArray]:
    plain, *others = shape_starts(term, shaped, model)
    events = [name for name in instants_of(shaped.parameters) if name not in term.parameters]
    return [plain, *(_with_events(bench, model, shaped, plain, events) if events else others)]


def _with_events(bench: Bench, model: Model, shaped: Term, plain: FloatArray, events: Sequence[str]) -> list[FloatArray]:
    """Give the plain shape with one more event after the other, each where it leaves least: among the steps of what is left."""
    names, found = list(shaped.parameters), [plain]
    for event in events:
        residual = bench.rig.sensed.one(_with(model, shaped, found[-1]))
        jumps = [jump for row in residual for jump in strongest_jumps(row, bench.rig.machine.assembly.sample_period)]
        tried = []
        for instant, size in dict.fromkeys(jumps):
            start = found[-1].copy()
            start[names.index(event)], start[names.index(jump_at(event))] = instant, size
            tried.append(np.clip(start, shaped.low, shaped.high))
        found.append(min(tried, key=lambda start: _left(bench, model, shaped, start)))
    return found[1:]


def shape_starts(term: Term, shaped: Term, model: Model) -> Sequence[FloatArray]:
    """Give the values of a term as fitted with its plain shape, and then with each value of the finer shape by itself at a usual size."""
    values = model.fitted.by_name
    plain = np.array([values.get(name, neutral) for name, neutral in zip(shaped.parameters, shaped.neutral, strict=True)])
    starts = [plain]
    for place, name in enumerate(shaped.parameters):
        if name not in term.parameters and name.partition(".")[2] in shaped.effect.finer_shape:
            start = plain.copy()
            start[place] = 0.5 * shaped.usual[place]
            starts.append(start)
    return starts


def _shape_of(term: Term) -> Term | None:
    """Give the finer shape of a term that has only its plain one."""
    return term.shaped if term.shaped is not None and not set(term.shaped.parameters) <= set(term.parameters) else None


def _is_worth_asking(promise: Screened, settings: Settings) -> bool:
    return promise.gain > settings.margin and promise.share > _WORTH_ASKING * settings.share_of_rest


def _left(bench: Bench, model: Model, term: Term, start: FloatArray) -> float:
    """Give what is left of the whitened residual with a term at its starting values."""
    residual = bench.rig.sensed.one(_with(model, term, start))
    return sum(float(np.sum(noise.whiten(row, wide=True) ** 2)) for noise, row in zip(model.fitted.noise, residual, strict=True))


def _with(model: Model, term: Term, start: FloatArray) -> dict[str, float]:
    """Give the values of a model with those of a term."""
    return {**model.fitted.by_name, **dict(zip(term.parameters, start.tolist(), strict=True))}
