"""Numbers read off a record: each against a value that can be worked out by hand."""

import math

import numpy as np
import pytest

from lathesim.analysis.display_unit import display_unit, known_share, shown_with_unit
from lathesim.analysis.experiment_figures import SweepAxis, sweep_figure
from lathesim.analysis.metric import Metric, MissingChannelError, measure, stock_metrics
from lathesim.analysis.turned_part import part_shape, roughness_along
from lathesim.analysis.turning_metrics import COST_METRICS, METRICS, reversals
from lathesim.component import Component, Output
from lathesim.components.spindles import SteadySpindle
from lathesim.engine.assembly import Assembly, Part
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import RecordError
from lathesim.record import Channel, Record
from tests.analysis.small_record import shoulder

RUN = shoulder()


class Cut(Component):
    """A tool in contact all the time, and the speed that is wanted; its names are its own."""

    ports = {"in_contact": "bites", "spindle_reference": "wish"}
    bites = Output("1", doc="1 in contact")
    wish = Output("rad/s", doc="wanted speed")

    @staticmethod
    def output() -> tuple[float, float]:
        return 1.0, 120.0


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (6.845e-4, "m", "0.6845 mm"),
        (1.25e-6, "m", "1.25 um"),
        (1.5, "m", "1500 mm"),
        (18.48, "s", "18.48 s"),
        (1234.5, "N", "1.234 kN"),
        (2.0 * math.pi, "rad/s", "60 rpm"),
        (0.5, "1", "0.5"),
        (math.nan, "m", "nan m"),
        (0.0, "N", "0 N"),
        (3e6, "kg/s", "3000000 kg/s"),
    ],
)
def test_numbers_as_a_person_reads_them(value: float, unit: str, text: str) -> None:
    assert shown_with_unit(value, unit) == text


def test_a_unit_is_chosen_by_the_largest_value() -> None:
    assert display_unit("m", 0.02) == (1e-3, "mm")
    assert display_unit("m", 6e-4) == (1e-6, "um")
    assert display_unit("m", 0.0) == (1e-3, "mm")
    assert display_unit("lx", 5.0) == (1.0, "lx")


BY_HAND = {
    "max_contour_error": 20e-6,
    "contact_time": 401 * 5e-3,
    "max_cutting_force": 1200.0,
    "mean_cutting_force": 1200.0,
    "max_x_voltage": 2.0,
    "rms_contour_error": 20e-6 * math.sqrt(3.0 / 8.0),
}


@pytest.mark.parametrize("name", BY_HAND)
def test_metrics_by_hand(name: str) -> None:
    assert measure(RUN, [stock_metrics()[name]]).values[name].value == pytest.approx(BY_HAND[name], rel=3e-3)


def test_every_metric_has_a_unit_and_a_sentence() -> None:
    for name, metric in stock_metrics().items():
        assert name == metric.name
        assert metric.unit
        assert 10 < len(metric.doc) < 160


def test_what_cannot_be_measured_says_why() -> None:
    def broken(record: Record) -> float:
        return float(record["x_axis.position"][10**9])

    def lacking(record: Record) -> float:
        raise MissingChannelError("a.b", "c.d")

    found = measure(RUN, [Metric("broken", "m", "an index too far", broken), Metric("lacking", "m", "a channel too few", lacking)])
    assert found.values == {}
    assert found.skipped["broken"].startswith("the metric failed: IndexError: ")
    assert found.skipped["lacking"] == "not available: needs channel a.b or c.d"


def test_a_metric_finds_its_channels_by_their_roles_whatever_the_parts_are_called() -> None:
    machine = Assembly((Part("chuck", SteadySpindle, {"target": 100.0}), Part("tool", Cut)), (), 0.1, 0.1)
    record = run(wire(machine), duration=1.0, engine="plain")
    assert measure(record, stock_metrics()).values["spindle_speed_error"].value == pytest.approx(20.0)


def test_a_value_that_is_no_number_is_null_in_json() -> None:
    found = measure(RUN, [Metric("nothing", "m", "nothing at all", lambda record: math.inf)])
    assert found.as_json() == {"nothing": {"value": None, "unit": "m"}}


def test_the_part_has_the_radius_at_which_the_tool_passed() -> None:
    shape = part_shape(RUN)
    assert shape is not None
    assert shape.stock_radius == 0.018
    inner = (shape.z > 0.021) & (shape.z < 0.039)
    assert np.allclose(shape.radius[inner], 0.015 + 1e-5, atol=1e-9)


def test_without_the_stock_there_is_no_shape() -> None:
    assert part_shape(Record(RUN.time, {name: RUN.channels[name] for name in ("x_axis.position", "z_axis.position")})) is None


@pytest.mark.parametrize(
    ("places", "turns"),
    [
        ([0.0, 1.0, 2.0, 2.0, 3.0], 0),
        ([0.0, 0.0, -1.0, -2.0], 0),
        ([0.0, 1.0, 0.5, 0.5, 0.0, 2.0], 2),
        ([0.0, 1.0, 1.0 - 1e-6, 2.0], 0),
        ([5.0], 0),
    ],
)
def test_turns_are_counted_and_rounding_is_none(places: list[float], turns: int) -> None:
    assert reversals(1e-2 * np.array(places)) == turns


def test_beside_next_to_nothing_there_is_no_share() -> None:
    assert known_share(0.173) == 0.173
    assert all(math.isnan(known_share(share)) for share in (6138.365, math.nan, math.inf))


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
