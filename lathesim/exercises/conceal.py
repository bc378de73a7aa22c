"""A recording in which something is hidden: the lesson's machine with effects, other values and noise, run by another integrator.

The machine is not the model: its uncertain values are drawn within what the lesson calls uncertain, its sensors have noise, it is run by
Heun's method with a tenth of the step, and what is logged is rounded. What is written down of it is what a class would be given.

A machine run by another integrator than the engine's: Heun's method with a finer step, for recordings whose truth is not the model's.

    k1 = f(t, x),   k2 = f(t + h, x + h k1),   x <- x + h/2 (k1 + k2)

The laws, their order and the sample instants are those of the fused plan; the stepping between two instants is another. What is of second
order here and of fourth there differs in the last digits, as two programs of two people would, and a friction that holds a body within
two steps holds it in other instants. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Parameter
from lathesim.engine.assembly import Assembly, FloatArray
from lathesim.engine.rk4 import HEUN
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError, SimulationError
from lathesim.exercises.hidden_effect import HiddenEffect, HiddenWish, drawn_values, place_wishes
from lathesim.exercises.logger import LoggedColumn
from lathesim.identification.replay.open_loop import drive, seen
from lathesim.identification.signal import channel_floor
from lathesim.lessons.sensor_sides import with_sensor_noise
from lathesim.limit import derived
from lathesim.record import Record

FINER = 10
"""Steps of this run for each step of the lesson."""


def fine_plan(assembly: Assembly, *, finer: int = FINER) -> Plan:
    """Return the plan of an assembly that runs by Heun's method with steps ``finer`` times shorter."""
    return wire(replace(assembly, step=assembly.step / finer), HEUN)


def fine_run(plan: Plan, duration: float | None, overrides: Mapping[str, float] | None = None, *, seed: int = 0) -> Record:
    """Run a plan made by :func:`fine_plan` and give its Record; raises :class:`SimulationError` where a law breaks."""
    # short blocks: where a size breaks the machine, the last one is run once more in plain Python, to find the law
    return run(plan, duration=duration, seed=seed, overrides=overrides, hints=Hints(largest_block=10 * FINER))


_FOUND = derived(3.0, "noise floors", "effects that move a channel by more can be found", "normal noise goes beyond once in 370 samples")
SEEN = 5.0
"""Floors by which an effect of drawn size must move a channel."""
_TOO_LARGE = 3.0
"""Standard deviations of a channel by which an effect of drawn size may move it: more is a broken machine."""
DRAWS = 25
"""How often what cannot be seen is drawn again."""
_LARGEST_DEVIATION = 2.0
"""Standard deviations within which the true values are drawn."""


class NotSeenError(LessonError):
    """No usual size of an effect is seen in the recording."""


@dataclass(frozen=True)
class Difficulty:
    """How well a drawn effect is to be seen: ``floors`` by which it moves the channel that shows it best, ``within`` a share of these.

    An effect is drawn ``draws`` times, and each time ``sizes`` are tried, from ``least`` of the drawn one to the end of the usual range,
    each at most ``stride`` times the last one.
    """

    floors: float
    within: float = 0.1
    draws: int = 3
    sizes: int = 8
    least: float = 0.02
    stride: float = 10.0


@dataclass(frozen=True)
class Situation:
    """One run of the machine: its assembly, how long it lasts [s] (none: until it ends itself), and recorded drive signals [SI]."""

    assembly: Assembly
    duration: float | None
    signals: Mapping[str, FloatArray]


@dataclass(frozen=True)
class TrueValue:
    """A value of the machine as the lesson gives it, and as it is [``unit``]."""

    given: float
    true: float
    unit: str


@dataclass(frozen=True)
class Concealed:
    """What was hidden and recorded: a table (columns, samples) [SI] for each situation, and the truth behind it.

    ``true_values`` tells what the lesson calls uncertain; ``moves`` by how many floors the hidden effects
    together move each compared channel.
    """

    hidden: tuple[HiddenEffect, ...]
    columns: tuple[LoggedColumn, ...]
    times: tuple[FloatArray, ...]
    tables: tuple[FloatArray, ...]
    true_values: Mapping[str, TrueValue]
    moves: Mapping[str, float]

    @property
    def lost_in_noise(self) -> str:
        """The sentence of a case whose effects move no channel visibly; empty where one is moved."""
        if not self.moves or max(self.moves.values()) >= _FOUND:
            return ""
        return "No recorded channel is moved by three times its noise: nobody can find this."


def conceal(
    situations: Sequence[Situation],
    columns: Sequence[LoggedColumn],
    wishes: Sequence[HiddenWish],
    uncertain: Mapping[str, float],
    *,
    seed: int,
    noise: float = 1.0,
    wanted: Difficulty | None = None,
) -> Concealed:
    """Hide the wishes in a machine and record it in each situation.

    ``uncertain`` gives one standard deviation [SI] by name, ``noise`` that of each sensor in steps of its resolution. Sizes that were not
    given are drawn until the effect is seen; raises :class:`NotSeenError` where none is. With ``wanted`` a drawn effect is as hard to find
    as that says.
    """
    rng = np.random.default_rng([seed, 1])
    machines = [TrueMachine(situation, columns, wishes, noise) for situation in situations]
    true_values = {name: _drawn(machines[0].plan, name, deviation, rng) for name, deviation in uncertain.items()}
    baseline = {name: item.true for name, item in true_values.items()}
    columns = machines[0].with_resolution(columns, baseline)
    hidden, moves = _sized(machines[0], columns, baseline, rng, noise, wanted)
    overrides = {**baseline, **_overrides(hidden)}
    records = [machine.run(overrides, seed + position) for position, machine in enumerate(machines)]
    tables = []
    for position, (machine, record) in enumerate(zip(machines, records, strict=True)):
        tables.append(logged(record, machine, columns, noise, seed + position))
    return Concealed(hidden, tuple(columns), tuple(record.time for record in records), tuple(tables), true_values, moves)


class TrueMachine:
    """The true machine in one situation, made ready to be run with other values."""

    def __init__(
        self, situation: Situation, columns: Sequence[LoggedColumn], wishes: Sequence[HiddenWish], noise: float, further: Sequence[str] = ()
    ) -> None:
        driven = drive(situation.assembly, situation.signals) if situation.signals else situation.assembly
        placed, self.hidden = place_wishes(driven, wishes, [column.target for column in columns if column.role == "compare"])
        noisy = _with_noise(placed, columns, noise)
        self.channels = [seen(placed, column.channel) for column in columns]
        self.extra = {name: seen(placed, name) for name in further}
        """Further outputs, and the channels by which they are recorded."""
        self.plan = fine_plan(replace(noisy, record=tuple(dict.fromkeys((*self.channels, *self.extra.values())))))
        self.duration = situation.duration

    def run(self, overrides: Mapping[str, float], seed: int) -> Record:
        """Run the machine with other values."""
        return fine_run(self.plan, self.duration, overrides, seed=seed)

    def with_resolution(self, columns: Sequence[LoggedColumn], baseline: Mapping[str, float]) -> list[LoggedColumn]:
        """Return the columns, each with the step it is rounded to: the one it has, or that of a 16-bit logger over its range."""
        record = self.run({**baseline, **_neutral(self.hidden)}, 0)
        return [column.over(record[channel]) for column, channel in zip(columns, self.channels, strict=True)]


def _with_noise(assembly: Assembly, columns: Sequence[LoggedColumn], noise: float) -> Assembly:
    """Put noise before every logged sensor that counts in steps: there it is part of the loop."""
    sizes = {}
    for sensor in dict.fromkeys(column.sensor for column in columns if column.sensor):
        part = assembly.by_name[sensor]
        sizes[sensor] = noise * part.parameters.get(part.component.ports["resolution"], 0.0)
    return with_sensor_noise(assembly, sizes)


def _drawn(plan: Plan, name: str, deviation: float, rng: np.random.Generator) -> TrueValue:
    """Draw the true value of a name, ``deviation`` [SI] being one standard deviation."""
    given = plan.given(name)
    declared = plan.declaration(name)
    low, high = (declared.low, declared.high) if isinstance(declared, Parameter) else (-math.inf, math.inf)
    off = float(np.clip(rng.standard_normal(), -_LARGEST_DEVIATION, _LARGEST_DEVIATION)) * deviation
    return TrueValue(given, float(np.clip(given + off, low, high)), declared.unit)


def _overrides(hidden: Sequence[HiddenEffect]) -> dict[str, float]:
    return {name: value for item in hidden for name, value in item.overrides.items()}


def _neutral(hidden: Sequence[HiddenEffect]) -> dict[str, float]:
    return {name: value for item in hidden for name, value in item.neutral.items()}


def _sized(
    machine: TrueMachine,
    columns: Sequence[LoggedColumn],
    baseline: Mapping[str, float],
    rng: np.random.Generator,
    noise: float,
    wanted: Difficulty | None,
) -> tuple[tuple[HiddenEffect, ...], dict[str, float]]:
    """Return the hidden effects with their values, and by how many floors they move each compared channel together."""
    if not machine.hidden:
        return (), {}
    neutral = _neutral(machine.hidden)
    without = machine.run({**baseline, **neutral}, 0)
    floors = {
        column.target: max(column.floor(noise), channel_floor(without[channel], column.resolution))
        for column, channel in zip(columns, machine.channels, strict=True)
    }

    def moved(tried: HiddenEffect) -> float:
        """Return by how many floors an effect alone moves the channel that shows it best; infinity where it breaks the machine."""
        try:
            record = machine.run({**baseline, **neutral, **tried.overrides}, 0)
        except SimulationError:
            return math.inf
        found = max(_moves(machine, columns, without, record, floors).values())
        return math.inf if tried.size_is_drawn and _is_broken(machine, columns, without, record) else found

    least = SEEN if wanted is None else wanted.floors
    sized: list[HiddenEffect] = []
    for item in machine.hidden:
        for _ in range((DRAWS if wanted is None else wanted.draws) if item.drawn else 1):
            tried = _of_size(drawn_values(item, rng), moved, wanted)
            if tried is not None:
                sized.append(tried)
                break
        else:
            fact = f"no usual size of {item.effect.__name__} at {item.at} moves a recorded channel by {least:g} times its noise."
            raise NotSeenError(fact, remedy="Give its values, or hide another effect.")
    return tuple(sized), _moves(machine, columns, without, machine.run({**baseline, **_overrides(sized)}, 0), floors)


def _of_size(drawn: HiddenEffect, moved: Callable[[HiddenEffect], float], wanted: Difficulty | None) -> HiddenEffect | None:
    """Return a drawn effect if it is seen, or of the size that is as hard to find as ``wanted``; none where there is no such size.

    The motion is nearly proportional to a power of the size: between a size that is too small and one that is too large the next one is
    on the line through both, in logarithms.
    """
    found = moved(drawn)
    if not drawn.size_is_drawn:
        return drawn if math.isfinite(found) else None
    if wanted is None:
        return drawn if SEEN <= found < math.inf else None
    share, below, above = 1.0, (0.0, 0.0), (math.inf, math.inf)
    for _ in range(wanted.sizes):
        if abs(found / wanted.floors - 1.0) <= wanted.within:
            return drawn.scaled(share)
        below, above = ((share, found), above) if found < wanted.floors else (below, (share, found))
        share = _next_share(below, above, wanted)
        if not wanted.least <= share <= drawn.largest_share:
            return None
        found = moved(drawn.scaled(share))
    return None


def _next_share(below: tuple[float, float], above: tuple[float, float], wanted: Difficulty) -> float:
    """Return the next share to try; ``below`` and ``above`` are the nearest shares with their motions, 0 or infinity where unknown."""
    if above[0] == math.inf:
        return below[0] * (min(wanted.stride, wanted.floors / below[1]) if below[1] > 0.0 else wanted.stride)
    if below[0] == 0.0:
        return above[0] * max(1.0 / wanted.stride, wanted.floors / above[1])
    if below[1] == 0.0 or above[1] == math.inf or above[0] <= below[0]:
        return math.sqrt(below[0] * above[0])
    power = math.log(above[1] / below[1]) / math.log(above[0] / below[0])
    return float(below[0] * (wanted.floors / below[1]) ** (1.0 / power))


def _moves(
    machine: TrueMachine, columns: Sequence[LoggedColumn], without: Record, record: Record, floors: Mapping[str, float]
) -> dict[str, float]:
    """Return by how many floors each compared channel moves; the floor holds what the sensors' noise makes of it in the loop."""
    moved = {}
    for column, channel in zip(columns, machine.channels, strict=True):
        if column.role == "compare":
            count = min(len(without), len(record))
            change = float(np.sqrt(np.mean((record[channel][:count] - without[channel][:count]) ** 2)))
            moved[column.target] = change / floors[column.target]
    return moved


def _is_broken(machine: TrueMachine, columns: Sequence[LoggedColumn], without: Record, record: Record) -> bool:
    """Return whether an effect is so large that the machine no longer does its work."""
    for column, channel in zip(columns, machine.channels, strict=True):
        count = min(len(without), len(record))
        change = float(np.sqrt(np.mean((record[channel][:count] - without[channel][:count]) ** 2)))
        if column.role == "compare" and change > _TOO_LARGE * float(np.std(without[channel])) + np.finfo(float).tiny:
            return True
    return False


def logged(record: Record, machine: TrueMachine, columns: Sequence[LoggedColumn], noise: float, seed: int) -> FloatArray:
    """Return what the logger writes down, shape (columns, samples) [SI]."""
    rows = []
    for position, (column, channel) in enumerate(zip(columns, machine.channels, strict=True)):
        rows.append(column.logged(record[channel], noise, np.random.default_rng([seed, 2, position])))
    return np.array(rows)
