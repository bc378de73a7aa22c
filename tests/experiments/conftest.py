"""The registry of what ships, which all tests of experiments read."""

import pytest

from lathesim.plugins import Registry, load_registry


@pytest.fixture(scope="session")
def registry() -> Registry:
    return load_registry(installed=False)
