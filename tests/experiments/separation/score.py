"""Whether a diagnosis is right about a case: the verdict held against the seal, by what is named and by the equation that it makes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tests.experiments.separation.names import NAMES
from tests.experiments.separation.ties import Tie, terms


def is_named_alone(told: dict[str, Any], tie: Tie) -> bool:
    """Return whether a diagnosis names the true rival, alone and in no tie."""
    others = {NAMES[key].effect for key in tie.rivals} - {NAMES[tie.rivals[tie.truth]].effect}
    right = {name for name in NAMES[tie.rivals[tie.truth]].right if name not in others}
    named = [item["effect"] for item in told.get("effects") or []]
    mean = NAMES[tie.rivals[tie.truth]].mean
    return told.get("verdict") == "named" and bool(named) and named[0] in right and all(name in right or name == mean for name in named)


def is_right(told: dict[str, Any], tie: Tie) -> bool:
    """Return whether a diagnosis tells the rivals apart: of what it names, or leaves tied, the true one is the only rival.

    Several effects that are named together make one equation. If it is that of a rival, that rival is what was named, whatever its parts
    are called. A tie with something that was no rival does not count against a verdict.
    """
    if told.get("verdict") not in ("named", "tied"):
        return False
    effects = told.get("effects") or []
    truth = tie.rivals[tie.truth]
    same = [key for key in tie.rivals if len(effects) > 1 and _is_together(key, effects)]
    if same:
        return same == [truth]
    left = {item for effect in effects for item in _with_ties(effect)}
    others = [key for key in tie.rivals if key != truth and NAMES[key].effect != NAMES[truth].mean]
    return _stands(truth, left, _right_alone(truth)) and not any(_stands(key, left, (NAMES[key].effect,)) for key in others)


def _is_together(key: str, effects: Sequence[dict[str, Any]]) -> bool:
    """Return whether all effects of a verdict sit at the place of a rival and make its equation together, not one of them alone."""
    own = terms([NAMES[key].effect])
    here = all(_stands(key, {(item["effect"], item["at"])}, (item["effect"],)) for item in effects)
    return here and terms(item["effect"] for item in effects) == own and all(terms([item["effect"]]) != own for item in effects)


def _right_alone(key: str) -> tuple[str, ...]:
    """Return the names that are right for a rival by themselves: an effect that is a part of its equation only is not."""
    own = terms([NAMES[key].effect])
    return tuple(name for name in NAMES[key].right if not terms([name]) < own)


def _with_ties(effect: dict[str, Any]) -> list[tuple[str, str]]:
    """Return an effect with those it is tied with as (effect, place)."""
    found = [(str(effect["effect"]), str(effect["at"]))]
    for text in effect.get("tied_with") or []:
        name, _, place = str(text).partition(" at ")
        found.append((name, place or found[0][1]))
    return found


def _stands(key: str, left: set[tuple[str, str]], names: Sequence[str]) -> bool:
    """Return whether a rival is among what is left, at its place; what sits at a motion may be told at a sensor of it and the other way."""
    own = NAMES[key].at
    return any(name in names and (place.partition(".")[0] == own or _sensor(own) != _sensor(place)) for name, place in left)


def _sensor(place: str) -> bool:
    return any(word in place for word in ("encoder", "scale", "tachometer"))
