"""A column that is another one from the middle of a recording on, and one that was cut off."""

from collections.abc import Callable

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis
from lathesim.components.drives import VoltageDrive
from lathesim.components.sensors import LinearEncoder
from lathesim.diagnosis.recording_checks.change_points import changed_midway, jumped_midway
from lathesim.diagnosis.recording_checks.wrong_readings import clipped_reading
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from tests.diagnosis.pushed_table import FORCE, MASS, PERIOD, POSITION, RESOLUTION, VISCOUS, Hidden, as_record, baseline, force, travel

SCALE, SAMPLES, HALF = "x_scale.position", 4000, 2000


def experiment(column: Callable[[FloatArray], FloatArray]) -> Experiment:
    """Return a table with two encoders, the second of which shows what ``column`` makes of it."""
    sensors = [Part(name, LinearEncoder, {"resolution": RESOLUTION}) for name in ("x_encoder", "x_scale")]
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}), *sensors)
    wires = (Wire(FORCE, constant=0.0), *[Wire(f"{part.name}.measured", "x_axis.position") for part in sensors])
    uncertain = {"x_axis.mass": 0.05 * MASS, "x_axis.viscous": 0.1 * VISCOUS}
    machine = RecordedMachine(
        Assembly(parts, wires, PERIOD, 0.5 * PERIOD), (FORCE,), (POSITION, SCALE), uncertain, {POSITION: RESOLUTION, SCALE: RESOLUTION}
    )
    pushed = force(SAMPLES)
    place = travel(pushed, Hidden())
    seen = np.round(place / RESOLUTION) * RESOLUTION
    record = as_record({FORCE: ("N", pushed), POSITION: ("m", seen), SCALE: ("m", column(seen))})
    return build_experiments(machine, [("fit", record)], [])[0]


def told(column: Callable[[FloatArray], FloatArray]) -> str:
    one = experiment(column)
    return changed_midway(one, fit(one.sensed, baseline(one), rounds=3))


def from_half_on(changed: FloatArray, values: FloatArray) -> FloatArray:
    return np.r_[values[:HALF], changed[HALF:]]


def test_samples_that_were_lost_are_told() -> None:
    said = told(lambda seen: from_half_on(np.r_[np.full(7, seen[0]), seen[:-7]], seen))
    assert said == (
        f"From about 4 s on {SCALE} is 14 ms (7 samples) later beside the other channels than before: samples were lost or repeated. Use "
        "what comes before, or after."
    )


def test_a_scale_that_changes_is_told() -> None:
    said = told(lambda seen: from_half_on(1.03 * seen, seen))
    assert said.startswith(f"From about 4 s on {SCALE} is 1.03 times what it was before, held against {POSITION}")


@pytest.mark.parametrize(
    "column",
    [
        lambda seen: seen,
        lambda seen: 1.03 * seen,
        lambda seen: np.r_[np.full(7, seen[0]), seen[:-7]],
        lambda seen: seen * np.linspace(1.0, 1.03, len(seen)),
        lambda seen: from_half_on(seen + 1e-3, seen),
        lambda seen: from_half_on(np.r_[np.full(25, seen[0]), seen[:-25]], np.r_[seen[25:], np.full(25, seen[-1])]),
    ],
    ids=[
        "sound",
        "another scale all along",
        "late all along",
        "a scale that drifts",
        "another zero",
        "from end to end of what is looked for",
    ],
)
def test_what_stays_or_changes_slowly_is_none(column: Callable[[FloatArray], FloatArray]) -> None:
    assert told(column) == ""


@pytest.mark.parametrize("jump", [25e-6, 0.0])
def test_counts_that_one_of_two_encoders_lost_are_told(jump: float) -> None:
    one = experiment(lambda seen: from_half_on(seen + jump, seen))
    said = jumped_midway(one, fit(one.sensed, baseline(one), rounds=3))
    assert said == (
        f"At about 4 s {SCALE} jumps by 25 um beside {POSITION}, which shows the same motion, and stays: one of them lost counts in "
        "fit (LostCounts)."
        if jump
        else ""
    )


VOLTAGE, CURRENT, NEWTONS_PER_AMPERE, LIMIT = "x_drive.voltage", "x_drive.current", 20.0, 2.5


def driven(volts: FloatArray, newtons: FloatArray, amperes: FloatArray) -> Experiment:
    """Return the table behind an amplifier of 1 A/V: what was commanded, what pushed it, and the current as it was logged."""
    drive = VoltageDrive.with_units({"effort": "N", "flow": "m/s"})
    parts = (
        Part("x_drive", drive, {"conductance": 1.0, "effort_constant": NEWTONS_PER_AMPERE}),
        Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}),
        Part("x_encoder", LinearEncoder, {"resolution": RESOLUTION}),
    )
    fed = {"x_drive.velocity": "x_axis.velocity", "x_axis.force": "x_drive.effort", "x_encoder.measured": "x_axis.position"}
    wires = (Wire(VOLTAGE, constant=0.0), *[Wire(target, source) for target, source in fed.items()])
    uncertain = {"x_axis.mass": 0.05 * MASS, "x_axis.viscous": 0.1 * VISCOUS}
    machine = RecordedMachine(
        Assembly(parts, wires, PERIOD, 0.5 * PERIOD), (VOLTAGE,), (POSITION, CURRENT), uncertain, {POSITION: RESOLUTION}
    )
    seen = np.round(travel(newtons, Hidden()) / RESOLUTION) * RESOLUTION
    return build_experiments(machine, [("fit", as_record({VOLTAGE: ("V", volts), POSITION: ("m", seen), CURRENT: ("A", amperes)}))], [])[0]


def noise(count: int) -> FloatArray:
    return np.round(0.02 * np.random.default_rng(7).standard_normal(count), 4)


@pytest.mark.parametrize(("factor", "in_the_drive"), [(1.2, False), (1.0, False), (1.2, True)], ids=["the reading", "sound", "the drive"])
def test_a_current_that_reads_more_while_the_axis_moves_as_before_is_told(factor: float, in_the_drive: bool) -> None:
    amperes = force(SAMPLES) / NEWTONS_PER_AMPERE
    more = np.where(np.arange(SAMPLES) < HALF, 1.0, factor)
    one = driven(amperes, NEWTONS_PER_AMPERE * amperes * (more if in_the_drive else 1.0), amperes * more + noise(SAMPLES))
    said = changed_midway(one, fit(one.sensed, baseline(one), rounds=3))
    assert bool(said) == (factor != 1.0 and not in_the_drive)
    assert not said or said.startswith(f"From about 4 s on {CURRENT} is 1.2 times what it was before, held against what the drive makes")


@pytest.mark.parametrize("cut_in_the_drive", [False, True])
def test_a_reading_that_ends_where_the_machine_goes_on_is_told(cut_in_the_drive: bool) -> None:
    """A current that was cut off by its logger, and one that was cut off by its drive."""
    wanted = force(2000) / NEWTONS_PER_AMPERE
    cut = np.clip(wanted, -LIMIT, LIMIT)
    one = driven(wanted, NEWTONS_PER_AMPERE * (cut if cut_in_the_drive else wanted), np.clip(wanted + noise(2000), -LIMIT, LIMIT))
    told = clipped_reading(one, fit(one.sensed, baseline(one)))
    stand = int(np.count_nonzero(np.abs(one.sensed.recorded[1]) == LIMIT))
    assert stand > 100
    said = (
        f"{CURRENT} is clipped at 2.5 A and -2.5 A: {stand} of 2000 samples stand there, and everything else went on as if it went "
        "further. Widen the range of the instrument and record again."
    )
    assert told == ("" if cut_in_the_drive else said)
