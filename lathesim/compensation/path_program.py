"""A path of way-points as a part program: straight blocks of whole samples, as a control in continuous-path mode runs them."""

from __future__ import annotations

import itertools

import numpy as np

from lathesim.engine.assembly import FloatArray

_MOST_BLOCKS = 20_000
_SMALLEST = 0.5e-6
"""Half of the last decimal that is written [mm]: a shorter way is none."""


def program_text(asked: FloatArray, period: float, words: list[str], spindle: FloatArray | None) -> str:
    """Return the program of way-points [m], shape (axes, samples), which begins where the tool stands.

    It has straight blocks of whole samples with the feed that takes just as long, and dwells where nothing moves.
    """
    count = asked.shape[1]
    every = max(1, -(-count // _MOST_BLOCKS))
    points = [*range(0, count - 1, every), count - 1]
    start = " ".join(f"{word}{1e3 * row[0]:.6f}" for word, row in zip(words, asked, strict=True))
    lines = [
        "(dialect: linuxcnc)",
        "(the path of a part, with the errors of one machine mirrored into it)",
        "G21 G18 G90 G94 G8",
        f"G0 {start}",
    ]
    standing, turning = 0.0, 0.0
    # what is not written is no way: the next block begins where the last one ended
    before = np.round(1e3 * asked[:, 0], 6)
    for first, last in itertools.pairwise(points):
        if spindle is not None and last < len(spindle) and spindle[last] != turning:
            turning = float(spindle[last])
            lines.append(f"G97 S{abs(turning) * 30.0 / np.pi:.4f} {'M3' if turning > 0.0 else 'M4'}" if turning else "M5")
        after = np.round(1e3 * asked[:, last], 6)
        way = float(np.sqrt(np.sum((after - before) ** 2)))
        lasting = (last - first) * period
        if way < _SMALLEST:
            standing += lasting
            continue
        if standing > 0.0:
            lines.append(f"G4 P{standing:.6f}")
            standing = 0.0
        # rounded up, so that rounding costs no further sample
        feed = np.ceil(way / lasting * 60.0 * 1e5) / 1e5
        target = " ".join(f"{word}{value:.6f}" for word, value in zip(words, after, strict=True))
        lines.append(f"G1 {target} F{feed:.5f}")
        before = after
    if standing > 0.0:
        lines.append(f"G4 P{standing:.6f}")
    return "\n".join([*lines, "M2"]) + "\n"
