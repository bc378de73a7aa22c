"""Training: several starts, all told, and the best one judged beside no regulator at all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.training.methods import Method, Trained
from lathesim.compensation.training.question import Question
from lathesim.engine.assembly import FloatArray
from lathesim.errors import SimulationError

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Training:
    """All starts, the best of them, and its score in each situation with the lesson's own steps beside that of the zero regulator."""

    starts: tuple[Trained, ...]
    best: Trained
    scores: dict[str, float]
    zero: dict[str, float]
    table: FloatArray


def train(
    question: Question,
    method: Method,
    *,
    starts: int,
    rounds: int | None,
    seed: int,
    judged: Question | None = None,
    tell: Tell = lambda text: None,
) -> Training:
    """Search from several starts and return all of them with the best, judged in the situations of ``judged``, else in its own.

    Raises :class:`SimulationError` where every start diverges.
    """
    rng = np.random.default_rng([seed, 3])
    wanted = rounds or method.rounds
    ended = []
    for number in range(starts):

        def told(turn: int, score: float, number: int = number) -> None:
            tell(f"start {number + 1} of {starts}, round {turn} of {wanted}: score {score:.4g}")

        ended.append(method.search(question, question.shape.start(rng), wanted, told))
    finite = [item for item in ended if not item.diverged]
    if not finite:
        raise SimulationError(
            f"the training diverges from all {starts} starts.", remedy="Lower the regulator's gain, or start anew with another --seed."
        )
    best = min(finite, key=lambda item: item.score)
    judging = judged or question
    exact = judging.scores([best.vector, np.zeros_like(best.vector)], exact=True)
    scores = dict(zip(judging.situations, map(float, exact[0]), strict=True))
    zero = dict(zip(judging.situations, map(float, exact[1]), strict=True))
    return Training(tuple(ended), best, scores, zero, question.shape.table(best.vector))
