"""How the candidates of a search stand, as bars."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.text import Text

if TYPE_CHECKING:
    from lathesim.identification.records.model import CandidateStanding

_BAR, _MOST = 10, 8
"""Characters of a whole bar, and candidates that are shown."""


def standing_bars(standings: Iterable[CandidateStanding], width: int) -> Text:
    """Return the best candidates, each with the share of the error it removes as a bar, and its gain on the held-out recording [nats].

    A candidate that was only screened has no gain there yet: its screening score stands in brackets.
    """
    shown = sorted(standings, key=lambda item: (math.isnan(item.held_out), -_gain(item)))[:_MOST]
    if not shown:
        return Text("No candidate has been tried yet.", style="dim")
    names = max(6, min(max(len(item.name) for item in shown), width - _BAR - 18))
    found = Text(no_wrap=True)
    found.append(f"{'effect':<{names}}  {'explains':<{_BAR}}       gain\n", style="bold")
    for place, item in enumerate(shown):
        judged = not math.isnan(item.held_out)
        bar = "█" * round(_BAR * min(1.0, max(0.0, item.share)))
        nats = f"{item.held_out:.0f}" if judged else f"({item.gain:.0f})"
        style = "bold green" if place == 0 and judged and item.held_out > 0.0 else "" if judged else "dim"
        found.append(f"{item.name[:names]:<{names}}  {bar:<{_BAR}} {item.share:>4.0%} {nats:>6}\n", style=style)
    return found


def _gain(item: CandidateStanding) -> float:
    return item.gain if math.isnan(item.held_out) else item.held_out
