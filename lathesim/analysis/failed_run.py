"""What went wrong in a run, read off its record: why it cut nothing, and whether a loop was unstable."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import PurePath

import numpy as np

from lathesim.analysis.display_unit import plain_number
from lathesim.analysis.metric import NOTHING_CUT, SPINDLE_SPEED, find_channel, sign_of_cutting, was_cut
from lathesim.component import ON
from lathesim.engine.assembly import Place
from lathesim.record import FloatArray, Record

_AS_NEAR = 1e-9
"""What counts as the same distance [m], assumed: rounding."""
_STANDS = 0.5
"""Speed of the spindle [rad/s], 5 1/min, below which it stands: assumed, slower than any work is cut."""
_AT_FEED = "write the moves that cut with G1, G2 or G3 and a feed"


@dataclass(frozen=True)
class RawStock:
    """The stock before the run [m], from ``face`` over ``stock_length`` along z: its part in the machine, and the channels of the tip.

    ``free_end`` is -1 where the free end lies at smaller z and 1 at larger; ``edge_length`` [m] is what the edge takes along when facing.
    """

    part: str
    stock_radius: float
    stock_length: float
    face: float
    x: str
    z: str
    free_end: float = -1.0
    edge_length: float = 0.0

    def as_text(self) -> str:
        """Return it for the ``stock`` entry of a record's ``meta``."""
        return json.dumps(asdict(self))

    @classmethod
    def of(cls, record: Record) -> RawStock | None:
        """Return the stock that a record names, or none."""
        try:
            found = cls(**json.loads(str(record.meta["stock"])))
        except (KeyError, TypeError, ValueError):
            return None
        return found if found.x in record and found.z in record else None


def nothing_cut(record: Record) -> str:
    """Return why nothing was cut and what to do, as one sentence; empty where something was, or where no cutting process was recorded."""
    sign = sign_of_cutting(record)
    return "" if sign is None or was_cut(record) or not len(record) else f"{NOTHING_CUT}: {_told(record) or _unseen(sign)}."


def _told(record: Record) -> str:
    """Return the first cause that holds; where the program leads the tool comes before what the axes did."""
    return _no_feed(record) or _led_beside(record) or _only_rapids(record) or _without_chips(record) or _never_there(record)


def _no_feed(record: Record) -> str:
    feeding = find_channel(record, "cutting_block")
    return "" if feeding is None or (record[feeding] > ON).any() else f"every move of the program is a rapid one; {_AT_FEED}"


def _only_rapids(record: Record) -> str:
    touching, engaged = find_channel(record, "rapid_contact"), find_channel(record, "engaged")
    if touching is None or engaged is None or (record[engaged] > ON).any() or not (record[touching] > ON).any():
        return ""
    first = int(np.argmax(record[touching] > ON))
    return f"the tool meets the stock in rapid moves alone, first {_line(record, first)}; {_AT_FEED}"


def _without_chips(record: Record) -> str:
    """Return the sentence of a tool that touches the material and takes nothing."""
    engaged, speed = find_channel(record, "engaged"), find_channel(record, *SPINDLE_SPEED)
    if engaged is None or not (record[engaged] > ON).any():
        return ""
    first = int(np.argmax(record[engaged] > ON))
    if speed is not None and float(np.max(np.abs(record[speed][record[engaged] > ON]))) < _STANDS:
        return f"the tool meets the stock {_line(record, first)} and the spindle stands; turn it on before, with M3 and S"
    return f"the tool touches the stock {_line(record, first)} and never feeds into it; let a move at feed go into the material"


def _led_beside(record: Record) -> str:
    """Return where the program leads the tool nearest to the stock in the blocks run at feed; empty where it leads it in."""
    stock = RawStock.of(record)
    x, z = (find_channel(record, "x_reference"), find_channel(record, "z_reference"))
    if stock is None or x is None or z is None:
        return ""
    programmed = _nearest(record, stock, record[x], record[z])
    if programmed.distance <= _AS_NEAR:
        return ""
    return f"the program leads the tool no nearer to the stock than {programmed.told(record)}; take it to {_remedy(stock, programmed)}"


def _never_there(record: Record) -> str:
    """Return where the axes are nearest to the stock in the blocks run at feed."""
    stock = RawStock.of(record)
    if stock is None:
        return ""
    reached = _nearest(record, stock, record[stock.x], record[stock.z])
    remedy = f"see how {stock.x} and {stock.z} follow their references"
    return f"the tool comes no nearer to the stock than {reached.told(record)}, though the program leads it there; {remedy}"


@dataclass(frozen=True)
class _Nearest:
    """The point nearest to the stock [m]: how far ``outside`` its radius and ``beyond`` its ends."""

    sample: int
    x: float
    z: float
    outside: float
    beyond: float

    @property
    def distance(self) -> float:
        return math.hypot(self.outside, self.beyond)

    def told(self, record: Record) -> str:
        return f"{_mm(self.distance)}, at a radius of {_mm(self.x)} and z = {_mm(self.z)} {_line(record, self.sample)}"


def _nearest(record: Record, stock: RawStock, x: FloatArray, z: FloatArray) -> _Nearest:
    end = stock.face + stock.stock_length
    outside, beyond = np.maximum(x - stock.stock_radius, 0.0), np.maximum(np.maximum(stock.face - z, z - end), 0.0)
    distance = np.hypot(outside, beyond)
    feeding = find_channel(record, "cutting_block")
    if feeding is not None:
        distance = np.where(record[feeding] > ON, distance, np.inf)
    first = int(np.argmax(distance <= distance.min() + _AS_NEAR))
    return _Nearest(first, float(x[first]), float(z[first]), float(outside[first]), float(beyond[first]))


def _remedy(stock: RawStock, nearest: _Nearest) -> str:
    """Return where the tool would meet the stock, and what would make a stock that it meets."""
    radius = f"a radius below {_mm(stock.stock_radius)}"
    span = f"z between {_mm(stock.face)} and {_mm(stock.face + stock.stock_length)}"
    if nearest.outside > 0.0 and nearest.beyond > 0.0:
        return f"{radius} and {span} at feed, or change the stock with {stock.part}.stock_radius and {stock.part}.face"
    if nearest.beyond > 0.0:
        return f"{span} at feed, or change the stock with {stock.part}.face and {stock.part}.stock_length"
    return f"{radius} at feed, or set {stock.part}.stock_radius to more than {_mm(nearest.x)}"


def _unseen(sign: str) -> str:
    return f"{sign} stays 0 over the whole run; take the tool into the material at feed, with the spindle turning"


def _line(record: Record, sample: int) -> str:
    """Return the line of the part program in work, as far as it was recorded."""
    name, program = find_channel(record, "program_line"), PurePath(str(record.meta.get("program", ""))).name
    told = "" if name is None else f"in line {int(record[name][sample])} of {program or 'the program'}"
    return told or f"at {plain_number(float(record.time[sample]), 4)} s"


def _mm(value: float) -> str:
    return f"{plain_number(1e3 * value, 4)} mm"


UNSTABLE = "the loop is unstable"
"""Words in the status of a run that an alarm stopped because of an unstable loop."""
COMMANDS = "loop_commands"
"""Entry of a record's ``meta``: the command channels of the controllers, separated by spaces."""
_SAME = 1e-6
"""Share of the largest command by which two successive samples may miss its limit (assumed); peaks of a swing differ by more."""
_LEVELS = 20
"""Number of different values up to which a command only toggles by converter steps, as for an axis at rest (assumed)."""
_TIMES, _WITHIN = 20, 0.2
"""Changes to the other limit in a row, and the mean time of each [s], that count as a swinging loop (assumed)."""


def unstable_loop(record: Record) -> str:
    """Return the hint for a run with an unstable loop, or an empty text if no loop was unstable.

    A loop that is unstable for small errors swings between the limits of its voltage (K. J. Astrom, R. M. Murray, Feedback Systems, section
    10.5: limit cycle with saturation). Left out: loops that swing within these limits.
    """
    if UNSTABLE in record.status:
        return "The loop is unstable, see the alarm: correct that first."
    for name in str(record.meta.get(COMMANDS, "")).split():
        part, item = Place.of(name)
        if name in record and _bounces(record[name], record.sample_period):
            return f"The loop of {part} is unstable, its {item} goes from limit to limit: lower its gains first."
    return ""


def _bounces(command: FloatArray, period: float) -> bool:
    largest = float(np.max(np.abs(command))) if len(command) else 0.0
    held = np.abs(np.diff(command)) <= _SAME * largest
    near = (command >= np.max(command, initial=0.0) - _SAME * largest) | (command <= np.min(command, initial=0.0) + _SAME * largest)
    at = np.flatnonzero(near[1:] & held)
    if len(at) <= _TIMES or len(np.unique(command)) <= _LEVELS:
        return False
    turns = at[1:][np.sign(command[at[1:]]) != np.sign(command[at[:-1]])]
    return len(turns) > _TIMES and bool((turns[_TIMES:] - turns[:-_TIMES] <= _TIMES * _WITHIN / period).any())
