"""The table of common units says exactly what pint says."""

import pytest

from lathesim.unit_table import KNOWN_UNITS, known_unit
from lathesim.units import dimension_text, registry, same_dimension


def test_every_unit_of_the_table_is_what_pint_says() -> None:
    for unit, (factor, dimension) in KNOWN_UNITS.items():
        base = registry().Quantity(1.0, unit).to_base_units()
        assert factor == pytest.approx(float(base.magnitude), rel=4e-16), unit  # versions of pint round the last digit differently
        assert dimension == dimension_text(base.dimensionality), unit


def test_brackets_of_replaced_placeholders_do_not_matter() -> None:
    assert known_unit("V/((N))") == KNOWN_UNITS["V/N"]
    assert known_unit("V/((rad/s))") == KNOWN_UNITS["V/(rad/s)"]
    assert known_unit("furlong") is None


@pytest.mark.parametrize(
    ("unit", "usual"),
    [("lbf", "N"), ("kgf", "N"), ("lbf*in", "N*m"), ("ozf*in", "N*m"), ("kgf*cm", "N*m"), ("in/min", "m/s"), ("psi", "Pa")],
)
def test_a_unit_that_is_put_together_another_way_measures_the_same(unit: str, usual: str) -> None:
    """Whether it stands in the table or not, and whatever was asked before."""
    assert same_dimension(unit, usual)
