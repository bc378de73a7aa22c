"""The method as one value: every limit of the search and of the decisions, passed down from ``diagnose``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from lathesim.diagnosis.method.candidates import CandidateLimits
from lathesim.diagnosis.method.discovery import DiscoveryLimits
from lathesim.diagnosis.method.explaining import ExplainingLimits
from lathesim.diagnosis.method.location import LocationLimits
from lathesim.diagnosis.method.recording_checks import CheckLimits
from lathesim.diagnosis.method.reporting import ReportingLimits
from lathesim.diagnosis.method.selection import SelectionLimits
from lathesim.diagnosis.method.shared import SharedLimits
from lathesim.diagnosis.method.verdict import VerdictLimits
from lathesim.identification.execution.budget import Deadline
from lathesim.limit import Limit


@dataclass(frozen=True)
class Method:
    """Every limit of a diagnosis. A test, an ablation or a study of the limits passes another one."""

    recording_checks: CheckLimits = CheckLimits()
    shared: SharedLimits = SharedLimits()
    location: LocationLimits = LocationLimits()
    candidates: CandidateLimits = CandidateLimits()
    selection: SelectionLimits = SelectionLimits()
    explaining: ExplainingLimits = ExplainingLimits()
    verdict: VerdictLimits = VerdictLimits()
    discovery: DiscoveryLimits = DiscoveryLimits()
    reporting: ReportingLimits = ReportingLimits()

    # what a search may spend
    most_effects: int = 4
    ends: Deadline = Deadline()
    """The deadline: the search ends before it, and the answer holds what is known so far."""
    search_time: float = 0.65
    """Share of the time for the search; the rest is for the answer."""

    # when an effect is accepted
    margin: float = Limit(
        10.0, "nats", "an accepted effect gains this beyond its parameters' due", "calibrated",
        "Kass and Raftery (1995) call 5 very strong evidence; the suite's controls needed 10, margin not recorded",
    )  # fmt: skip
    per_parameter: float = Limit(
        3.0, "nats", "each fitted parameter must gain this", "derived",
        "half the 0.986 quantile of chi-squared with one degree of freedom (Wilks 1938): 1.4 % of useless parameters would pass",
    )  # fmt: skip
    share_of_all: float = Limit(0.03, "share of error", "an effect must explain this of all the error")
    share_of_rest: float = Limit(0.15, "share of residual", "and this of what the other effects leave")
    nearly_all_of_rest: float = Limit(0.6, "share of residual", "or this of what the others leave, however little of all that is")

    # which sizes are plausible
    largest_size: float = Limit(
        30.0, "times the typical value", "an effect whose size, or whose shape, is further off than this is not that effect",
        "assumed",
        "in the place of three limits from 10 to 100; of 29 cases asked before and after, 27 have the same answer, all the same names",
    )  # fmt: skip
    possible: Mapping[str, float] = field(default_factory=dict)
    """How large parameters (free name -> size) could be on this machine, whatever is usual on others."""

    without_earlier: Method | None = None
    """The limits that are asked of what a recording from before a change shows too; None where there is no such recording."""

    @property
    def beside_earlier(self) -> bool:
        """Whether a recording from before a change stands beside: what the lesson's errors look like, it shows."""
        return self.without_earlier is not None

    def judged_by_itself(self, samples: int) -> Method:
        """Return the limits of one recording that judges what was fitted to it: each value is due half the logarithm of the samples.

        Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
        """
        return replace(self, per_parameter=max(self.per_parameter, 0.5 * math.log(samples)))

    def beside_an_earlier_recording(self) -> Method:
        """Return the limits where a recording from before a change is held beside: what is new needs no share of the error."""
        return replace(self, without_earlier=self, share_of_all=0.0, share_of_rest=0.0)


STANDARD = Method()
"""The limits that every command uses."""
