"""What a remedy is: what a control adds so that an effect no longer shows on the part.

Where an axis will be: the second-order model of its position loop that remedies act on.

    T T_i m'' + T m' + m = r,   T = ``lag``, T_i = ``inner``;  solved exactly for a reference that is held over the sample

A remedy that acts at the reference's reversal comes too early by the lag of the loop; one that asks the measured velocity comes late and
chatters. The model reverses when the axis does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.lag import followed_running


@dataclass(frozen=True)
class EffectAtLoop:
    """A diagnosed effect with its ``values`` [SI] and the position loop it belongs to.

    ``lag`` and ``inner`` are T and T_i [s] of the model, ``per_force`` the command [V] that moves the axis as a newton does, ``travel`` the
    ends of the way that is asked for [m]. ``closes`` says whether the effect falsifies the reading that closes the loop, else it moves the
    table behind its back. ``other`` is the port of another axis that says where it is asked to be, empty without one, and
    ``other_travel`` the ends of its way [m].
    """

    effect: str
    values: Mapping[str, float]
    lag: float
    inner: float
    per_force: float
    travel: tuple[float, float]
    closes: bool
    other: str = ""
    other_travel: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Sizes:
    """Values of a remedy [SI], its tables, name -> (columns, rows), and its ``sources``, input -> port.

    The simulation finds those that are ``tuned``, from a start that is not zero, or from the best of those that it ``begins`` with. Of
    ``one_sided`` ones too much is worse than too little. ``free`` are values of the effect that no control knows, with their ranges.
    ``share`` is how much of the remedy acts.
    """

    values: Mapping[str, float]
    tuned: tuple[str, ...] = ()
    one_sided: tuple[str, ...] = ()
    tables: Mapping[str, tuple[tuple[str, ...], Any]] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    begins: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    share: float = 1.0


class Remedy(Effect):
    """Passes on what it is given:  outgoing = incoming. A remedy adds to it what takes an effect away.

    It sits on a wire of the control: on the reference of a controller, on its command, on a reading. ``share`` is how much of it acts: 1
    the whole, 0 nothing, bit for bit. A lesson inserts it as it does an effect, under the key ``remedy:``.
    """

    family = "compensation"
    site = "reading"
    neutral = {"share": 0.0}
    fingerprint = "none: it takes a fingerprint away"
    experiment = "Run the same program with share 0 and with share 1."
    source = "the remedies of common controls; see the class"

    answers: ClassVar[tuple[str, ...]] = ()
    """Effects it compensates."""
    limits: ClassVar[tuple[str, ...]] = ()
    """What bounds it: converter, voltage, sensor, bandwidth."""
    cannot: ClassVar[str] = ""
    """What it cannot do, in one sentence."""
    follows: ClassVar[dict[str, str]] = {}
    """Own parameter -> the value of a diagnosis that it follows from, in words."""
    typed_in: ClassVar[bool] = False
    """Whether it is tried only for a control that has it: there are better ones."""
    reshapes: ClassVar[bool] = False
    """Whether it changes how a machine without the effect follows too, from which the rest of the effect is then counted."""

    incoming = Input("{signal}", doc="what the control would send")
    outgoing = Output("{signal}", doc="what it sends instead")
    share = Parameter("1", 1.0, low=0.0, high=3.0, doc="how much of the remedy acts: 1 the whole, 0 nothing")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the sizes against an effect that it answers, for ``lathesim remedy``; None where a person has to size it."""
        return None

    if not TYPE_CHECKING:  # the law of a subclass takes other names, which is what laws are for

        @staticmethod
        def output(incoming: float) -> float:
            """Pass on."""
            return incoming


def with_added(incoming: float, share: float, added: float) -> float:
    """Return what the control would send with the share of what is added in this sample: the law of many a remedy."""
    return incoming if share == 0.0 else incoming + share * added


SHORTEST = 1.0e-7


def followed(position: float, rate: float, asked: float, lag: float, inner: float, time: float) -> tuple[float, float]:
    """Return position and rate of the model after some ``time`` in which ``asked`` is held."""
    if lag < SHORTEST:
        return asked, (asked - position) / time
    return followed_running(position, rate, asked, 0.0, lag, inner if inner >= SHORTEST else 0.0, time)


def ahead(before: float, now: float, following: float, lag: float, inner: float, period: float) -> float:
    """Return what must be added to a held reference so that the axis moves by ``now``, then ``following``, a sample later.

    The inverse of the model at the middle of the sample:  c + T c' + T T_i c''.
    """
    middle = 0.5 * (now + following)
    return middle + lag * (following - now) / period + lag * inner * (following - 2.0 * now + before) / (period * period)


class ModelledRemedy(Remedy):
    """A remedy that knows where the axis will be, from the reference and a model of the loop; see the module. It passes on its input."""

    drive = Input("{drive}", doc="commanded position")
    lag = Parameter("s", 0.0, low=0.0, high=10.0, doc="T: distance behind over velocity; 0 follows at once")
    inner = Parameter("s", 0.0, low=0.0, high=10.0, doc="T_i: time constant of the speed inside the loop")
    model_position = DiscreteState("{drive}", doc="where the model is at the end of this sample")
    model_rate = DiscreteState("({drive})/s", doc="how fast it is then")

    if not TYPE_CHECKING:  # the law of a subclass takes other names, which is what laws are for

        @staticmethod
        def update(
            drive: float, lag: float, inner: float, model_position: float, model_rate: float, sample_period: float, time: float
        ) -> tuple[float, float]:
            """Follow the reference."""
            if time <= 0.0:
                return drive, 0.0
            return followed(model_position, model_rate, drive, lag, inner, sample_period)
