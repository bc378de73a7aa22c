"""Metrics of cost, cutting speed, droop and unrest, on records made by hand."""

import numpy as np
import pytest

from lathesim.analysis.experiment_figures import SweepAxis, sweep_figure
from lathesim.analysis.metric import measure
from lathesim.analysis.turned_part import roughness_along
from lathesim.analysis.turning_metrics import COST_METRICS, METRICS
from lathesim.errors import RecordError
from lathesim.record import Channel, Record

UNITS = {"design.machine_cost": "dollar", "economy.part_cost": "dollar", "economy.time_per_part": "s"}


def record(**channels: list[float]) -> Record:
    """Return a record of one sample a second; ``part__output`` names a channel."""
    named = {name.replace("__", "."): values for name, values in channels.items()}
    length = len(next(iter(named.values())))
    filled = {name: Channel(name, UNITS.get(name, "1"), np.array(values)) for name, values in named.items()}
    return Record(np.arange(float(length)), filled, {"sample_period": 1.0})


def values(made: Record) -> dict[str, float]:
    return {name: item.value for name, item in measure(made, (*METRICS, *COST_METRICS)).values.items()}


def test_the_index_weighs_cost_and_time() -> None:
    found = values(record(design__machine_cost=[55900.0] * 11))
    assert (found["machine_cost"], found["cycle_time"]) == (55900.0, 10.0)
    assert found["performance_index"] == pytest.approx(3.118)


def test_cost_and_time_of_a_part_are_those_at_the_end() -> None:
    found = values(record(economy__part_cost=[0.1, 0.2], economy__time_per_part=[1.0, 2.5], tool_wear__used_life=[0.0, 0.04]))
    assert (found["part_cost"], found["time_per_part"], found["parts_per_edge"]) == (0.2, 2.5, pytest.approx(25.0))


def test_cutting_speeds_and_droop_count_only_while_something_is_cut() -> None:
    made = record(
        cutting__engaged=[0.0, 1.0, 1.0, 0.0],
        cutting__cutting_speed=[9.0, 2.0, 4.0, 9.0],
        interpolator__spindle_reference=[100.0, -100.0, -100.0, 100.0],
        spindle__speed=[0.0, -98.0, -96.0, 0.0],
    )
    found = values(made)
    assert [found[f"{word}_cutting_speed"] for word in ("min", "mean", "max")] == [2.0, 3.0, 4.0]
    assert found["mean_spindle_droop"] == pytest.approx(3.0)


def test_unrest_is_the_rms_of_the_change_in_contact() -> None:
    made = record(cutting__in_contact=[0.0, 0.0, 1.0, 1.0], x_dac__voltage=[0.0, 9.0, 10.0, 8.0])
    assert values(made)["x_voltage_unrest"] == pytest.approx(np.sqrt((1.0 + 4.0) / 2.0))


def test_the_last_cut_counts_for_the_roughness_of_a_place() -> None:
    made = record(surface_finish__roughness=[0.0, 1.0, 1.0, 1.0, 0.0, 2.0, 2.0], z_axis__position=[0.0, 0.0, 1.0, 2.0, 2.0, 1.0, 2.0])
    surface = roughness_along(made, cells=10)
    assert surface.roughness == pytest.approx([1.0] * 5 + [2.0] * 5)


def test_the_figure_of_a_sweep_over_one_and_two_parameters() -> None:
    one = SweepAxis("a.b", [1.0, 10.0, 100.0], "V/mm", logarithmic=True)
    two = SweepAxis("c.d", [1.0, 2.0], "1")
    line = sweep_figure([one], [("max_contour_error", "m", np.array([3e-4, 1e-4, np.nan]))], "A sweep")
    (panel,) = line.axes
    assert panel.get_xscale() == "log"
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("a.b [V/mm]", "max contour error [µm]")
    assert panel.get_legend().get_texts()[0].get_text() == "least: 100"
    chart = sweep_figure([two, one], [("cycle_time", "s", np.array([6.0, 5.0, 4.0, 3.0, 2.0, np.nan]))])
    assert (chart.axes[0].get_xlabel(), chart.axes[0].get_ylabel()) == ("a.b [V/mm]", "c.d")
    with pytest.raises(RecordError, match="a sweep over 3 parameters cannot be drawn"):
        sweep_figure([one, two, one], [])
