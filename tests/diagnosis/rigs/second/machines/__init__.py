"""The rigs of the second set: those that limits may be chosen on, and those that are only asked."""

from __future__ import annotations

from tests.diagnosis.rigs.second.machines.calibrating import CALIBRATING
from tests.diagnosis.rigs.second.machines.held_out import HELD_OUT

RIGS = (*CALIBRATING, *HELD_OUT)
