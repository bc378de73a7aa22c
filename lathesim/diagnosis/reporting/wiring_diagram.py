"""The wiring as a small block diagram: boxes in layers from left to right, feedback running back below them.

A wire that closes a loop is found by walking depth first from the parts that nothing feeds; the other wires then say which layer a part
stands in (longest way from the left), and a few sweeps put each part near those it is wired to. Source: Sugiyama, Tagawa, Toda, Methods
for visual understanding of hierarchical system structures, IEEE Trans. Systems, Man, Cybernetics 11 (1981).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

Wires = Sequence[tuple[str, str]]

WIDTH = 700.0
_MOST_PARTS = 14
_HEIGHT = 26.0
_ROW = 46.0
_GAP = 22.0
_LETTER = 5.6
_BEGINNINGS = ("interpolator", "recorded", "controller")


@dataclass(frozen=True)
class Box:
    """A part: its left upper corner, its size and the size of its letters [px of the drawing]."""

    name: str
    x: float
    y: float
    width: float
    height: float
    letters: float


@dataclass(frozen=True)
class Diagram:
    """Boxes, and the wires as SVG paths; ``left_out`` counts the parts that are too far from the place to be drawn."""

    width: float
    height: float
    boxes: tuple[Box, ...]
    forward: tuple[str, ...]
    back: tuple[str, ...]
    left_out: int


def wiring_diagram(wires: Wires, near: Iterable[str] = ()) -> Diagram | None:
    """Lay out the parts that ``wires`` join (from part, to part); of a large machine those nearest to the parts ``near``."""
    pairs = [pair for pair in dict.fromkeys(wires) if pair[0] != pair[1]]
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    if not names:
        return None
    kept = _nearest(names, pairs, [name for name in near if name in names])
    pairs = [pair for pair in pairs if pair[0] in kept and pair[1] in kept]
    layers, closing = _layers([name for name in names if name in kept], pairs)
    return _drawn(layers, [pair for pair in pairs if pair not in closing], closing, len(names) - len(kept))


def _nearest(names: list[str], pairs: Wires, near: list[str]) -> set[str]:
    if len(names) <= _MOST_PARTS:
        return set(names)
    kept = dict.fromkeys(near or names[:1])
    for name in (queue := list(kept)):
        for source, target in pairs:
            other = target if source == name else source if target == name else ""
            if other and other not in kept and len(kept) < _MOST_PARTS:
                kept[other] = None
                queue.append(other)
    return set(kept)


def _layers(names: list[str], pairs: Wires) -> tuple[list[list[str]], list[tuple[str, str]]]:
    """Return the names layer by layer, and the pairs that close a loop."""
    fed = {target for _, target in pairs}
    following = {name: [target for source, target in pairs if source == name] for name in names}
    roots = [name for name in names if name not in fed] or [_beginning(names, following)]
    order, closing = _ordered([*roots, *names], following)
    onward = {name: [target for target in targets if (name, target) not in closing] for name, targets in following.items()}
    depth = _depths(order, onward)
    depth |= {name: min(depth[target] for target in onward[name]) - 1 for name in roots if onward[name] and name not in fed}
    layers = [[name for name in names if depth[name] == level] for level in range(max(depth.values()) + 1)]
    return _untangled([layer for layer in layers if layer], pairs, {name for pair in closing for name in pair}), closing


def _ordered(starts: list[str], following: dict[str, list[str]]) -> tuple[list[str], list[tuple[str, str]]]:
    """Return the names so that each stands before what follows it, searched depth first, and the pairs that close a loop."""
    done: dict[str, bool] = {}
    closing: list[tuple[str, str]] = []
    order: list[str] = []

    def visit(name: str) -> None:
        done[name] = False
        for target in following[name]:
            if target not in done:
                visit(target)
            elif not done[target]:
                closing.append((name, target))
        done[name] = True
        order.insert(0, name)

    for name in starts:
        if name not in done:
            visit(name)
    return order, closing


def _depths(order: list[str], onward: dict[str, list[str]]) -> dict[str, int]:
    """Return the layer of each name: one beyond the furthest that it follows."""
    depth = dict.fromkeys(order, 0)
    for name in order:
        for target in onward[name]:
            depth[target] = max(depth[target], depth[name] + 1)
    return depth


def _beginning(names: list[str], following: dict[str, list[str]]) -> str:
    """Return where to begin drawing a machine that is one loop: at what commands it."""
    for word in _BEGINNINGS:
        for name in names:
            if word in name:
                return name
    return max(names, key=lambda name: len(following[name]))


def _untangled(layers: list[list[str]], pairs: Wires, low: set[str]) -> list[list[str]]:
    """Order each layer by the mean place of the neighbours of its parts, those ``low`` with a wire running back below the others."""
    for _ in range(4):
        place = {name: row - 0.5 * (len(layer) - 1) for layer in layers for row, name in enumerate(layer)}
        for layer in layers:
            mean = {}
            for name in layer:
                near = [place[a if b == name else b] for a, b in pairs if name in (a, b)]
                mean[name] = sum(near) / len(near) if near else place[name]
            layer.sort(key=lambda name: (name in low, mean[name]))
            place |= {name: row - 0.5 * (len(layer) - 1) for row, name in enumerate(layer)}
    return layers


def _drawn(layers: list[list[str]], forward: Wires, closing: Wires, left_out: int) -> Diagram:
    widest = [max(len(name) for name in layer) * _LETTER + 12.0 for layer in layers]
    used = WIDTH - 4.0
    share = min(1.0, (used - _GAP * (len(layers) - 1)) / sum(widest))
    gap = min(3.0 * _GAP, (used - share * sum(widest)) / max(1, len(layers) - 1))
    middle = 4.0 + 0.5 * _ROW * max(len(layer) for layer in layers)
    boxes: dict[str, Box] = {}
    x = 0.5 * (WIDTH - share * sum(widest) - gap * (len(layers) - 1))
    for layer, width in zip(layers, widest, strict=True):
        for row, name in enumerate(layer):
            y = middle + (row - 0.5 * len(layer)) * _ROW + 0.5 * (_ROW - _HEIGHT)
            boxes[name] = Box(name, x, y, share * width, _HEIGHT, min(10.0, 10.0 * share))
        x += share * width + gap
    lowest = max(box.y + box.height for box in boxes.values())
    ordered = sorted(closing, key=lambda pair: abs(boxes[pair[0]].x - boxes[pair[1]].x))
    depths = [lowest + 12.0 + 9.0 * rank for rank in range(len(ordered))]
    return Diagram(
        WIDTH,
        (depths[-1] if depths else lowest) + 8.0,
        tuple(boxes.values()),
        tuple(_ahead(boxes[source], boxes[target]) for source, target in forward),
        tuple(_below(boxes[source], boxes[target], depth) for (source, target), depth in zip(ordered, depths, strict=True)),
        left_out,
    )


def _ahead(source: Box, target: Box) -> str:
    begin, end = source.x + source.width, target.x - 1.5
    first, last = source.y + 0.5 * source.height, target.y + 0.5 * target.height
    bend = 0.5 * (end - begin)
    return f"M{begin:.1f},{first:.1f} C{begin + bend:.1f},{first:.1f} {end - bend:.1f},{last:.1f} {end:.1f},{last:.1f}"


def _below(source: Box, target: Box, depth: float) -> str:
    begin, end = source.x + 0.62 * source.width, target.x + 0.38 * target.width
    return (
        f"M{begin:.1f},{source.y + source.height:.1f} V{depth - 5:.1f} q0,5 {-5 if end < begin else 5},5 "
        f"H{end + (5 if end < begin else -5):.1f} q{-5 if end < begin else 5},0 {-5 if end < begin else 5},-5 "
        f"V{target.y + target.height + 1.5:.1f}"
    )
