"""Whether what could not be told from an effect still cannot once everything else was found.

Ties are seen when an effect comes in, with the rest of what is missing still there: a delay and the lag of a current loop leave the same as
long as a friction is not known. Each rival is tried again in the place of the effect, beside all others of the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lathesim.diagnosis.belief import Settings
from lathesim.diagnosis.found import Found
from lathesim.diagnosis.growth import fewer
from lathesim.diagnosis.side_by_side import Asked, side_by_side
from lathesim.diagnosis.trial import Bench
from lathesim.diagnosis.verdict import standing


def try_rivals_again(bench: Bench, found: Found, settings: Settings) -> None:
    """Hold the effects of a model of several against what each was tied with, in the place of it; what does as well still stays."""
    if len(found.model.terms) < 2:
        return
    tied = {item.term.part: item.tied for item in standing(found, settings) if item.tied}
    for term in found.model.terms:
        rivals = [trial for trial in found.trials.get(term.part, ()) if trial.term in tied.get(term.part, ())]
        if not rivals:
            continue
        bench.say(f"trying again what {term.name} at {term.at} could not be told from")
        before = fewer(bench, found.model, term)
        tried = [(term, found.model.fitted.by_name), *[(trial.term, trial.model.fitted.by_name) for trial in rivals]]
        starts = [np.array([values[name] for name in one.parameters]) for one, values in tried]
        asked = [Asked(one, before.terms, before.free, [start]) for (one, _), start in zip(tried, starts, strict=True)]
        own, *others = side_by_side(bench, before, asked)
        share = found.removed_by(term)
        # what it took away when it came in is what it is credited with
        found.trials[term.part] = [replace(trial, share_of_all=share + trial.share_of_all - own.share_of_all) for trial in (own, *others)]
