"""The flexible tool of the campaign against the border of stability of an orthogonal cut, and against the balance of what it takes."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.live.even_clock import Stretch
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.live.watching.watch import Watch
from tests.live.campaign.cases import channels, prepared
from tests.live.campaign.flexible_tool import CLAMPED, DEEP, PRESSURE, RADIUS, SHARE, Tool, loose, thickness
from tests.live.campaign.machines import cut

PERIOD = 1e-3
TOOL = Tool(22.0, 12.5e6, 0.03)


def _border(tool: Tool, speed: float) -> float:
    """Return the border of stability [N/m] at a cutting speed: force along the chip per thickness.

    A tool that swings at w without growing holds 1 + K G(w) (1 - exp(-i w T)) = 0 with G = 1 / (k - m w^2 + i c w). K is then
    -1 / (2 Re G), and w T = 3 pi + 2 arg(G), up to whole waves (Altintas, Manufacturing Automation, 2nd ed. 2012, section 4.2.1).
    """
    natural = np.sqrt(tool.stiffness / tool.mass)
    w = natural * np.linspace(1.0005, 1.6, 200_000)
    answer = 1.0 / (tool.stiffness - tool.mass * w**2 + 2j * tool.damping * np.sqrt(tool.stiffness * tool.mass) * w)
    whole = (w * 2.0 * np.pi * RADIUS / speed - 3.0 * np.pi - 2.0 * np.angle(answer)) / (2.0 * np.pi)
    crossed = np.flatnonzero(np.diff(np.floor(whole)) != 0.0)
    return float(np.min(-0.5 / answer.real[crossed]))


def _growth(tool: Tool, force: float, speed: float) -> float:
    """Return the logarithm of how much the swing of the chip grows in a turn, in the later half of 3 s."""
    count = 3000
    feed, held, fast = (np.full(count, value) for value in (1.0, force, speed))  # a chip of a metre, which no swing leaves
    chip = thickness(feed, held, fast, (tool, tool), np.zeros(count), PERIOD)
    turn = round(2.0 * np.pi * RADIUS / speed / PERIOD)
    early, late = (np.std(chip[end - 4 * turn : end]) for end in (count // 2, count))
    return float(np.log(late / early) / (count / 2) * turn)


@pytest.mark.parametrize("speed", [1.5, 2.0, 2.1, 2.5, 4.0])
def test_the_swing_dies_just_below_the_border_and_grows_just_above(speed: float) -> None:
    border = _border(TOOL, speed)
    assert _growth(TOOL, 0.97 * border, speed) < 0.0 < _growth(TOOL, 1.03 * border, speed)


def test_the_lowest_border_over_speeds_is_the_known_formula() -> None:
    lowest = min(_border(TOOL, speed) for speed in np.linspace(1.5, 4.0, 300))
    assert lowest == pytest.approx(2.0 * TOOL.stiffness * TOOL.damping * (1.0 + TOOL.damping), rel=1e-3)


@pytest.mark.parametrize("beyond", [1.3, 1.45, 1.6])
def test_a_loose_clamp_lets_the_deep_passes_cross_the_border_and_no_other(beyond: float) -> None:
    tool = loose(beyond)
    deep, shallow = SHARE * PRESSURE * DEEP, SHARE * PRESSURE * 0.6e-3
    assert 1.0 <= _border(tool, 2.0) / (deep / beyond) < 1.02  # 2 m/s is next to the worst speed of its lobe
    assert shallow < _border(tool, 2.5)
    assert deep < 0.1 * min(_border(CLAMPED, speed) for speed in (2.0, 2.5))


def _developed(beyond: float) -> np.ndarray:
    """Return the last turns of a deep pass of 6 s with a loose clamp, at a feed of 0.2 mm [m]."""
    count = 6000
    feed, held, fast = (np.full(count, value) for value in (0.2e-3, SHARE * PRESSURE * DEEP, 2.0))
    return thickness(feed, held, fast, (CLAMPED, loose(beyond)), np.ones(count), PERIOD)[-3142:]  # 50 turns of 62.83 ms


def test_developed_chatter_leaves_the_cut_and_takes_what_is_fed() -> None:
    chip = _developed(1.4)
    assert np.min(chip) == 0.0 and 0.1 < np.mean(chip == 0.0) < 0.5
    assert np.mean(chip) == pytest.approx(0.2e-3, rel=0.01)  # what one turn leaves, another takes


def test_developed_chatter_swings_a_little_above_the_mode() -> None:
    chip = _developed(1.4) - 0.2e-3
    strength = np.abs(np.fft.rfft(chip * np.hanning(len(chip))))
    line = np.fft.rfftfreq(len(chip), PERIOD)[np.argmax(strength)]
    mode = np.sqrt(loose(1.4).stiffness / CLAMPED.mass) / (2.0 * np.pi)
    assert mode < line < 1.06 * mode
    assert abs(line * 2.0 * np.pi * RADIUS / 2.0 - round(line * 2.0 * np.pi * RADIUS / 2.0)) > 0.1  # no whole number a turn


def test_a_clamped_tool_takes_an_even_chip() -> None:
    feed, held, fast = (np.full(2000, value) for value in (0.3e-3, SHARE * PRESSURE * DEEP, 2.0))
    chip = thickness(feed, held, fast, (CLAMPED, CLAMPED), np.zeros(2000), PERIOD)
    assert np.max(np.abs(chip / 0.3e-3 - 1.0)) < 0.005


def test_a_turn_longer_than_the_line_of_the_surface_is_refused() -> None:
    one = np.ones(10)
    with pytest.raises(ValueError, match=r"a turn takes longer than 0\.41 s"):
        thickness(1e-4 * one, one, 0.1 * one, (TOOL, TOOL), 0.0 * one, PERIOD)


def test_the_watch_tells_chatter_by_its_noise_and_not_as_values_that_move() -> None:
    seconds, begin = 90.0, 72.0
    time = np.arange(round(seconds / PERIOD)) * PERIOD
    values = cut(seconds, 39, {"chatter": np.where(time >= begin, 1.4, 0.0)})
    watch = Watch(ResidualStream(prepared("cut"), *channels("cut"), PERIOD), PERIOD, learn=40.0)
    (alarm, *_) = watch.take(Stretch(0.0, values, True))
    assert alarm.state == "in its noise"
    assert begin <= alarm.begun < alarm.time < begin + 10.0
