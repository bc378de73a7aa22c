"""A machine, or one of its parts, as an FMU for co-simulation: its compiled ``run_block`` behind the functions of FMI 3.0.

The FMU is a ZIP file with ``modelDescription.xml`` (variables, units, start values, which outputs follow from which inputs), a library for
the platform at hand, and ``resources/machine.bin`` with the numbers of the machine. The library is ``fmi3.c`` and the object file of the
engine, linked by the C compiler of the system: plain, compiled and exported give the same bits.

Source: Functional Mock-up Interface 3.0 (Modelica Association, 2022), sections 2.4 to 2.6 and 4. Left out: model exchange, scheduled
execution, other platforms than the one at hand. Noise is stored for the length of the run, and begins anew after it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from platform import machine as processor
from xml.etree import ElementTree as Xml

import numpy as np

import lathesim
from lathesim.component import Component, Declaration, DiscreteState, Input, Memory, Output, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Place, Wire
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import object_file
from lathesim.engine.run_arrays import draw_noise, start_arrays
from lathesim.engine.wiring import Node, Plan, giving, law_sources, wire
from lathesim.errors import LatheSimError, SimulationError, nearest
from lathesim.units import registry, si_factor
from lathesim.whole_file import whole_file

_BASE_UNITS = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "candela": "cd", "radian": "rad"}


class FromOutside(Component):
    """Passes on what comes from outside:  out = in.  A sampled part sees its value of the instant before."""

    given = Input("{signal}", doc="what comes from outside")
    passed = Output("{signal}", doc="what comes from outside")

    @staticmethod
    def output(given: float) -> float:
        return given


@dataclass(frozen=True)
class Exported:
    """What an FMU has to be, and what was made: its plan, and ``inputs`` and ``parameters``, names in it by the names of the variables.

    ``held`` names the inputs and outputs that move between two samples in the lesson, and are held from sample to sample in an FMU.
    """

    plan: Plan
    inputs: Mapping[str, str]
    parameters: Mapping[str, str]
    held: tuple[str, ...] = ()
    duration: float = 0.0
    seed: int = 0
    name: str = "machine"

    @property
    def platform(self) -> str:
        """The platform of the library, as FMI names it."""
        system = {"win32": "windows", "darwin": "darwin"}.get(sys.platform, "linux")
        return f"{_PROCESSORS.get(processor().lower(), processor().lower())}-{system}"


_PROCESSORS = {"amd64": "x86_64", "arm64": "aarch64"}


def whole_machine(plan: Plan, name: str, duration: float, seed: int) -> Exported:
    """Return a machine to be exported: what no wire feeds is an input, and what is recorded an output."""
    free = [full for full in plan.parameters if isinstance(plan.declaration(full), Input) and plan.feeds[full][0] == "parameter"]
    return Exported(plan, {full: full for full in free}, _settable(plan, free), (), duration, seed, name)


def one_part(plan: Plan, part: str, duration: float, seed: int) -> Exported:
    """Return a part to be exported: what a wire of the machine feeds is an input, everything that it gives an output."""
    if part not in plan.parts:
        raise LatheSimError(f"the machine has no part '{part}'.", remedy=nearest(part, plan.parts) or f"It has {', '.join(plan.parts)}.")
    own = plan.parts[part]
    parts, wires, inputs = [own], [], {}
    for full, (kind, source) in plan.feeds.items():
        place, declared = Place.of(full), plan.declaration(full)
        if place.part != part:
            continue
        start = plan.values[source] if kind == "parameter" else float(getattr(declared, "default", None) or 0.0)
        is_open = kind == "output" or (isinstance(declared, Input) and full in plan.assembly.wired)
        if is_open and isinstance(declared, Input) and declared.previous:
            guest = Part(f"given_{place.port}", FromOutside.with_units({"signal": declared.unit}))
            parts.append(guest)
            wires += [Wire(f"{guest.name}.given", constant=start), Wire(full, f"{guest.name}.passed")]
            inputs[full] = f"{guest.name}.given"
            continue
        wires.append(Wire(full, constant=start))
        if is_open:
            inputs[full] = full
    given = plan.assembly
    record = tuple(f"{part}.{name}" for name in own.component.declared(Output))
    if not record:
        raise LatheSimError(f"{part} has no output.", remedy="Export a part that gives something.")
    alone = wire(Assembly(tuple(parts), tuple(wires), given.sample_period, given.step, record=record), plan.tableau)
    return Exported(alone, inputs, _settable(alone, inputs.values()), held_by_an_fmu(plan, part), duration, seed, part)


def held_by_an_fmu(plan: Plan, part: str) -> tuple[str, ...]:
    """Return the inputs and outputs of a part that laws take anew between two samples, and that an FMU in its place holds there."""
    stages = [*plan.laws.stage, *((name, "derivative") for name in plan.parts)]
    taken = {(name, item) for name, law in stages for item in plan.parts[name].component.arguments.get(law, ())}
    held = []
    for full, (kind, source) in plan.feeds.items():
        place, there = Place.of(full), Place.of(source)
        is_passed = kind == "output" and (place.part == part) != (there.part == part)
        if is_passed and (place.part, place.port) in taken and plan.moves_between_samples(source):
            held.append(full if place.part == part else source)
    return tuple(dict.fromkeys(held))


def _settable(plan: Plan, inputs: Iterable[str]) -> dict[str, str]:
    """Return the parameters that a user of an FMU may set: not what says how long a memory is."""
    memories = [(part, item) for part in plan.parts.values() for item in part.component.declared(Memory).values()]
    lengths = {f"{part.name}.{name}" for part, item in memories for name in item.held_by}
    lengths |= {plan.feeds[name][1] for name in lengths if name in plan.feeds}
    return {name: name for name in plan.parameters if name not in {*inputs, *lengths}}


def direct_inputs(exported: Exported) -> dict[str, list[str]]:
    """Return for each channel the inputs (names of variables) from which it follows in the same instant."""
    plan = exported.plan
    known: dict[Node, frozenset[str]] = {}
    fed_by = {inside: outside for outside, inside in exported.inputs.items()}

    def of_law(node: Node) -> frozenset[str]:
        if node not in known:
            known[node] = frozenset()
            part, law = plan.parts[node[0]], node[1]
            arguments = part.component.arguments[law]
            found: set[str] = set()
            for name in arguments:
                kind, source = plan.feeds.get(f"{part.name}.{name}", ("parameter", f"{part.name}.{name}"))
                if kind == "parameter" and source in fed_by:
                    found.add(fed_by[source])
            for source in law_sources(part, law, plan.feeds):
                found |= of_law(giving(plan.parts, source))
            kept = any(isinstance(part.component.declarations.get(name), (DiscreteState, Memory)) for name in arguments)
            if kept and law != "update" and "update" in part.component.laws:
                found |= of_law((part.name, "update"))
            known[node] = frozenset(found)
        return known[node]

    return {channel: sorted(of_law(giving(plan.parts, channel))) for channel in plan.channels}


def write_fmu(exported: Exported, file: Path) -> None:
    """Write an FMU. Raises :class:`LatheSimError` where there is no C compiler, or where the machine cannot be compiled."""
    plan = exported.plan
    arrays = start_arrays(plan, None, exported.duration)
    samples = max(1, math.ceil(exported.duration / plan.assembly.sample_period) + 1) if plan.arrays.noises else 1
    noise = draw_noise(plan.arrays.noises, exported.seed, 0, samples)
    numbers = [arrays.parameters, arrays.states, arrays.discrete, *arrays.memories, *arrays.tables, *noise]
    content = b"".join(np.ascontiguousarray(item, dtype="<f8").tobytes() for item in numbers)
    digest = hashlib.sha256(fuse(plan).digest.encode() + content).hexdigest()[:32]
    header = _header(exported, digest, [len(arrays.states), len(arrays.discrete)], [arrays.memories, arrays.tables, tuple(noise)])
    model = exported.name if exported.name.isidentifier() else "machine"
    with tempfile.TemporaryDirectory() as folder:
        library = _library(Path(folder), header, object_file(fuse(plan), f"run_block_{digest}"))
        with whole_file(file) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", _description(exported, digest, model))
            archive.write(library, f"binaries/{exported.platform}/{model}{library.suffix}")
            archive.writestr("resources/machine.bin", content)


def _header(exported: Exported, digest: str, states: list[int], arrays: list[tuple[FloatArray, ...]]) -> str:
    """Return ``machine.h``: the sizes of the machine, and where its arrays lie among its numbers."""
    plan, place, shapes = exported.plan, len(exported.plan.parameters) or 1, []
    parameters = place
    place += sum(states)
    for array in (item for some in arrays for item in some):
        shapes.append(f"{{{place}, {array.shape[0]}, {array.shape[-1]}}}")
        place += array.size
    moving = sum(states) + sum(item.size for item in arrays[0])
    inputs = {plan.parameters[name] for name in exported.inputs.values()}
    defined = {
        "run_block": f"run_block_{digest}", "TOKEN": json.dumps(digest), "PERIOD": repr(plan.assembly.sample_period),
        "STEP": repr(plan.assembly.step), "STEPS": plan.assembly.steps_per_sample, "PARAMETERS": parameters, "STATES": states[0],
        "MOVING": moving, "MEMORIES": len(arrays[0]), "TABLES": len(arrays[1]), "NOISES": len(arrays[2]),
        "NOISE_SAMPLES": arrays[2][0].size, "NUMBERS": place, "CHANNELS": len(plan.channels), "INPUTS": len(inputs),
        "ENDS": int(bool(plan.assembly.finish)),
    }  # fmt: skip
    lines = [f"#define {name} {value}" for name, value in defined.items()]
    lines.append(f"static const long long ARRAY_SHAPES[][3] = {{{', '.join(shapes)}}};")
    lines.append(f"static const char IS_INPUT[] = {{{', '.join(str(int(place in inputs)) for place in range(parameters))}}};")
    lines.append(f"static const char *const NAMES[] = {{{', '.join(json.dumps(name) for name in plan.channels)}}};")
    return "\n".join([*lines, ""])


def _library(folder: Path, header: str, code: bytes) -> Path:
    """Return the library, linked in a folder."""
    compiler = next((found for name in [os.environ.get("CC", ""), "cc", "gcc", "clang"] if name and (found := shutil.which(name))), None)
    if compiler is None:
        raise LatheSimError("an FMU is linked by a C compiler, and there is none.", remedy="Install gcc or clang, or name one in CC.")
    (folder / "machine.h").write_text(header, encoding="utf-8")
    (folder / "machine.o").write_bytes(code)
    library = folder / f"library{ {'win32': '.dll', 'darwin': '.dylib'}.get(sys.platform, '.so') }"
    command = [compiler, "-shared", "-fPIC", "-O2", "-fvisibility=hidden", f"-I{folder}", str(Path(__file__).with_name("fmi3.c"))]
    command += [str(folder / "machine.o"), "-o", str(library), *(() if sys.platform == "win32" else ("-lm",))]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode:
        raise SimulationError(f"{compiler} cannot link the FMU: {(made.stderr.strip().splitlines() or ['no reason given'])[-1]}")
    return library


def _description(exported: Exported, token: str, model: str) -> bytes:
    """Return ``modelDescription.xml``."""
    plan = exported.plan
    period = repr(plan.assembly.sample_period)
    about = {"modelName": exported.name, "instantiationToken": token, "variableNamingConvention": "structured"}
    root = Xml.Element("fmiModelDescription", {"fmiVersion": "3.0", "generationTool": f"lathesim {lathesim.__version__}", **about})
    steps = {"canHandleVariableCommunicationStepSize": "true", "fixedInternalStepSize": period}
    Xml.SubElement(root, "CoSimulation", {"modelIdentifier": model, **steps})
    places = {outside: plan.parameters[inside] + 1 for outside, inside in {**exported.inputs, **exported.parameters}.items()}
    places |= {channel: place + max(1, len(plan.parameters)) + 1 for place, channel in enumerate(plan.channels)}
    _add_units(Xml.SubElement(root, "UnitDefinitions"), sorted(({plan.unit(name) for name in places} - {"1", ""}) | {"s"}))
    Xml.SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(exported.duration or 1.0), stepSize=period)
    variables = Xml.SubElement(root, "ModelVariables")
    Xml.SubElement(variables, "Float64", name="time", valueReference="0", causality="independent", variability="continuous", unit="s")
    for name, place in places.items():
        declared = plan.declaration(name)
        about = {"name": name, "valueReference": str(place), "description": declared.doc, **_kind(exported, name, declared)}
        if declared.unit not in ("1", ""):
            about["unit"] = declared.unit
        Xml.SubElement(variables, "Float64", about)
    structure = Xml.SubElement(root, "ModelStructure")
    follows = direct_inputs(exported)
    for kind in ("Output", "InitialUnknown"):
        for channel in plan.channels:
            known = {"dependencies": " ".join(str(places[name]) for name in follows[channel])} if kind == "Output" else {}
            Xml.SubElement(structure, kind, {"valueReference": str(places[channel]), **known})
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="utf-8", xml_declaration=True)
    return text


def _kind(exported: Exported, name: str, declared: Declaration) -> dict[str, str]:
    """Return causality, variability and start value of a variable."""
    plan = exported.plan
    if name in plan.channels:
        return {"causality": "output", "variability": "continuous"}
    if name in exported.inputs:
        return {"causality": "input", "variability": "continuous", "start": repr(plan.values[exported.inputs[name]])}
    bounds = {"min": declared.low, "max": declared.high} if isinstance(declared, Parameter) else {}
    limits = {word: repr(value) for word, value in bounds.items() if math.isfinite(value)}
    return {"causality": "parameter", "variability": "fixed", "start": repr(plan.values[name]), **limits}


def _add_units(definitions: Xml.Element, units: Iterable[str]) -> None:
    """Add the units with their powers of the base units; an angle is written as a power of the radian."""
    for unit in units:
        base = registry().Quantity(1.0, unit).to_base_units()
        powers = {_BASE_UNITS[name]: f"{power:g}" for name, power in dict(base.units._units).items() if name in _BASE_UNITS}
        factor = {} if si_factor(unit)[0] == 1.0 else {"factor": repr(si_factor(unit)[0])}
        Xml.SubElement(Xml.SubElement(definitions, "Unit", name=unit), "BaseUnit", {**powers, **factor})
