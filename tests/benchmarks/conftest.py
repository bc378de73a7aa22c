"""The work item, made once for all benchmarks."""

from __future__ import annotations

import pytest

from lathesim.cli.speed.bench_rows import Work, lathe_work


@pytest.fixture(scope="session")
def work() -> Work:
    return lathe_work()
