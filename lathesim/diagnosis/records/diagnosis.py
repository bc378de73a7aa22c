"""What a diagnosis says: the verdict, the effects with their parameters and ties, the place, and how much better the model fits.

It holds numbers and text only; :func:`as_json` gives the JSON of schema ``lathesim-diagnosis/1``, and the report draws from
:class:`Evidence`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from lathesim.analysis.display_unit import known_share
from lathesim.diagnosis.records.comparison import Explanation, Step
from lathesim.engine.assembly import FloatArray
from lathesim.json_text import eight_digits

SCHEMA = "lathesim-diagnosis/1"

Verdict = Literal["no_mismatch", "parameters_only", "named", "tied", "unknown", "recording_fault"]

VERDICTS: dict[Verdict, str] = {
    "no_mismatch": "The simulation explains the recording as it is.",
    "parameters_only": "No physics is missing: other values of the uncertain parameters explain the recording.",
    "named": "Physics is missing, and it is named.",
    "tied": "Physics is missing; this recording cannot tell between a few explanations.",
    "unknown": "Physics is missing that the catalogue does not explain.",
    "recording_fault": "The recording itself is at fault; no physics is named from it.",
}
"""One sentence for each verdict."""
TOO_SLOW = "The recording is too slow for this question; no physics is named from it."
"""The sentence for ``recording_fault`` where the samples are sound, but too far apart."""

_OF_EARLIER_METHODS: dict[str, Any] = {"possible": [], "residual_tests": [], "stability": None}
"""Keys of the format that nothing fills any more: readers may still ask for them."""

Ends = tuple[bool, bool]
"""Whether an interval ends at the lowest, and at the highest value that may be set: nothing recorded ends it there."""

NAMING: tuple[Verdict, ...] = ("named", "tied")
"""The verdicts that name effects."""


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval [``unit``]."""

    value: float
    unit: str
    low: float
    high: float
    ends: Ends = (False, False)


@dataclass(frozen=True)
class Determined:
    """What recordings say of the sizes of an effect.

    ``undetermined`` names parameters that they do not determine, ``left_out`` those of them that the lines to paste do without.
    ``may_be_zero`` says that the intervals of all sizes hold the value with which the effect vanishes, and that its gain is not clear in
    spite of that. ``products`` are those of two parameters that they determine where they determine neither of the two.
    """

    undetermined: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    may_be_zero: bool = False
    products: Mapping[str, Interval] = field(default_factory=dict)


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was left out.

    ``probability`` that it is this one and none of the other candidates; ``tied_with`` names those the recording cannot tell from it, and
    ``separating_experiment`` says what would; ``share`` is the share of the whole error that it removes. ``before`` is the effect of the
    lesson before which it is inserted, as behind a spring; empty where there is none. One that ``is_step`` is the step in which something
    is read or set.
    """

    effect: str
    at: str
    family: str
    probability: float
    parameters: Mapping[str, Interval]
    tied_with: tuple[str, ...] = ()
    separating_experiment: str | None = None
    share: float = 0.0
    doc: str = ""
    before: str = ""
    sizes: Determined = field(default_factory=Determined)
    is_step: bool = False


@dataclass(frozen=True)
class Unnamed:
    """What is left ``at`` a port, could be predicted and has no name: its root mean square ``size`` [``unit``], and on what it depends."""

    at: str
    size: float
    unit: str
    depends_on: tuple[str, ...] = ()


@dataclass(frozen=True)
class Unanswerable:
    """An effect ``at`` a place that the recordings do not show, however large it is, and ``why``."""

    effect: str
    at: str
    why: str


@dataclass(frozen=True)
class Location:
    """Where the mismatch sits: parts (the suspect first), channels (the worst first), stretches of time [s], and what it depends on."""

    components: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    windows: tuple[tuple[float, float], ...] = ()
    variables: tuple[str, ...] = ()


@dataclass(frozen=True)
class ChannelFit:
    """Root mean square of a channel's residual before and after, beside what the recording cannot resolve [``unit``]."""

    unit: str
    floor: float
    before: float
    after: float
    recording: str


@dataclass(frozen=True)
class BaselineValue:
    """A value of the lesson: as given, refitted without the effects (what it had absorbed), and refitted with them [``unit``]."""

    unit: str
    given: float
    refit_without: float
    refit_with: float
    low: float = math.nan
    high: float = math.nan
    ends: Ends = (False, False)


@dataclass(frozen=True)
class MissingSignal:
    """What is missing at a place [``unit``] over ``time`` [s], before and after; ``share`` is its size as a share of what acts there."""

    at: str
    unit: str
    time: FloatArray
    before: FloatArray
    after: FloatArray
    total: FloatArray
    share_before: float
    share_after: float

    @property
    def sizes(self) -> tuple[float, float]:
        """Root mean squares of what is missing before and after [``unit``]."""
        before, after = (
            float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else math.nan for values in (self.before, self.after)
        )
        return before, after


@dataclass(frozen=True)
class ChannelTrace:
    """A channel of the validation recording over ``time`` [s]: recorded, simulated without and with what was found [``unit``].

    One that is not ``held`` stays off by what it starts off: no loop, spring or friction brings it back, and errors add up.
    """

    channel: str
    unit: str
    time: FloatArray
    recorded: FloatArray
    before: FloatArray
    after: FloatArray
    held: bool = True


@dataclass(frozen=True)
class Evidence:
    """What the report draws."""

    missing: tuple[MissingSignal, ...] = ()
    traces: tuple[ChannelTrace, ...] = ()
    wires: tuple[tuple[str, str], ...] = ()
    """Wires of the machine, from part to part."""
    tried: tuple[tuple[str, float, float], ...] = ()
    """Candidates that were fitted: name with place, gain in log-likelihood on the fitted and on the validation recording [nats]."""
    runners_up: tuple[tuple[str, str, float], ...] = ()
    """For effects of the model: name with place, that of the next best candidate beside it, and how far that is behind on the validation
    recording [nats]."""


@dataclass(frozen=True)
class AnsweredQuestion:
    """Which recordings were held against which lesson, and how.

    ``before`` is a recording from before a change; empty where the question is not what changed. ``findings`` say what was found in the
    recordings themselves and what was done about it, ``turned`` which channels were recorded with the other sign. With ``judges_itself``
    one part of a recording judged what was fitted to another part, and ``together`` both were fitted, so that none was left to judge.
    ``judges`` are the recordings that judged, where these are several; ``validation`` is the one of which the answer is shown.
    """

    lesson: str
    recording: str
    validation: str = ""
    before: str = ""
    findings: tuple[str, ...] = ()
    turned: tuple[str, ...] = ()
    judges_itself: bool = False
    together: bool = False
    judges: tuple[str, ...] = ()

    @property
    def is_one_stroke(self) -> bool:
        """Whether one stroke alone was recorded, so that what was fitted to all of it was judged on all of it."""
        return self.judges_itself and self.validation == self.recording


@dataclass(frozen=True)
class Searched:
    """How an answer was found: the ``rule`` of the decision in words, the changes of the model that were accepted, and what competed.

    ``untried`` are effects, with their places, that a search which was stopped had not fitted yet, the most promising first.
    """

    rule: str = ""
    history: tuple[Step, ...] = ()
    explanations: tuple[Explanation, ...] = ()
    """Every explanation that was tried, with what it predicts of held-out data."""
    untried: tuple[str, ...] = ()
    wall_time: float = 0.0


@dataclass(frozen=True)
class Rest:
    """What is left when the answer is believed: the share of the error that is gone, and whether nothing is left that could be predicted.

    ``unnamed`` could be predicted and has no name, ``discovered`` is a formula for it with its unit. Sentences say what is ``left`` and
    where, and what the recording could not tell (``not_told``) with the experiment that would.
    """

    removed_share: float = 0.0
    adequate: bool = False
    unnamed: tuple[Unnamed, ...] = ()
    discovered: str = ""
    left: tuple[str, ...] = ()
    not_told: tuple[str, ...] = ()
    far_off: tuple[str, ...] = ()
    """Values of the lesson that are further off than it declares possible."""
    unanswerable: tuple[Unanswerable, ...] = ()
    """The effects that these recordings would not show, however large they are."""
    easiest: str = ""
    """The channel that no compared one shows and that is the easiest to log; empty where all are shown."""


@dataclass(frozen=True)
class LessonLines:
    """What is written into a lesson: the effects to insert, on which ``side`` of a spring a sensor sits where the lesson does not say it,
    and the text of a ``plugin`` file with a discovered formula as an effect, empty where there is none."""

    insert: tuple[Mapping[str, str], ...] = ()
    side: Mapping[str, str] = field(default_factory=dict)
    plugin: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """The outcome of a diagnosis; one that is not ``complete`` was stopped and holds what was known until then."""

    verdict: Verdict
    sentence: str
    question: AnsweredQuestion
    effects: tuple[FoundEffect, ...] = ()
    location: Location = field(default_factory=Location)
    fit: Mapping[str, ChannelFit] = field(default_factory=dict)
    baseline: Mapping[str, BaselineValue] = field(default_factory=dict)
    rest: Rest = field(default_factory=Rest)
    lines: LessonLines = field(default_factory=LessonLines)
    search: Searched = field(default_factory=Searched)
    evidence: Evidence = field(default_factory=Evidence)
    complete: bool = True

    @property
    def names(self) -> bool:
        """Whether the effects are what was left out; else they only explain part of what is missing."""
        return self.verdict in NAMING


def with_unit(number: str, unit: str) -> str:
    """Return a number with its unit, a pure number alone."""
    return number if unit == "1" else f"{number} {unit}"


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the JSON of a diagnosis; numbers that are not finite become null."""
    place, values = diagnosis.location, ("unit", "given", "refit_without", "refit_with", "low", "high")
    told = {
        "schema": SCHEMA,
        "lesson": diagnosis.question.lesson,
        "verdict": diagnosis.verdict,
        "sentence": diagnosis.sentence,
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "location": {"components": place.components, "channels": place.channels, "windows_s": place.windows, "variables": place.variables},
        "fit": diagnosis.fit,
        "missing": [
            {"at": item.at, "unit": item.unit, "before": item.sizes[0], "after": item.sizes[1],
             "share_before": known_share(item.share_before), "share_after": known_share(item.share_after)}
            for item in diagnosis.evidence.missing
        ],
        "removed_share": diagnosis.rest.removed_share,
        "adequate": diagnosis.rest.adequate,
        "baseline": {name: {key: getattr(item, key) for key in values} for name, item in diagnosis.baseline.items()},
        "insert": diagnosis.lines.insert,
        "side": diagnosis.lines.side,
        "left": diagnosis.rest.left,
        "not_told": diagnosis.rest.not_told,
        "recording": diagnosis.question.findings,
        "discovered": diagnosis.rest.discovered or None,
        "rule": diagnosis.search.rule,
        "history": [_step(number, step) for number, step in enumerate(diagnosis.search.history, start=1)],
        "complete": diagnosis.complete,
        "report": None,
        "wall_time_s": diagnosis.search.wall_time,
        **_OF_EARLIER_METHODS,
        "untried": diagnosis.search.untried,
        "explanations": diagnosis.search.explanations,
        "unnamed": diagnosis.rest.unnamed,
        "unanswerable": diagnosis.rest.unanswerable,
    }  # fmt: skip
    return dict(eight_digits(told))


def _step(number: int, step: Step) -> dict[str, Any]:
    told = {"step": number, "move": step.move, "in": step.came_in, "out": step.went}
    return {**told, "log_likelihood_gain": step.gain, "validation_gain": step.validation_gain, "why": step.why}


def _effect(effect: FoundEffect) -> dict[str, Any]:
    sizes = {name: {"value": item.value, "unit": item.unit, "low": item.low, "high": item.high} for name, item in effect.parameters.items()}
    return {
        "effect": effect.effect, "at": effect.at, "family": effect.family, "probability": effect.probability, "parameters": sizes,
        "tied_with": effect.tied_with, "separating_experiment": effect.separating_experiment, "share": effect.share,
        "undetermined": effect.sizes.undetermined, "may_be_zero": effect.sizes.may_be_zero,
        **({"before": effect.before} if effect.before else {}),
    }  # fmt: skip
