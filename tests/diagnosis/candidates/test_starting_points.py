"""Steps of a residual are found where they are, and a search for lost counts begins there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis
from lathesim.components.drives import VoltageDrive
from lathesim.diagnosis.candidates.starting_points import limit_points, starting_points
from lathesim.effects.drive_errors import DriveSaturation, SlewLimit
from lathesim.effects.sensor_errors import LostCounts
from lathesim.effects.structure import AxialResonance
from lathesim.effects.time_shift import ChannelTimeShift, ClockSkew, TransportDelay
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import instants_of
from lathesim.identification.replay.experiment import RecordedMachine, baseline_free, build_experiments
from lathesim.identification.signal import behind, strongest_jumps
from tests.diagnosis.pushed_table import FORCE, PERIOD, POSITION, as_record, machine, recording


@pytest.mark.parametrize("instant", [0.31, 1.5, 2.9])
def test_a_step_in_noise_is_found_with_its_size(instant: float) -> None:
    time = np.arange(4000) * 1e-3
    signal = np.where(time >= instant, 5e-6, 0.0) + 1e-6 * np.random.default_rng(3).standard_normal(4000)
    found, size = strongest_jumps(signal, 1e-3)[0]
    assert found == pytest.approx(instant, abs=5e-3)
    assert size == pytest.approx(5e-6, rel=0.05)


def test_a_step_on_a_slow_wander_is_among_those_of_a_short_window() -> None:
    time = np.arange(4000) * 1e-3
    signal = np.where(time >= 1.0, 5e-6, 0.0) + 20e-6 * np.sin(1.5 * time)
    assert min(abs(found - 1.0) for found, _ in strongest_jumps(signal, 1e-3)) < 0.01


def test_instants_are_those_that_an_effect_declares() -> None:
    lost = SimpleNamespace(parameters=("lost.jump", "lost.instant", "lost.second_instant"), effect=LostCounts)
    assert instants_of(lost) == ["lost.instant", "lost.second_instant"]  # type: ignore[arg-type]


def test_a_limit_is_looked_for_where_the_command_of_the_recording_comes_to() -> None:
    """A force that never comes near the usual limits of another machine, or goes far beyond them."""
    for size in (0.5, 500.0):
        record = recording(size=size)
        experiment, _ = build_experiments(machine(), [("a", record), ("b", record)], [DriveSaturation])
        points = limit_points(experiment, list(experiment.candidates))[experiment.candidates[0].part]
        largest = float(np.abs(record[FORCE]).max())
        assert np.all(points < largest)
        assert float(points.max()) > 0.7 * largest


def test_a_limit_is_looked_for_below_a_command_that_is_at_its_largest_for_long() -> None:
    record = recording()
    steps = np.where(np.arange(len(record)) % 500 < 250, 3.0, -3.0)
    record = replace(record, channels={**record.channels, FORCE: replace(record.channels[FORCE], values=steps)})
    experiment, _ = build_experiments(machine(), [("a", record), ("b", record)], [DriveSaturation])
    points = limit_points(experiment, list(experiment.candidates))[experiment.candidates[0].part]
    assert np.sum(points < 2.9) >= 4


def test_a_limit_of_the_rate_is_looked_for_far_below_the_jumps_of_a_command_in_steps() -> None:
    """Steps of 6 N jump by 6000 N/s from sample to sample, and a drive that needs 0.1 s for one has 60 N/s."""
    record = recording()
    steps = np.where(np.arange(len(record)) % 500 < 250, 3.0, -3.0)
    record = replace(record, channels={**record.channels, FORCE: replace(record.channels[FORCE], values=steps)})
    experiment, _ = build_experiments(machine(), [("a", record), ("b", record)], [SlewLimit])
    points = limit_points(experiment, list(experiment.candidates))[experiment.candidates[0].part]
    assert float(np.min(np.abs(np.log(points / 60.0)))) < np.log(1.6)


def test_a_resonance_is_looked_for_at_frequencies_close_together() -> None:
    record = recording()
    experiment, _ = build_experiments(machine(), [("a", record), ("b", record)], [AxialResonance])
    (candidate,) = experiment.candidates
    baseline = fit(experiment.sensed, baseline_free(experiment.machine))
    points = starting_points(experiment, baseline, [candidate])[candidate.part]
    frequencies = np.sort(points[:, [name.endswith(".frequency") for name in candidate.parameters].index(True)])
    assert frequencies[0] < 15.0
    assert np.all(frequencies[1:] / frequencies[:-1] < 1.6)


@pytest.mark.parametrize("late", [7, 0, -4])
def test_a_staircase_is_behind_another_one_by_whole_steps(late: int) -> None:
    """Half-way between two steps it is as near to the other one as anywhere around: a search has to begin where the edges meet."""
    rng = np.random.default_rng(5)
    stairs = np.repeat(rng.standard_normal(80), 25)
    recorded = np.roll(stairs, late) + 0.05 * rng.standard_normal(len(stairs))
    assert behind(recorded, stairs, 50) == late


def test_a_late_reading_is_looked_for_where_the_recording_has_it() -> None:
    record = recording(count=1500, noise=1e-8)
    number = np.arange(1500.0)
    late = record.with_channel(POSITION, "m", np.interp(number - 6.0, number, record[POSITION]))
    experiment, _ = build_experiments(machine(), [("a", late), ("b", late)], [ChannelTimeShift])
    fitted = fit(experiment.sensed, baseline_free(experiment.machine), rounds=0)
    points = starting_points(experiment, fitted, list(experiment.candidates))[experiment.candidates[0].part]
    assert points[0, 0] == pytest.approx(6.0 * PERIOD)
    assert len(points) == 1 + len(experiment.candidates[0].points)


def test_a_clock_is_looked_for_by_how_the_recording_falls_behind() -> None:
    """A clock that is 0.8 % fast: the second half of the recording is further ahead of the simulation than the first."""
    record = recording(count=4000, noise=1e-8)
    number = np.arange(4000.0)
    ahead = record.with_channel(POSITION, "m", np.interp(1.008 * number, number, record[POSITION]))
    experiment, _ = build_experiments(machine(), [("a", ahead), ("b", ahead)], [ClockSkew])
    fitted = fit(experiment.sensed, baseline_free(experiment.machine), rounds=0)
    points = starting_points(experiment, fitted, list(experiment.candidates))[experiment.candidates[0].part]
    assert points[0, 0] == pytest.approx(-0.008, rel=0.1)


def test_a_delay_is_looked_for_between_the_samples_that_hold_it() -> None:
    """A command that is held and acts 2.4 samples late is read from the third sample on: at a whole one a fit would stand at a wall."""
    rng = np.random.default_rng(2)
    command = np.repeat(rng.uniform(-5.0, 5.0, 50), 20)
    current = 2.0 * np.r_[np.zeros(3), command[:-3]] + 0.01 * rng.standard_normal(1000)
    parts = (
        Part("drive", VoltageDrive.with_units({"effort": "N", "flow": "m/s"}), {"conductance": 2.0}),
        Part("motor", ForceAxis, {"mass": 5.0, "viscous": 10.0}),
    )
    fed = {"drive.velocity": "motor.velocity", "motor.force": "drive.effort"}
    wires = (Wire("drive.voltage", constant=0.0), *[Wire(target, source) for target, source in fed.items()])
    held = RecordedMachine(
        Assembly(parts, wires, PERIOD, 0.5 * PERIOD), ("drive.voltage",), ("drive.current",), {"drive.conductance": 0.1}, {}
    )
    record = as_record({"drive.voltage": ("V", command), "drive.current": ("A", current)})
    experiment, _ = build_experiments(held, [("a", record), ("b", record)], [TransportDelay])
    (candidate,) = (candidate for candidate in experiment.candidates if candidate.at == "drive")
    points = starting_points(experiment, fit(experiment.sensed, baseline_free(experiment.machine)), [candidate])[candidate.part]
    assert points[0, 0] == pytest.approx(2.5 * PERIOD)
