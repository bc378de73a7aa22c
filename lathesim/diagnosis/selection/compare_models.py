"""Is a model better than another one, by how much, and is that more than chance gives? Every decision of the search asks here.

Models are compared by their log-likelihoods on both recordings [nats]. Two things may make a difference of nothing:

1. What is fitted gains by itself. A further parameter gains half a chi-square of one degree of freedom, and a new effect what the best of
   all candidates gains by chance. The sum of both is the cost of a model; a simpler model saves it.
2. A model is never quite right. Two explanations of a large error differ by a share of what they explain, and that tells nothing.

Sources: Wilks, The large-sample distribution of the likelihood ratio, Annals of Mathematical Statistics 9 (1938); Kass and Raftery, Bayes
factors, Journal of the American Statistical Association 90 (1995), for the words that go with a number of nats.
"""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method import Method
from lathesim.identification.records.model import Model, is_full_band


@dataclass(frozen=True)
class Gains:
    """How much larger the log-likelihood of a model is than another one's [nats]; ``validation`` is none where it was not asked for."""

    estimation: float
    validation: float | None = None

    @property
    def least(self) -> float:
        """The smaller of the two."""
        return self.estimation if self.validation is None else min(self.estimation, self.validation)


@dataclass(frozen=True)
class ModelComparison:
    """A model held against another one.

    ``better``: it gains more than its further parameters cost, more than the resolution, and the validation recording agrees. ``as_good``:
    it loses on neither recording more than it saves in parameters or than the resolution, and ``explains_elsewhere`` no other share of the
    error. ``cost`` [nats] is below 0 for a simpler model.
    """

    gains: Gains
    cost: float
    resolution: float
    better: bool
    as_good: bool
    explains_elsewhere: bool = False

    @property
    def reason(self) -> str:
        """The comparison in words."""
        validation = "" if self.gains.validation is None else f" and {self.gains.validation:.0f} on the validation recording"
        due = f"{self.cost:.0f} are due" if self.cost > 0.0 else f"it saves {-self.cost:.0f}"
        return f"gains {self.gains.estimation:.0f} nats on the estimation recording{validation}; {due}"


def due(method: Method, *, effects: int = 1, parameters: int = 0, null_maximum: float = 0.0) -> float:
    """Return the log-likelihood [nats] that so many further effects and parameters must gain: less than nothing for fewer of them."""
    return method.margin * effects + method.per_parameter * parameters + null_maximum


def compare_models(
    gains: Gains, method: Method, *, effects: int = 0, parameters: int = 0, null_maximum: float = 0.0, explained: float = 0.0,
    apart: float = 0.0, alike: bool = False,
) -> ModelComparison:  # fmt: skip
    """Return how a model compares with another one, over which it has ``gains``.

    ``effects`` and ``parameters`` are how many more it has, ``null_maximum`` what the best of the candidates gains by chance, ``explained``
    the gain of what both explain [nats]. Models whose shares of the explained error are ``apart`` are not as good as one another, however
    likely. Where both have one error of form, being ``alike``, only the fit makes a difference of nothing.
    """
    cost = due(method, effects=effects, parameters=parameters, null_maximum=null_maximum)
    share = method.selection.fit_share if alike else method.selection.tie_share
    resolution = max(method.per_parameter, share.times(abs(explained)))
    agrees = gains.validation is None or gains.validation > max(method.per_parameter, method.selection.fit_share * gains.estimation)
    better = gains.estimation > max(cost, resolution) and agrees
    elsewhere = apart >= method.selection.tie_share
    as_good = gains.least > -max(resolution, -cost) and not elsewhere and (cost <= 0.0 or better)
    return ModelComparison(gains, cost, resolution, better, as_good, elsewhere)


def gains_over(model: Model, other: Model, *, full_band: bool | None = None) -> Gains:
    """Return the gains of a model over another one: on all frequencies, or on those of the motion where no effect of either goes beyond."""
    wide = is_full_band((*model.candidates, *other.candidates)) if full_band is None else full_band
    return Gains(model.score.above(other.score, full_band=wide), model.validation.above(other.validation, full_band=wide))


def further_parameters(model: Model, other: Model) -> int:
    """Return how many more parameters the effects of a model have than those of another one."""
    return sum(len(candidate.parameters) for candidate in model.candidates) - sum(
        len(candidate.parameters) for candidate in other.candidates
    )
