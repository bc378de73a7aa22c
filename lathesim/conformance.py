"""``check_component``: does a machine part keep the contract? The same test for stock parts and guests.

from lathesim.conformance import check_component
for fault in check_component(MyForce):
    print(fault)          # my_force.py:31: ForceModel.output gives 2 values, but 3 are declared: ... Return one value for each.
"""

from __future__ import annotations

import inspect
import itertools
import math
import random
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lathesim.component import Component, Declaration, DiscreteState, Input, Memory, Noise, Output, Parameter, State, Table
from lathesim.errors import ComponentError, UnitError
from lathesim.units import si_factor

SAMPLE_PERIOD = 0.005
STEP = 0.0005
SAMPLES = 4
"""Samples each case is run for: enough for a part to leave its start and to answer to what it remembers."""
LONGEST_MEMORY = 50
"""Cells a memory is given here; a law takes the length it finds."""
SIZES = (0.0, 1.0, -1.0, 1e-3, -1e-3, 40.0)
"""Values every input and continuous state is given at the same time."""
DEFAULTS = "the defaults"
_ROUNDING = 1e-12
"""Share by which a factor of a unit, a product of decimal numbers, may miss 1."""
_RESULT = {"derivative": State, "output": Output, "update": DiscreteState}


@dataclass
class _Case:
    """One set of values: parameters, inputs and states by name."""

    label: str
    values: dict[str, float]
    discrete: dict[str, float]
    memories: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Any] = field(default_factory=dict)


def check_component(component: type[Component], *, compiled: bool = False) -> list[ComponentError]:
    """Return what a component breaks of the contract; an empty list where it keeps it.

    Looked at: one sentence of documentation, units that can be read, laws that take what they name and give what is declared, as finite
    floats, at default values, at every bound of every parameter and at random values between them; the same answer twice. With
    ``compiled``, and numba installed, the compiled laws must give the same bits. A class that needs rows in its tables may give some as
    ``example_tables = {"path": [[...], ...]}``; otherwise rows of rising numbers are used. A class whose law rightly stops being a number
    somewhere says so in ``breaks_where``, one sentence.
    """
    if not (isinstance(component, type) and issubclass(component, Component)):
        return [ComponentError(f"{component!r} is no Component.", remedy="Derive the class from lathesim.component.Component.")]
    faults = [*_documentation(component), *_units(component)]
    if faults:
        return faults
    closed = component.with_units(dict.fromkeys(component.placeholders(), "1"))
    faults = _sources(component)
    for case in _cases(closed):
        fault = _run(component, closed.laws, case)
        if fault is not None:
            return [*faults, fault]
    if compiled and not faults:
        faults += _compiled(component, closed)
    return faults


def _documentation(component: type[Component]) -> Iterator[ComponentError]:
    if not (component.__doc__ or "").strip():
        yield ComponentError(
            f"{component.__name__} has no docstring.", place=_place(component), remedy="Say what it gives, its equation and its source."
        )


def _units(component: type[Component]) -> Iterator[ComponentError]:
    for name, item in component.declarations.items():
        unit = re.sub(r"\{\w+\}", "m", item.unit)
        try:
            si_factor(unit)
        except UnitError as error:
            yield ComponentError(
                f"{component.__name__}.{name} has the unit '{item.unit}', which is none.",
                place=line_of(component, name),
                remedy=error.remedy,
            )
            continue
        if abs(si_factor(unit)[0] - 1.0) > _ROUNDING:
            yield ComponentError(
                f"{component.__name__}.{name} is declared in '{item.unit}'.",
                place=line_of(component, name),
                remedy="Laws work in SI units.",
            )


def _sources(component: type[Component]) -> list[ComponentError]:
    """Return where a law uses something that cannot be taken into a fused machine."""
    from lathesim.engine.law_text import LawLibrary

    library = LawLibrary()
    found = []
    for law, function in component.laws.items():
        try:
            library.add(function, law)
        except ComponentError as error:
            found.append(ComponentError(f"{component.__name__}.{law}: {error.fact}", place=_place(function), remedy=error.remedy))
    return found


def _cases(component: type[Component]) -> Iterator[_Case]:
    parameters = component.declared(Parameter)
    settings: list[tuple[str, dict[str, float]]] = [(DEFAULTS, {})]
    for name, item in parameters.items():
        settings += [(f"{name} = {bound:g}", {name: bound}) for bound in (item.low, item.high) if math.isfinite(bound)]
    for side in ("low", "high"):
        bounds = {name: getattr(item, side) for name, item in parameters.items() if math.isfinite(getattr(item, side))}
        if len(bounds) > 1:
            settings.append((f"every parameter at its {side} bound", bounds))
    chance = random.Random(component.__name__)
    for _ in range(4):
        settings.append(("values between the bounds", {name: _between(item, chance) for name, item in parameters.items()}))
    for (label, changed), size in itertools.product(settings, SIZES):
        yield _case(component, label, changed, lambda size=size: size)  # type: ignore[misc]
    for label, changed in settings:
        yield _case(component, label, changed, lambda: chance.gauss(0.0, 1.0))


def _between(item: Parameter, chance: random.Random) -> float:
    low = item.low if math.isfinite(item.low) else item.default - abs(item.default)
    return chance.uniform(low, item.high if math.isfinite(item.high) else item.default + abs(item.default))


def _case(component: type[Component], label: str, changed: dict[str, float], size: Callable[[], float]) -> _Case:
    values = {name: item.default for name, item in component.declared(Parameter).items()} | changed
    values |= {name: size() for name in [*component.declared(Input), *component.declared(State)]}
    examples = getattr(component, "example_tables", {})
    tables = {
        name: examples.get(name, [[float(row)] * len(item.columns) for row in range(3)]) for name, item in component.declared(Table).items()
    }
    memories = _memories(component, values)
    return _Case(label, values, {name: item.start for name, item in component.declared(DiscreteState).items()}, memories, tables)


def _walk(component: type[Component], laws: dict[str, Any], case: _Case) -> Iterator[tuple[str, Any, dict[str, float]]]:
    """Run a case for a few samples and give each law's answer with what it was given."""
    discrete = dict(case.discrete)
    noises = itertools.cycle((0.0, 1.0, -2.0, 0.5))
    for sample in range(SAMPLES):
        known: dict[str, Any] = {**case.values, **case.memories, **case.tables}
        known |= {"time": sample * SAMPLE_PERIOD, "sample_period": SAMPLE_PERIOD, "step": STEP}
        known |= {name: next(noises) for name in component.declared(Noise)}
        for law in component.law_order:
            given = {name: known[name] if name in known else discrete[name] for name in component.arguments[law]}
            answer = laws[law](*given.values())
            yield law, answer, {name: value for name, value in given.items() if isinstance(value, float)}
            answers = answer if isinstance(answer, tuple) else (answer,)
            if law == "update":
                discrete = dict(zip(discrete, answers, strict=True)) if discrete else {}
            elif law != "derivative":
                known |= zip(component.output_laws()[law], answers, strict=True)


def _run(component: type[Component], laws: dict[str, Any], case: _Case) -> ComponentError | None:
    answers: list[Any] = []
    walk = _walk(component, laws, case)
    law = next(iter(laws), "")
    while True:
        try:
            law, answer, given = next(walk)
        except StopIteration:
            break
        except Exception as error:
            return ComponentError(
                f"{component.__name__} raises {type(error).__name__} ({error}) with {case.label}.",
                place=_line_in(error, laws) or _place(laws[law]),
                remedy="A law answers to every value its parameters may take; guard the division, root or logarithm.",
            )
        fault = _wrong_answer(component, law, answer, given, case.label)
        if fault is not None:
            return fault
        answers.append(answer)
    if case.label != DEFAULTS:
        return None
    again = _case_again(component, case)
    if _bits(answer for _, answer, _ in _walk(component, laws, again)) != _bits(answers):
        return ComponentError(
            f"{component.__name__} gives two answers to the same values.",
            place=_place(component),
            remedy="Laws keep nothing to themselves; declare a DiscreteState.",
        )
    return None


def _bits(answers: Iterable[Any]) -> list[str]:
    """Return answers in a form in which equal bits are equal, also those of what is no number."""
    return [
        " ".join(float(value).hex() for value in (answer if isinstance(answer, tuple) else (answer,)) if value is not None)
        for answer in answers
    ]


def _case_again(component: type[Component], case: _Case) -> _Case:
    return _Case(case.label, case.values, case.discrete, _memories(component, case.values), case.tables)


def _memories(component: type[Component], values: dict[str, float]) -> dict[str, list[float]]:
    """Return memories at the start: short ones, but as long as what they have to hold with these values."""
    given = {"duration": SAMPLES * SAMPLE_PERIOD} | values
    return {
        name: [item.start] * max(min(item.length, LONGEST_MEMORY), math.ceil(item.samples(given, SAMPLE_PERIOD)))
        for name, item in component.declared(Memory).items()
    }


def _wrong_answer(component: type[Component], law: str, answer: Any, given: dict[str, float], label: str) -> ComponentError | None:
    names = list(component.output_laws().get(law) or component.declared(_RESULT[law]))
    if not names:
        return None
    answers = answer if isinstance(answer, tuple) else (answer,)
    where = f"{component.__name__}.{law}"
    if len(answers) != len(names):
        return ComponentError(
            f"{where} gives {len(answers)} values, but {len(names)} are declared: {', '.join(names)}.",
            place=_place(component.laws[law]),
            remedy="Return one value for each, in that order.",
        )
    for name, value in zip(names, answers, strict=True):
        if not isinstance(value, float):
            return ComponentError(
                f"{where} gives {type(value).__name__} for {name}.",
                place=_place(component.laws[law]),
                remedy="Return floats, 0.0 instead of 0.",
            )
        if not math.isfinite(value) and not getattr(component, "breaks_where", ""):
            shown = ", ".join(f"{key} = {number:g}" for key, number in given.items())
            return ComponentError(
                f"{where} gives {value} for {name} with {label}; it was given {shown}.",
                place=_place(component.laws[law]),
                remedy="Guard the division, root or logarithm, or narrow the parameter's bounds.",
            )
    return None


def _compiled(component: type[Component], closed: type[Component]) -> list[ComponentError]:
    try:
        import numba
        import numpy as np
    except ImportError:
        return []
    from lathesim.engine.law_text import LawLibrary

    library = LawLibrary()
    names = {law: library.add(function, law) for law, function in component.laws.items()}
    scope: dict[str, Any] = {"math": math}
    exec(compile("\n".join(library.blocks), f"<{component.__name__}>", "exec"), scope)  # noqa: S102 - the component's own laws
    for name in library.functions:
        scope[name] = numba.njit(error_model="numpy")(scope[name])
    laws = {law: scope[name] for law, name in names.items()}
    for case in itertools.islice(_cases(closed), 0, None, 7):
        plain = [answer for _, answer, _ in _walk(component, closed.laws, case)]
        fast = _case_again(closed, case)
        fast.memories = {name: np.array(values) for name, values in fast.memories.items()}
        fast.tables = {name: np.array(rows) for name, rows in fast.tables.items()}
        try:
            answers = [answer for _, answer, _ in _walk(component, laws, fast)]
        except Exception as error:
            first = str(error).strip().splitlines()
            return [
                ComponentError(
                    f"{component.__name__} cannot be compiled: {first[-1] if first else type(error).__name__}.",
                    place=_place(component),
                    remedy="Use floats and math only, with the same types in all branches; runs with this part stay plain.",
                )
            ]
        if _bits(answers) != _bits(plain):
            return [
                ComponentError(
                    f"{component.__name__} gives other bits compiled than plain with {case.label}.",
                    place=_place(component),
                    remedy="Write x*x, math.sqrt(x) and math.floor(x + 0.5); keep min and max away from numbers that are none.",
                )
            ]
    return []


def _place(thing: Any) -> str:
    """Return ``file:line`` of a class or function, or its name where it has no file."""
    try:
        file = Path(inspect.getsourcefile(thing) or "").name
        return f"{file}:{inspect.getsourcelines(thing)[1]}"
    except (OSError, TypeError):
        return str(getattr(thing, "__qualname__", thing))


def line_of(component: type[Component], name: str) -> str:
    """Return ``file:line`` of the declaration of a component's name."""
    owner: type = next((base for base in component.__mro__ if isinstance(vars(base).get(name), Declaration)), component)
    try:
        lines, first = inspect.getsourcelines(owner)
        file = Path(inspect.getsourcefile(owner) or "").name
    except (OSError, TypeError):
        return _place(component)
    places = (f"{file}:{first + offset}" for offset, line in enumerate(lines) if re.match(rf"\s+{name}\s*[:=]", line))
    return next(places, _place(component))


def _line_in(error: BaseException, laws: dict[str, Any]) -> str:
    """Return ``file:line`` of the deepest frame of an error that lies in the file of a law."""
    files: Sequence[str] = [function.__code__.co_filename for function in laws.values() if hasattr(function, "__code__")]
    trace, found = error.__traceback__, ""
    while trace is not None:
        if trace.tb_frame.f_code.co_filename in files:
            found = f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}"
        trace = trace.tb_next
    return found
