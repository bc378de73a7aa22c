"""An FMU of another tool as a machine part: a component class made of its model description, whose laws call its library.

The part is sampled: at each of its sample instants t it does the step from t - sample_period to t with the inputs of the instant before,
as masters of co-simulation do. Outputs that the FMU says to follow from an input at once are read with the inputs of t. All are held until
the next instant. Ports are the scalar numbers of the FMU in SI, named as its variables, without what all names begin with.

An FMU is code. What only reads its description is in :func:`component_of`; the library is loaded when a run begins.
Source: Functional Mock-up Interface 3.0 (Modelica Association, 2022), section 4. Left out: model exchange, arrays, texts, clocks.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import itertools
import math
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lathesim.component import BUILT_IN_ARGUMENTS, LAW_NAMES, Component, DiscreteState, Input, Output, Parameter
from lathesim.errors import PluginError, UnitError, nearest
from lathesim.units import si_factor

_RUN = "run_number"
"""The state that says which instance belongs to a run."""
_LIVE = 16
"""Instances of an FMU that are kept; the oldest makes room for a new one."""
_KEPT = 2**16
"""Sample instants whose answers are kept: a block in which a law broke is run again to find it, and a step cannot be taken back."""
_WHOLE = re.compile(r"U?Int\d+|Integer|Enumeration")
_NUMBER = re.compile(r"Real|Float\d+|Boolean|U?Int\d+|Integer|Enumeration")
_BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_READ = ("2.", "3.")
"""How the versions of FMI begin that are read."""
_FAILED = 2
"""The least status of FMI that is a failure."""


@dataclass(frozen=True)
class _Port:
    """A variable of an FMU as a declared name: SI value = factor * value + offset."""

    name: str
    reference: int
    access: str
    unit: str
    factor: float
    offset: float
    start: float
    about: str
    causality: str
    bounds: tuple[float, float]

    def given(self, value: float) -> float | int | bool:
        """Return the value that the FMU is given for an SI value."""
        own = (value - self.offset) / self.factor
        return round(own) != 0 if self.access == "Boolean" else round(own) if _WHOLE.fullmatch(self.access) else own


@dataclass(frozen=True)
class _Fmu:
    """An FMU that can be run: its file, what fmpy read of its description, its ports, and where each instance is kept."""

    file: Path
    description: Any
    ports: tuple[_Port, ...]
    live: dict[int, _Instance] = field(default_factory=dict)

    def of(self, *causalities: str) -> list[_Port]:
        """Return the ports of some causalities, in the order of the file."""
        return [port for port in self.ports if port.causality in causalities]

    @functools.cached_property
    def folder(self) -> tempfile.TemporaryDirectory[str]:
        """The folder in which the FMU is unpacked."""
        import fmpy

        folder = tempfile.TemporaryDirectory(prefix="lathesim_fmu_", ignore_cleanup_errors=True)
        fmpy.extract(self.file, folder.name)
        return folder

    def begun(self, parameters: Sequence[float]) -> float:
        """Begin a run with these parameters [SI], and return its number."""
        most = 1 if self.description.coSimulation.canBeInstantiatedOnlyOncePerProcess else _LIVE
        while len(self.live) >= most:
            self.live.pop(next(iter(self.live))).end()
        number = next(_NUMBERS)
        self.live[number] = _Instance(self, parameters)
        return float(number)

    def run(self, number: float) -> _Instance:
        """Return the instance of a run."""
        if int(number) not in self.live:
            raise ValueError(f"more than {_LIVE} runs of {self.file.name} go on at once")
        return self.live[int(number)]


_NUMBERS = itertools.count(1)


class _Instance:
    """One instance of an FMU, from its start on. Whatever fails in it raises ValueError with what it logged."""

    def __init__(self, model: _Fmu, parameters: Sequence[float]) -> None:
        from fmpy.simulation import instantiate_fmu

        self.model, self.parameters, self.log = model, tuple(parameters), ""
        self.is_2 = model.description.fmiVersion.startswith("2.")
        self.failure = ""
        self.instants: dict[float, int] = {}
        self.instant = 0
        self.answers: dict[tuple[str, int], tuple[float, ...]] = {}
        self.slave: Any = self._done(
            instantiate_fmu, model.folder.name, model.description, "CoSimulation", logger=self._logged, require_functions=False
        )
        self._set({port: value for port, value in zip(model.of("parameter"), parameters, strict=True) if value != port.start})
        if self.is_2:
            self._done(self.slave.setupExperiment, startTime=0.0)
            self._done(self.slave.enterInitializationMode)
        else:
            self._done(self.slave.enterInitializationMode, startTime=0.0)
        self._done(self.slave.exitInitializationMode)

    def _logged(self, *given: Any) -> None:
        if given[2 if self.is_2 else 1] >= _FAILED:
            self.log = given[-1].decode(errors="replace").strip()

    def _done(self, function: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """Call a function of the library; what fails once fails again in the same words."""
        if not self.failure:
            try:
                return function(*given, **named)
            except Exception as error:  # fmpy raises plain exceptions
                self.failure = self.log or str(error)
        raise ValueError(self.failure.rstrip("."))

    def _set(self, values: Mapping[_Port, float]) -> None:
        for port, value in values.items():
            self._done(getattr(self.slave, f"set{port.access}"), [port.reference], [port.given(value)])

    def step(self, time: float, period: float, parameters: Sequence[float], inputs: Sequence[float]) -> None:
        """Do the step that ends at a time [s], with the inputs [SI] that held since it began."""
        if time in self.instants:
            self.instant = self.instants[time]
            return
        if tuple(parameters) != self.parameters:
            raise ValueError(f"a parameter changes during the run, and those of {self.model.file.name} are fixed")
        if self.instants:
            self._set(dict(zip(self.model.of("input"), inputs, strict=True)))
            done = self._done(self.slave.doStep, next(reversed(self.instants)), period)
            if done and done[1]:
                self.failure = "the FMU ends the simulation"
                self._done(lambda: None)
        self.instants[time] = self.instant = len(self.instants)
        for kept, most in ((self.instants, _KEPT), (self.answers, _KEPT * len(self.model.ports))):
            if len(kept) > most:
                del kept[next(iter(kept))]  # type: ignore[arg-type]

    def read(self, outputs: Sequence[_Port], inputs: Mapping[_Port, float]) -> tuple[float, ...]:
        """Return outputs [SI] at the instant of the last step, where they follow from these inputs [SI]."""
        key = (outputs[0].name, self.instant)
        if key not in self.answers:
            self._set(inputs)
            values = [self._done(getattr(self.slave, f"get{port.access}"), [port.reference])[0] for port in outputs]
            self.answers[key] = tuple(port.factor * float(value) + port.offset for port, value in zip(outputs, values, strict=True))
        return self.answers[key]

    def end(self) -> None:
        """Free the instance."""
        if not self.failure:
            self._done(self.slave.terminate)
            self._done(self.slave.freeInstance)


def fmu_of(name: str, origins: Mapping[str, str]) -> type[Component]:
    """Return the component that the FMU of a file name is; raises :class:`PluginError` where no plug-in is one."""
    if name in origins:
        return component_of(Path(origins[name]))
    hint = nearest(name[:-4], [known[:-4] for known in origins if known.endswith(".fmu")]).replace("'?", ".fmu'?")
    remedy = hint or "It is code, so put it in plugins/ of your workspace, or name its folder with --plugins."
    raise PluginError(f"there is no FMU '{name}' among the plug-ins.", remedy=remedy)


def component_of(file: Path) -> type[Component]:
    """Return the component that an FMU is; its description is read, and none of its code is run.

    Raises :class:`PluginError` where the file is no FMU, or one that cannot be run here.
    """
    stamp = file.stat()
    return _component(file.resolve(), stamp.st_mtime_ns, stamp.st_size)


@functools.lru_cache(maxsize=64)
def _component(file: Path, *_stamp: int) -> type[Component]:
    model = _read(file)
    run = DiscreteState("1", doc="which instance of the FMU computes the part", shown=False)
    body: dict[str, Any] = {"__module__": __name__, "outputs_are_held": True, _RUN: run}
    inputs, outputs, parameters = model.of("input"), model.of("output"), model.of("parameter")
    for port in inputs:
        body[port.name] = Input(port.unit, doc=port.about, previous=True)
    for port in outputs:
        body[port.name] = Output(port.unit, doc=port.about)
    for port in parameters:
        body[port.name] = Parameter(port.unit, port.start, doc=port.about, low=port.bounds[0], high=port.bounds[1])
    body["__doc__"] = _about(model)

    def update(number: float, time: float, sample_period: float, *values: float) -> float:
        given = values[: len(parameters)]
        number = number or model.begun(given)
        model.run(number).step(time, sample_period, given, values[len(parameters) :])
        return number

    digest = hashlib.sha256(file.read_bytes()).hexdigest()[:16]
    names = [_RUN, "time", "sample_period", *(port.name for port in (*parameters, *inputs))]
    body["update"] = _law(update, names, f"{file.name}:update:{digest}")
    follows = _direct_inputs(model)
    free = [port for port in outputs if not follows[port]]
    for law, given in [("output", free)] * bool(free) + [(f"output_{port.name}", [port]) for port in outputs if follows[port]]:
        taken = [*follows[given[0]]]
        names = [_RUN, *(port.name for port in taken)]
        body[law] = _law(functools.partial(_output, model, given, taken), names, f"{file.name}:{law}:{digest}")
    return type(file.name, (Component,), body)


def _output(model: _Fmu, outputs: Sequence[_Port], taken: Sequence[_Port], number: float, *values: float) -> Any:
    """Return the outputs of a law; before the first instant all are 0."""
    found = model.run(number).read(outputs, dict(zip(taken, values, strict=True))) if number else (0.0,) * len(outputs)
    return found if len(found) > 1 else found[0]


def _law(function: Callable[..., Any], names: Sequence[str], foreign: str) -> staticmethod[..., Any]:
    """Return a law that takes these names and calls a function of which the engine copies no text."""

    def law(*values: float) -> Any:
        return function(*values)

    law.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    )
    law.foreign = foreign  # type: ignore[attr-defined]
    return staticmethod(law)


def _read(file: Path) -> _Fmu:
    try:
        import fmpy
    except ImportError:
        raise PluginError(f"{file.name} needs fmpy, which is not installed.", remedy="pip install 'lathesim[fmi]'") from None
    version = ""
    try:
        with file.open("rb") as stream, zipfile.ZipFile(stream) as archive:
            names = archive.namelist()
            version = archive.read("modelDescription.xml").partition(b'fmiVersion="')[2].partition(b'"')[0].decode()
            description = fmpy.read_model_description(stream, validate=False) if version.startswith(_READ) else None
    except Exception as error:  # whatever a damaged archive and its XML let through
        reason = (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")
        raise PluginError(f"it is no FMU: {reason}.", place=str(file)) from None
    if description is None:
        fact = f"it is an FMU of FMI {version or 'unknown version'}, and those of 2.0 and 3.0 are read."
        raise PluginError(fact, place=str(file), remedy="Export it anew.")
    if description.coSimulation is None:
        fact = "the FMU offers no co-simulation, only model exchange or scheduled execution."
        raise PluginError(fact, place=str(file), remedy="Export it for co-simulation.")
    here = fmpy.platform if description.fmiVersion.startswith("2.") else fmpy.platform_tuple
    built = sorted({name.split("/")[1] for name in names if name.startswith("binaries/") and name.count("/") > 1})
    if here not in built:
        fact = f"the FMU has no library for {here}, only for {', '.join(built) or 'none'}."
        raise PluginError(fact, place=str(file), remedy="Export or compile it for this platform.")
    return _Fmu(file, description, _ports(description, str(file)))


def _ports(description: Any, place: str) -> tuple[_Port, ...]:
    numbers = [item for item in description.modelVariables if _NUMBER.fullmatch(item.type) and not item.dimensions]
    some = [item for item in numbers if item.causality in ("input", "output") or (item.causality == "parameter" and item.start is not None)]
    if not any(item.causality == "output" for item in some):
        raise PluginError("the FMU has no output that is a number.", place=place)
    first, last = (choose(item.name for item in some) for choose in (min, max))
    begin = max(place for place in range(len(first) + 1) if place == 0 or (last.startswith(first[:place]) and first[place - 1] == "."))
    taken: set[str] = set()
    return tuple(_port(description, item, item.name[begin:], taken) for item in some)


def _port(description: Any, item: Any, wished: str, taken: set[str]) -> _Port:
    name = _identifier(wished)
    while name in taken or name in BUILT_IN_ARGUMENTS or name in LAW_NAMES or name == _RUN or name.startswith("output_"):
        name = f"fmu_{name}"
    taken.add(name)
    unit, factor, offset, remark = _si(description, item.unit or (item.declaredType.unit if item.declaredType is not None else None))
    low, high = (factor * float(value) + offset if value is not None else None for value in (item.min, item.max))
    access = item.type if item.type != "Enumeration" else "Integer" if description.fmiVersion.startswith("2.") else "Int64"
    start = _number(item.start) * factor + offset
    bounds = (-math.inf if low is None else low, math.inf if high is None else high)
    about = f"{(item.description or item.name).strip() or name}{remark}"
    return _Port(name, item.valueReference, access, unit, factor, offset, start, about, item.causality, bounds)


def _number(text: str | None) -> float:
    """Return a start value; a truth value counts 1 or 0."""
    return {"true": 1.0, "false": 0.0}[text] if text in ("true", "false") else float(text or 0.0)


def _identifier(text: str) -> str:
    name = re.sub(r"\W+|__+", "_", text, flags=re.ASCII).strip("_")
    return name if name and not name[0].isdigit() else f"fmu_{name}"


def _si(description: Any, unit: str | None) -> tuple[str, float, float, str]:
    """Return the SI unit of a unit of an FMU, factor and offset to it, and a remark where the FMU leaves open what it means."""
    if unit in (None, "", "1", "-"):
        return "1", 1.0, 0.0, ""
    base = getattr(next((item for item in description.unitDefinitions if item.name == unit), None), "baseUnit", None)
    if base is None:
        return "1", 1.0, 0.0, f" (in {unit}, of which the FMU does not say what it is)"
    powers = {name: getattr(base, name) for name in _BASE_UNITS if getattr(base, name)}
    texts = {name: name if abs(power) == 1 else f"{name}^{abs(power)}" for name, power in powers.items()}
    above, below = ([texts[name] for name, power in powers.items() if power * sign > 0] for sign in (1, -1))
    made = "/".join(["*".join(above) or "1", *below])
    written = str(unit).replace(".", "*")
    try:
        if base.factor == 1.0 and not base.offset and si_factor(written) == si_factor(made):
            made = written
    except UnitError:
        pass
    return made, float(base.factor), float(base.offset), ""


def _direct_inputs(model: _Fmu) -> dict[_Port, list[_Port]]:
    """Return for each output the inputs from which it follows at once: all of them where the FMU does not say."""
    inputs = model.of("input")
    said = {item.variable.valueReference: item.dependencies for item in model.description.outputs}
    found = {}
    for port in model.of("output"):
        known = said.get(port.reference)
        wanted: Iterable[int] = [port.reference for port in inputs] if known is None else {item.valueReference for item in known}
        found[port] = [port for port in inputs if port.reference in wanted]
    return found


def _about(model: _Fmu) -> str:
    description, known = model.description, {port.reference for port in model.ports}
    left = [item.name for item in description.modelVariables if item.causality == "input" and item.valueReference not in known]
    text = f"{description.description or description.modelName}, computed by the FMU {model.file.name}.\n\n"
    text += f"Source: {description.generationTool or 'a tool that it does not name'}, FMI {description.fmiVersion}, co-simulation. "
    return text + f"Left out: {', '.join(left) or 'nothing that the description names'}."
