"""The tool point: its modes, and its frequency response, displacement over force, as it was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from lathesim.errors import LessonError, RecordingError, nearest
from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import MAP, ROUNDING_OF_A_FILE

Complex = np.ndarray[Any, np.dtype[np.complex128]]


@dataclass(frozen=True)
class Mode:
    """One mode: natural frequency [Hz], damping ratio [1], stiffness [N/m], angle of its direction from the surface normal [rad]."""

    frequency: float
    damping: float
    stiffness: float
    direction: float = 0.0

    def __post_init__(self) -> None:
        for word, value in (("natural frequency", self.frequency), ("stiffness", self.stiffness)):
            if not value > 0.0 or not math.isfinite(value):
                raise LessonError(f"a mode has the {word} {value:g}.", remedy="Give a finite value above 0.")
        if not 0.0 <= self.damping < 1.0:
            raise LessonError(f"a mode has the damping ratio {self.damping:g}.", remedy="Give one from 0 to below 1.")

    @property
    def mass(self) -> float:
        """Modal mass [kg]: m = k/(2 pi f)^2."""
        return self.stiffness / (2.0 * math.pi * self.frequency) ** 2

    @property
    def viscous(self) -> float:
        """Modal damping [N*s/m]: c = 2 zeta sqrt(k m)."""
        return 2.0 * self.damping * math.sqrt(self.stiffness * self.mass)


@dataclass(frozen=True)
class ToolPoint:
    """Modes of a tool point with the factor of each: how much of the force acts along it, and how much of it counts along the normal.

    The factor is mu_i = cos(beta - alpha_i) cos(alpha_i), beta the angle of the cutting force from the normal, alpha_i that of the mode.
    A force along the normal, such as process damping, has the factor cos^2(alpha_i) instead. Source: Y. Altintas, Manufacturing
    Automation (2012), oriented transfer function; T. Schmitz, K. S. Smith, Machining Dynamics (2019).
    """

    modes: tuple[Mode, ...]
    factors: tuple[float, ...]

    @classmethod
    def of(cls, modes: Sequence[Mode], force_angle: float) -> ToolPoint:
        """Return the tool point of modes under a force at an angle [rad] from the surface normal."""
        factors = [math.cos(force_angle - mode.direction) * math.cos(mode.direction) for mode in modes]
        return cls(tuple(modes), tuple(factors))

    @property
    def normal_factors(self) -> tuple[float, ...]:
        """The factor of each mode for a force along the normal of the surface: cos^2(alpha_i)."""
        return tuple(math.cos(mode.direction) ** 2 for mode in self.modes)

    def receptance(self, frequency: Any) -> Complex:
        """Return displacement along the normal over the cutting force [m/N] at frequencies [Hz], (frequencies,)."""
        return self._sum(frequency, self.factors)

    def normal_receptance(self, frequency: Any) -> Complex:
        """Return displacement along the normal over a force along it [m/N] at frequencies [Hz], (frequencies,)."""
        return self._sum(frequency, self.normal_factors)

    def _sum(self, frequency: Any, factors: Sequence[float]) -> Complex:
        omega = 2.0 * np.pi * np.asarray(frequency, dtype=np.float64)
        total = np.zeros(omega.shape, dtype=np.complex128)
        for mode, factor in zip(self.modes, factors, strict=True):
            total += factor / (mode.stiffness - mode.mass * omega**2 + 1j * mode.viscous * omega)
        return total


Quantity = Literal["receptance", "mobility", "accelerance"]
QUANTITIES: tuple[Quantity, ...] = ("receptance", "mobility", "accelerance")
SI_UNITS = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}
UNITS: dict[str, tuple[Quantity, float]] = {
    "m/n": ("receptance", 1.0),
    "mm/n": ("receptance", 1e-3),
    "um/n": ("receptance", 1e-6),
    "µm/n": ("receptance", 1e-6),
    "nm/n": ("receptance", 1e-9),
    "m/kn": ("receptance", 1e-3),
    "m/s/n": ("mobility", 1.0),
    "(m/s)/n": ("mobility", 1.0),
    "m/(n*s)": ("mobility", 1.0),
    "m/(s*n)": ("mobility", 1.0),
    "mm/s/n": ("mobility", 1e-3),
    "(mm/s)/n": ("mobility", 1e-3),
    "m/s^2/n": ("accelerance", 1.0),
    "(m/s^2)/n": ("accelerance", 1.0),
    "m/(n*s^2)": ("accelerance", 1.0),
    "m/(s^2*n)": ("accelerance", 1.0),
    "1/kg": ("accelerance", 1.0),
    "mm/s^2/n": ("accelerance", 1e-3),
    "(mm/s^2)/n": ("accelerance", 1e-3),
    "g/n": ("accelerance", 9.80665),
}
"""Unit of a response, without spaces and in small letters -> what it measures, and its size in SI."""
FEWEST_LINES = 8
POOR_COHERENCE = 0.5
_SOFTEST = 1.0
"""Median receptance [m/N] above which a unit is wrong (assumed): one newton would move a tool point by a metre."""
_LAST_LINES = 4
"""Smallest number of lines that judge the end of a response; otherwise it is a fiftieth of all lines (assumed)."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Receptance [m/N] at rising frequencies [Hz], both (lines,), as measured.

    ``coherence`` (lines,) from 0 to 1 where it is known. ``hits`` (hits, lines) are the responses of single hits, where they were kept, and
    ``forces`` (lines,) the mean spectrum of the force, for weighting. ``window_rate`` [1/s] is the decay of an exponential window over
    force and response, by which all poles stand to the left. ``force_noise`` [N*sqrt(s)] is the root of the density of the noise of the
    force, of which the ``pulse_length`` [s] around each hit was kept; it began ``pulse_lead`` [s] before the middle of the pulse.
    ``quantity`` says what was measured.
    """

    frequency: FloatArray
    receptance_values: Complex
    coherence: FloatArray | None = None
    hits: Complex | None = None
    forces: FloatArray | None = None
    quantity: Quantity = "receptance"
    window_rate: float = 0.0
    pulse_length: float = 0.0
    pulse_lead: float = 0.0
    force_noise: float = 0.0
    title: str = ""
    findings: tuple[str, ...] = field(default=())

    def receptance(self, frequency: Any) -> Complex:
        """Return the receptance [m/N] at frequencies [Hz], linear between the measured lines."""
        asked = np.asarray(frequency, dtype=np.float64)
        real = np.interp(asked, self.frequency, self.receptance_values.real)
        return np.asarray(real + 1j * np.interp(asked, self.frequency, self.receptance_values.imag))

    @property
    def notes(self) -> str:
        """What a file keeps beside the numbers: ``window_rate 0.3; pulse_length 0.006; pulse_lead 0.002; force_density 0.0044``."""
        values = {
            "window_rate": self.window_rate,
            "pulse_length": self.pulse_length,
            "pulse_lead": self.pulse_lead,
            "force_density": self.force_noise,
        }
        return "; ".join(f"{name} {value:.9g}" for name, value in values.items() if value)

    @property
    def highest(self) -> float:
        """The highest frequency measured [Hz]."""
        return float(self.frequency[-1])


def to_receptance(frequency: FloatArray, values: Complex, quantity: Quantity, scale: float = 1.0) -> tuple[FloatArray, Complex]:
    """Return frequencies and receptance [m/N] of a response: mobility over j w, accelerance over -w^2; a line at 0 Hz is left out then."""
    if quantity == "receptance":
        return frequency, values * scale
    keep = frequency > 0.0
    omega = 2.0 * np.pi * frequency[keep]
    return frequency[keep], values[keep] * scale / ((1j * omega) if quantity == "mobility" else -(omega**2))


def from_receptance(frequency: FloatArray, values: Complex, quantity: Quantity) -> Complex:
    """Return a receptance [m/N] as mobility [m/s/N] or accelerance [m/s^2/N], or as it is; the inverse of :func:`to_receptance`."""
    if quantity == "receptance":
        return values
    omega = 2.0 * np.pi * frequency
    return np.asarray(values * (1j * omega if quantity == "mobility" else -(omega**2)))


def unit_of(text: str, place: str) -> tuple[Quantity, float]:
    """Return what a unit such as ``um/N`` measures and its size in SI; :class:`RecordingError` where it is none of a response."""
    key = text.replace(" ", "").replace("²", "^2").replace("μ", "µ").replace("**", "^").lower()
    if key in UNITS:
        return UNITS[key]
    known = ", ".join(("m/N", "um/N", "m/s/N", "m/s^2/N", "g/N"))
    raise RecordingError(f"'{text}' is no unit of a frequency response.", place=place, remedy=nearest(key, UNITS) or f"Units: {known} ...")


def checked(response: FrequencyResponse, place: str) -> FrequencyResponse:
    """Return a response whose numbers can be used; :class:`RecordingError` in one sentence otherwise."""
    f, h = response.frequency, response.receptance_values
    if len(f) != len(h):
        raise RecordingError(f"there are {len(f)} frequencies and {len(h)} values of the response.", place=place)
    if len(f) < FEWEST_LINES:
        raise RecordingError(f"the response has {len(f)} lines.", place=place, remedy=f"Give at least {FEWEST_LINES}.")
    if not (np.isfinite(f).all() and np.isfinite(h.real).all() and np.isfinite(h.imag).all()):
        at = int(np.flatnonzero(~(np.isfinite(f) & np.isfinite(h.real) & np.isfinite(h.imag)))[0])
        raise RecordingError(f"line {at + 1} of the response is not a number.", place=place, remedy="Take it out.")
    steps = np.diff(f)
    if (steps <= 0.0).any():
        at = int(np.flatnonzero(steps <= 0.0)[0])
        fact = f"the frequencies fall from {f[at]:g} to {f[at + 1]:g} Hz."
        raise RecordingError(fact, place=place, remedy="Sort the lines by rising frequency, each once.")
    if f[0] < 0.0:
        raise RecordingError(f"the first frequency is {f[0]:g} Hz.", place=place, remedy="Give the lines from 0 Hz on.")
    if not np.abs(h).max() > 0.0:
        raise RecordingError("the response is 0 at all frequencies.", place=place, remedy="Check the columns.")
    if (middle := float(np.median(np.abs(h)))) > _SOFTEST:
        raise RecordingError(f"the receptance is {middle:.3g} m/N in the median.", place=place, remedy="Check the unit of the response.")
    if np.abs(h.imag).max() <= ROUNDING_OF_A_FILE * np.abs(h).max():
        raise RecordingError("the response has no phase.", place=place, remedy="Give its real and imaginary part, or magnitude and phase.")
    if response.coherence is not None:
        good = response.coherence[np.isfinite(response.coherence)]
        if not len(good) or good.max() < POOR_COHERENCE:
            best = float(good.max()) if len(good) else 0.0
            fact = f"the coherence is at most {best:.2g}: force and response have little to do with each other."
            raise RecordingError(fact, place=place, remedy="Tap again, with the cables checked.")
    return response


def within(response: FrequencyResponse, low: float, high: float, place: str) -> FrequencyResponse:
    """Return the lines of a response from ``low`` to ``high`` [Hz]; :class:`RecordingError` where too few are there."""
    keep = (response.frequency >= low) & (response.frequency <= high)
    if np.count_nonzero(keep) < FEWEST_LINES:
        fact = f"{np.count_nonzero(keep)} lines are between {low:g} and {high:g} Hz."
        raise RecordingError(fact, place=place, remedy=f"It goes from {response.frequency[0]:g} to {response.highest:g} Hz.")
    return replace(
        response,
        frequency=response.frequency[keep],
        receptance_values=response.receptance_values[keep],
        coherence=None if response.coherence is None else response.coherence[keep],
        hits=None if response.hits is None else response.hits[:, keep],
        forces=None if response.forces is None else response.forces[keep],
    )


def ends_too_low(response: FrequencyResponse, factor: float) -> tuple[str, ...]:
    """Return a warning if a response, times the ``factor`` of the cutting force, ends below the chatter frequency of the cut.

    Above all its modes a tool point acts as a mass: the real part is negative. If it is positive at the end, a mode lies above. If the
    oriented real part is lowest at the end, it falls further.
    """
    last = max(_LAST_LINES, len(response.frequency) // 50)
    real = response.receptance_values.real
    end, scatter = real[-last:], np.diff(real[-last:], 2) / np.sqrt(6.0)
    if (factor * end).min() <= (factor * real).min() < 0.0:
        return (f"the response ends at {response.highest:g} Hz, below the chatter frequency: the limits are too high. Measure further up",)
    if end.mean() > MAP.steady * float(scatter.std()) / np.sqrt(last):
        fact = f"the response ends at {response.highest:g} Hz, below a mode that still adds to it"
        return (f"{fact}: chatter above is not measured. Measure further up",)
    return ()


def quantity_and_scale(quantity: str | None, unit: str | None, place: str) -> tuple[Quantity, float] | None:
    """Return what a lesson or an option says of a response: its quantity and size in SI; none where it says nothing."""
    if quantity is not None and quantity not in QUANTITIES:
        remedy = nearest(quantity, QUANTITIES) or f"Quantities: {', '.join(QUANTITIES)}."
        raise LessonError(f"there is no response quantity '{quantity}'.", place=place, remedy=remedy)
    if unit is None:
        return None if quantity is None else (quantity, 1.0)
    found, scale = unit_of(unit, place)
    if quantity is not None and quantity != found:
        raise LessonError(f"'{unit}' is a unit of {found}, not of {quantity}.", place=place, remedy="Correct one of them.")
    return found, scale
