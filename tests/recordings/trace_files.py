"""Writers of every form of trace that the stock readers know, each with the numbers and units that a reader must find in it."""

import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROWS, PERIOD = 120, 0.002
TIME = PERIOD * np.arange(ROWS)
PLACE = np.round(8.0 * np.sin(9.0 * TIME) + 3.0 * TIME, 6)
SPEED = np.round(72.0 * np.cos(9.0 * TIME) + 3.0, 6)
CURRENT = np.round(2.0 * np.sign(SPEED) + 0.5 * np.sin(71.0 * TIME), 6)
Expected = Mapping[str, tuple[str, np.ndarray]]


@dataclass(frozen=True)
class TraceFile:
    """A form: the name of its file, its writer, its columns with units and values, and whether ``test`` needs a library."""

    name: str
    write: Callable[[Path], None]
    expected: Expected
    library: str = ""


def rows_of(*columns: np.ndarray, mark: str = ",", comma: bool = False, form: str = "{:.6f}") -> str:
    text = "\n".join(mark.join(form.format(value) for value in row) for row in zip(*columns, strict=True)) + "\n"
    return text.replace(".", ",") if comma else text


def text_file(head: str, *columns: np.ndarray, mark: str = ",") -> Callable[[Path], None]:
    return lambda path: path.write_text(head + rows_of(*columns, mark=mark), encoding="utf-8") and None


def held_text(values: np.ndarray, row: int, name: str) -> str:
    """Return the attribute of a channel that is written where it changes."""
    return f' {name}="{values[row]:.6f}"' if row in (0, ROWS - 1) or values[row] != values[row - 1] else ""


STEPS = np.round(np.floor(TIME / 0.012) * 0.5, 6)
ANGLE, TURNS = np.round(108.0 * TIME, 6), 18.0 + 1e-3 * (np.arange(ROWS) // 5 % 2)


def write_sinumerik(path: Path) -> None:
    """Write a trace in which two channels are written where they change, and one at each of its samples, every 4 ms."""
    channels = [
        ("f1", "/Nck/!SD/nckServoDataCmdPos64 [u1, 7]", "posn", PERIOD, ROWS),
        ("f2", "/Nck/!SD/nckServoDataCmdVel64 [u1, 7]", "velo", PERIOD, ROWS),
        ("f3", "/Nck/!SD/nckServoDataActCurr32 [u1, 7]", "current", PERIOD, ROWS),
        ("f4", "/Nck/!SEMA/measPos1 [u1, 7]", "posn", 2 * PERIOD, ROWS // 2),
    ]
    lines = [
        f'  <dataSignal id="{key}" interval="{step:.6f}" datapointCount="{count}" name="{name}" unitsType="{kind}"/>'
        for key, name, kind, step, count in channels
    ]
    for row in range(ROWS):
        fields = held_text(ANGLE, row, "f1") + held_text(TURNS, row, "f2") + held_text(STEPS, row, "f3")
        fields += f' f4="{ANGLE[row] - 0.5:.6f}"' if row % 2 else ""
        lines.append(f'  <rec time="{TIME[row]:.6f}"{fields}/>')
    head = '<?xml version="1.0" encoding="utf-8" ?>\n<!--XML file-->\n<traceSession version="01.00.03.02">\n<traceData>\n <dataFrame>\n'
    path.write_text(head + "\n".join(lines) + "\n </dataFrame>\n</traceData>\n</traceSession>\n", encoding="utf-8")


DIGITS = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"


def base85(values: np.ndarray) -> str:
    """Return doubles as the SAT Library writes them; a word of zeros is a dot."""
    found = ""
    for (word,) in struct.iter_unpack(">I", values.astype(">f8").tobytes()):
        digits = "".join(DIGITS[word // 85**power % 85] for power in (4, 3, 2, 1, 0))
        found += digits if word else "."
    return "\n  ".join(found[begin : begin + 120] for begin in range(0, len(found), 120))


FREQUENCY = np.arange(1.0, 41.0)
SPECTRUM = np.round(np.exp(1j * FREQUENCY / 7.0) / FREQUENCY, 6)


def array(name: str, values: np.ndarray, length: int) -> str:
    raw = f'<raw name="m_pNumberArray"><![CDATA[\n  {base85(values)}\n  ]]></raw>'
    return f'<NumericArray format="base85" name="{name}"><unsigned_int name="m_length">{length}</unsigned_int>{raw}</NumericArray>\n'


def write_response(path: Path) -> None:
    """Write two series of one signal and a spectrum."""
    series = "".join(
        f'<TimeSeries name="m_TimeSeriesList_node">{array("m_ValueVector", values, ROWS)}<float name="m_TimeVector.start">0</float>'
        f'<float name="m_TimeVector.end">{float(TIME[-1])!r}</float>'
        f'<unsigned_int name="m_TimeVector.length">{ROWS}</unsigned_int></TimeSeries>\n'
        for values in (PLACE, CURRENT)
    )
    pairs = np.column_stack([SPECTRUM.real, SPECTRUM.imag]).ravel()
    spectrum = array("m_ValueVector", pairs, len(FREQUENCY)) + array("m_FrequencyVector", FREQUENCY, len(FREQUENCY))
    ids = '<unsigned_int name="m_uSignodeId">61</unsigned_int><unsigned_int name="m_uSecondId">0</unsigned_int>'
    node = f'<PlatformSignalNode><unsigned_int name="m_uNodeId">61</unsigned_int>\n{series}{ids}'
    node += f'<CrossSpectrum name="m_avgCrossSpec">{spectrum}</CrossSpectrum></PlatformSignalNode>'
    head = '<?xml version="1.0" encoding="ISO-8859-1"?>\n<!-- 4.7.6.0.3 -->\n<ResponseTestCustom ver="4.7.6.0.3">\n'
    path.write_text(f"{head}{node}\n</ResponseTestCustom>\n", encoding="latin-1")


def write_edge(path: Path) -> None:
    """Write cycles of 2 ms in payloads of ten rows, with an event between two of them."""
    names = [("CYCLE", "Cycle"), ("DES_POS|1", "X1"), ("ENC_POS|1", "X1"), ("CURRENT|1", "X1")]
    signals = [{"Name": name, "Type": "DOUBLE", "Axis": axis, "Address": name} for name, axis in names]
    rows = [[5000 + row, PLACE[row], SPEED[row], CURRENT[row]] for row in range(ROWS)]
    payload: list[dict[str, object]] = [{"HFData": rows[begin : begin + 10]} for begin in range(0, ROWS, 10)]
    payload.insert(3, {"HFBlockEvent": {"GCode": "G1 X5"}})
    header = {"Version": {"outputFileFormatVersion": "1.0"}, "SignalListHFData": signals, "CycleTimeMs": 2}
    lines = ",\n".join(json.dumps(entry) for entry in payload)
    path.write_text(f'{{\n"Header":\n{json.dumps(header)}\n,"Payload":\n[{lines}]}}\n', encoding="utf-8")


FAST = np.round(np.arange(5 * ROWS) * PERIOD / 5, 6)


@dataclass(frozen=True)
class ScopeForm:
    """How TwinCAT Scope exports: what separates cells, the decimal sign, whether each channel has its times, and the order of channels."""

    mark: str = "\t"
    comma: bool = False
    every_time: bool = False
    fast_first: bool = True
    end: str = ""

    def write(self, path: Path) -> None:
        """Write two channels at 2 ms, one of them in V, and one at 0.4 ms."""
        slow = [("place", "(None)", "REAL64", TIME, PLACE), ("test space", "V (Voltage)", "REAL32", TIME, CURRENT)]
        fast = [("fast", "mA (Current)", "REAL32", FAST, FAST)]
        groups = [fast, slow] if self.fast_first else [slow, fast]
        if self.every_time:
            groups = [[channel] for group in groups for channel in group]
        keys = [("Name", 0), ("SymbolComment", -1), ("Data-Type", 2), ("SymbolName", -2), ("Unit", 1)]
        lines = [f"Name{self.mark}trace", f"File{self.mark}C:\\trace.csv", f"Starttime of export{self.mark}132959733843760000", "", ""]
        for key, item in keys:
            row = []
            for group in groups:
                row += [key, *("" if item == -1 else f"MAIN.{c[0].split()[0]}" if item == -2 else str(c[item]) for c in group)]
            lines.append(self.mark.join(row))
        for key, plain in (("SampleTime[ms]", "0,4"), ("ScaleFactor", "1"), ("Unit ScaleFactor", "1")):
            lines.append(self.mark.join(cell for group in groups for cell in (key, *[plain] * len(group))))
        lines.append("")
        for row in range(len(FAST)):
            cells = [" "] * sum(1 + len(group) for group in groups)
            place = 0
            for group in groups:
                if row < len(group[0][3]):
                    numbers = [1e3 * group[0][3][row], *(channel[4][row] for channel in group)]
                    cells[place : place + len(numbers)] = [f"{number:.10g}" for number in numbers]
                place += 1 + len(group)
            while cells[-1] == " ":
                cells.pop()
            text = self.mark.join(cells)
            lines.append(text.replace(".", ",") if self.comma else text)
        path.write_text("\n".join(lines) + "\n" + self.end, encoding="utf-8")


SCOPES = {
    "default": ScopeForm(comma=True, every_time=True, fast_first=False, end="EOF\n"),
    "without oversampling": ScopeForm(mark=";", every_time=True, fast_first=False),
    "end mark": ScopeForm(end="EOF\n"),
    "decimal comma": ScopeForm(comma=True),
    "double times": ScopeForm(every_time=True),
    "double times, not sorted": ScopeForm(every_time=True, fast_first=False),
    "single times, not sorted": ScopeForm(fast_first=False),
    "blanks": ScopeForm(mark=" "),
    "colons": ScopeForm(mark=":"),
    "semicolons": ScopeForm(mark=";"),
    "commas": ScopeForm(mark=","),
}
"""The eleven variants of the public samples."""


def scope_expected(place: str = "place", test: str = "test space", fast: str = "fast") -> Expected:
    return {
        "time": ("s", TIME), place: ("", PLACE), test: ("V", CURRENT), f"time of {fast}": ("s", FAST), fast: ("mA", FAST),
    }  # fmt: skip


def write_kuka(path: Path) -> None:
    """Write a header and its values beside it, all channels value by value."""

    def channel(name: str, unit: str, *further: str) -> str:
        return "\r\n".join(["#BEGINCHANNELHEADER", f"200,{name}", f"202,{unit}", f"220,{ROWS}", *further, "#ENDCHANNELHEADER", ""])

    stored = ["210,EXPLIZIT", f"211,{path.stem}.r64", "213,BLOCK", "214,REAL64"]
    text = "DIAEXTENDED  {@:ENGLISH\r\n#BEGINGLOBALHEADER\r\n1,WINDOWS 32Bit\r\n112,High -> Low\r\n#ENDGLOBALHEADER\r\n"
    text += channel("Zeit", "s", "210,IMPLIZIT", "240,0", f"241,{PERIOD}")
    text += channel("Actual_Position_A1", "deg", *stored, "221,1", "240,0", "241,1")
    text += channel("Motor_Current_A1", "A", *stored, "221,2", "240,0.5", "241,2")
    path.write_text(text, encoding="latin-1", newline="")
    np.column_stack([PLACE, (CURRENT - 0.5) / 2.0]).astype("<f8").tofile(path.with_suffix(".r64"))


def write_old_scope(path: Path) -> None:
    lines = [f"joint.0.motor-pos-cmd {x:+.14f} joint.0.f-error {i:+.14f} " for x, i in zip(PLACE, CURRENT, strict=True)]
    path.write_text("Sampling period is 2000000 nSec \n\n" + "\n".join(lines), encoding="utf-8")


def write_monitor(path: Path) -> None:
    path.write_text(
        "".join(f"rig:X-Act 2020-12-09 15:05:41.{2000 * row:06d} {PLACE[row]:.6f}  \n" for row in range(ROWS)), encoding="utf-8"
    )


def cdr(row: int) -> bytes:
    """Return a JointState of ROS 2: stamp, frame, two names, two positions, no velocities, two efforts."""
    text = lambda word: struct.pack("<I", len(word) + 1) + word.encode() + b"\0"  # noqa: E731
    nanoseconds = round(1e9 * TIME[row])
    body = struct.pack("<iI", 100 + nanoseconds // 10**9, nanoseconds % 10**9) + text("base")
    for item in (struct.pack("<I", 2), text("a1"), text("a2"), struct.pack("<I", 2)):
        body += bytes(-len(body) % 4) + item
    body += bytes(-len(body) % 8) + struct.pack("<dd", PLACE[row], SPEED[row]) + struct.pack("<II", 0, 2)
    body += bytes(-len(body) % 8) + struct.pack("<dd", CURRENT[row], 0.25)
    return b"\0\1\0\0" + body


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort  # N*m
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_mcap(path: Path) -> None:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode())
        plain = writer.register_schema("power", "jsonschema", b"{}")
        joints = writer.register_channel("/joint_states", "cdr", schema)
        old = writer.register_schema("my/Labelled", "ros1msg", b"string label\nfloat64 data\n")
        power, labelled = writer.register_channel("/power", "json", plain), writer.register_channel("/old", "ros1", old)
        for row in range(ROWS):
            at = round(1e9 * (100.0 + TIME[row]))
            writer.add_message(joints, at + 7, cdr(row), at + 7)
            if row % 4 == 0:
                writer.add_message(power, at, json.dumps({"volt": CURRENT[row]}).encode(), at)
                writer.add_message(labelled, at, struct.pack("<I3sd", 3, b"abc", PLACE[row]), at)
        writer.finish()


def write_mf4(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        signals = [Signal(CURRENT, TIME, name="current", unit="A"), Signal(PLACE, TIME, name="place", unit="mm")]
        file.append(signals)
        file.append([Signal(FAST, FAST, name="fast", unit="V")])
        file.save(path, overwrite=True)


def write_tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        for name, unit, values in (("place", "mm", PLACE), ("current", "A", CURRENT)):
            properties = {"unit_string": unit, "wf_increment": PERIOD, "wf_start_offset": 0.0}
            file.write_segment([ChannelObject("axis", name, values, properties=properties)])


EVERY_SECOND = np.where(np.arange(ROWS) % 2 == 1, ANGLE - 0.5, np.nan)
FOURTH = np.arange(0, ROWS, 4)
EDGE = "time,pos_x,cmd_pos_x,v_x,cont_dev_x,curr_x\n"
ODRIVE = "time,ODrive 2 Position,ODrive 2 Velocity,ODrive 2 Current\n"
MOTEUS = "timestamp,POSITION,VELOCITY,TORQUE,Q_CURRENT\n"
HALSCOPE = "# Sampling period is 2000000 ns\njoint.0.pos-cmd;joint.0.f-error\n# Position: 0.5;0.5\n# Scale: 0;1\n"
FILES = {
    "SINUMERIK trace": TraceFile("trace.xml", write_sinumerik, {
        "time": ("s", TIME), "nckServoDataCmdPos64|7": ("deg", ANGLE), "nckServoDataCmdVel64|7": ("rpm", TURNS),
        "nckServoDataActCurr32|7": ("A", STEPS), "measPos1|7": ("deg", EVERY_SECOND),
    }),
    "SINUMERIK frequency response": TraceFile("response.xml", write_response, {
        "time": ("s", TIME), "node_61_1": ("", PLACE), "node_61_2": ("", CURRENT), "frequency": ("Hz", FREQUENCY),
        "spectrum_61_0 real": ("", SPECTRUM.real), "spectrum_61_0 imaginary": ("", SPECTRUM.imag),
    }),
    "SINUMERIK Edge": TraceFile("edge.json", write_edge, {
        "time": ("s", 10.0 + TIME), "CYCLE": ("", 5000.0 + np.arange(ROWS)), "DES_POS|1": ("mm", PLACE), "ENC_POS|1": ("mm", SPEED),
        "CURRENT|1": ("A", CURRENT),
    }),
    "SINUMERIK Edge table": TraceFile("edge.csv", text_file(EDGE, TIME, PLACE, PLACE, SPEED, CURRENT, CURRENT), {
        "time": ("s", TIME), "pos_x": ("mm", PLACE), "cmd_pos_x": ("mm", PLACE), "v_x": ("mm/s", SPEED), "cont_dev_x": ("mm", CURRENT),
        "curr_x": ("A", CURRENT),
    }),
    "Heidenhain scope": TraceFile("scope.csv", text_file("x_s_actual,x_i_nominal\n", PLACE, CURRENT), {
        "x_s_actual": ("", PLACE), "x_i_nominal": ("", CURRENT),
    }),
    "Klipper accelerometer": TraceFile("raw.csv", text_file("#time,accel_x,accel_y,accel_z\n", TIME, PLACE, SPEED, CURRENT), {
        "time": ("s", TIME), "accel_x": ("mm/s^2", PLACE), "accel_y": ("mm/s^2", SPEED), "accel_z": ("mm/s^2", CURRENT),
    }),
    "ODrive log": TraceFile("odrive.csv", text_file(ODRIVE, TIME, PLACE, SPEED, CURRENT), {
        "time": ("s", TIME), "ODrive 2 Position": ("rev", PLACE), "ODrive 2 Velocity": ("rev/s", SPEED), "ODrive 2 Current": ("A", CURRENT),
    }),
    "moteus log": TraceFile("moteus.csv", text_file(MOTEUS, TIME, PLACE, SPEED, CURRENT, CURRENT), {
        "timestamp": ("s", TIME), "POSITION": ("rev", PLACE), "VELOCITY": ("rev/s", SPEED), "TORQUE": ("N*m", CURRENT),
        "Q_CURRENT": ("A", CURRENT),
    }),
    "halscope": TraceFile(
        "halscope.csv",
        text_file(HALSCOPE, PLACE, CURRENT, mark=";"),
        {"time": ("s", TIME), "joint.0.pos-cmd": ("", PLACE), "joint.0.f-error": ("", CURRENT)},
    ),
    "halscope, until 2.8": TraceFile("halscope.log", write_old_scope, {
        "time": ("s", TIME), "joint.0.motor-pos-cmd": ("", PLACE), "joint.0.f-error": ("", CURRENT),
    }),
    "TwinCAT Scope": TraceFile("twincat.csv", SCOPES["end mark"].write, scope_expected()),
    "KUKA trace": TraceFile("kuka.dat", write_kuka, {
        "Zeit": ("s", TIME), "Actual_Position_A1": ("deg", PLACE), "Motor_Current_A1": ("A", CURRENT),
    }),
    "EPICS": TraceFile("pvs.log", write_monitor, {"time": ("s", TIME), "rig:X-Act": ("", PLACE)}),
    "MCAP": TraceFile("ros.mcap", write_mcap, {
        "time": ("s", TIME), "/joint_states.position.a1": ("", PLACE), "/joint_states.position.a2": ("", SPEED),
        "/joint_states.effort.a1": ("", CURRENT), "/joint_states.effort.a2": ("", np.full(ROWS, 0.25)),
        "time of /power.volt": ("s", TIME[FOURTH]), "/power.volt": ("", CURRENT[FOURTH]), "/old.data": ("", PLACE[FOURTH]),
    }, "mcap"),
    "MF4": TraceFile("car.mf4", write_mf4, {
        "time": ("s", TIME), "current": ("A", CURRENT), "place": ("mm", PLACE), "time of fast": ("s", FAST), "fast": ("V", FAST),
    }, "asammdf"),
    "TDMS": TraceFile("daq.tdms", write_tdms, {"time": ("s", TIME), "place": ("mm", PLACE), "current": ("A", CURRENT)}, "nptdms"),
}  # fmt: skip
