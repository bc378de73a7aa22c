"""Cuts drawn within what a lesson calls uncertain: the band of limits that they give, and the belief before the first cut."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lathesim.errors import LessonError, nearest
from lathesim.json_text import parsed_json
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_of
from lathesim.record import FloatArray
from lathesim.stability.belief import Prior
from lathesim.stability.frequency_limit import between_lines, widths_of_lines
from lathesim.stability.lesson_settings import Cut, cut_of, with_modes
from lathesim.stability.stability_thresholds import MAP
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint
from lathesim.units import in_unit, split_quantity

PREFIX = "tool_point."
CLOSE = 0.03
"""Share within which the edges of two independent bands agree at every speed before they are taken."""
_FEWEST, _MOST = 256, 4096
"""Draws of each of the two, at first and at most."""
_STRATA = 32
"""Draws of a factor that scales the limit for each draw of all else, one in each part of its distribution."""
_QUANTILES = (0.025, 0.5, 0.975)
_TINY = 2.0**-32
"""Least share of the draws, below the resolution of the sequence: an edge of the cube has no normal number."""
OF_THE_CUT = ("cutting_stiffness", "process_damping")
OF_A_MODE = ("frequency", "damping", "stiffness")
_UNITS = {"cutting_stiffness": "Pa", "process_damping": "N/m", "frequency": "Hz", "damping": "1", "stiffness": "N/m"}


@dataclass(frozen=True)
class Spread:
    """Relative standard deviation of a quantity of the cut, or of a mode counted from 1; 0 stands for all modes."""

    name: str
    mode: int
    deviation: float


@dataclass(frozen=True)
class LimitBand:
    """The 2.5, 50 and 97.5 % quantiles of the limit [m], (3, speeds), the number of draws behind them, and by how much the edges of their
    two independent halves differ at most, as a share."""

    edges: FloatArray
    draws: int
    apart: float


def spreads_of(lesson: Lesson, cut: Cut) -> tuple[Spread, ...]:
    """Return what the lesson calls uncertain of its tool point; names as ``tool_point.cutting_stiffness`` or ``tool_point.damping_2``."""
    found = []
    for name, text in lesson.settings.uncertain.items():
        if not name.startswith(PREFIX):
            continue
        place = lesson.source.place(("uncertain", name))
        item = name.removeprefix(PREFIX)
        word, _, number = item.rpartition("_")
        mode = int(number) if number.isdigit() and word in OF_A_MODE else 0
        item = word if mode else item
        if item not in (*OF_THE_CUT, *OF_A_MODE):
            known = (*OF_THE_CUT, *OF_A_MODE)
            raise LessonError(f"the tool point has no '{item}'.", place=place, remedy=nearest(item, known) or f"It has {', '.join(known)}.")
        found.append(Spread(item, mode, _deviation(cut, item, mode, text, place)))
    return tuple(found)


def _deviation(cut: Cut, item: str, mode: int, text: str, place: str) -> float:
    if split_quantity(text)[1] == "%":
        share = si_of(text, "1", place)
    else:
        modes = cut.tool.modes if isinstance(cut.tool, ToolPoint) else ()
        if item in OF_A_MODE and not (modes and mode <= len(modes)):
            raise LessonError(f"there is no mode {mode} whose {item} it could be.", place=place, remedy="Give the deviation in percent.")
        middle = (
            getattr(modes[max(mode, 1) - 1], item) if item in OF_A_MODE else {OF_THE_CUT[0]: cut.stiffness}.get(item, cut.process_damping)
        )
        share = si_of(text, _UNITS[item], place) / middle if middle else 0.0
    if not 0.0 <= share < MAP.widest:
        raise LessonError(f"an uncertainty of {in_unit(share, '%', 'g')} makes no sense.", place=place, remedy="Give one from 0 to 300 %.")
    return share


def with_factors(cut: Cut, factors: Mapping[tuple[str, int], float]) -> Cut:
    """Return a cut with quantities multiplied: (name, mode counted from 1, or 0 for all) -> factor."""

    def factor(name: str, mode: int = 0) -> float:
        return factors.get((name, 0), 1.0) * (factors.get((name, mode), 1.0) if mode else 1.0)

    tool = cut.tool
    if isinstance(tool, ToolPoint):
        modes = [
            replace(
                mode,
                frequency=mode.frequency * factor("frequency", number),
                damping=min(mode.damping * factor("damping", number), 0.99),
                stiffness=mode.stiffness * factor("stiffness", number),
            )
            for number, mode in enumerate(tool.modes, 1)
        ]
        tool = ToolPoint(tuple(modes), tool.factors)
    else:
        values = tool.receptance_values / factor("stiffness")
        tool = replace(tool, frequency=tool.frequency * factor("frequency"), receptance_values=values)
    return replace(
        cut,
        tool=tool,
        stiffness=cut.stiffness * factor("cutting_stiffness"),
        process_damping=cut.process_damping * factor("process_damping"),
    )


def band(cut: Cut, spreads: Sequence[Spread], speeds: Sequence[float], seed: int = 1) -> LimitBand:
    """Return the quantiles of the limit at each rising speed [rpm], of uninterrupted turning.

    What is uncertain is drawn log-normally by two scrambled Sobol sequences, which are doubled until their edges agree. Source: A. B. Owen,
    Monte Carlo variance of scrambled net quadrature, SIAM J. Numer. Anal. 34 (1997); errors from independent scramblings.
    """
    from scipy.special import ndtri
    from scipy.stats import qmc

    asked, measured = np.asarray(speeds, dtype=np.float64), cut.tool
    if isinstance(measured, FrequencyResponse):
        lines, values = between_lines(measured.frequency, measured.receptance_values)
        cut = replace(cut, tool=replace(measured, frequency=lines, receptance_values=values, coherence=None, hits=None, forces=None))
    scaling = [spread for spread in spreads if _scales(spread, cut)]
    others = [spread for spread in spreads if spread.deviation > 0.0 and spread not in scaling]
    scale, sigma = math.hypot(*(_sigma(spread) for spread in scaling)), np.array([_sigma(spread) for spread in others])
    if not others:
        return LimitBand(_widths(cut, asked) * np.exp(scale * ndtri(_QUANTILES))[:, None], 1, 0.0)
    streams = [qmc.Sobol(len(others) + 1, seed=2 * seed + half) for half in range(2)]
    rows: list[list[FloatArray]] = [[], []]
    scales: list[list[FloatArray]] = [[], []]
    count = _FEWEST
    while True:
        for stream, found, factors in zip(streams, rows, scales, strict=True):
            for point in np.clip(stream.random(count - len(found)), _TINY, 1.0 - _TINY):
                drawn = np.exp(sigma * ndtri(point[1:]))
                given = {(spread.name, spread.mode): float(factor) for spread, factor in zip(others, drawn, strict=True)}
                found.append(_widths(with_factors(cut, given), asked))
                factors.append(np.exp(scale * ndtri((np.arange(_STRATA) + point[0]) / _STRATA)) if scale else np.ones(1))
        apart = _apart(*(_edges(found, factors) for found, factors in zip(rows, scales, strict=True)))
        if apart <= CLOSE or 2 * count > _MOST:
            return LimitBand(_edges([*rows[0], *rows[1]], [*scales[0], *scales[1]]), 2 * count, apart)
        count *= 2


def _sigma(spread: Spread) -> float:
    """Return the standard deviation of the logarithm of what is drawn."""
    return math.sqrt(math.log1p(spread.deviation**2))


def _scales(spread: Spread, cut: Cut) -> bool:
    """Whether the limit is in proportion, or in inverse proportion, to a quantity: it then needs no limit of its own for each draw."""
    return spread.mode == 0 and (spread.name == "stiffness" or (spread.name == "cutting_stiffness" and cut.process_damping == 0.0))


def _edges(rows: Sequence[FloatArray], scales: Sequence[FloatArray]) -> FloatArray:
    """Return the quantiles of limits (draws, speeds) with each of their scales; each is one of them, as some may be infinite."""
    limits, factors = np.stack(rows), np.stack(scales)[:, :, None]
    each = [
        np.quantile((limits[:, None, place : place + 1] * factors).reshape(-1), _QUANTILES, method="inverted_cdf")
        for place in range(limits.shape[1])
    ]
    return np.stack(each, axis=1)


def _apart(first: FloatArray, second: FloatArray) -> float:
    """Return by how much the edges of two bands differ at most, as a share; infinite where one has no end and the other has."""
    ends = [edges[[0, 2]] for edges in (first, second)]
    same = ends[0] == ends[1]
    low = np.where(same, 1.0, np.minimum(*ends))
    return float(np.max(np.where(same, 1.0, np.maximum(*ends)) / low)) - 1.0


def _widths(cut: Cut, speeds: FloatArray) -> FloatArray:
    """Return the limits [m] of a cut at speeds [rpm]."""
    drag = cut.process_damping * 60.0 / (math.pi * cut.diameter)
    tool = cut.tool
    if isinstance(tool, FrequencyResponse):
        inside = (tool.frequency > 0.0) & (tool.receptance_values != 0.0)
        lines, response = tool.frequency[inside], tool.receptance_values[inside]
        return widths_of_lines(lines, cut.factor * response, math.cos(cut.direction) ** 2 * response, cut.stiffness, drag, speeds)
    lines = _frequency_lines(tool)
    return widths_of_lines(lines, tool.receptance(lines), tool.normal_receptance(lines), cut.stiffness, drag, speeds)


def _frequency_lines(tool: ToolPoint) -> FloatArray:
    """Return frequencies [Hz], close near modes: limits are right within 0.3 %, and 1.5 % where process damping rules."""
    highest = 3.0 * max(mode.frequency for mode in tool.modes)
    parts = [np.linspace(highest / 200.0, highest, 200)]
    reach = np.sinh(np.linspace(-5.0, 5.0, 160)) / math.sinh(5.0)
    for mode in tool.modes:
        parts.append(mode.frequency * (1.0 + np.clip(reach * max(30.0 * mode.damping, 0.05), -0.95, 2.0)))
    return np.unique(np.concatenate(parts))


_OF_AN_OVERHANG = 0.02
_LEAST = 1e-4
"""Relative standard deviation of what is not called uncertain."""


@dataclass(frozen=True)
class LessonPrior:
    """The prior with the cutting stiffness [Pa] by which limits become stiffness, and sentences worth telling."""

    prior: Prior
    told: tuple[str, ...] = ()


def lesson_prior(lesson: Lesson, *, needs_uncertain: bool = True) -> LessonPrior:
    """Return the prior of a lesson's map; :class:`LessonError` where nothing is uncertain or the cut is none that cuts can teach."""
    cut = cut_of(lesson)
    spreads = spreads_of(lesson, cut)
    place = str(lesson.path)
    if needs_uncertain and not any(spread.deviation > 0.0 for spread in spreads):
        remedy = "Add for example  uncertain: {tool_point.damping: 30 %, tool_point.stiffness: 20 %}."
        raise LessonError("nothing of the tool point is uncertain, so cuts teach nothing.", place=place, remedy=remedy)
    if cut.milling is not None or cut.share < 1.0 or cut.process_damping > 0.0:
        word = "milling" if cut.milling is not None else "interrupted cuts" if cut.share < 1.0 else "process damping"
        raise LessonError(
            f"the map learns uninterrupted turning, and the lesson has {word}.", place=place, remedy="Leave it out for the map."
        )
    tool, told = with_modes(cut)
    lowest = [abs(min(0.0, float(np.min(_real(tool.factors[at], mode))))) for at, mode in enumerate(tool.modes)]
    first = int(np.argmax(lowest))
    mode, factor = tool.modes[first], tool.factors[first]
    if factor <= 0.0:
        raise LessonError(
            "the force on the mode that limits the cut has the wrong sign.", place=place, remedy="Check the directions and the force angle."
        )
    sentences = [told] if told else []
    if len([value for value in lowest if value > MAP.counts * lowest[first]]) > 1:
        sentences.append(f"The map learns the mode at {mode.frequency:.1f} Hz alone, which limits the cut most.")
    deviation = dict.fromkeys(("frequency", "damping", "stiffness", "cutting_stiffness"), 0.0)
    for spread in spreads:
        if spread.mode in (0, first + 1) and spread.name in deviation:
            deviation[spread.name] = math.hypot(deviation[spread.name], math.sqrt(math.log1p(spread.deviation**2)))
    mean = np.array([math.log(mode.frequency), math.log(max(mode.damping, 1e-4)), math.log(mode.stiffness / (cut.stiffness * factor))])
    spread_of_three = np.array(
        [deviation["frequency"], deviation["damping"], math.hypot(deviation["stiffness"], deviation["cutting_stiffness"])]
    )
    return LessonPrior(Prior(mean, np.maximum(spread_of_three, _LEAST)), tuple(sentences))


def carried_over(known: LessonPrior, path: Path) -> LessonPrior:
    """Return a prior that begins where the cuts at another overhang ended; ``path`` is what ``lathesim cuts --json`` wrote there.

    What the cuts corrected there of frequency, damping and stiffness is corrected here as well, relative to what each lesson gives. How the
    parameters went together is left out, and 2 % are added for what an overhang changes beyond its model.
    """
    names = ("frequency", "damping", "stiffness_over_cutting_stiffness")
    try:
        told = parsed_json(path.read_text(encoding="utf-8"))
        rows = [told["parameters"][name] for name in names]
        given = np.array([float(told["given"][name]) for name in names])
        value, low, high = (np.array([float(row[word]) for row in rows]) for word in ("value", "low", "high"))
    except FileNotFoundError:
        raise LessonError("there is no such file.", place=str(path), remedy="Write it with 'lathesim cuts ... --json'.") from None
    except (ValueError, KeyError, TypeError):
        raise LessonError("the file holds no learned map.", place=str(path), remedy="Write it with 'lathesim cuts ... --json'.") from None
    deviation = np.hypot(np.log(high / low) / (2.0 * 1.959964), _OF_AN_OVERHANG)
    prior = Prior(known.prior.mean + np.log(value / given), np.asarray(deviation))
    return replace(known, prior=prior, told=(*known.told, f"The map begins where the cuts of {path.name} ended."))


def _real(factor: float, mode: Mode) -> FloatArray:
    return np.asarray(ToolPoint((mode,), (factor,)).receptance(np.linspace(0.5, 2.0, 400) * mode.frequency).real)
