"""A formula that was found for what no effect explains."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Addend:
    """One addend of a discovered formula: coefficient and its standard error [``unit``], the function's text and its unit in letters."""

    coefficient: float
    unit: str
    text: str
    error: float = 0.0
    of: str = "1"


@dataclass(frozen=True)
class Span:
    """The values [``unit``] of a letter (v, q, t) between which a formula was found."""

    letter: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class Discovered:
    """A formula for what is missing at ``at`` [``unit``]; ``share`` is how much of it the formula explains on the validation recording.

    ``role`` is the role of the port at ``at``; ``domain`` says where the recording has been; ``size`` is the root mean square of what is
    missing at the frequencies of the motion [``unit``], which may be far less than what is missing at all frequencies.
    """

    at: str
    unit: str
    addends: tuple[Addend, ...]
    share: float
    role: str = "effort"
    domain: tuple[Span, ...] = ()
    size: float = 0.0

    @property
    def formula(self) -> str:
        """The formula as text, with units and standard errors."""
        addends = [f"({item.coefficient:.4g} +- {_one_digit(item.error)} {item.unit}) {item.text}" for item in self.addends]
        return f"{' + '.join(addends)}  [{self.unit}]"


def _one_digit(error: float) -> str:
    """Return a number to one digit that counts, written out: ``10`` and not ``1e+01``."""
    return f"{float(f'{error:.1g}'):g}"
