"""Lesson 1 against Table 1 of Liu and Landers (2004), and its golden channels.

The 8-bit converters make limit cycles, so a single result scatters by 1 % (largest error) and 2 % (integral) when a parameter moves by
1 %. The reference is the mean over such draws of an independent simulator; the given values alone lie within the limits too.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis.metric import measure
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import Registry
from lathesim.record import Record
from lathesim.units import quantity

REFERENCE = {
    "I": (18.48, 0.684e-3, 0.1113e-6),
    "II": (18.48, 0.334e-3, 0.0201e-6),
    "III": (18.48, 0.510e-3, 0.0773e-6),
    "IV": (28.83, 0.430e-3, 0.0791e-6),
    "V": (18.48, 0.684e-3, 0.0398e-6),
    "VI": (18.48, 0.222e-3, 0.0537e-6),
}
"""Case -> cycle time [s], largest contour error [m], integral of its square [m^2 s] in contact."""
JITTERED = [f"{axis}_{name}" for axis in "xz" for name in ("axis.gain", "axis.time_constant", "controller.proportional")]

AT = (2.0, 6.0, 10.0, 12.0, 14.0, 16.0, 18.0)
GOLDEN = {
    "x_axis.position": (8e-6, (0.0150008, 0.0150008, 0.0150008, 0.01608061, 0.0170001, 0.01699934, 0.01957295)),
    "z_axis.position": (8e-6, (0.01326906, 0.02133714, 0.0293371, 0.03473045, 0.04063897, 0.04663459, 0.04823414)),
    "contour.contour_error": (8e-6, (0.0, 0.0, 0.0, -0.0001319058, 0.0, 0.0, -0.0004270526)),
    "x_dac.voltage": (0.0785, (-0.0392, -0.0392, -0.0392, 0.0392, 0.0392, 0.0392, 0.1176)),
    "z_dac.voltage": (0.0785, (0.1176, 0.1176, 0.1176, 0.1176, 0.1176, 0.1176, -2.549)),
    "cutting_force.cutting_force": (15.0, (0.0, 914.87, 884.61, 868.97, 471.76, 465.42, 0.0)),
    "cutting.depth_of_cut": (8e-6, (0.0, 0.002999, 0.002999, 0.0019194, 0.0009999, 0.0010007, 0.0)),
    "spindle.speed": (0.5, (104.8, 104.8, 104.8, 104.9, 104.8, 104.8, 104.8)),
    "surface_finish.roughness": (5e-9, (0.0, 5.625e-7, 5.625e-7, 1.2651e-6, 1.2644e-6, 1.2644e-6, 0.0)),
}
"""Case I: channel -> tolerance and values at the times of ``AT`` [SI]. The tolerance of a voltage is one level of the converter."""


@pytest.fixture(scope="module")
def records(registry: Registry) -> dict[str, Record]:
    lesson = load_lesson("01_contour_error")
    return {variant: simulate(lesson, registry, variant, engine="compiled") for variant in lesson.variants}


def metrics(record: Record, registry: Registry) -> tuple[float, float, float]:
    values = measure(record, registry.metrics).values
    return values["cycle_time"].value, values["max_contour_error"].value, values["contour_error_squared_integral"].value


def test_the_lesson_has_the_cases_of_the_table() -> None:
    assert load_lesson("01_contour_error").variants == tuple(REFERENCE)


@pytest.mark.parametrize("variant", REFERENCE)
def test_a_case_reaches_the_values_of_the_table(variant: str, records: dict[str, Record], registry: Registry) -> None:
    cycle_time, largest, integral = metrics(records[variant], registry)
    assert cycle_time == pytest.approx(REFERENCE[variant][0], abs=1e-9)
    assert largest == pytest.approx(REFERENCE[variant][1], rel=0.03)
    assert integral == pytest.approx(REFERENCE[variant][2], rel=0.06)


def test_the_largest_errors_rank_as_published(records: dict[str, Record], registry: Registry) -> None:
    largest = {variant: metrics(record, registry)[1] for variant, record in records.items()}
    assert largest["VI"] < largest["II"] < largest["IV"] < largest["III"] < largest["I"] == pytest.approx(largest["V"], rel=0.001)


@pytest.mark.parametrize("channel", GOLDEN)
def test_the_golden_channels_of_case_one(channel: str, records: dict[str, Record]) -> None:
    tolerance, values = GOLDEN[channel]
    samples = [round(time / 0.005) for time in AT]
    assert records["I"][channel][samples] == pytest.approx(values, abs=tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("variant", REFERENCE)
def test_the_means_over_small_changes_are_those_of_the_reference(variant: str, registry: Registry) -> None:
    lesson = load_lesson("01_contour_error")
    plan = prepare(lesson, registry, variant).plan
    given = np.array([plan.values[name] for name in JITTERED])
    chance = np.random.default_rng(2004)
    rows = []
    for _ in range(20):
        overrides = dict(zip(JITTERED, given * chance.uniform(0.99, 1.01, len(given)), strict=True))
        rows.append(metrics(simulate(lesson, registry, variant, overrides, engine="compiled"), registry))
    means = np.mean(rows, axis=0)
    assert means[0] == pytest.approx(REFERENCE[variant][0], abs=1e-9)
    assert means[1] == pytest.approx(REFERENCE[variant][1], rel=0.03)
    assert means[2] == pytest.approx(REFERENCE[variant][2], rel=0.06)


def test_the_readme_shows_what_the_lesson_gives(registry: Registry, records: dict[str, Record]) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    shown = {row[0]: row for line in readme.splitlines() if (row := re.split(r"\s{2,}", line.strip()))[0] in REFERENCE}
    (goal,) = load_lesson("01_contour_error").settings.goals
    for case, record in records.items():
        largest = measure(record, registry.metrics).values["max_contour_error"].value
        met = largest <= quantity(str(goal.at_most), "m")
        assert (shown[case][3], shown[case][-1]) == (f"{1e3 * largest:.5g} mm", f"{met:d} of 1")
