"""A draw: a machine drawn at random, what it hides, and what the program answered."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from scipy.stats import norm

from tests.diagnosis.scoring import SOUND, are_found, effects_of

LEVEL = 0.95
"""Probability of the intervals that the program gives."""


@dataclass(frozen=True)
class Draw:
    """One machine and its answer.

    ``hidden`` holds for each effect the names that are right for it; ``sizes`` the true values by ``part.parameter`` of the lesson and
    ``Effect.parameter`` of what is hidden. ``told`` is the answer of the program without its prose; ``seconds`` processor time.
    """

    source: str
    name: str
    kind: str
    hidden: tuple[tuple[str, ...], ...]
    sizes: Mapping[str, float]
    told: Mapping[str, Any]
    seconds: float
    beside: tuple[str, ...] = ()
    """Effects that belong to what is hidden, and may be named too: the friction on which a peak at low speed stands."""


@dataclass(frozen=True)
class Interval:
    """A true value beside the interval that was given for it."""

    truth: float
    value: float
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Return whether the interval holds the truth."""
        return self.low <= self.truth <= self.high

    @property
    def rank(self) -> float:
        """Return the share of the posterior that lies below the truth, for a normal one of that interval (Talts et al. 2018, eq. 1)."""
        side = self.high - self.value if self.truth > self.value else self.value - self.low
        return float(norm.cdf((self.truth - self.value) / side * norm.ppf(0.5 + 0.5 * LEVEL))) if side > 0.0 else 0.5


def shortened(answer: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a gate needs of an answer of ``diagnose``."""
    effects = [
        {"effect": one["effect"], "at": one["at"], "tied_with": list(one.get("tied_with") or []), "parameters": _values(one["parameters"])}
        for one in answer.get("effects") or []
    ]
    baseline = {name: {**one, "value": one.get("refit_with")} for name, one in (answer.get("baseline") or {}).items()}
    return {"verdict": answer.get("verdict", ""), "adequate": answer.get("adequate"), "effects": effects, "baseline": _values(baseline)}


def _values(parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, list[Any]]:
    return {name: [one.get("value"), one.get("low"), one.get("high")] for name, one in parameters.items()}


def intervals(draw: Draw) -> Iterator[Interval]:
    """Yield the intervals of a draw whose truth is known: values of the lesson, and sizes of hidden effects that are named.

    Values count only where the answer is right: a value beside a wrong effect answers another question.
    """
    if not is_right(draw):
        return
    told = [draw.told["baseline"]]
    told += [{f"{one['effect']}.{name}": value for name, value in one["parameters"].items()} for one in draw.told["effects"]]
    for given in told:
        for name, (value, low, high) in given.items():
            if name in draw.sizes and None not in (value, low, high):
                # a wave of negative amplitude is one of positive amplitude half a turn on
                turned = name.endswith(".amplitude") and value < 0.0
                yield Interval(draw.sizes[name], *((-value, -high, -low) if turned else (value, low, high)))


def tied_set(draw: Draw) -> tuple[str, ...]:
    """Return the names that an answer leaves open for its first effect but what may stand beside it; one that names none leaves none."""
    effects = [one for one in effects_of(draw.told) if one["effect"] not in draw.beside]
    if not effects:
        return ()
    first = effects[0]
    return tuple(dict.fromkeys([first["effect"], *(tie.partition(" at ")[0] for tie in first["tied_with"])]))


def is_right(draw: Draw) -> bool:
    """Return whether an answer names exactly what is hidden; for a sound machine, that it names nothing and doubts nothing."""
    if not draw.hidden:
        return draw.told["verdict"] in SOUND
    return are_found(effects_of(draw.told), draw.hidden, draw.beside, tied=False)


def read(file: Path) -> list[Draw]:
    """Return the draws of a file, one a line."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    draws = [json.loads(line) for line in lines]
    sets = [{"hidden": tuple(tuple(names) for names in one["hidden"]), "beside": tuple(one.get("beside", ()))} for one in draws]
    return [Draw(**{**one, **own}) for one, own in zip(draws, sets, strict=True)]


def append(file: Path, draws: Iterable[Draw]) -> None:
    """Add draws to a file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a", encoding="utf-8") as text:
        for draw in draws:
            print(json.dumps(asdict(draw)), file=text, flush=True)
