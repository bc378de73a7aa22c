"""Programs that a design may choose from, and the sizes of rivals that it counts with."""

import math

import numpy as np
import pytest

from lathesim.engine.wiring import wire
from lathesim.experiments.candidate_programs import lay_candidate, lay_those_that_fit, neighbours
from lathesim.experiments.families import candidates, strokes_in_turn, turned_candidates
from lathesim.experiments.rivals import NamedRival, place_rivals
from lathesim.experiments.room import Room, room_of
from lathesim.experiments.scene import _is_at_a_limit, counts_of, shown_lags, with_sizes_in_reach
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.path_columns import END_X, END_Z, FEED, FEED_MODE, PER_REVOLUTION, SPINDLE_SPEED
from lathesim.plugins import Registry

AXIS = "22_what_is_wrong_with_this_machine"


def room(lesson: str, registry: Registry) -> Room:
    return room_of(prepare(load_lesson(lesson), registry))


def test_exchanged_programs_keep_to_time_and_travel(registry: Registry) -> None:
    closed, random = room("27_a_controller_that_tells_nothing", registry), np.random.default_rng(3)
    first = strokes_in_turn(closed, 10.0, 4, 1)[0]
    near = neighbours(first, closed, 10.0, random, 12)
    assert len(near) > 6
    assert all(item.seconds <= 10.0 and item.moves != first.moves for item in near)
    assert [lay_candidate(item, closed).candidate for item in near] == near


def test_strokes_that_make_values_known_go_at_the_feed_limit(registry: Registry) -> None:
    closed = room("27_a_controller_that_tells_nothing", registry)
    moves = [move for item in strokes_in_turn(closed, 10.0, 20, 1) for move in item.moves if not move.rest]
    assert np.mean([move.speed == closed.feed for move in moves]) > 0.8


def test_cuts_and_spindle_speeds_stay_within_what_the_lesson_does(registry: Registry) -> None:
    lathe = room("05_spindle_droop", registry)
    assert lathe.turning is not None and lathe.turning.cuts
    found = turned_candidates(lathe, 12.0, 12, np.random.default_rng(1))
    titles = {item.title for item in found}
    assert any("steps of feed" in title for title in titles) and any("speed" in title for title in titles)
    assert {"speeds of the spindle, both ways", "speeds of the spindle, one way"} <= titles
    for item in found:
        table = lay_candidate(item, lathe).table
        assert np.abs(table[:, SPINDLE_SPEED]).max() <= lathe.turning.speed * (1.0 + 1e-6)
        per_turn = table[table[:, FEED_MODE] == PER_REVOLUTION]
        assert per_turn[:, FEED].max(initial=0.0) <= lathe.turning.feed * (1.0 + 1e-6)
        assert table[:, END_X].min(where=table[:, END_Z] > lathe.turning.face, initial=1.0) >= lathe.turning.smallest_radius - 1e-7


def test_axis_without_a_spindle_has_no_cuts(registry: Registry) -> None:
    assert turned_candidates(room(AXIS, registry), 12.0, 4, np.random.default_rng(1)) == []


def test_sensors_and_converters_are_exact_in_designs(registry: Registry) -> None:
    counts = counts_of(prepare(load_lesson("05_spindle_droop"), registry).machinery)
    assert counts["spindle_dac.bits"] == (12.0, 32.0) and counts["tachometer_adc.bits"] == (12.0, 32.0)
    assert counts["x_encoder.resolution"] == (1e-6, 0.0)


def test_steady_force_stands_at_no_limit() -> None:
    # a cut at one feed and another: with an edge force the force stands higher, where it stood before
    sound = np.repeat([[0.0, 100.0, 0.0, 200.0]], 50, axis=1)
    moving = np.linspace([0.0, 1.0], [1.0, 3.0], 200).T
    assert not _is_at_a_limit(np.vstack([1.3 * sound, moving]), [0, 1, 2], np.vstack([sound, moving]))
    wave = np.sin(np.linspace(0.0, 20.0, 200))[None, :]
    assert _is_at_a_limit(np.vstack([np.clip(2.0 * wave, -1.5, 1.5), moving]), [0, 1, 2], np.vstack([wave, moving]))


@pytest.mark.slow
def test_sizes_are_drawn_within_what_drive_and_recording_can_show(registry: Registry) -> None:
    prepared = prepare(load_lesson(AXIS), registry)
    own, channels = room_of(prepared), mapping_of(load_lesson(AXIS), prepared.machinery).targets("compare")
    named = [
        NamedRival("ForceOffset", "x_axis", {"offset": (300.0, 400.0)}),
        NamedRival("TransportDelay", "x_drive", {"delay": (1e-9, 1e-8)}),
    ]
    holding, rivals = place_rivals(named, prepared.machinery, channels, registry, 2, 1, "--between")
    programs = lay_those_that_fit(candidates(own, 6.5, 2, 1), own, 7.0)
    force, delay = with_sizes_in_reach(holding, rivals, programs, f"{own.interpolator.name}.path")
    # the drive pushes with 351 N at most, of which the program needs some 250 N
    assert 20.0 < np.abs(force.sizes).max() <= 100.0
    assert all(math.log2(before / after).is_integer() for before, after in zip(rivals[0].sizes[:, 0], force.sizes[:, 0], strict=True))
    assert delay.term is not None
    assert not shown_lags(delay.term, delay.sizes, wire(holding)).any()
    assert shown_lags(delay.term, np.array([[5e-3]]), wire(holding)) == 5e-3
