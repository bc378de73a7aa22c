"""The rivals of an experiment: effects at places, each of which could be what a machine has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Output
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.errors import LatheSimError, nearest
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.records import Candidate as Term
from lathesim.json_text import parsed_json
from lathesim.plugins import Registry

NOTHING = "nothing"
"""Name of the rival that leaves the machine as the lesson has it."""
NEXT_RUN = ", the next run"
"""What the title of a lesson ends with that a designed program came with."""


@dataclass(frozen=True)
class Rival:
    """One of the rivals: its name as ``Effect@part``, its term in the machine that holds all of them, and sizes it may have.

    ``sizes`` (draws, parameters) [SI]; without a term the rival is that nothing was left out.
    """

    name: str
    term: Term | None
    sizes: FloatArray

    @property
    def effect(self) -> str:
        """The name of its effect."""
        return self.name.partition("@")[0]


@dataclass(frozen=True)
class NamedRival:
    """A rival as it was asked for: effect, part, and what is known of its sizes (parameter -> low, high [SI])."""

    effect: str
    at: str
    known: dict[str, tuple[float, float]]


def named_between(text: str) -> list[NamedRival]:
    """Return the rivals of ``'Backlash@x_axis,PreslidingFriction@x_axis'``."""
    found = []
    for item in (piece.strip() for piece in text.split(",")):
        if not item:
            continue
        effect, _, at = item.partition("@")
        found.append(NamedRival(effect.strip(), at.strip(), {}))
    return found


def named_in_diagnosis(path: Path, title: str) -> list[NamedRival]:
    """Return the rivals that a diagnosis left: what it named and what is tied with it, else all that it lists.

    ``title`` is that of the lesson. Raises :class:`LatheSimError` where the file is no diagnosis, one of another lesson, or one that left
    nothing to tell.
    """
    try:
        told: Any = parsed_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LatheSimError(f"the diagnosis cannot be read: {error.strerror}.", place=str(path), remedy="Check the path.") from error
    except ValueError:
        told = None
    if not isinstance(told, dict) or not str(told.get("schema", "")).startswith("lathesim-diagnosis/"):
        raise LatheSimError("this is no diagnosis.", place=str(path), remedy="Give what 'lathesim diagnose --json FILE' wrote.")
    made_with = told.get("lesson")
    if isinstance(made_with, str) and made_with and made_with.removesuffix(NEXT_RUN) != title.removesuffix(NEXT_RUN):
        fact = f"this is a diagnosis of another lesson: '{made_with}', not '{title}'."
        raise LatheSimError(fact, place=str(path), remedy="Give the lesson that it was made with, or name the rivals with --between.")
    return named_in(told, str(path))


def named_in(told: dict[str, Any], place: str) -> list[NamedRival]:
    """Return the rivals of a diagnosis as JSON; raises :class:`LatheSimError` where it left nothing to tell."""
    effects = [item for item in told.get("effects") or [] if isinstance(item, dict) and item.get("effect")]
    found: list[NamedRival] = []
    for item in effects:
        at = str(item.get("at", ""))
        known = {
            name: (float(value["low"]), float(value["high"]))
            for name, value in (item.get("parameters") or {}).items()
            if isinstance(value, dict) and _number(value.get("low")) and _number(value.get("high"))
        }
        found.append(NamedRival(str(item["effect"]), at, known))
        found += [_tied(str(other), at) for other in item.get("tied_with") or []]
    unique = list({(item.effect, item.at): item for item in reversed(found)}.values())[::-1]
    if len(unique) < 2:
        verdict = told.get("verdict", "unknown")
        fact = f"the diagnosis ({verdict}) leaves no explanations to distinguish."
        raise LatheSimError(fact, place=place, remedy="Name rivals with --between 'Effect@part,Effect@part', or values with --for.")
    return unique


def _number(value: object) -> bool:
    return isinstance(value, (int, float)) and bool(np.isfinite(value))


def _tied(text: str, at: str) -> NamedRival:
    """Return a rival that is told as ``Effect`` (at the same place) or ``Effect at part``."""
    effect, _, other = text.replace(" at ", "@").partition("@")
    return NamedRival(effect.strip().partition(" ")[0], other.strip() or at, {})


def place_rivals(
    named: Sequence[NamedRival], assembly: Assembly, compared: Sequence[str], registry: Registry, draws: int, seed: int, place: str
) -> tuple[Assembly, list[Rival]]:
    """Return the machine with every rival in it, neutral, and the rivals with sizes drawn from what is known or usual.

    ``Effect@part`` may name the part that moves where the effect sits at a sensor of it. Raises :class:`LatheSimError` where a rival has no
    place, and where two are the same.
    """
    wanted = [item for item in named if item.effect != NOTHING]
    effects = {item.effect: registry.effect(item.effect) for item in wanted}
    holding, terms = insert_candidates(assembly, effects.values(), compared)  # type: ignore[arg-type]
    rivals: list[Rival] = []
    for number, item in enumerate(named):
        if item.effect == NOTHING:
            rivals.append(Rival(NOTHING, None, np.zeros((draws, 0))))
            continue
        if channel := _unread(item, effects[item.effect], terms, assembly, compared):
            fact = f"nothing that is recorded reads '{item.at}', so {item.effect} shows nowhere."
            raise LatheSimError(fact, place=place, remedy=f"Record {channel} too.")
        term = _term(item, terms, assembly, place)
        rivals.append(Rival(f"{item.effect}@{term.at}", term, _sizes(term, item.known, draws, seed + number)))
    names = [rival.name for rival in rivals]
    if len(set(names)) < len(names):
        double = next(name for name in names if names.count(name) > 1)
        raise LatheSimError(f"two rivals are the same: {double}.", place=place, remedy="Name another effect, or another part.")
    if len(rivals) < 2:
        raise LatheSimError("one rival alone needs no experiment.", place=place, remedy="Name two or more, or 'nothing' beside it.")
    return holding, rivals


def _unread(item: NamedRival, effect: Any, terms: Sequence[Term], assembly: Assembly, compared: Sequence[str]) -> str:
    """Return the channel that would have to be recorded for an effect to sit at a sensor; empty where it has a place, or none at all."""
    sensor = assembly.by_name.get(item.at)
    if sensor is None or any(
        item.at in (term.at, term.seat.of_motion, Place.of(term.at).part) for term in terms if term.name == item.effect
    ):
        return ""
    for output in sensor.component.declared(Output):
        channel = f"{sensor.name}.{output}"
        _, more = insert_candidates(assembly, [effect], [*compared, channel])
        if any(term.at == item.at for term in more):
            return channel
    return ""


def _term(item: NamedRival, terms: Sequence[Term], assembly: Assembly, place: str) -> Term:
    own = [term for term in terms if term.name == item.effect]
    if not own:
        fact = f"{item.effect} has no place in this machine."
        raise LatheSimError(fact, place=place, remedy="See 'lathesim effects NAME' for where it sits.")
    exact = [term for term in own if term.at == item.at]
    if exact:
        return exact[0]
    motion = [term for term in own if term.seat.of_motion == item.at or Place.of(term.at).part == item.at]
    if motion:
        return next((term for term in motion if term.seat.second), motion[0])
    if not item.at and len(own) == 1:
        return own[0]
    parts = sorted({term.seat.of_motion or term.at for term in own})
    known = {part.name for part in assembly.parts}
    fact = f"{item.effect} does not sit at '{item.at}'." if item.at else f"{item.effect} has several places."
    remedy = nearest(item.at, parts) if item.at and item.at not in known else f"It can sit at {', '.join(parts)}."
    raise LatheSimError(fact, place=place, remedy=remedy or f"It can sit at {', '.join(parts)}.")


def _sizes(term: Term, known: dict[str, tuple[float, float]], draws: int, seed: int) -> FloatArray:
    """Return sizes (draws, parameters) between what is known or usual, spread evenly, on a logarithmic scale above zero.

    Where an effect is made by several parameters, it has all of them in the first draw, and one of them in each further one: a machine
    may have one alone, and a program that tells it by another is none.
    """
    from scipy.stats import qmc

    count = len(term.parameters)
    if count == 0:
        return np.zeros((draws, 0))
    unit = qmc.Sobol(count, seed=seed).random(1 << max(0, (draws - 1).bit_length()))[:draws]
    rows = np.empty((draws, count))
    for column, name in enumerate(term.parameters):
        low, high = known.get(Place.of(name).port) or _range(term, column)
        low, high = max(low, float(term.low[column])), min(high, float(term.high[column]))
        rows[:, column] = low * (high / low) ** unit[:, column] if low > 0.0 else low + (high - low) * unit[:, column]
    made = [column for column, name in enumerate(term.parameters) if Place.of(name).port in term.effect.neutral]
    if len(made) > 1 and not known:
        for draw in range(1, draws):
            idle = [column for column in made if column != made[(draw - 1) % len(made)]]
            rows[draw, idle] = np.asarray(term.neutral)[idle]
    return rows


def _range(term: Term, column: int) -> tuple[float, float]:
    values = term.points[:, column] if len(term.points) else term.usual[[column]]
    return float(values.min()), float(values.max())
