"""``design_experiment``: a lesson and rivals to the part program whose run tells them apart, or to why none can."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.candidate_programs import Laid, lay_those_that_fit, walking_time
from lathesim.experiments.discrimination import NESTED, Ablation, ProgramWorth, refitted_worth, worths
from lathesim.experiments.families import CandidateProgram, candidates, turned_candidates
from lathesim.experiments.replica import NOBODY, Listener, Search
from lathesim.experiments.rivals import NamedRival, place_rivals
from lathesim.experiments.room import Room, room_of
from lathesim.experiments.scene import Scene, with_sizes_in_reach
from lathesim.identification.replay.loading import uncertainties
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry
from lathesim.whole_file import make_folder, write_text

_CANDIDATES = 100
_BATCH = 25
"""Programs of one batch, so that progress is told and Ctrl-C heard."""
_SPARE = 10
"""Programs in reserve for those that the reading of a program refuses."""
_LOOKED_AT = 8
"""Programs, each family first, in which no rival may drive the machine to a limit; assumed."""
_OF_TURNED = 2
"""Programs of cut and spindle for each one that is wanted: half of them do not move what is recorded."""
_STEPPED = 2
"""Programs on which coarser steps of the integration are held against the lesson's own; assumed."""
_SIFTED = 3
"""One of so many programs goes on from the first draw of the sizes to all of them; assumed."""
_FINALISTS = 6
_REFITS = 8
"""Rounds of the refit on the best programs, at most."""


@dataclass(frozen=True)
class DesignWish:
    """What is asked of a design: how long a run may last [s], how many programs are tried, over how many draws, and what is left out.

    ``rate`` [Hz] is how often a recording with --for takes a row; 0: as the lesson says, else each sample.
    """

    at_most: float = 30.0
    candidates: int = _CANDIDATES
    draws: int = 3
    seed: int = 1
    conditions: Ablation = field(default_factory=Ablation)
    rate: float = 0.0
    criterion: str = "D"
    """By which a program for values is judged, with --for: D, A, E or V."""
    arcs: bool = True
    """Whether circles are among the programs, where two axes are free."""
    exchanges: int = 40
    """Rounds in which strokes of the best program are exchanged, with --for."""


@dataclass(frozen=True, eq=False)
class Designed:
    """The best program with what it is worth, the others it was chosen from, and what each channel tells of each pair.

    ``by_channel`` (pairs, channels) holds the share of T that each channel brings, ``traces`` (rivals, channels, times) what is read.
    """

    lesson: Lesson
    scene: Scene
    program: Laid
    worth: ProgramWorth
    search: Search
    floors: FloatArray
    pairs: tuple[tuple[str, str, float], ...]
    by_channel: FloatArray
    traces: FloatArray
    others: tuple[tuple[Laid, ProgramWorth], ...] = ()
    """The next best programs, to be taken where a trial of this one goes wrong."""

    @property
    def decidable(self) -> bool:
        """Whether the run could tell each pair; how likely it does, the chance says."""
        return min(far for _, _, far in self.pairs) >= NESTED


def design_experiment(
    lesson: Lesson, named: Sequence[NamedRival], registry: Registry, wish: DesignWish, variant: str | None = None, place: str = "--between",
    listener: Listener = NOBODY,
) -> Designed:  # fmt: skip
    """Return the program whose run is expected to tell the rivals apart best per second.

    Raises :class:`LatheSimError` where the lesson maps no recording, moves no axis, or a rival has no place.
    """
    began, say, stop = clock.perf_counter(), listener.say, listener.stop
    prepared = prepare(lesson, registry, variant)
    mapping = mapping_of(lesson, prepared.machinery)
    channels = mapping.targets("compare")
    room = room_of(prepared)
    assembly, rivals = place_rivals(named, prepared.machinery, channels, registry, wish.draws, wish.seed, place)
    resolution = {signal.target: signal.resolution for signal in mapping.signals if signal.resolution}
    uncertain = uncertainties(lesson, prepared.plan) if lesson.settings.uncertain else {}
    laid = lay_those_that_fit(_programs(room, wish), room, wish.at_most)
    rivals = with_sizes_in_reach(assembly, rivals, laid[:_LOOKED_AT], f"{room.interpolator.name}.path")
    scene = Scene(assembly, rivals, channels, uncertain, room, resolution, 1.1 * wish.at_most + 1.0, stop)
    floors = np.max([scene.floors(program) for program in laid[:_LOOKED_AT]], axis=0)
    laid = (scene.those_that_move(laid, floors) or laid)[: wish.candidates]
    say(f"{len(rivals)} rivals: {', '.join(rival.name for rival in rivals)}. Trying {len(laid)} programs ...")
    scene.step_as_coarsely_as_may_be(laid[:_STEPPED], floors, NESTED)
    judged: list[tuple[Laid, ProgramWorth]] = []
    tried, stopped = judged, False
    try:
        for first in range(0, len(laid), _BATCH):
            some = laid[first : first + _BATCH]
            judged += zip(some, worths(scene, some, floors, 1, wish.conditions), strict=True)
            say(f"  {len(judged)} of {len(laid)} programs; the best decides with a chance of {max(item.chance for _, item in judged):.2f}")
        best = sorted(judged, key=lambda pair: -_score(pair[1], wish.conditions))[: max(_FINALISTS, len(judged) // _SIFTED)]
        some = [program for program, _ in best]
        tried, judged = judged, list(zip(some, worths(scene, some, floors, wish.draws, wish.conditions), strict=True))
        say("Refitting the rivals to each other on the best programs ...")
        final = _finals(scene, judged, floors, wish)
    except KeyboardInterrupt:
        if not judged:
            raise
        if stop is not None:
            stop.clear()
        stopped, final = True, judged
    ranked = sorted(final, key=lambda pair: -_score(pair[1], wish.conditions))
    program, worth = ranked[0]
    pairs, by_channel, traces = _told_by(scene, program, worth, floors)
    told = tuple((item.candidate.title, item.seconds, value.chance) for item, value in tried)
    search = Search(scene.runs, clock.perf_counter() - began, stopped, told)
    return Designed(lesson, scene, program, worth, search, floors, pairs, by_channel, traces, tuple(ranked[1:]) if not stopped else ())


def _finals(
    scene: Scene, judged: Sequence[tuple[Laid, ProgramWorth]], floors: FloatArray, wish: DesignWish
) -> list[tuple[Laid, ProgramWorth]]:
    """Return the programs that were best after each refit, the last of them the best: a refit only takes from what a program is worth, so
    the rest is not followed once it cannot be better."""
    found: list[tuple[Laid, ProgramWorth]] = []
    best = -np.inf
    for program, slopes in sorted(judged, key=lambda pair: -_score(pair[1], wish.conditions))[:_FINALISTS]:
        if _score(slopes, wish.conditions) <= best:
            break
        limit = best
        worth = refitted_worth(
            scene,
            program,
            floors,
            wish.draws,
            wish.conditions,
            _REFITS,
            lambda item: _score(item, wish.conditions) > limit,  # noqa: B023
        )
        if worth is not None:
            found.append((program, worth))
            best = _score(worth, wish.conditions)
    return found


def _programs(room: Room, wish: DesignWish) -> list[CandidateProgram]:
    """Return the programs to be tried: those of the axes, and where the lesson turns something those of cut and spindle by turns."""
    walking, count = walking_time(wish.at_most), wish.candidates + _SPARE
    moved = candidates(room, walking, count, wish.seed, arcs=wish.arcs)
    turned = turned_candidates(room, walking, _OF_TURNED * count, np.random.default_rng([wish.seed, 11]))
    return [item for pair in zip_longest(turned, moved) for item in pair if item is not None] if turned else moved


def write_design(lesson: Lesson, room: Room, seconds: float, program: str, folder: Path, further: Mapping[str, Any] | None = None) -> Path:
    """Write program.nc, of so many seconds, and lesson.yaml, which runs it and maps a recording as a lesson does; return its place.

    ``further`` are keys of the lesson beside what is changed.
    """
    make_folder(folder)
    file = folder / "program.nc"
    changed: dict[str, Any] = {"program": str(file.resolve()), "variants": {}, "try": [], "goals": [], **(further or {})}
    write_text(file, program)
    if room.needs_duration:
        changed["duration"] = f"{np.ceil(10.0 * seconds) / 10.0:.1f} s"
    place = folder / "lesson.yaml"
    write_text(place, changed_lesson(lesson, [], {}, folder, further=changed))
    return place


def with_program(found: Designed, program: Laid, worth: ProgramWorth) -> Designed:
    """Return the design with another of its programs."""
    pairs, by_channel, traces = _told_by(found.scene, program, worth, found.floors)
    return replace(found, program=program, worth=worth, pairs=pairs, by_channel=by_channel, traces=traces, others=())


def _score(worth: ProgramWorth, conditions: Ablation) -> float:
    # where nothing decides, the rivals that stay furthest apart still tell most
    far = float(np.log1p(worth.apart[worth.apart > 0.0].min())) if (worth.apart > 0.0).any() else 0.0
    return (worth.score if conditions.price else worth.chance) + 1e-3 * far


def _told_by(
    scene: Scene, program: Laid, worth: ProgramWorth, floors: FloatArray
) -> tuple[tuple[tuple[str, str, float], ...], FloatArray, FloatArray]:
    """Return T of each pair (the smaller way round, median over draws), the share of each channel, and what each rival reads."""
    rows = np.array([scene.values(rival, rival.sizes[len(rival.sizes) // 2]) for rival in scene.rivals])
    traces = scene.readings([program], [rows])[0]
    levels = scene.in_noise_levels(traces, program, floors)
    pairs, shares = [], []
    for a in range(len(scene.rivals)):
        for b in range(a + 1, len(scene.rivals)):
            far = float(np.median(np.minimum(worth.apart[a, b], worth.apart[b, a])))
            pairs.append((scene.rivals[a].name, scene.rivals[b].name, far))
            sums = np.square(levels[a] - levels[b]).sum(axis=1)
            shares.append(sums / max(float(sums.sum()), 1e-300))
    return tuple(pairs), np.array(shares), traces
