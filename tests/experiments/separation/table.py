"""The table of a campaign: what was asked and what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

BINS = ((0.0, 0.6), (0.6, 0.9), (0.9, 1.01))


def table(results: Sequence[dict[str, Any]]) -> list[str]:
    """Return the lines of the table over all cases so far."""
    done = [item for item in results if "designed" in item]
    if not done:
        return ["no case ended with a program"]
    right = [item["designed"]["decided"] and item["designed"]["runs"] == 1 for item in done]
    usual = [item["exercise"]["decided"] and item["exercise"]["runs"] == 1 for item in done]
    shares = [item["designed"]["seconds"] / item["exercise"]["seconds"] if item["designed"]["decided"] else np.inf for item in done]
    chances = np.array([item["chance"] for item in done], dtype=float)
    alone = [sum(bool(item[way].get("alone")) for item in done) for way in ("designed", "exercise")]
    lines = [
        f"{len(done)} of {len(results)} cases with a program; all of them pass 'program': {all(item['passes_program'] for item in done)}",
        f"right after one run: designed {sum(right)}/{len(done)}, the exercise {sum(usual)}/{len(done)}; "
        f"named alone, in no tie: {alone[0]} and {alone[1]}",
        f"seconds, designed against the exercise repeated: median {np.median(shares):.2f} (at most, as an exercise that does not decide "
        "counts one run more)",
        f"predicted chance {chances.mean():.2f}, right {np.mean(right):.2f}, Brier {np.mean(np.square(chances - right)):.3f}",
    ]
    for low, high in BINS:
        chosen = (chances >= low) & (chances < high)
        if chosen.any():
            seen = np.array(right)[chosen].mean()
            lines.append(f"  foretold {low:.1f} to {min(high, 1.0):.1f}: {chances[chosen].mean():.2f}, right {seen:.2f} of {chosen.sum()}")
    for family in dict.fromkeys((item["rig"], item["family"]) for item in done):
        own = [good for item, good in zip(done, right, strict=True) if (item["rig"], item["family"]) == family]
        lines.append(f"  {family[0]}, {family[1]}: {sum(own)}/{len(own)}")
    cpu = [item["design_cpu_s"] for item in done]
    lines.append(f"processor time of a design: median {np.median(cpu):.0f} s, most {max(cpu):.0f} s")
    return lines
