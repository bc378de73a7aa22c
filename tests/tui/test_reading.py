"""What a person reads in the app: names, units, zeros, differences, amplitudes and labels; and what is kept until the next start."""

from __future__ import annotations

import numpy as np
import pytest
from textual.color import Color
from textual.theme import BUILTIN_THEMES

from lathesim.analysis.display_unit import plain_name, pretty_quantities, shown_with_unit
from lathesim.analysis.metric import Measured
from lathesim.cli.open_app import FIRST_LESSON, make_app
from lathesim.errors import LatheSimError
from lathesim.record import Channel, Record
from lathesim.tui.drawing.curves import Cursors, Curve, peak_words, scaled, spectrum_lines
from lathesim.tui.model.student_book import STATE, KeptState
from lathesim.tui.widgets.controls import readings


def record(**channels: tuple[str, np.ndarray]) -> Record:
    """Return a record of channels, given as ``part__port`` with unit and values, 1000 samples a second."""
    found = {name.replace("__", "."): value for name, value in channels.items()}
    count = len(next(iter(found.values()))[1])
    return Record(np.arange(count) / 1000.0, {name: Channel(name, unit, values, "") for name, (unit, values) in found.items()})


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("contour.contour_error", "contour error"),
        ("sensed_contour.contour_error", "sensed contour error"),
        ("cutting_force.radial_force", "cutting radial force"),
        ("x_dac.voltage", "X D/A voltage"),
        ("max_contour_error", "largest contour error"),
        ("x_controller", "X controller"),
    ],
)
def test_a_name_is_read_in_plain_words(name: str, words: str) -> None:
    assert plain_name(name) == words


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (-1.47e-17, "m", "0 mm"),
        (2e-12, "m", "0.002 nm"),
        (5.2e-6, "m", "5.2 um"),
        (1e-17, "rad/s", "0 rpm"),
        (1e-17, "1", "1e-17"),
        (1e-11, "m^2*s", "1e-05 mm^2*s"),
    ],
)
def test_a_remainder_of_the_arithmetic_is_zero_and_a_small_value_is_not(value: float, unit: str, text: str) -> None:
    assert shown_with_unit(value, unit) == text


def test_units_have_their_signs_and_words_stay_as_they_are() -> None:
    assert pretty_quantities("best 5 um in 3 us, 0.1 mm^2*s; let us see 2 parts") == "best 5 µm in 3 µs, 0.1 mm²·s; let us see 2 parts"


def test_the_feed_is_read_as_in_the_program() -> None:
    speeds = {"x_axis__velocity": 0.0, "z_axis__velocity": 0.003, "interpolator__feed_speed": -1.47e-17}
    moving = record(**{name: ("m/s", np.full(2, speed)) for name, speed in speeds.items()})
    feed = next(line for line in readings(moving, 0) if line.title == "Feed")
    assert (feed.actual, feed.wanted) == ("180 mm/min", "0 mm/min")
    assert readings(moving, 0, first=["interpolator.feed_speed"])[1].actual == "0 mm/min"
    titles = [line.title for line in readings(moving, 0, first=["x_axis.velocity", "z_axis.velocity"])]
    assert titles[1:3] == ["X axis", "Z axis"]
    assert str(Measured("max_feed_speed", 0.003, "m/s")) == "180 mm/min"
    assert Cursors().at(0.0).value_words(moving, "interpolator.feed_speed") == ": 0 mm/min"
    ((_, drawn),) = scaled([Curve(moving, "interpolator.feed_speed")], fit_to_feed=False)
    assert drawn.unit == "mm/min"


def test_two_cursors_give_the_difference_and_its_frequency() -> None:
    ramp = record(contour__contour_error=("m", np.linspace(0.0, 1e-3, 1001)))
    cursors = Cursors().at(0.2).marked().at(0.7)
    assert cursors.words == "t = 0.7 s, Δt = 500 ms (2 Hz) from 0.2 s"
    assert cursors.value_words(ramp, "contour.contour_error") == ": 0.7 mm, Δ 0.5 mm"
    assert (cursors.span, cursors.marked().span) == ((0.2, 0.7), None)


def test_the_spectrum_shows_amplitude_and_frequency_of_a_wave() -> None:
    time = np.arange(2000) / 1000.0
    wave = record(cut__wave=("m", 3e-3 + 5e-6 * np.sin(2.0 * np.pi * 40.0 * time)))
    (line,) = spectrum_lines([Curve(wave, "cut.wave")], (0.5, 1.5))
    assert (line.x[np.argmax(line.y)], line.y.max()) == (pytest.approx(40.0, abs=0.1), pytest.approx(5.0, rel=0.02))
    assert peak_words(line) == "cut wave [µm]: largest 4.99 at 39.96 Hz"


def luminance(colour: Color) -> float:
    """Return the relative luminance of WCAG 2.1."""
    parts = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in colour.normalized]
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]


@pytest.mark.parametrize("name", [name for name, theme in BUILTIN_THEMES.items() if not theme.ansi])
def test_labels_of_axes_stand_out_in_every_theme(name: str) -> None:
    """Labels and marks have the colour ``$foreground`` on ``$background``; WCAG 2.1 asks for a contrast of 4.5."""
    colours = BUILTIN_THEMES[name].to_color_system().generate()
    light, dark = sorted((luminance(Color.parse(colours[key])) for key in ("foreground", "background")), reverse=True)
    assert (light + 0.05) / (dark + 0.05) >= 4.5


def test_theme_lesson_and_screen_are_kept_in_the_folder() -> None:
    fresh = make_app()
    assert (fresh._lessons, fresh._first) == ([(FIRST_LESSON, "")], "bench")
    KeptState("nord", "02_quantisation", "8_bits", "lessons").write()
    app = make_app()
    assert (app.theme, app._lessons[0], app._first) == ("nord", ("02_quantisation", "8_bits"), "lessons")
    assert app._lessons[1:] == [("02_quantisation", ""), (FIRST_LESSON, "")]
    with pytest.raises(LatheSimError, match="no variant 'gone'"):
        app.workbench.open_lesson("02_quantisation", "gone")
    STATE.write_text('{"theme": "no such", "lesson": 3}', encoding="utf-8")
    assert KeptState.read() == KeptState()
