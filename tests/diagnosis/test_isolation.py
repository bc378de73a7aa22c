"""What the recordings of a diagnosis cannot answer: rivals that a search passed by, and effects that no size of them would show."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from lathesim.diagnosis.isolation.answerable import locked
from lathesim.diagnosis.isolation.visible import Looking
from lathesim.diagnosis.records.diagnosis import Unanswerable, as_json
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from lathesim.effects.backlash_and_screw import PeriodicPitchError
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.sensor_errors import EncoderEccentricity
from lathesim.effects.time_shift import ChannelTimeShift, TransportDelay
from lathesim.identification.estimation.least_squares import fit
from lathesim.record import Record
from tests.diagnosis.pushed_table import (
    FORCE,
    PERIOD,
    POSITION,
    RESOLUTION,
    VISCOUS,
    Hidden,
    as_record,
    baseline,
    experiments,
    force,
    recording,
    searched,
    study,
    travel,
)
from tests.diagnosis.sample_diagnoses import NAMED, varied


def with_a_wave(seed: int) -> Record:
    record = recording(seed=seed)
    place = record[POSITION]
    return record.with_channel(POSITION, "m", place + 8e-6 * np.sin(2.0 * np.pi * place / 2e-3))


def test_a_rival_that_the_search_passed_by_is_found_and_tied() -> None:
    estimation, validation = experiments(with_a_wave(1), with_a_wave(2), effects=(PeriodicPitchError, EncoderEccentricity))
    found = searched(estimation, validation)
    ((named, rivals),) = found.rivals.items()
    assert len(rivals) == 1
    again, unanswerable = locked(study(estimation, validation), replace(found, tried=(), rivals={}))
    assert [one.candidate.name for one in again.rivals[named]] == [one.candidate.name for one in rivals]
    assert unanswerable == ()


def late(seed: int, samples: int = 2) -> Record:
    """Return a recording of a table with dry friction on which the recorded force acts some samples late."""
    pushed = force(2000, seed)
    place = travel(np.concatenate([np.zeros(samples), pushed[:-samples]]), Hidden(dry=30.0))
    return as_record({FORCE: ("N", pushed), POSITION: ("m", np.round(place / RESOLUTION) * RESOLUTION)})


def test_a_late_sensor_and_a_late_drive_in_an_open_loop_are_tied_beside_a_friction() -> None:
    """Beside the friction that was found without either the delay was no match: it never came near its size."""
    estimation, validation = experiments(late(1), late(2), effects=(CoulombFriction, TransportDelay, ChannelTimeShift))
    found, _ = locked(study(estimation, validation), searched(estimation, validation))
    ties = {found.worth[part].candidate.name: [one.candidate.name for one in rivals] for part, rivals in found.rivals.items()}
    assert ties == {"CoulombFriction": [], "ChannelTimeShift": ["TransportDelay"]}


def test_an_effect_without_rivals_is_locked_by_nothing() -> None:
    estimation, validation = experiments(with_a_wave(1), with_a_wave(2), effects=(PeriodicPitchError,))
    found = searched(estimation, validation)
    again, unanswerable = locked(study(estimation, validation), found)
    assert [rivals for rivals in again.rivals.values() if rivals] == []
    assert unanswerable == ()


def test_an_effect_that_no_size_shows_is_said_with_its_reason() -> None:
    """A table that goes one way at one speed all the time: a dry friction is another viscous one."""
    push, time = 40.0, PERIOD * np.arange(1500)
    seen = np.round(push / VISCOUS * time / RESOLUTION) * RESOLUTION
    records = [as_record({FORCE: ("N", np.full(1500, push)), POSITION: ("m", seen)})] * 2
    estimation, validation = experiments(*records, effects=(ForceOffset, CoulombFriction))
    asked = study(estimation, validation)
    _, (unanswerable,) = locked(asked, searched(estimation, validation))
    assert (unanswerable.effect, unanswerable.at) == ("CoulombFriction", "x_axis")
    assert unanswerable.why == "x_axis moves in one direction only; x_axis moves at one speed; a change of x_axis.viscous looks the same"


def test_a_change_that_grows_beyond_bounds_has_a_size() -> None:
    """A wave pushes a table that is held by nothing away: its square is beyond the largest number."""
    estimation, validation = experiments(recording(), recording(seed=2))
    fitted = fit(estimation.sensed, baseline(estimation))
    looking = SimpleNamespace(study=study(estimation, validation), fitted=fitted, least=np.zeros(1))
    assert 1.0 < Looking._moves(looking, np.full(fitted.residual.shape, 1e100)) < np.inf  # type: ignore[arg-type]


def test_what_is_not_answered_stands_in_the_answer() -> None:
    told = varied(NAMED, unanswerable=(Unanswerable("Backlash", "x_encoder", "x_axis moves in one direction only"),))
    lines = answer_lines(told)
    assert "What this recording cannot tell:" in lines
    assert "- These would not stand out at any size: Backlash at x_encoder. Reason: x_axis moves in one direction only." in lines
    assert as_json(told)["unanswerable"] == [{"effect": "Backlash", "at": "x_encoder", "why": "x_axis moves in one direction only"}]


def test_what_is_tied_is_not_said_to_stay_hidden() -> None:
    tied = varied(
        NAMED, effects=(replace(NAMED.effects[0], tied_with=("Weight",)),), unanswerable=(Unanswerable("Weight", "x_axis", "why"),)
    )
    lines = answer_lines(tied)
    assert not any("would not stand out" in line for line in lines)
    assert "(or Weight)" in lines[0]
