"""A machine that several threads ask for at once is made once, and all of them get the same runs."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lathesim.engine import batch
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from tests.engine.small_machine import loop


def test_a_machine_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    working: list[int] = []
    together: list[int] = []
    made = batch.compiled_machine

    def watched(fused: Any) -> Any:
        working.append(1)
        together.append(len(working))
        try:
            return made(fused)
        finally:
            working.pop()

    monkeypatch.setattr(batch, "compiled_machine", watched)
    plan = wire(replace(loop(), finish=""))

    def one(_: int) -> np.ndarray:
        found: np.ndarray = Batch(plan, 200, noisy=False).run([], np.zeros((1, 0)))[0]
        return found

    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(one, range(8)))
    assert together == [1] * 8
    assert all(np.array_equal(run, runs[0]) for run in runs)
