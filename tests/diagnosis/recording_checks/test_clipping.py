"""A current that was cut off by its logger, and one that was cut off by its drive."""

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis
from lathesim.components.drives import VoltageDrive
from lathesim.components.sensors import LinearEncoder
from lathesim.diagnosis.recording_checks.clipping import clipped_reading
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import Experiment, Machine, build_experiments
from tests.diagnosis.pushed_table import MASS, PERIOD, POSITION, RESOLUTION, VISCOUS, Hidden, as_record, baseline, force, travel

VOLTAGE, CURRENT, NEWTONS_PER_AMPERE, LIMIT = "x_drive.voltage", "x_drive.current", 20.0, 2.5


def machine() -> Machine:
    """Return the table of the other tests, behind an amplifier of 1 A/V."""
    parts = (
        Part(
            "x_drive", VoltageDrive.with_units({"effort": "N", "flow": "m/s"}), {"conductance": 1.0, "effort_constant": NEWTONS_PER_AMPERE}
        ),
        Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}),
        Part("x_encoder", LinearEncoder, {"resolution": RESOLUTION}),
    )
    fed = {"x_drive.velocity": "x_axis.velocity", "x_axis.force": "x_drive.effort", "x_encoder.measured": "x_axis.position"}
    wires = (Wire(VOLTAGE, constant=0.0), *[Wire(target, source) for target, source in fed.items()])
    uncertain = {"x_axis.mass": 0.05 * MASS, "x_axis.viscous": 0.1 * VISCOUS}
    assembly = Assembly(parts, wires, PERIOD, 0.5 * PERIOD)
    return Machine(assembly, (VOLTAGE,), (POSITION, CURRENT), uncertain, {POSITION: RESOLUTION})


def experiment(*, cut_in_the_drive: bool) -> Experiment:
    """Return a recording whose current ends at the limit: only as it was logged, or in the machine as well."""
    wanted = force(2000) / NEWTONS_PER_AMPERE
    cut = np.clip(wanted, -LIMIT, LIMIT)
    noise = np.round(0.02 * np.random.default_rng(7).standard_normal(2000), 4)
    place = travel(NEWTONS_PER_AMPERE * (cut if cut_in_the_drive else wanted), Hidden())
    seen = np.round(place / RESOLUTION) * RESOLUTION
    logged = np.clip(wanted + noise, -LIMIT, LIMIT)
    record = as_record({VOLTAGE: ("V", wanted), POSITION: ("m", seen), CURRENT: ("A", logged)})
    return build_experiments(machine(), [("fit", record)], [])[0]


@pytest.mark.parametrize("cut_in_the_drive", [False, True])
def test_a_reading_that_ends_where_the_machine_goes_on_is_told(cut_in_the_drive: bool) -> None:
    one = experiment(cut_in_the_drive=cut_in_the_drive)
    told = clipped_reading(one, fit(one.sensed, baseline(one)))
    stand = int(np.count_nonzero(np.abs(one.sensed.recorded[1]) == LIMIT))
    assert stand > 100
    said = (
        f"{CURRENT} is clipped at 2.5 A and -2.5 A: {stand} of 2000 samples stand there, and everything else went on as if it went "
        "further. Widen the range of the instrument and record again."
    )
    assert told == ("" if cut_in_the_drive else said)
