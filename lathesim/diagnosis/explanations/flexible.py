"""The flexible explanation: what a machine was doing that predicts what a fitted model leaves.

What is left of a channel, or the force that a moving part lacks, is an unknown function of the operating conditions and noise:

    r = constant + sum over terms f(conditions) + coloured noise

A term is a smooth function or a wave, whose period the spectrum of the residual gives. Terms come in by the marginal likelihood on the
estimation recording, each with a strength of its own: what the recording does not show shrinks to nothing. On the validation recording a
term stays only where it predicts better without being fitted; the constant, the phase of a wave and the level of the noise belong to a
recording. The gain is the log predictive density of the blocks of the validation recording above that of the constant, under one colour of
noise: that of what the flexible explanation leaves.

Left out: functions of two conditions other than products.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.explanations.conditions import Conditions, Functions, Rules, Term
from lathesim.diagnosis.explanations.held_out import HeldOut
from lathesim.diagnosis.explanations.learned import Recording, learned
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class KeptTerm:
    """A term of a flexible explanation: its ``size``, the root mean square on the estimation recording [unit of the residual], and the
    ``share`` of the validation recording's power that it takes beside the terms before it."""

    term: Term
    size: float
    share: float


@dataclass(frozen=True, eq=False)
class Flexible:
    """What a residual depends on, as far as that predicts the validation recording.

    ``gain`` is its log predictive density there above that of the constant [nats], with its ``standard_error``; ``before`` and ``after``
    are root mean squares there, less the ``mean`` and less the prediction [unit of the residual].
    """

    gain: float
    standard_error: float
    without_lines: float
    """The gain without lines over time, which a loop that swings by itself makes: that is no function of what a machine does [nats]."""
    strongest_line: float
    """The largest share of the validation recording's power that a line over time takes beside all other terms."""
    before: float
    after: float
    mean: float
    parts: tuple[KeptTerm, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """What it depends on, the strongest first."""
        return tuple(part.term for part in self.parts)

    def without_faint_lines(self, share: float) -> float:
        """Return the gain, where no line over time takes a ``share`` of the power: without that of the lines. A loop that swings by itself
        makes faint ones, and what shakes a machine from outside makes strong ones."""
        return self.gain if self.strongest_line > share else self.without_lines


def flexible(
    conditions: Conditions, residual: FloatArray, held_out: tuple[Conditions, FloatArray], unresolved: float = 0.0, every: int = 1
) -> Flexible:
    """Return what a residual (samples,) depends on, judged on the conditions and the residual of the validation recording.

    Samples whose residual is not finite are left out. ``unresolved`` is what a sensor may be off by where it stands, one standard deviation
    [unit of the residual]. ``before`` and ``after`` are those of means of ``every`` so many samples, where noise is most of single ones.
    Without any term that holds on the validation recording, the gain is 0.
    """
    functions = Functions.of(conditions)
    length = min(len(residual), len(held_out[1])) // Rules.blocks
    found = learned(functions, conditions, residual, length, unresolved)
    judge = Recording(functions, *held_out, found.recording.colour, found.posterior.terms)
    asked = HeldOut(found, judge, length, every)
    kept = asked.holding()
    terms = asked.ranked(kept)
    left = np.square([asked.left(terms[:number]) for number in range(len(terms) + 1)])
    shares = (left[:-1] - left[1:]) / left[0]
    parts = tuple(KeptTerm(term, found.size_of(term, kept), share) for term, share in zip(terms, shares.tolist(), strict=True))
    worth = asked.worth_of(terms, ())
    steady = asked.worth_of([term for term in terms if not term.is_line], ())
    # what shakes a machine looks at first like what swings as it is shaken: the share of a line is that beside all other terms
    beside = [asked.left([term for term in terms if term is not line]) ** 2 for line in terms if line.is_line]
    strongest = max((float((without - left[-1]) / left[0]) for without in beside), default=0.0)
    of_power = asked.left(()), asked.left(terms), float(np.mean(judge.residual[judge.counted]))
    return Flexible(worth.gain, worth.standard_error, steady.gain, strongest, *of_power, parts)
