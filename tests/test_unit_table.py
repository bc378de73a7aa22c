"""The table of common units says exactly what pint says."""

import pytest

from lathesim.unit_table import KNOWN_UNITS, known_unit
from lathesim.units import registry


@pytest.mark.parametrize("unit", KNOWN_UNITS)
def test_every_unit_of_the_table_is_what_pint_says(unit: str) -> None:
    base = registry().Quantity(1.0, unit).to_base_units()
    assert KNOWN_UNITS[unit] == (float(base.magnitude), str(base.dimensionality))


def test_brackets_of_replaced_placeholders_do_not_matter() -> None:
    assert known_unit("V/((N))") == KNOWN_UNITS["V/N"]
    assert known_unit("V/((rad/s))") == KNOWN_UNITS["V/(rad/s)"]
    assert known_unit("furlong") is None
