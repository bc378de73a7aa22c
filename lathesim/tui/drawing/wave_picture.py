"""The end of the part with the waves of the last turn, drawn in characters: the circle a stiff tool leaves, and what the tool met."""

from __future__ import annotations

import numpy as np

from lathesim.analysis.part.waves import Waves
from lathesim.tui.drawing.braille import BRAILLE, braille_codes, trace
from lathesim.tui.drawing.lathe_picture import ACTUAL, LABEL, NOTHING, REFERENCE, Picture

_RADIUS = 0.38
"""Radius of the circle over the height of the picture."""
_LARGEST = 0.09
"""Waves are magnified until the largest is this share of the height; of a cut without chatter by no more than so many dots a micrometre."""
_DOTS_A_MICROMETRE = 2.0


def draw_waves(waves: Waves, columns: int, rows: int) -> Picture:
    """Return the end of the part, ``columns`` by ``rows`` characters; ``dot`` is the height of a wave that moves the line by a dot [m]."""
    height, width = 4 * rows, 2 * columns
    size = min(height, width)
    deviation = waves.height[-1] - waves.height[-1].mean()
    largest = float(np.abs(deviation).max())
    gain = min(_LARGEST * size / largest, _DOTS_A_MICROMETRE * 1e6) if largest > 0.0 else 0.0
    text, layer = np.full((rows, columns), " "), np.full((rows, columns), NOTHING)
    angle = np.append(waves.angle, waves.angle[0])
    circle = np.full(len(angle), _RADIUS * size)
    # a higher surface is one that the tool cut less deep: it stands out
    seen = circle + gain * np.append(deviation, deviation[0])
    for radius, kind, dash in ((circle, REFERENCE, (1, 2)), (seen, ACTUAL, (1, 0))):
        dots = np.zeros((height, width), dtype=np.bool_)
        trace(dots, 0.5 * width + radius * np.cos(angle), 0.5 * height + radius * np.sin(angle), dash=dash)
        codes = braille_codes(dots)
        drawn = codes > 0
        text[drawn] = [chr(BRAILLE + int(code)) for code in codes[drawn]]
        layer[drawn] = kind
    words = f" R_a {1e6 * waves.roughness:.3g} um "
    if columns > len(words) and rows > 2:
        begin = (columns - len(words)) // 2
        text[rows // 2, begin : begin + len(words)] = list(words)
        layer[rows // 2, begin : begin + len(words)] = LABEL
    return Picture(text, layer, np.zeros((rows, columns), dtype=np.bool_), 1.0 / gain if gain > 0.0 else 0.0)
