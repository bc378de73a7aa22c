"""An effect that stands on another one which is not there: what takes the other's place in the model was a wrong beginning.

A spindle that hardly ever turns the other way has a constant torque as well as dry friction; taken for it, what is left at low speed
is called the excess of a friction that is not there. The friction is then tried in the place of either, of both, and beside them: a peak
that is far wider than any takes so much of the friction that this scores little.
"""

from __future__ import annotations

from collections.abc import Iterator

from lathesim.diagnosis.candidates.eligibility import stands
from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import compare_models, further_parameters, gains_over
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial


def add_prerequisites(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with what an effect of the model stands on, in the place of the effect, of another one at the same part, of both,
    or of none, where that explains both recordings as well for what its values cost."""
    for candidate in found.model.candidates:
        if stands(candidate, found.model, laboratory.experiment):
            continue
        others = [other for other in found.model.candidates if other is not candidate and _host(other) == _host(candidate)]
        grounds = [
            ground
            for ground in laboratory.experiment.candidates
            if ground.name in candidate.effect.identification.prerequisites and ground.at == candidate.at
        ]
        laboratory.progress(
            f"asking whether {' or '.join(ground.name for ground in grounds)} is there, on which {candidate.name} at {candidate.at} stands"
        )
        for gone, trial in _instead(laboratory, found.model, candidate, others, grounds, method=method):
            model = laboratory.settled(trial.model)
            if _is_as_good(model, found.model, method):
                laboratory.progress(
                    f"{trial.candidate.name} at {trial.candidate.at} takes the place of {' and '.join(other.name for other in gone)}"
                )
                trials = {**found.trials, trial.candidate.part: [trial]}
                return found.accepted(model, "prerequisite", "the effect that it stands on explains as much", trials=trials)
            if gone == (candidate,):
                again = _on_top(laboratory, trial.model, candidate, method=method)
                both = laboratory.settled(again.model)
                if _is_as_good(both, found.model, method):
                    laboratory.progress(f"{trial.candidate.name} at {trial.candidate.at} is there too")
                    trials = {**found.trials, trial.candidate.part: [trial], candidate.part: [again]}
                    return found.accepted(both, "prerequisite", "both are there", trials=trials)
    return found


def _instead(
    laboratory: Laboratory, model: Model, candidate: Candidate, others: list[Candidate], grounds: list[Candidate], method: Method = STANDARD
) -> Iterator[tuple[tuple[Candidate, ...], Trial]]:
    """Return the effects that are left out with the trial of a ground in their place, the fewest effects first."""
    for gone in [*((other, candidate) for other in others), (candidate,), *((other,) for other in others)]:
        before = model
        for other in gone:
            before = fewer(laboratory, before, other)
        points = starting_points(laboratory.experiment, before.fitted, grounds, method=method)
        for item in screen(laboratory.experiment.sensed, before.fitted, grounds, points, method=method).ranked:
            yield gone, laboratory.trial(before, item.candidate, before.candidates, before.free, item.starts[:1])


def _on_top(laboratory: Laboratory, before: Model, candidate: Candidate, method: Method = STANDARD) -> Trial:
    """Return the trial of an effect on the ground that it needs: from what it was without it, a way to both may be long."""
    (item,) = screen(
        laboratory.experiment.sensed,
        before.fitted,
        [candidate],
        starting_points(laboratory.experiment, before.fitted, [candidate], method=method),
        method=method,
    ).ranked
    return laboratory.trial(before, candidate, before.candidates, before.free, item.starts)


def _is_as_good(model: Model, other: Model, method: Method) -> bool:
    """Return whether a model explains both recordings no worse than another one, for what the values and effects cost that it has fewer."""
    effects, parameters = len(model.candidates) - len(other.candidates), further_parameters(model, other)
    return compare_models(gains_over(model, other), method, effects=effects, parameters=parameters).as_good


def _host(candidate: Candidate) -> str:
    return candidate.at.partition(".")[0]
