"""The same lathe in other hands: one peer a file, found by ``lathesim bench`` when it runs from a checkout.

A peer has ``NAME``, ``absent()`` (why it cannot be measured here, empty where it can) and one of two things: ``simulate(work)``, which
gives the positions of both axes, shape (2, samples) [m], or ``times_and_positions(work, repeats)``, which measures by itself. ``PACKAGE``
names what it needs installed; ``SLOW`` marks what takes longer than half a minute, ``IN_TURNS`` what is quick enough to be measured in
turns with the engine. All must agree with the engine to one encoder count.
"""

from __future__ import annotations

import importlib
import time
from typing import Any

import numpy as np

PEERS = ("hand_written_c", "scipy_odeint", "scipy_solve_ivp", "python_control", "bdsim_blocks", "pathsim_blocks", "octave_modular")


def peer_module(peer: str) -> Any:
    """Return the module of a peer."""
    return importlib.import_module(f"{__name__}.{peer}")


def times_and_positions(peer: str, work: Any, repeats: int) -> tuple[list[float], np.ndarray]:
    """Run a peer a few times and give the CPU seconds of each run and the positions of the last."""
    module = peer_module(peer)
    if hasattr(module, "times_and_positions"):
        return module.times_and_positions(work, repeats)  # type: ignore[no-any-return]
    if hasattr(module, "PACKAGE"):
        from tests.benchmarks.peers.elsewhere import times_and_positions as measured

        return measured(peer, module.PACKAGE, repeats)
    seconds, positions = [], module.simulate(work)
    for _ in range(repeats):
        start = time.process_time()
        positions = module.simulate(work)
        seconds.append(time.process_time() - start)
    return seconds, positions
