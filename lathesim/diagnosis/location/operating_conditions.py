"""What a machine was doing at each sample: the variables that a mismatch may depend on.

A variable has no value (NaN) where it makes no sense: time since entry while the tool is out of the cut, spindle angle likewise, time out
of the cut while it is in. Where no sensor tells, the lesson's own simulation does (:attr:`Experiment.doing`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.condition import Kind
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import recorded_motion, velocity_of


@dataclass(frozen=True)
class Variable:
    """A variable that a mismatch may depend on: one or two arrays (samples,) whose bins are looked at together."""

    values: tuple[FloatArray, ...]
    kind: Kind = Kind.OTHER
    host: str = ""
    """The part that moves; empty where that is not asked."""


def variables(experiment: Experiment, method: Method = STANDARD) -> dict[str, Variable]:
    """Return what the machine was doing, by name."""
    period = experiment.machine.assembly.sample_period
    recorded = {name: experiment.record[name] for name in experiment.machine.compare}
    motion = recorded_motion(experiment.with_candidates, recorded)
    time = np.asarray(np.arange(len(experiment.record.time)) * period, dtype=np.float64)
    found = {"time": Variable((time,), Kind.TIME)}
    for part in experiment.machine.assembly.parts:
        host, ports = part.name, part.component.ports
        velocity = motion.get(f"{host}.{ports.get('flow', '')}")
        position = motion.get(f"{host}.{ports.get('displacement', '')}")
        if velocity is not None:
            direction = direction_of(velocity, method=method)
            # how a part that is to stand still moves is what loads do to it
            meant, acceleration = np.where(direction == 0.0, 0.0, velocity), velocity_of(velocity, period)
            found |= {
                f"velocity of {host}": Variable((meant,), Kind.VELOCITY),
                f"speed of {host}": Variable((np.abs(meant),), Kind.SPEED),
                f"sign of velocity of {host}": Variable((direction,), Kind.SIGN),
                f"acceleration of {host}": Variable((acceleration,)),
            }
            if position is not None:
                found |= {
                    f"position of {host}": Variable((position,), Kind.POSITION, host),
                    f"position and direction of {host}": Variable((position, direction)),
                    f"position and velocity of {host}": Variable((position, meant), Kind.TOGETHER),
                    f"position and acceleration of {host}": Variable((position, acceleration), Kind.TOGETHER),
                    f"distance since reversal of {host}": Variable((since_reversal(position, direction), direction)),
                    f"distance since rest of {host}": Variable((since_rest(position, direction), direction)),
                }
        if (in_cut := experiment.doing.get(f"{host}.{ports.get('in_cut', '')}")) is not None:
            found |= _of_the_cut(host, in_cut > 0.5, time, experiment.doing.get(f"{host}.{ports.get('angle', '')}"))
    for name in experiment.machine.drive:
        if not _pushes(experiment, name):
            found[name] = Variable((experiment.record[name],))
    return found


def _pushes(experiment: Experiment, name: str) -> bool:
    """Return whether a driven input is the command of a drive: in a loop that nobody modelled it answers to the load that nobody
    measured, and what is missing then always depends on it."""
    part, _, item = name.partition(".")
    ports = next(other.component.ports for other in experiment.machine.assembly.parts if other.name == part)
    return ports.get("drive") == item and ports.get("measured", item) == item


def _of_the_cut(host: str, in_cut: npt.NDArray[np.bool_], time: FloatArray, angle: FloatArray | None) -> dict[str, Variable]:
    """Return the variables of a place where a tool cuts now and then; none where it always or never does."""
    if in_cut.all() or not in_cut.any():
        return {}
    since = time - _since(in_cut, time)
    found = {
        f"in the cut or not of {host}": Variable((in_cut.astype(np.float64),)),
        f"time since entry of {host}": Variable((np.where(in_cut, since, np.nan),), Kind.PARTIAL),
        f"time out of the cut of {host}": Variable((np.where(in_cut, np.nan, time),), Kind.PARTIAL),
    }
    if angle is not None and float(np.ptp(angle[in_cut])) > 2.0 * np.pi:
        turned = np.where(in_cut, np.mod(angle, 2.0 * np.pi), np.nan)
        found[f"spindle angle in the cut of {host}"] = Variable((turned,), Kind.ANGLE)
    return found


def _since(flags: npt.NDArray[np.bool_], time: FloatArray) -> FloatArray:
    """Return the time at which the present stretch of equal flags began."""
    changed = np.concatenate([[True], flags[1:] != flags[:-1]])
    return time[np.maximum.accumulate(np.where(changed, np.arange(len(flags)), 0))]


def turns(experiment: Experiment) -> dict[str, tuple[FloatArray, npt.NDArray[np.bool_]]]:
    """Return, by part, the angle of a spindle without a sensor [rad] and where it counts: the longest stretch in the cut."""
    found = {}
    for part in experiment.machine.assembly.parts:
        ports = part.component.ports
        angle = experiment.doing.get(f"{part.name}.{ports.get('angle', '')}")
        in_cut = experiment.doing.get(f"{part.name}.{ports.get('in_cut', '')}")
        if angle is None or in_cut is None:
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (in_cut > 0.5).astype(np.int8), [0]])))
        if len(edges):
            begin, end = max(zip(edges[::2], edges[1::2], strict=True), key=lambda pair: int(pair[1] - pair[0]))
            inside = np.zeros(len(angle), dtype=bool)
            inside[begin:end] = True
            found[part.name] = (angle, inside)
    return found


def samples_per_turn(angle: FloatArray) -> int:
    """Return the number of samples in a turn, from an angle between 0 and 2 pi with gaps (NaN)."""
    steps = np.diff(angle)
    forward = steps[np.isfinite(steps) & (steps > 0.0)]
    return max(1, round(2.0 * np.pi / float(np.median(forward)))) if len(forward) else 1


def direction_of(velocity: FloatArray, standstill: float | None = None, method: Method = STANDARD) -> FloatArray:
    """Return -1, 0 or +1 for each sample; below ``standstill``, a share of the fastest motion, a part stands still."""
    share = method.location.standstill if standstill is None else standstill
    still = np.abs(velocity) < share * float(np.max(np.abs(velocity), initial=0.0))
    return np.where(still, 0.0, np.sign(velocity))


def since_reversal(position: FloatArray, direction: FloatArray) -> FloatArray:
    """Return the distance travelled since the direction last changed."""
    moving = direction != 0.0
    last = np.where(moving, direction, 0.0)
    held = _forward_filled(last)
    return _since_change(position, held)


def since_rest(position: FloatArray, direction: FloatArray) -> FloatArray:
    """Return the distance travelled since a part last began to move, or turned round."""
    return _since_change(position, direction)


def _since_change(position: FloatArray, direction: FloatArray) -> FloatArray:
    changed = np.concatenate([[True], direction[1:] != direction[:-1]])
    start = np.maximum.accumulate(np.where(changed, np.arange(len(position)), 0))
    return np.abs(position - position[start])


def _forward_filled(values: FloatArray) -> FloatArray:
    index = np.maximum.accumulate(np.where(values != 0.0, np.arange(len(values)), 0))
    return values[index]


def held_by_friction(experiment: Experiment, fitted: Fitted, row: int, method: Method = STANDARD) -> FloatArray:
    """Return for each sample (samples,) what dry friction may hold there unseen, in the unit of what is missing behind channel ``row``.

    At rest friction takes any value up to its level, whichever way the part came to rest: no law tells it, and it says nothing for or
    against one. It is 0 where the part moves, and where the model has no dry friction. Source: Armstrong-Helouvry, Dupont, Canudas de
    Wit, Automatica 30 (1994), section 2 (stiction is a force of constraint).
    """
    held = np.zeros(experiment.sensed.samples)
    for host, names in _dry_frictions(experiment, fitted).items():
        rest = _at_rest(experiment, host, method=method)
        if rest is None or not rest.any():
            continue
        there = fitted.by_name
        rows = np.array([list(there.values()), [0.0 if name in names else value for name, value in there.items()]])
        with_it, without = experiment.sensed.outputs(list(there), rows)
        moved = np.abs(with_it[row] - without[row])[~rest]
        if experiment.sensed.noise_shapes(there)[row].differences:
            # behind a moving part the missing signal is a force already
            held = np.maximum(held, np.where(rest, sum(there[name] for name in names), 0.0))
        elif len(moved):
            held = np.maximum(held, np.where(rest, float(np.median(moved)), 0.0))
    return held


def _dry_frictions(experiment: Experiment, fitted: Fitted) -> dict[str, list[str]]:
    """Return by host the names of the levels of dry friction in a fitted model."""
    values = fitted.by_name
    found: dict[str, list[str]] = {}
    for candidate in experiment.candidates:
        level = f"{candidate.part}.level"
        if candidate.effect.identification.sticks and values.get(level, 0.0) > 0.0:
            found.setdefault(candidate.at, []).append(level)
    return found


def _at_rest(experiment: Experiment, host: str, method: Method = STANDARD) -> npt.NDArray[np.bool_] | None:
    """Return where a part stands still: by its sensor, else as simulated."""
    direction = _direction(experiment, host, method=method)
    return None if direction is None else np.asarray(direction == 0.0)


def _direction(experiment: Experiment, host: str, method: Method = STANDARD) -> FloatArray | None:
    """Return which way a part moves at each sample, 0 where it stands still: by its sensor, else as simulated."""
    ports = next(part.component.ports for part in experiment.machine.assembly.parts if part.name == host)
    flow = f"{host}.{ports.get('flow', '')}"
    motion = recorded_motion(experiment.with_candidates, {name: experiment.record[name] for name in experiment.machine.compare})
    if flow in motion:
        return direction_of(motion[flow], method=method)
    return direction_of(experiment.doing[flow], method.location.commanded_standstill, method=method) if flow in experiment.doing else None


def one_way(experiment: Experiment, host: str, method: Method = STANDARD) -> bool:
    """Return whether a part is known to move in one direction only."""
    direction = _direction(experiment, host, method=method)
    return direction is not None and not (np.any(direction > 0.0) and np.any(direction < 0.0))


def resting(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> list[str]:
    """Return where a part with dry friction stands still, and for how much of the time."""
    found = []
    for host in _dry_frictions(experiment, fitted):
        rest = _at_rest(experiment, host, method=method)
        if rest is not None and float(np.mean(rest)) > method.shared.dependence:
            share = f"{float(np.mean(rest)):.0%} of the samples"
            found.append(f"{host} stands still in {share}; dry friction holds there whatever pushes, and what it holds is not counted.")
    return found
