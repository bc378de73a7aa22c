"""How stable a decision is, in one line."""

from __future__ import annotations

from lathesim.diagnosis.records.diagnosis import Diagnosis


def stability_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the line on how often the decision stands when its limits are shaken, and on which limit it hinges."""
    found = diagnosis.stability
    if found is None:
        return []
    verdict = diagnosis.verdict.replace("_", " ")
    others = [f"{name.replace('_', ' ')} in {share:.0%}" for name, share in found.outcomes.items() if name != diagnosis.verdict]
    turned = f" ({', '.join(others)})" if others else ""
    hinges = f"; it hinges on {', '.join(found.hinges_on)}" if found.hinges_on else ""
    return [f"Stability: {verdict} in {found.share:.0%} of {found.decisions} decisions with shaken limits{turned}{hinges}."]
