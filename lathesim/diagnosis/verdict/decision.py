"""The decision: the first rule that holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.diagnosis import NAMING, VERDICTS, FoundEffect, Verdict, listed


@dataclass(frozen=True)
class Facts:
    """What a decision rests on: the effects that were accepted, whether a residual test fails, and how much is explained.

    ``explained`` is the share of the error that the effects are credited with; ``first_may_be_zero`` says that the interval of the first
    effect includes its neutral value; ``tied`` that another effect, or a value of the lesson, explains as much.
    """

    effects: bool
    test_fails: bool
    values_differ: bool
    explained: float
    first_may_be_zero: bool
    tied: bool


@dataclass(frozen=True)
class Rule:
    """A verdict, the reason for it in words, and when it holds."""

    verdict: Verdict
    reason: str
    holds: Callable[[Facts, Method], bool]


RULES: tuple[Rule, ...] = (
    Rule("unknown", "no effect was accepted, and a residual test fails", lambda f, m: not f.effects and f.test_fails),
    Rule("parameters_only", "no effect was accepted, and parameter values differ", lambda f, m: not f.effects and f.values_differ),
    Rule("no_mismatch", "no effect was accepted, and nothing is left", lambda f, m: not f.effects),
    Rule(
        "unknown", "a residual test fails, and the effects explain too little",
        lambda f, m: f.test_fails and f.explained < m.verdict.named_share,
    ),
    Rule("unknown", "a residual test fails, and the first size may be zero", lambda f, m: f.test_fails and f.first_may_be_zero),
    Rule("tied", "another effect or a parameter value explains as much", lambda f, m: f.tied),
    Rule("named", "the first effect is the only explanation of the catalogue", lambda f, m: True),
)  # fmt: skip


def decide(facts: Facts, method: Method) -> Rule:
    """Return the first rule that holds."""
    return next(rule for rule in RULES if rule.holds(facts, method))


def sentence_of(verdict: Verdict, effects: tuple[FoundEffect, ...], far_off: tuple[str, ...], jointly: tuple[str, ...] = ()) -> str:
    """Return the verdict as a sentence; ``far_off`` are values of the lesson that are outside their plausible range."""
    if verdict == "parameters_only" and len(jointly) > 1:
        return f"No physics is missing, but {listed(jointly)} are further off than the lesson holds possible."
    if verdict == "parameters_only" and far_off:
        others = f" (or {' or '.join(far_off[1:])})" if len(far_off) > 1 else ""
        return f"No physics is missing, but {far_off[0]}{others} is further off than the lesson holds possible."
    if verdict not in NAMING or not effects:
        return VERDICTS[verdict]
    names = [f"{effect.effect} at {effect.at}" + (f" (or {', '.join(effect.tied_with)})" if effect.tied_with else "") for effect in effects]
    return f"The simulation left out {listed(names)}."
