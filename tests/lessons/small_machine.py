"""A machine small enough to follow by hand: a command held by a controller, a mass that friction may act on, and a sensor."""

from pathlib import Path

from lathesim.component import Component, DiscreteState, Input, Output, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.plugins import Registry


class Push(Component):
    """Gives the force  F = gain (target - measured), once a sample."""

    gain = Parameter("N/m", 100.0, low=0.0, doc="force per metre of error")
    target = Parameter("m", 0.01, doc="where to go")
    measured = Input("m", doc="measured position")
    held = DiscreteState("N", 0.0, doc="force held")
    force = Output("N", doc="force")

    @staticmethod
    def update(gain: float, target: float, measured: float) -> float:
        return gain * (target - measured)

    @staticmethod
    def output(held: float) -> float:
        return held


class Table(Component):
    """A mass on a viscous slideway:  m dv/dt = F - b v - disturbance."""

    ports = {"effort": "disturbance", "flow": "velocity", "displacement": "position", "drive": "force", "inertia": "mass"}
    force = Input("N", doc="driving force")
    disturbance = Input("N", default=0.0, doc="force against positive motion")
    speed = State("m/s", doc="speed")
    travel = State("m", doc="travel")
    mass = Parameter("kg", 10.0, low=0.1, high=1000.0, doc="moving mass")
    viscous = Parameter("N*s/m", 100.0, low=0.0, doc="viscous friction")
    position = Output("m", doc="position")
    velocity = Output("m/s", doc="velocity")

    @staticmethod
    def derivative(speed: float, force: float, disturbance: float, mass: float, viscous: float) -> tuple[float, float]:
        return (force - viscous * speed - disturbance) / mass, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        return travel, speed


class HeavyTable(Table):
    """The table with other bounds and one parameter less in common: its mass is called ``load``."""

    mass = Parameter("kg", 500.0, low=100.0, high=1000.0, doc="moving mass")


class Ruler(Component):
    """Gives the position as it is."""

    ports = {"measured": "position", "reading": "reading"}
    position = Input("m", doc="position")
    reading = Output("m", doc="measured position")

    @staticmethod
    def output(position: float) -> float:
        return position


class Drag(Effect):
    """A constant force against the motion, smoothed:  F_out = F_in + level v/(|v| + v0)."""

    catalogue, family, site = 1, "reversal", "effort"
    neutral = {"level": 0.0}
    fingerprint = "A step of the missing force where the velocity changes sign."
    experiment = "Several speeds in both directions."
    source = "assumed"
    incoming = Input("{signal}", doc="force before the drag")
    flow = Input("{flow}", doc="velocity of the host")
    outgoing = Output("{signal}", doc="force with the drag")
    level = Parameter("{signal}", 5.0, low=0.0, doc="size of the drag")
    blur = Parameter("{flow}", 1e-4, low=1e-9, doc="speed at which half of it acts")

    @staticmethod
    def output(incoming: float, flow: float, level: float, blur: float) -> float:
        return incoming + level * flow / (abs(flow) + blur)


class Shift(Effect):
    """A constant added:  out = in + offset."""

    catalogue, family, site = 5, "constants", "reading"
    neutral = {"offset": 0.0}
    fingerprint = "A constant."
    experiment = "None."
    source = "assumed"
    incoming = Input("{signal}", doc="signal before")
    outgoing = Output("{signal}", doc="signal after")
    offset = Parameter("{signal}", 0.001, doc="what is added")

    @staticmethod
    def output(incoming: float, offset: float) -> float:
        return incoming + offset


MACHINE = """\
machine: A table on a spring
sample_period: 5 ms
step: 1 ms
parts:
  push: {component: Push, set: {gain: 200 N/m}}
  table: {component: Table, set: {mass: 20 kg}, start: {travel: 1 mm}}
  ruler: {component: Ruler}
wires:
  push.measured: ruler.reading
  table.force: push.force
  ruler.position: table.position
"""


def small_registry() -> Registry:
    """Return a registry that holds the parts of this file only."""
    registry = Registry()
    registry.__dict__["components"] = {part.__name__: part for part in (Push, Table, HeavyTable, Ruler)}
    registry.__dict__["effects"] = {effect.__name__: effect for effect in (Drag, Shift)}
    registry.__dict__["metrics"] = {}
    return registry


def write_lesson(
    folder: Path, body: str = "", *, machine: str = MACHINE, head: str = "lesson: Small\nmachine: small\nduration: 0.1 s\n"
) -> Path:
    """Write the machine and a lesson on it, and give the lesson's file."""
    (folder / "machines").mkdir(exist_ok=True)
    (folder / "machines" / "small.yaml").write_text(machine, encoding="utf-8")
    path = folder / "lesson.yaml"
    path.write_text(head + body, encoding="utf-8")
    return path
