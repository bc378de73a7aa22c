"""A run that cuts nothing has no roughness and no force, and one sentence says why; a run without a cutting process is left alone."""

import math
from typing import Any

import numpy as np
import pytest

from lathesim.analysis.failed_run import RawStock, nothing_cut
from lathesim.analysis.metric import Metric, measure, stock_metrics
from lathesim.record import Channel, Record
from tests.analysis.small_record import shoulder

STOCK = RawStock("stock", 0.018, 0.060, 0.015, "x_axis.position", "z_axis.position")
OF_A_CUT = {
    "max_surface_roughness", "mean_surface_roughness", "max_cutting_force", "mean_cutting_force", "max_feed", "max_depth_of_cut",
    "removed_volume", "max_spindle_torque", "rms_spindle_torque", "max_cutting_power", "rms_cutting_power", "cutting_energy",
    "mean_spindle_droop", "min_cutting_speed", "mean_cutting_speed", "max_cutting_speed", "tool_wear", "max_x_force", "rms_x_force",
    "max_z_force", "rms_z_force", "part_cost", "time_per_part", "parts_per_edge", "settled_removal_rate",
}  # fmt: skip


def passing(x: list[float], z: list[float], stock: RawStock | None = STOCK, **changed: Any) -> Record:
    """Return a record of a tool at these places [mm], one a sample, at feed after the first; nothing is cut but what is ``changed``."""
    count = len(x)
    given = {
        "interpolator__x_reference": ("m", 1e-3 * np.array(x)),
        "interpolator__z_reference": ("m", 1e-3 * np.array(z)),
        "interpolator__cutting_block": ("1", np.array([0.0] + [1.0] * (count - 1))),
        "interpolator__program_line": ("1", 3.0 + np.arange(count)),
        "x_axis__position": ("m", 1e-3 * np.array(x)),
        "z_axis__position": ("m", 1e-3 * np.array(z)),
        "spindle__speed": ("rad/s", np.full(count, 100.0)),
        "cutting__engaged": ("1", np.zeros(count)),
        "cutting__rapid_contact": ("1", np.zeros(count)),
        "cutting__removal_rate": ("m^3/s", np.zeros(count)),
        "cutting_force__cutting_force": ("N", np.zeros(count)),
        "surface_finish__roughness": ("m", np.zeros(count)),
        "stock__removed_volume": ("m^3", np.zeros(count)),
    }
    for name, values in changed.items():
        given[name] = (given[name][0], np.array(values))
    channels = {name.replace("__", "."): Channel(name.replace("__", "."), unit, values) for name, (unit, values) in given.items()}
    told = {"stock": stock.as_text()} if stock else {}
    return Record(np.arange(float(count)), channels, {"sample_period": 1.0, "program": "parts/pass.nc", **told})


BESIDE = {
    "too far out": (
        ([30, 25, 25, 25], [0, 0, 20, 40]),
        "7 mm, at a radius of 25 mm and z = 20 mm in line 5 of pass.nc; "
        "take it to a radius below 18 mm at feed, or set stock.stock_radius to more than 25 mm.",
    ),
    "only beyond the end": (
        ([30, 10, 10, 30], [0, 0, 5, 5]),
        "10 mm, at a radius of 10 mm and z = 5 mm in line 5 of pass.nc; "
        "take it to z between 15 mm and 75 mm at feed, or change the stock with stock.face and stock.stock_length.",
    ),
    "off the corner, on the far side": (
        ([40, 22, 21], [0, 79, 79]),
        "5 mm, at a radius of 21 mm and z = 79 mm in line 5 of pass.nc; take it to a radius below 18 mm and z between 15 mm and 75 mm "
        "at feed, or change the stock with stock.stock_radius and stock.face.",
    ),
    "nearer in a rapid": (
        ([19, 28, 25], [20, 20, 20]),
        "7 mm, at a radius of 25 mm and z = 20 mm in line 5 of pass.nc; "
        "take it to a radius below 18 mm at feed, or set stock.stock_radius to more than 25 mm.",
    ),
}


@pytest.mark.parametrize("kind", BESIDE)
def test_the_smallest_distance_at_feed_is_told_with_its_place_and_line(kind: str) -> None:
    places, told = BESIDE[kind]
    assert nothing_cut(passing(*places)) == f"nothing was cut: the program leads the tool no nearer to the stock than {told}"


def test_a_tool_that_does_not_follow_the_program() -> None:
    record = passing([10, 10, 10], [10, 20, 30], x_axis__position=[0.02, 0.02, 0.019])
    assert nothing_cut(record) == (
        "nothing was cut: the tool comes no nearer to the stock than 1 mm, at a radius of 19 mm and z = 30 mm in line 5 of pass.nc, "
        "though the program leads it there; see how x_axis.position and z_axis.position follow their references."
    )


OTHERWISE = {
    "rapids": ({"interpolator__cutting_block": [0.0] * 3}, "every move of the program is a rapid one"),
    "a crash": ({"cutting__rapid_contact": [0.0, 1.0, 0.0]}, "the tool meets the stock in rapid moves alone, first in line 4 of pass.nc"),
    "a standing spindle": (
        {"cutting__engaged": [0.0, 0.0, 1.0], "spindle__speed": [50.0, 9.0, 0.0]},
        "the tool meets the stock in line 5 of pass.nc and the spindle stands; turn it on before, with M3 and S.",
    ),
    "no feed into it": ({"cutting__engaged": [0.0, 0.0, 1.0]}, "the tool touches the stock in line 5 of pass.nc and never feeds into it"),
}


def test_where_the_program_leads_the_tool_is_told_before_what_a_rapid_touched() -> None:
    x, z = BESIDE["too far out"][0]
    told = nothing_cut(passing(x, z, cutting__rapid_contact=[1.0, 0.0, 0.0, 0.0]))
    assert "the program leads the tool no nearer to the stock than 7 mm" in told


@pytest.mark.parametrize("kind", OTHERWISE)
def test_other_ways_to_cut_nothing(kind: str) -> None:
    changed, told = OTHERWISE[kind]
    sentence = nothing_cut(passing([16, 16, 16], [0, 20, 40], **changed))
    assert sentence.startswith(f"nothing was cut: {told}")
    assert sentence.count(".") == 1 + told.count(".") - told.endswith(".")
    assert sentence.endswith(".")


def test_a_record_that_does_not_know_its_stock_says_what_stays_at_nothing() -> None:
    assert nothing_cut(passing([25, 25], [0, 20], stock=None)) == (
        "nothing was cut: cutting.removal_rate stays 0 over the whole run; "
        "take the tool into the material at feed, with the spindle turning."
    )


def test_where_something_is_cut_or_nothing_could_be_there_is_no_sentence() -> None:
    assert nothing_cut(passing([16, 16, 16], [0, 20, 40], cutting__removal_rate=[0.0, 1e-9, 0.0])) == ""
    assert nothing_cut(shoulder()) == ""
    assert nothing_cut(Record(np.arange(3.0), {"x_axis.position": Channel("x_axis.position", "m", np.zeros(3))})) == ""


def test_metrics_of_cutting_have_no_value_where_nothing_was_cut() -> None:
    found = measure(passing([25, 25, 25], [0, 20, 40]), stock_metrics())
    for name, unit in (("max_surface_roughness", "m"), ("max_cutting_force", "N"), ("removed_volume", "m^3"), ("mean_cutting_force", "N")):
        if name != "mean_cutting_force":  # it needs to know of the contact, which this record does not have
            assert found.skipped[name] == "no value: nothing was cut"
            assert found.as_json()[name] == {"value": None, "unit": unit, "reason": "no value: nothing was cut"}
        assert name not in found.values
    assert found.values["cycle_time"].value == 2.0
    assert found.values["rapid_contact_time"].value == 0.0
    assert "mean_cutting_force" not in found.as_json()


def test_which_metrics_are_of_cutting() -> None:
    assert {name for name, metric in stock_metrics().items() if metric.of_cutting} == OF_A_CUT


def test_without_a_cutting_process_a_metric_of_cutting_is_measured_as_ever() -> None:
    bare = Record(np.arange(3.0), {"a.main_force": Channel("a.main_force", "N", np.zeros(3))})
    assert measure(bare, [stock_metrics()["max_cutting_force"]]).values["max_cutting_force"].value == 0.0


def test_a_metric_of_a_guest_may_be_of_cutting_too() -> None:
    guest = Metric("chips", "1", "number of chips", lambda record: math.inf, of_cutting=True)
    assert measure(passing([25, 25], [0, 20]), [guest]).as_json()["chips"]["reason"] == "no value: nothing was cut"
    assert measure(shoulder(), [guest]).as_json() == {"chips": {"value": None, "unit": "1"}}
