"""The closed controller: transport delays keep the order of RK4, and the nominal machine has the numbers of its equations."""

import cmath
import math

import numpy as np
import pytest
from scipy.linalg import expm

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.signals import DelayLine
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import SimulationError
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.lessons.simulate import prepare, run_prepared, simulate
from lathesim.plugins import Registry
from lathesim.record import Record

LESSON = "27_a_controller_that_tells_nothing"


class LateTank(Component):
    """A level that is filled ever faster and empties with what it was:  dx/dt = t^4 - r x(t - d)."""

    late = Input("m", doc="level one delay ago")
    rate = Parameter("1/s", 1.0, doc="r")
    level = State("m", doc="level")
    value = Output("m", doc="level")

    @staticmethod
    def derivative(late: float, rate: float, time: float) -> float:
        return time * time * time * time - rate * late

    @staticmethod
    def output(level: float) -> float:
        return level


def late_tank(step: float, delay: float, duration: float) -> Record:
    """Run dx/dt = t^4 - x(t - d), x = 0 until the start."""
    parts = (Part("tank", LateTank), Part("line", DelayLine.with_units({"signal": "m"}), {"delay": delay}))
    wires = (Wire("tank.late", "line.outgoing"), Wire("line.incoming", "tank.value"))
    return run(wire(Assembly(parts, wires, step, step)), duration=duration, engine="plain")


def exact_level(time: float, delay: float) -> float:
    """Return the solution by the method of steps: the sum over k of (-1)^k 4! (t - k d)^(5 + k)/(5 + k)! while t > k d."""
    terms = range(math.ceil(time / delay))
    return math.fsum((-1) ** k * 24.0 * (time - k * delay) ** (5 + k) / math.factorial(5 + k) for k in terms)


@pytest.mark.parametrize("rest", [0.0, 0.37, 0.8])
def test_delay_keeps_the_fourth_order_of_runge_kutta(rest: float) -> None:
    delay = 0.4
    steps = [delay / (whole + rest) for whole in (4, 8, 16, 32)]
    errors = []
    for step in steps:
        record = late_tank(step, delay, 2.0)
        exact = [exact_level(float(time), delay) for time in record.time]
        errors.append(np.abs(record.channels["tank.value"].values - exact).max())
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.15)


def test_delayed_cubic_arrives_exactly() -> None:
    class Cubic(Component):
        """A cubic of time."""

        value = Output("m", doc="cubic")

        @staticmethod
        def output(time: float) -> float:
            return time * time * time - 0.3 * time * time

    parts = (Part("source", Cubic), Part("line", DelayLine.with_units({"signal": "m"}), {"delay": 0.0237}))
    record = run(wire(Assembly(parts, (Wire("line.incoming", "source.value"),), 0.01, 0.01)), duration=1.0, engine="plain")
    late = record.time[20:] - 0.0237
    assert record.channels["line.outgoing"].values[20:] == pytest.approx(late**3 - 0.3 * late**2, abs=1e-12)


def test_staircase_lags_by_what_the_loop_gain_and_the_delay_give(registry: Registry) -> None:
    record = simulate(load_lesson(LESSON), registry, "staircase", engine="compiled")
    error = record.channels["interpolator.x_reference"].values - record.channels["x_axis.position"].values
    just_before_the_corner = int(np.searchsorted(record.time, 2.0 - 1e-9))
    # kv e = v with e = reference - x(t - d); the reference is held, on average half a sample late
    lag = 6e-3 * (1 / 20 - 1e-3 + 0.5 * 0.25e-3)
    assert error[just_before_the_corner] == pytest.approx(lag, abs=1e-7)
    after = slice(just_before_the_corner, just_before_the_corner + 8000)
    assert record.channels["x_axis.position"].values[after].max() - 12e-3 == pytest.approx(0.0005e-3, abs=0.05e-6)
    assert abs(error[-1]) < 1e-9
    assert record.time[-1] == pytest.approx(25.0)


@pytest.mark.slow
def test_too_long_a_delay_swings_up_at_the_rate_of_its_rightmost_root(registry: Registry) -> None:
    overrides = {"x_late_position.delay": "2.6 ms"}
    with pytest.raises(SimulationError, match="stopped being a number") as caught:
        simulate(load_lesson(LESSON), registry, "staircase", overrides, engine="compiled")
    record = caught.value.record
    assert record is not None
    speed = np.abs(record.channels["x_axis.velocity"].values)
    peaks = [place for place in range(len(speed) // 3, len(speed) - 1) if speed[place - 1] < speed[place] >= speed[place + 1]]
    rate = np.polyfit(record.time[peaks], np.log(speed[peaks]), 1)[0]
    assert rate == pytest.approx(rightmost_root(2.6e-3, 90 + 450j).real, rel=0.01)
    assert rightmost_root(2.0e-3, 25 + 486j).real < 0.0 < rightmost_root(2.1e-3, 25 + 486j).real


def test_two_milliseconds_ring_slowly_away_and_swing_up_only_where_late_values_are_held(registry: Registry) -> None:
    record = simulate(load_lesson(LESSON), registry, "staircase", {"x_late_position.delay": "2 ms"}, engine="compiled")
    jerky = np.abs(np.diff(record["x_axis.velocity"], 2))
    first = int(np.searchsorted(record.time, 2.02))
    peaks = [place for place in range(first, first + 800) if jerky[place - 1] < jerky[place] >= jerky[place + 1]]
    rate = np.polyfit(record.time[peaks], np.log(jerky[peaks]), 1)[0]
    assert rate == pytest.approx(rightmost_root(2.0e-3, 25 + 486j).real, rel=0.2)
    assert rightmost_root(2.0e-3, 25 + 486j).real == pytest.approx(-14.2, abs=0.05)
    # a simulation that counts the delay in steps and holds what arrives over each is late by half a step more
    assert held_rate(2.0e-3, 0.25e-3) == pytest.approx(11.0, abs=0.05)
    assert held_rate(2.0e-3, 0.02e-3) < 0.0


def held_rate(delay: float, step: float) -> float:
    """Return how fast the X slide grows [1/s] where late values are those of whole steps ago, held over a step: exact in between.

    States: four swings, four rates, both integrals, voltage, current, speed, position, by equations (1) to (5).
    """
    now, late = np.zeros((14, 14)), np.zeros((14, 14))
    speed_sum, power_sum, voltage, current, speed, place = range(8, 14)
    wanted, wanted_late = np.zeros(14), np.zeros(14)
    wanted_late[place] = -20.0
    for number, (frequency, damping) in enumerate(zip((6.0, 15.0, 40.0, 90.0), (0.5, 0.4, 0.3, 0.3), strict=True)):
        now[number, 4 + number] = 1.0
        now[4 + number, [number, 4 + number]] = -frequency * frequency, -2.0 * frequency * damping
        late[4 + number, place] = -1.0
        wanted[4 + number] = 20.0 * 0.02 * frequency
    wanted_late[speed] = -1.0
    now[speed_sum], late[speed_sum] = wanted, wanted_late
    asked, asked_late = 166.7 * wanted, 166.7 * wanted_late
    asked[speed_sum] += 6944.0
    asked_late[current] -= 1.0
    now[power_sum], late[power_sum] = asked, asked_late
    now[voltage], late[voltage] = 0.833 * asked / 0.002, 0.833 * asked_late / 0.002
    now[voltage, power_sum] += 166.7 / 0.002
    late[voltage, voltage] -= 1.0 / 0.002
    now[current, voltage] = 200.0
    late[current, [speed, current]] = -200.0 * 50.0, -200.0
    now[speed, current], late[speed, speed], now[place, speed] = 0.5, -5.0, 1.0
    both = expm(step * np.block([[now, np.eye(14)], [np.zeros((14, 28))]]))
    count = round(delay / step)
    whole = np.eye(14 * (count + 1), k=-14)
    whole[:14, :14], whole[:14, 14 * count :] = both[:14, :14], both[:14, 14:] @ late
    return float(np.log(np.abs(np.linalg.eigvals(whole)).max()) / step)


def interpolated(registry: Registry, period: str, **values: str) -> Record:
    """Run the staircase with the jerk-limited interpolator."""
    lesson = load_lesson(LESSON)
    given = {f"interpolator.{name}": text for name, text in values.items()}
    replaced = {"interpolator": "JerkLimitedInterpolator"}
    text = changed_lesson(lesson, [], given, lesson.path.parent, replace=replaced, further={"sample_period": period, "step": period})
    return run_prepared(prepare(lesson_from_text(text, lesson.path), registry, "staircase"), engine="compiled")


@pytest.mark.slow
def test_jerk_limited_interpolator_is_the_mean_of_ramps_whatever_the_sample_period(registry: Registry) -> None:
    time = np.arange(0.0, 2.5, 1e-5)
    level = np.where(time < 0.02, 0.15 * time**2, 0.15 * 0.02**2 + 6e-3 * (time - 0.02))
    ramp = np.where(time < 2.0, level, 12e-3 - 0.15 * np.maximum(2.02 - time, 0.0) ** 2)
    summed = np.concatenate([[0.0], np.cumsum(0.5e-5 * (ramp[1:] + ramp[:-1]))])
    mean = (summed - np.interp(time - 0.06, time, summed)) / 0.06
    for period in ("0.25 ms", "0.7 ms", "0.025 ms"):
        record = interpolated(registry, period, acceleration="0.3 m/s^2", averaging="60 ms", pause="80 ms")
        early = record.time < 2.4
        x = record["interpolator.x_reference"][early]
        assert np.abs(x - np.interp(record.time[early], time, mean)).max() < 1e-7
        z_moves = record.time[np.argmax(record["interpolator.z_reference"] > 1e-9)]
        assert z_moves == pytest.approx(2.1, abs=2e-3)
        assert record.time[-1] == pytest.approx(12 * 2.1 + 1.0 + 0.06, abs=2e-3)


@pytest.mark.parametrize(("cycle", "late"), [("1 ms", 0.0), ("8 ms", 4e-3)])
def test_a_block_takes_whole_cycles_of_the_control(registry: Registry, cycle: str, late: float) -> None:
    record = interpolated(registry, "0.25 ms", acceleration="0.3 m/s^2", cycle=cycle)
    # 12 mm at 6 mm/s with ramps of 20 ms take 2.020 s: whole milliseconds, and 2.024 s in cycles of 8 ms; 1 s of rest are 125 of them
    z_moves = record.time[np.argmax(record["interpolator.z_reference"] > 1e-9)]
    assert z_moves == pytest.approx(2.02 + late, abs=1e-3)
    assert record.time[-1] == pytest.approx(12 * (2.02 + late) + 1.0, abs=1e-3)


def rightmost_root(delay: float, start: complex) -> complex:
    """Return the root of the closed loop of the X slide near ``start``, by Newton's method on equations (1) to (5)."""

    def characteristic(s: complex) -> complex:
        late = cmath.exp(-s * delay)
        elements = zip((6, 15, 40, 90), (0.5, 0.4, 0.3, 0.3), strict=True)
        position = 20 * (1 + sum(0.02 * w * s / (s * s + 2 * w * z * s + w * w) for w, z in elements))
        current = (s + 5 * late) * s / 0.5
        voltage = (s + 200 * late) * current / 200 + 50 * late * s
        asked = (166.7 + 6944 / s) * (-position * late - late * s)
        return (0.002 * s + late) * voltage - (0.833 + 166.7 / s) * (asked - late * current)

    root = start
    for _ in range(80):
        slope = (characteristic(root + 1e-4) - characteristic(root - 1e-4)) / 2e-4
        root -= characteristic(root) / slope
    return root
