"""Where reference data lie that the project does not carry; a user's machine has none, and the tests that need them are skipped."""

from pathlib import Path

import pytest

SHARED = Path(__file__).parents[2] / "shared"

needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the reference data beside the project are not here")
