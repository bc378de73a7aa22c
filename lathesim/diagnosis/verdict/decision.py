"""The decision: the first rule that holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lathesim.diagnosis.records.diagnosis import NAMING, VERDICTS, FoundEffect, Verdict, listed
from lathesim.diagnosis.verdict.grounds import Grounds


@dataclass(frozen=True)
class Facts:
    """What the rules ask: whether effects were accepted, whether a test of what is left fails, how much is explained.

    ``explains_little`` says that the effects are credited with too small a share of the error to be named, ``first_may_be_zero`` that the
    interval of the first effect includes its neutral value, ``closest`` that a test fails at its place, and no further effect explains what
    is left, ``tied`` that another effect, or a value of the lesson, explains as much.
    """

    effects: bool
    test_fails: bool
    values_differ: bool
    explains_little: bool
    first_may_be_zero: bool
    closest: bool
    tied: bool


def facts(grounds: Grounds) -> Facts:
    """Return the facts that follow from the grounds of a decision. A test that discredits leaves the effects credited with nothing."""
    failed = [test for test in grounds.tests if not test.passed]
    discredited = any(test.severity == "discredits" for test in failed)
    return Facts(
        effects=grounds.effects,
        test_fails=any(test.severity != "weakens" for test in failed),
        values_differ=grounds.values_off or grounds.moved.holds,
        explains_little=discredited or not grounds.explains.holds,
        first_may_be_zero=grounds.first_may_be_zero is not None and grounds.first_may_be_zero.holds,
        closest=not grounds.rest_explained and any(test.channel in grounds.at_first and test.severity != "weakens" for test in failed),
        tied=grounds.tied or any(one.holds for one in grounds.ties),
    )


@dataclass(frozen=True)
class Rule:
    """A verdict, the reason for it in words, and when it holds."""

    verdict: Verdict
    reason: str
    holds: Callable[[Facts], bool]


CLOSEST = "a residual test fails at the first effect, and no effect of the catalogue explains what is left"
"""The reason where the effects are the closest of the catalogue, and no more."""

RULES: tuple[Rule, ...] = (
    Rule("unknown", "no effect was accepted, and a residual test fails", lambda f: not f.effects and f.test_fails),
    Rule("parameters_only", "no effect was accepted, and parameter values differ", lambda f: not f.effects and f.values_differ),
    Rule("no_mismatch", "no effect was accepted, and nothing is left", lambda f: not f.effects),
    Rule("unknown", "a residual test fails, and the effects explain too little", lambda f: f.test_fails and f.explains_little),
    Rule("unknown", "a residual test fails, and the first size may be zero", lambda f: f.test_fails and f.first_may_be_zero),
    Rule("unknown", CLOSEST, lambda f: f.closest),
    Rule("tied", "another effect or a parameter value explains as much", lambda f: f.tied),
    Rule("named", "the first effect is the only explanation of the catalogue", lambda f: True),
)


def decide(grounds: Grounds) -> Rule:
    """Return the first rule that holds."""
    found = facts(grounds)
    return next(rule for rule in RULES if rule.holds(found))


def sentence_of(
    rule: Rule, effects: tuple[FoundEffect, ...], far_off: tuple[str, ...], jointly: tuple[str, ...] = (), *, changed: bool = False
) -> str:
    """Return the verdict of a rule as a sentence; ``far_off`` are values of the lesson that are outside their plausible range. With
    ``changed`` effects are what has changed, and not what the simulation left out."""
    verdict = rule.verdict
    if verdict == "parameters_only" and len(jointly) > 1:
        return f"No physics is missing, but {listed(jointly)} are further off than the lesson holds possible."
    if verdict == "parameters_only" and far_off:
        others = f" (or {' or '.join(far_off[1:])})" if len(far_off) > 1 else ""
        return f"No physics is missing, but {far_off[0]}{others} is further off than the lesson holds possible."
    if not effects or (verdict not in NAMING and rule.reason != CLOSEST):
        return VERDICTS[verdict]
    names = [f"{effect.effect} at {effect.at}" + (f" (or {', '.join(effect.tied_with)})" if effect.tied_with else "") for effect in effects]
    if rule.reason == CLOSEST:
        return f"{VERDICTS[verdict]} Closest to it {'is' if len(names) == 1 else 'are'} {listed(names)}."
    return f"New since the recording from before: {listed(names)}." if changed else f"The simulation left out {listed(names)}."
