"""Rounds of design, run and diagnosis, the evidence of several recordings added up to one verdict, and the program that splits a tie."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lathesim.cluster import Cluster
from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.preparation import Question
from lathesim.diagnosis.records.diagnosis import NAMING, Diagnosis, FoundEffect, Verdict, as_json
from lathesim.engine.assembly import Assembly
from lathesim.errors import LatheSimError, LessonError
from lathesim.experiments.design_experiment import Designed, DesignWish, design_experiment
from lathesim.experiments.experiment_files import record_run, undecidable_sentence, write_experiment, write_program_and_lesson
from lathesim.experiments.replica import Listener, Say
from lathesim.experiments.rivals import named_in
from lathesim.identification.replay.loading import LoadedCase, load_case
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry

_LEAST = 0.02
"""Probability of what a diagnosis does not name; assumed: no diagnosis is surer than that."""
_SURE = 0.9
"""Probability from which on the joined verdict is no tie."""


@dataclass(frozen=True)
class Other:
    """A further recording of the machine, with the lesson that maps it."""

    lesson: str
    recording: Path


def diagnose_together(
    case: LoadedCase, others: Sequence[Other], registry: Registry, ask: Callable[[LoadedCase], Question], tell: Callable[[str], None],
    cluster: Cluster | None = None,
) -> Diagnosis:  # fmt: skip
    """Return one verdict of a recording and the others of the same machine.

    The new recording is fitted, and each other one judges: its start, its phases and what else belongs to one recording are fitted anew,
    values of the machine and of the effects are shared. The likelihoods of all recordings are added up. With a ``cluster`` its workers
    make the diagnoses at the same time. Raises :class:`LessonError` where a recording is one of another machine.
    """
    question = ask(case)
    answers, questions = [], []
    for left, other in zip(range(len(others), 0, -1), others, strict=True):
        further = load_case(load_lesson(other.lesson), [other.recording], registry)
        _check_same(case, further, other)
        judging = further.recordings[0]
        if judging.name == question.fitted.name:
            # both folders of a class hold a recording.csv, and the answer names the one that judged
            judging = replace(judging, name=str(other.recording))
        if cluster is not None:
            questions.append(replace(question, validation=judging))
            continue
        tell(f"together with {other.recording.name}")
        answers.append(diagnose(replace(question, validation=judging, ends=question.ends.share(1.0 / left)), tell))
    if cluster is not None:
        tell(f"together with {len(questions)} recordings, on the cluster")
        answers = cluster.in_order(answered, None, questions)
    return joined(answers)


def answered(shared: None, question: Question) -> Diagnosis:
    """Return the diagnosis of a question, on a worker of a cluster."""
    return diagnose(question, lambda step: None)


def _check_same(case: LoadedCase, further: LoadedCase, other: Other) -> None:
    """Refuse a recording whose lesson has other parts, wires, values or channels."""
    place = f"--with {other.lesson} {other.recording}"
    first, second = case.machine, further.machine
    if set(first.compare) != set(second.compare):
        fact = f"the lessons compare other channels: {', '.join(first.compare)} against {', '.join(second.compare)}."
        raise LessonError(fact, place=place, remedy="Map the same channels in both lessons.")
    difference = _difference(first.assembly, second.assembly)
    if difference:
        raise LessonError(f"the recordings are of different machines: {difference}.", place=place, remedy="Join recordings of one machine.")
    if not first.drive and len({case.prepared.case.program, further.prepared.case.program}) > 1:
        fact = "the recordings are runs of different programs, and no recorded reference drives the machine."
        raise LessonError(fact, place=place, remedy="Record the reference too, and map it under 'drive:' in both lessons.")


def _difference(first: Assembly, second: Assembly) -> str:
    """Return in what two machines differ, but for their paths; empty where they are the same."""
    parts, others = first.by_name, second.by_name
    for name in sorted(parts.keys() ^ others.keys()):
        return f"only one has {name}"
    for name, part in parts.items():
        if part.component.__name__ != others[name].component.__name__:
            return f"{name} is {part.component.__name__} in one and {others[name].component.__name__} in the other"
        for item in sorted({*part.parameters, *others[name].parameters}):
            one, two = part.value(item), others[name].value(item)
            if not math.isclose(one, two, rel_tol=1e-9, abs_tol=1e-300):
                return f"{name}.{item} is {one:g} in one and {two:g} {part.component.declarations[item].unit} in the other"
    return "their wires differ" if first.wired != second.wired else ""


def joined(answers: Sequence[Diagnosis]) -> Diagnosis:
    """Return one answer of several, each of which fits the same new recording and is judged by another one.

    Values of machine and effect are shared, what belongs to a recording is its own, so the joint log-likelihood of an explanation is its
    gain on the new recording and the sum of its gains on all others. Of what any answer names or ties, the likeliest is named, and tied
    with what differs from it by less than two explanations must. Effects that stand together are each held against what was tried in
    their place. Where answers differ in how many effects there are, their odds are multiplied.
    """
    if any(len(answer.effects) != 1 for answer in answers):
        return _together(answers) if len({_key(answer) for answer in answers}) == 1 else _by_odds(answers)
    named = {_name(answer.effects[0]): answer for answer in reversed(answers)}
    gains = [{name: (fitted, judged) for name, fitted, judged in answer.evidence.tried} for answer in answers]
    if any(name not in own for name in named for own in gains):
        return _by_odds(answers)

    def ahead(first: str, second: str) -> float:
        both = [(own[first], own[second]) for own in gains if first in own and second in own]
        return float(np.mean([a[0] - b[0] for a, b in both]) + sum(a[1] - b[1] for a, b in both)) if both else math.inf

    best = next((name for name in named if all(ahead(name, other) >= 0.0 for other in named)), next(iter(named)))
    joint = float(np.mean([own[best][0] for own in gains]) + sum(own[best][1] for own in gains))
    resolution = max(STANDARD.per_parameter, STANDARD.material * abs(joint))
    first = [answer.effects[0] for answer in answers]
    tied_names = {name if " at " in name else f"{name} at {effect.at}" for effect in first for name in effect.tied_with}
    behind = {name: ahead(best, name) for name in sorted({*named, *tied_names} - {best})}
    probability = 1.0 / (1.0 + sum(math.exp(-max(0.0, by) / (0.5 * resolution)) for by in behind.values()))
    tied = tuple(name for name, by in behind.items() if by < resolution)
    effect = replace(named[best].effects[0], probability=probability, tied_with=tied)
    return _with_verdict(answers, named[best], (effect,), is_tied=bool(tied))


def _together(answers: Sequence[Diagnosis]) -> Diagnosis:
    """Return the answer of several effects that all answers agree on, with the ties that are left when the recordings are added up.

    Each effect is ahead of whatever was tried in its place, beside the same others, by at least what the next best of that is behind on
    each recording that judges.
    """
    effects = []
    for effect in answers[0].effects:
        name = _name(effect)
        own = [next(item for item in answer.effects if _name(item) == name) for answer in answers]
        tied = tuple(dict.fromkeys(other for item in own for other in item.tied_with))
        gains = [judged for answer in answers for other, _, judged in answer.evidence.tried if other == name]
        behind = [by for answer in answers for first, _, by in answer.evidence.runners_up if first == name]
        resolution = max(STANDARD.per_parameter, STANDARD.material * abs(sum(gains)))
        told_apart = len(behind) == len(answers) and sum(behind) >= resolution
        probability = min(item.probability for item in own) if tied and not told_apart else max(item.probability for item in own)
        effects.append(replace(effect, probability=probability, tied_with=() if told_apart else tied))
    return _with_verdict(answers, answers[0], tuple(effects), is_tied=any(effect.tied_with for effect in effects))


def _key(answer: Diagnosis) -> tuple[str, ...]:
    return tuple(sorted(_name(effect) for effect in answer.effects))


def _name(effect: FoundEffect) -> str:
    return f"{effect.effect} at {effect.at}"


def _with_verdict(answers: Sequence[Diagnosis], chosen: Diagnosis, effects: tuple[FoundEffect, ...], *, is_tied: bool) -> Diagnosis:
    if not effects:
        # where nothing is named, the recording that is furthest off is shown
        chosen = max((answer for answer in answers if answer.verdict == chosen.verdict), key=_furthest_off)
    verdict: Verdict = chosen.verdict if chosen.verdict not in NAMING else "tied" if is_tied else "named"
    search = replace(chosen.search, wall_time=sum(answer.search.wall_time for answer in answers))
    question = replace(chosen.question, judges=tuple(answer.question.validation for answer in answers))
    return replace(chosen, effects=effects, verdict=verdict, search=search, question=question)


def _furthest_off(answer: Diagnosis) -> float:
    """Return how many times its noise the channel is off that is furthest off."""
    return max((item.after / item.floor for item in answer.fit.values() if item.floor > 0.0 and math.isfinite(item.after)), default=0.0)


def _by_odds(answers: Sequence[Diagnosis]) -> Diagnosis:
    """Return the answer whose effects have the best odds in all of them together."""
    # of equal odds those with more effects: what one recording hardly shows another one may
    keys = sorted({_key(answer) for answer in answers}, key=lambda key: (-len(key), key))

    def odds(key: tuple[str, ...]) -> float:
        total = 0.0
        for answer in answers:
            own = {_name(effect): effect.probability for effect in answer.effects}
            sizes = [own.get(item, _LEAST) for item in key] or [1.0 if not answer.effects else _LEAST]
            total += sum(math.log(max(size, _LEAST)) for size in sizes) / len(sizes)
        return total

    weights = {key: math.exp(odds(key)) for key in keys}
    best = max(weights, key=lambda key: weights[key])
    share = weights[best] / sum(weights.values())
    chosen = next(answer for answer in answers if _key(answer) == best)
    effects = tuple(replace(effect, probability=min(effect.probability, share)) for effect in chosen.effects)
    return _with_verdict(answers, chosen, effects, is_tied=chosen.verdict == "tied" or share < _SURE)


def with_designed_program(
    diagnosis: Diagnosis, lesson: Lesson, registry: Registry, folder: Path, variant: str | None, say: Callable[[str], None],
    stop: threading.Event | None = None,
) -> Diagnosis:  # fmt: skip
    """Return the diagnosis with ``separating_experiment`` naming the program in ``folder``, or saying that none would tell.

    Where nothing is tied, or no program moves the machine, the diagnosis stays as it is and one sentence says why. ``stop`` set keeps the
    best program so far, and the diagnosis.
    """
    try:
        named = named_in(as_json(diagnosis), "--design")
        found = design_experiment(lesson, named, registry, DesignWish(), variant, "--design", Listener(say, stop))
    except LatheSimError as error:
        say(f"No program is designed: {error.fact}")
        return diagnosis
    except KeyboardInterrupt:
        say("No program is designed: stopped before one was tried.")
        return diagnosis
    if not found.decidable:
        advice = told = undecidable_sentence(found)
    else:
        write_program_and_lesson(found, folder)
        write_experiment(found, (), folder)
        told = str(folder / "program.nc")
        advice = f"Run {told}, and diagnose it with {folder / 'lesson.yaml'} together with this recording (--with)."
        say(f"The program that would tell is {told}.")
    effects = tuple(replace(effect, separating_experiment=told) if effect.tied_with else effect for effect in diagnosis.effects)
    general = [effect.separating_experiment for effect in diagnosis.effects if effect.tied_with and effect.separating_experiment]
    not_told = tuple(_advised(sentence, general, advice) for sentence in diagnosis.rest.not_told)
    return replace(diagnosis, effects=effects, rest=replace(diagnosis.rest, not_told=not_told))


def _advised(sentence: str, general: Sequence[str], advice: str) -> str:
    """Return a sentence with the advice for these rivals in place of the one for all of their kind."""
    for text in general:
        sentence = sentence.replace(text, advice)
    return sentence


RECORDING = "recording.csv"


@dataclass(frozen=True)
class Round:
    """One round: its folder, how long its program lasts [s], the verdict of all recordings so far, and what was named."""

    folder: Path
    seconds: float
    verdict: str
    named: tuple[str, ...]


@dataclass(frozen=True)
class RunRounds:
    """All rounds, and why no further one was run."""

    rounds: tuple[Round, ...]
    ended: str

    @property
    def seconds(self) -> float:
        """How long all programs last together [s]."""
        return sum(item.seconds for item in self.rounds)


def run_rounds(
    design: Callable[[DesignWish], Designed], machine: Lesson, registry: Registry, wish: DesignWish, most: int, folder: Path, say: Say
) -> RunRounds:
    """Return the rounds of a sequence; ``machine`` is the lesson that plays the real machine, with noise before its sensors.

    Each round designs with another seed, runs the program on the machine, and diagnoses the new recording together with those before.
    """
    done: list[Round] = []
    for number in range(1, most + 1):
        found = design(replace(wish, seed=wish.seed + number - 1))
        if found.search.stopped:
            return RunRounds(tuple(done), "Stopped.")
        if not found.decidable:
            return RunRounds(tuple(done), "No program inside the limits tells these rivals apart.")
        if done and found.worth.score <= 0.0:
            return RunRounds(tuple(done), "A further round is worth less than its seconds.")
        own = folder / f"round_{number}"
        file = write_program_and_lesson(found, own)
        _record(machine, own, found, registry, wish.seed + number)
        say(f"Round {number}: {found.program.seconds:.1f} s run; diagnosing ...")
        before = [Other(str(item.folder / "lesson.yaml"), item.folder / RECORDING) for item in done]
        told = _diagnose(file, own / RECORDING, before, found, registry)
        names = tuple(f"{effect.effect}@{effect.at}" for effect in told.effects)
        done.append(Round(own, found.program.seconds, told.verdict, names))
        say(f"Round {number}: {told.verdict} {', '.join(names)}".strip())
        nothing = told.verdict in ("no_mismatch", "parameters_only") and any(rival.term is None for rival in found.scene.rivals)
        if told.verdict == "named" or nothing:
            return RunRounds(tuple(done), "Decided.")
    return RunRounds(tuple(done), f"Not decided after {most} rounds.")


def _record(machine: Lesson, folder: Path, found: Designed, registry: Registry, seed: int) -> None:
    """Run a program on the lesson that plays the machine, and write what would have been recorded."""
    prepared = prepare(machine, registry, program=folder / "program.nc")
    record_run(found.lesson, prepared.machinery, found.program.seconds, folder / RECORDING, seed, {}, {})


def _diagnose(file: Path, recording: Path, others: Sequence[Other], found: Designed, registry: Registry) -> Diagnosis:
    lesson = load_lesson(file)
    effects = [registry.effect(name) for name in dict.fromkeys(rival.effect for rival in found.scene.rivals if rival.term is not None)]
    case = load_case(lesson, [recording], registry)

    def ask(loaded: LoadedCase) -> Question:
        return Question(lesson.title, loaded.machine, loaded.recordings[0], None, tuple(effects))  # type: ignore[arg-type]

    return diagnose_together(case, others, registry, ask, lambda text: None) if others else diagnose(ask(case))
