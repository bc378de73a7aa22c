"""Numbers read off a record: each against a value that can be worked out by hand."""

import math

import numpy as np
import pytest

from lathesim.analysis.display_unit import display_unit, shown_with_unit
from lathesim.analysis.metric import Metric, MissingChannelError, measure, stock_metrics
from lathesim.analysis.turned_part import part_shape
from lathesim.component import Component, Output
from lathesim.components.spindles import SteadySpindle
from lathesim.engine.assembly import Assembly, Part
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.record import Record
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
