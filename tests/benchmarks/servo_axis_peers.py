"""The servo axis of ``lathesim bench --lanes`` in other hands: heyoka (batch mode), mujoco's rollout and CasADi with RK4 and with CVODES.

    python -m tests.benchmarks.servo_axis_peers

It needs those packages and numpy only, and prints the processor time of one run of sixteen. The machine is

    m dv/dt = F c (u - e v) - b v,   dx/dt = v,   u of the sampled and rounded cascade controller, held over a sample

heyoka cannot hold a sampled law in its own loop and is called once a sample; mujoco holds neither sampling nor rounding.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from importlib.metadata import version

import numpy as np

LANES, PERIOD, STEPS = 16, 1e-3, 4
SECONDS = 25.0
MASS, VISCOUS, POSITION_GAIN, VELOCITY_GAIN, EFFORT = 95.1089, 203.5034, 160.18, 243.45, 35.15065
COUNT, LEVELS, LIMIT = 50e-9, 2.0**24 - 1.0, 10.0


def reference(time: float) -> float:
    """Return the reference [m]: back and forth over 0.1 m at 0.1 m/s."""
    phase = 0.5 * time
    return 0.1 * abs(2.0 * (phase - np.floor(phase + 0.5)))


class Controller:
    """The sampled laws for all lanes, with numpy."""

    def __init__(self) -> None:
        self.before = np.zeros(LANES)

    def voltage(self, place: np.ndarray, time: float) -> np.ndarray:
        counted = COUNT * np.floor(place / COUNT + 0.5)
        before = counted if time <= 0.0 else self.before
        error = POSITION_GAIN * (reference(time) - counted) - (counted - before) / PERIOD
        self.before = counted
        command = np.clip(VELOCITY_GAIN * error, -LIMIT, LIMIT)
        quantum = 2.0 * LIMIT / LEVELS
        return np.clip(-LIMIT + np.floor((command + LIMIT) / quantum + 0.5) * quantum, -LIMIT, LIMIT)


def masses() -> np.ndarray:
    return MASS * (1.0 + 0.01 * np.arange(LANES))


def heyoka_batch(samples: int) -> str:
    import heyoka as hy  # type: ignore[import-not-found]

    x, v = hy.make_vars("x", "v")
    rate = (EFFORT * hy.par[0] - VISCOUS * v) / hy.par[1]
    made = hy.taylor_adaptive_batch([(x, v), (v, rate)], np.zeros((2, LANES)), pars=np.vstack([np.zeros(LANES), masses()]), tol=1e-9)

    def run() -> np.ndarray:
        made.set_time(0.0)
        made.state[:] = 0.0
        controller = Controller()
        for sample in range(samples):
            made.pars[0] = controller.voltage(made.state[0], sample * PERIOD)
            made.propagate_until((sample + 1) * PERIOD)
        return made.state[0].copy()

    return measured(run, samples)


def casadi_function(samples: int, plugin: str) -> str:
    import casadi as ca  # type: ignore[import-not-found]

    x, v, u, mass = (ca.MX.sym(name) for name in ("x", "v", "u", "mass"))
    ode = {"x": ca.vertcat(x, v), "p": ca.vertcat(u, mass), "ode": ca.vertcat(v, (EFFORT * u - VISCOUS * v) / mass)}
    options = {"number_of_finite_elements": STEPS} if plugin == "rk" else {"reltol": 1e-6, "abstol": 1e-12}
    over = ca.integrator("over", plugin, ode, 0.0, PERIOD, options)
    state, now = ca.MX.sym("state", 3), ca.MX.sym("now")
    phase = 0.5 * now
    asked = 0.1 * ca.fabs(2.0 * (phase - ca.floor(phase + 0.5)))
    counted = COUNT * ca.floor(state[0] / COUNT + 0.5)
    last = ca.if_else(now <= 0.0, counted, state[2])
    error = POSITION_GAIN * (asked - counted) - (counted - last) / PERIOD
    command = ca.fmin(ca.fmax(VELOCITY_GAIN * error, -LIMIT), LIMIT)
    quantum = 2.0 * LIMIT / LEVELS
    held = ca.fmin(ca.fmax(-LIMIT + ca.floor((command + LIMIT) / quantum + 0.5) * quantum, -LIMIT), LIMIT)
    after = over(x0=state[:2], p=ca.vertcat(held, mass))["xf"]
    sample = ca.Function("sample", [state, now, mass], [ca.vertcat(after, counted)])
    if plugin == "rk":
        sample = sample.expand()
    whole = sample.mapaccum("whole", samples).map(LANES)
    times = np.tile(PERIOD * np.arange(samples), LANES)[None, :]
    heavy = np.repeat(masses(), samples)[None, :]

    def run() -> np.ndarray:
        found = np.array(whole(np.zeros((3, LANES)), times, heavy))
        return found[0, samples - 1 :: samples]

    return measured(run, samples)


def mujoco_rollout(samples: int) -> str:
    import mujoco  # type: ignore[import-not-found]
    from mujoco import rollout  # type: ignore[import-not-found]

    text = """<mujoco><option timestep="{step}" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
    <worldbody><body><joint name="x" type="slide" axis="1 0 0" damping="{damping}"/>
    <geom type="sphere" size="0.1" mass="{mass}"/></body></worldbody>
    <actuator><general joint="x" gaintype="fixed" biastype="affine" gainprm="{gain}" biasprm="0 -{gain} -{rate}"
    forcelimited="true" forcerange="-{force} {force}"/></actuator></mujoco>"""
    gain, rate, force = EFFORT * VELOCITY_GAIN * POSITION_GAIN, EFFORT * VELOCITY_GAIN, EFFORT * LIMIT
    models = [
        mujoco.MjModel.from_xml_string(text.format(step=PERIOD / STEPS, damping=VISCOUS, mass=mass, gain=gain, rate=rate, force=force))
        for mass in masses()
    ]
    data = mujoco.MjData(models[0])
    asked = np.repeat([reference(PERIOD * sample) for sample in range(samples)], STEPS)[None, :, None]
    control = np.tile(asked, (LANES, 1, 1))
    size = mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros((LANES, size))

    def run() -> np.ndarray:
        states, _ = rollout.rollout(models, data, start, control)
        return states[:, -1, 1].copy()

    return measured(run, samples)


def measured(run: Callable[[], np.ndarray], samples: int) -> str:
    """Return the least processor time of two calls for one run of 25 s, and where the axes are at the end."""
    seconds, found = [], np.zeros(LANES)
    for _ in range(2):
        begun = time.process_time()
        found = run()
        seconds.append(time.process_time() - begun)
    each = 1e3 * min(seconds) / LANES * SECONDS / (samples * PERIOD)
    return f"{each:.4g} ms a run of {SECONDS:g} s; after {samples} samples x = {found[0]:.9g} to {found[-1]:.9g} m"


def main() -> None:
    """Print a line for each peer that is installed."""
    for package, what, call, samples in (
        ("heyoka", "batch mode, one call a sample", heyoka_batch, 25000),
        ("mujoco", "rollout, actuators without sampling and rounding", mujoco_rollout, 25000),
        ("casadi", "four RK4 steps a sample, mapaccum and map", lambda count: casadi_function(count, "rk"), 25000),
        ("casadi", "CVODES, started again each sample", lambda count: casadi_function(count, "cvodes"), 2500),
    ):
        if importlib.util.find_spec(package) is None:
            print(f"{package}: not installed")
        else:
            print(f"{package} {version(package)}, {what}: {call(samples)}")


if __name__ == "__main__":
    main()
