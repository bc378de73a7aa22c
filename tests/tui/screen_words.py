"""What a screen shows, read from its SVG picture: the words, row by row."""

from __future__ import annotations

import html
import re

_TEXT = re.compile(r'<text [^>]*?x="([\d.]+)" y="([\d.]+)"[^>]*>(.*?)</text>', re.S)


def words_of(svg: str) -> str:
    """Return the rows of a screen as text, without what differs from run to run (ids, colours)."""
    rows: dict[float, list[tuple[float, str]]] = {}
    for x, y, text in _TEXT.findall(svg):
        rows.setdefault(float(y), []).append((float(x), html.unescape(text).replace("\xa0", " ")))
    return "\n".join("".join(text for _, text in sorted(cells)).rstrip() for _, cells in sorted(rows.items())) + "\n"
