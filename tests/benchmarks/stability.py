"""The figures of ``lathesim bench --stability``, as ratios in one run: collocation against semi-discretization, lobes of a measured
response against reading its file, and the time of the next cut."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.cli.speed.bench_rows import Tell, measured_on_line
from lathesim.cli.writing import CommandResult
from tests.benchmarks.held import Held, clock, held_result

CHEAPER, READING, NEXT = 20.0, 3.0, 2.0
"""Bars: how many times cheaper collocation is at least; lobes over reading the file at most; seconds of the next cut at most."""
_ERROR = 1e-4
_COLLOCATION = (8, 10, 12, 14, 16, 18, 20, 24, 28, 34, 40, 50)
_STEPS = (20, 30, 40, 60, 80, 120, 160, 240, 320, 480, 640, 960)
_POINTS = (
    (500.0, 0.8),
    (700.0, 1.1),
    (1000.0, 0.9),
    (1400.0, 1.2),
    (2000.0, 0.8),
    (2600.0, 1.3),
    (3300.0, 1.0),
    (4200.0, 1.1),
    (5200.0, 0.9),
    (7500.0, 1.2),
)
"""Speeds [rpm] and widths over the limit of 1 mm, spread over a map of 60 x 40 points."""


@dataclass(frozen=True)
class StabilityFigure(Held):
    """A figure with its bar and whether it is kept."""

    name: str
    value: float
    bar: float
    is_at_least: bool


def measured(quick: bool, save: Path | None, tell: Tell) -> tuple[CommandResult, list[str]]:
    """Measure stability maps."""
    figures = stability_figures(tell)
    return held_result("lathesim-bench-stability/1", figures, _lines(figures))


def _lines(figures: Sequence[StabilityFigure]) -> Iterator[str]:
    for figure in figures:
        word = "least" if figure.is_at_least else "most"
        yield f"{figure.name}: {figure.value:.3g} (at {word} {figure.bar:g}: {figure.sign})"
    yield f"\n{measured_on_line()}"


def stability_figures(tell: Tell) -> list[StabilityFigure]:
    """Return the figures, measured here and now."""
    tell("measuring collocation against semi-discretization ...")
    cheaper = _cheaper()
    tell("measuring lobes of a measured response ...")
    reading = _reading()
    tell("measuring the next cut ...")
    return [
        StabilityFigure(f"a map at |mu| error {_ERROR:g}: semi-discretization over collocation, cost", cheaper, CHEAPER, True),
        StabilityFigure("400 speeds x 40 lobes of 20 000 frequencies over reading the file, cost", reading, READING, False),
        StabilityFigure("the next cut after ten [s]", _next(), NEXT, False),
    ]


def _cheaper() -> float:
    from lathesim.stability.periodic_delay import multipliers, turning
    from lathesim.stability.tool_point import Mode, ToolPoint

    tool = ToolPoint((Mode(100.66, 0.0996, 1e6),), (0.342,))
    ours = theirs = 0.0
    for speed, width in _POINTS:
        equation = turning(tool, 700e6, 1e-3 * width, speed)
        wanted = abs(multipliers(equation, 60)[0])
        ours += _least(lambda n, equation=equation: abs(multipliers(equation, n)[0]), _COLLOCATION, wanted)  # type: ignore[misc]
        theirs += _least(lambda m, equation=equation: semi_discretization(equation, m), _STEPS, wanted)  # type: ignore[misc]
    return theirs / ours


def _least(compute: Callable[[int], float], sizes: tuple[int, ...], wanted: float) -> float:
    """Return the CPU seconds of the smallest size from which on the error stays below the bar."""
    good = next((size for size in sizes if abs(compute(size) - wanted) < _ERROR), sizes[-1])
    return min(_seconds(lambda: compute(good)) for _ in range(3))


def _seconds(call: Callable[[], Any]) -> float:
    begun = time.process_time()
    call()
    return time.process_time() - begun


def semi_discretization(equation: Any, steps: int) -> float:
    """Return the largest multiplier by first-order semi-discretization with so many steps of a period.

    Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), chapter 3: the delayed position is linear over a
    step.
    """
    import scipy.linalg

    h = equation.period / steps
    size = equation.now(0.0).shape[0]
    half = size // 2
    dimension = size + steps * half
    product = np.eye(dimension)
    kept: dict[bytes, tuple[Any, Any, Any]] = {}
    for step in range(steps):
        at = (step + 0.5) * h
        a, b = equation.now(at), equation.before(at)[:, 0::2]
        key = a.tobytes() + b.tobytes()
        if key not in kept:
            block = np.zeros((size + 2 * half, size + 2 * half))
            block[:size, :size], block[:size, size : size + half] = a, b
            block[size : size + half, size + half :] = np.eye(half) / h
            whole = scipy.linalg.expm(block * h)
            late = whole[:size, size + half :]
            kept[key] = (whole[:size, :size], whole[:size, size : size + half] - late, late)
        push, early, late = kept[key]
        # the state, then the positions of the steps before, the newest first
        state = push @ product[:size] + early @ product[-half:] + late @ product[-2 * half : -half]
        product = np.concatenate([state, product[0:size:2], product[size : dimension - half]])
    return float(np.abs(scipy.linalg.eigvals(product)).max())


def _reading() -> float:
    from lathesim.stability.frequency_limit import limits_of_lines
    from lathesim.stability.response_files import read_response, write_response
    from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint

    tool = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(420.0, 0.035, 3e7), Mode(1180.0, 0.012, 9e7)), (1.0, 1.0, 1.0))
    frequency = np.linspace(0.1, 2000.0, 20_000)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "response.csv"
        write_response(FrequencyResponse(frequency, tool.receptance(frequency)), path)
        read = read_response(path)
        speeds = np.linspace(1000.0, 8000.0, 400)
        reading = min(_seconds(lambda: read_response(path)) for _ in range(5))
        lobes = min(_seconds(lambda: limits_of_lines(read.frequency, read.receptance_values, 7e8, speeds, 40)) for _ in range(5))
    return lobes / reading


def _next() -> float:
    from lathesim.stability.belief import Prior, TriedCut, learn, learn_all
    from lathesim.stability.frequency_limit import limit_at
    from lathesim.stability.next_cut import CutRange, next_cut
    from lathesim.stability.tool_point import Mode, ToolPoint

    prior = Prior(np.log([100.0, 0.05, 0.01]), np.array([0.1, 0.3, 0.28]))
    tool = ToolPoint((Mode(106.0, 0.042, 1.1e7),), (1.0,))
    cuts = []
    for number in range(10):
        speed, width = 1500.0 + 230.0 * number, 1.2e-3 + 0.15e-3 * number
        limit = limit_at(tool, 1e9, speed)
        cuts.append(TriedCut(speed, width, width < limit.width, limit.frequency if width >= limit.width else float("nan")))
    inside = CutRange(np.linspace(1000.0, 4000.0, 121), 6e-3)
    belief = learn_all(prior, cuts[:-1])

    return clock(lambda: next_cut(learn(belief, cuts[-1]), inside))
