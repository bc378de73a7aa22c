"""The smallest size of an effect that shows, as ``isolable`` predicts it from a sound recording, held against answers at other sizes.

The sound recording has the course of the one that judges the case, with loads and noise of another draw. At twice the predicted size a
diagnosis has to name the effect, and at half of it not: then the smallest size is within a factor of two. It is asked about this effect
alone: whether a search among all of them comes to it is another question.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from lathesim.diagnosis.isolation.visible import Shape, smallest_visible
from tests.diagnosis.asking import ask_case, keep, kept, truth_of
from tests.diagnosis.rigs.cases import Case, write_case, write_sound
from tests.diagnosis.rigs.predicted_ties import named_right, with_answer
from tests.diagnosis.scoring import effects_of, share

IN_PROPORTION = (
    "coulomb", "gravity", "converter_offset", "dead_zone", "cogging", "backlash", "pitch_wave", "presliding", "sag", "interpolation",
    "lead_error", "wind_up", "warm_up",
)  # fmt: skip
"""What may be hidden of any size, by itself. Lags and delays are left out: the smallest that a diagnosis takes for one is a share of a
sample, and shorter than a step of the simulator that makes the recordings."""
AWAY = 2.0
"""Factor by which the sizes that are asked about are larger and smaller than the predicted one."""


def predicted_size(folder: Path, sound: Path, named: dict[str, Any]) -> float:
    """Return the predicted smallest size of a named effect, as a share of the size that was answered; infinite where none shows."""
    looking, truth, values = with_answer(folder, sound, named)
    (found,) = smallest_visible(looking, [Shape(truth, values)])
    return found.factor


def asked(cases: Sequence[tuple[Case, Path]], name: str, limit: float) -> Iterator[tuple[str, float, bool, bool]]:
    """Yield for each case whose effect was named: what it hides, the predicted smallest size as a share of its own, and whether an answer
    names the effect at twice that size and at half of it."""
    answers = kept([folder for _, folder in cases], name)
    for case, folder in cases:
        truth = truth_of(folder)
        key = next(iter(truth["right"]), "")
        named = named_right(truth, answers[folder]) if folder in answers and len(truth["right"]) == 1 else None
        if named is None or key not in IN_PROPORTION or case.keys != (key,):
            continue
        size = predicted_size(folder, write_sound(case, folder.parent / "sizes" / f"{case.name}.csv"), named)
        if math.isinf(size):
            continue
        found = []
        for factor in (AWAY * size, size / AWAY):
            place = folder.parent / "sizes" / f"{factor:.3g}"
            (written,) = (one for one in write_case(case, place, factor) if one.name == folder.name)
            answer = ask_case(written, limit=limit, more=("--effect", named["effect"]))
            keep(written / "told.json", answer)
            found.append(named["effect"] in [one["effect"] for one in effects_of(answer.told)])
        yield f"{folder.name} {key}", size, found[0], found[1]


def line(case: str, size: float, larger: bool, smaller: bool) -> str:
    """Return a case in a line."""
    said = ["named" if one else "not named" for one in (larger, smaller)]
    return f"{case}: predicted {size:.3g} of what was hidden; twice that {said[0]}, half of it {said[1]}"


def table(found: Sequence[tuple[str, float, bool, bool]]) -> list[str]:
    """Return how often the predicted size was right within a factor."""
    return [
        f"Named at {AWAY:g} times the predicted size: {share([one[2] for one in found])}.",
        f"Not named at 1/{AWAY:g} of it: {share([not one[3] for one in found])}.",
        f"Both: {share([one[2] and not one[3] for one in found])}.",
    ]
