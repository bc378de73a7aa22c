"""A lesson with the changes a person made to it, and its machine as a person looks through it: groups of parts, and what can be set."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.component import GROUPS, Component, Input, Parameter, State
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Part, Place
from lathesim.errors import LatheSimError, UnitError
from lathesim.lessons.case import Given
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.part_values import placed_at, seconds, take_value
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.shipped import shipped_files
from lathesim.units import conversion, in_unit, split_quantity

Insert = Mapping[str, str]
"""An ``insert:`` entry of a lesson: ``effect``, ``at``, ``name`` and the effect's parameters."""


@dataclass(frozen=True)
class Setup:
    """A lesson, one of its variants, and what was changed on top: values, parts, effects, part program, seed.

    ``values`` maps ``part.name`` to a quantity with its unit, as ``--set`` takes it; ``replaced`` maps a part to the component that is put
    in its place.
    """

    lesson: Lesson
    variant: str | None = None
    values: Mapping[str, str] = field(default_factory=dict)
    replaced: Mapping[str, str] = field(default_factory=dict)
    inserted: tuple[Insert, ...] = ()
    program: Path | None = None
    seed: int | None = None
    simulation: Mapping[str, str] = field(default_factory=dict)
    """``sample_period``, ``step`` and ``duration``, as a lesson has them."""

    @property
    def is_changed(self) -> bool:
        """Whether anything differs from the lesson's variant."""
        return bool(self.summary != (self.variant or "as in the lesson"))

    @property
    def needs_file(self) -> bool:
        """Whether the changes go beyond the options of ``lathesim run``, so that they are written as a lesson."""
        return bool(self.replaced or self.inserted or self.simulation)

    @property
    def name(self) -> str:
        """The name of the lesson, with that of the variant."""
        return f"{self.lesson.name}_{self.variant}" if self.variant else self.lesson.name

    @property
    def summary(self) -> str:
        """The variant and the changes in a few words."""
        words = [self.variant] if self.variant else []
        words += [f"{name}={quantity}" for name, quantity in self.values.items()]
        words += [f"{part}: {component}" for part, component in self.replaced.items()]
        words += [f"{entry['effect']} at {entry['at']}" for entry in self.inserted]
        words += [f"{name}={quantity}" for name, quantity in self.simulation.items()]
        words += [self.program.name] if self.program is not None else []
        words += [f"seed {self.seed}"] if self.seed is not None else []
        return ", ".join(words) or "as in the lesson"

    def with_value(self, name: str, quantity: str | None) -> Setup:
        """Return the setup with another value of ``part.parameter`` or ``part.state``; None takes the lesson's own."""
        return replace(self, values=_with(self.values, name, quantity))

    def with_part(self, part: str, component: str | None, values: Mapping[str, str] | None = None) -> Setup:
        """Return the setup with another component in a place, None takes the lesson's own, and with other ``values`` if given."""
        return replace(self, replaced=_with(self.replaced, part, component), values=self.values if values is None else dict(values))

    def with_insert(self, entry: Insert) -> Setup:
        """Return the setup with one effect more."""
        return replace(self, inserted=(*self.inserted, dict(entry)))

    def with_insert_value(self, position: int, item: str, quantity: str | None) -> Setup:
        """Return the setup with another value of an inserted effect's parameter; None takes the effect's own."""
        entry = _with(self.inserted[position], item, quantity)
        return replace(self, inserted=tuple(entry if place == position else other for place, other in enumerate(self.inserted)))

    def with_simulation(self, name: str, quantity: str | None) -> Setup:
        """Return the setup with another sample period, step or duration; None takes the lesson's own."""
        return replace(self, simulation=_with(self.simulation, name, quantity))

    def without_insert(self, position: int) -> Setup:
        """Return the setup with one of its inserted effects taken out."""
        return replace(self, inserted=tuple(entry for place, entry in enumerate(self.inserted) if place != position))

    def lesson_text(self, folder: Path) -> str:
        """Return the setup as the YAML text of a lesson for a file in ``folder``; ``lathesim run`` takes it unchanged."""
        further = {"program": self.program and str(self.program.resolve()), "seed": self.seed, **self.simulation}
        given = {key: value for key, value in further.items() if value is not None}
        return changed_lesson(self.lesson, self.inserted, self.values, folder, variant=self.variant, replace=self.replaced, further=given)

    def prepared(self, registry: Registry) -> Prepared:
        """Return the setup assembled and wired; raises what :func:`lathesim.lessons.simulate.prepare` raises."""
        if self.needs_file:
            return prepare(lesson_from_text(self.lesson_text(self.lesson.path.parent), self.lesson.path), registry)
        return prepare(self.lesson, registry, self.variant, self.values, program=self.program)

    def command(self, out: Path | None = None, file: Path | None = None) -> str:
        """Return the command that runs the same; ``file`` is the lesson file it was written to where it needs one."""
        words = ["lathesim", "run", str(file) if file is not None and self.needs_file else self.lesson_word]
        if not (file is not None and self.needs_file):
            words += ["--variant", self.variant] if self.variant else []
            for name, quantity in self.values.items():
                words += ["--set", f"{name}={quantity}"]
            words += ["--program", _shortened(self.program)] if self.program is not None else []
            words += ["--seed", str(self.seed)] if self.seed is not None else []
        words += ["--out", str(out)] if out is not None else []
        return shlex.join(words)

    @property
    def lesson_word(self) -> str:
        """The lesson as a command names it: by its name where it is shipped or lies in ``lesson_configs``, else by its file."""
        shipped = {path.resolve() for path in shipped_files("lesson_configs", "*.yaml")}
        own = Path("lesson_configs").resolve()
        path = self.lesson.path.resolve()
        return self.lesson.name if path in shipped or path.parent == own else _shortened(self.lesson.path)


def _with(given: Mapping[str, str], name: str, text: str | None) -> dict[str, str]:
    """Return a mapping with another text of a name, or without it where that is None."""
    return {key: value for key, value in {**given, name: text}.items() if value is not None}


def _shortened(path: Path) -> str:
    """Return a path as seen from here where that is shorter."""
    here = Path.cwd().resolve()
    resolved = path.resolve()
    return str(resolved.relative_to(here)) if resolved.is_relative_to(here) else str(path)


EFFECTS, FURTHER, SIMULATION = "effects", "further parts", "simulation"
_SIMULATION_UNITS = {"sample_period": "s", "step": "s", "duration": "s", "seed": "1"}
_SIMULATION_WORDS = {
    "sample_period": "time between two samples of converters and controllers",
    "step": "length of one integration step",
    "duration": "length of the run where no output ends it",
    "seed": "number from which all noise is drawn",
}


@dataclass(frozen=True)
class Entry:
    """One thing that can be set: ``text`` as it is written now, ``default`` and ``bounds`` in words, ``fed`` by a wire or not.

    What ``is_aside`` a person seldom sets: a start value, and a parameter that comes by a wire.
    """

    name: str
    text: str
    unit: str
    default: str
    bounds: str
    doc: str
    changed: bool = False
    fed: str = ""
    is_aside: bool = False


def grouped_parts(case: Prepared) -> dict[str, list[Part]]:
    """Return the parts by group, groups in the order of the shop, empty ones left out; effects stand by themselves."""
    found: dict[str, list[Part]] = {group: [] for group in (*GROUPS, EFFECTS, FURTHER)}
    for part in case.machinery.parts:
        group = EFFECTS if issubclass(part.component, Effect) else part.component.group
        found[group if group in found else FURTHER].append(part)
    return {group: parts for group, parts in found.items() if parts}


def part_entries(case: Prepared, setup: Setup, part: Part) -> list[Entry]:
    """Return the parameters and start values of a part, in the order of their declaration; those that stand aside come last."""
    entries = []
    for item, declared in part.component.declarations.items():
        name = f"{part.name}.{item}"
        if isinstance(declared, Parameter):
            feeding = case.plan.feeds.get(name)
            fed = feeding[1] if feeding is not None and feeding[1] != name else ""
            limits = [declared.low, declared.high]
            default = declared.default
        elif isinstance(declared, State) and declared.shown:
            fed, limits, default = "", [-math.inf, math.inf], declared.start
        else:
            continue
        text = fed or _written(case, setup, part, item) or shown_with_unit(default, declared.unit, 6)
        changed = name in setup.values or _inserted_value(setup, part.name, item) is not None
        doc = declared.doc if isinstance(declared, Parameter) else f"at the start: {declared.doc}"
        bounds = _bounds(*(_in_unit_of(text, limit, declared.unit) if math.isfinite(limit) else "" for limit in limits))
        aside = not changed and (bool(fed) or isinstance(declared, State))
        entries.append(Entry(name, text, declared.unit, _in_unit_of(text, default, declared.unit), bounds, doc, changed, fed, aside))
    return sorted(entries, key=lambda entry: entry.is_aside)


def simulation_entries(case: Prepared, setup: Setup) -> list[Entry]:
    """Return what can be set of the run itself."""
    plan, seed = case.plan, setup.seed if setup.seed is not None else case.case.seed
    texts = {
        "sample_period": in_unit(plan.assembly.sample_period, "ms", "g"),
        "step": in_unit(plan.assembly.step, "ms", "g"),
        "seed": str(seed),
    }
    if case.duration is not None:
        texts["duration"] = f"{case.duration:g} s"
    entries = []
    for name, text in texts.items():
        changed = name in setup.simulation or (name == "seed" and setup.seed is not None)
        entries.append(Entry(name, setup.simulation.get(name, text), _SIMULATION_UNITS[name], "", "", _SIMULATION_WORDS[name], changed))
    return entries


def taken_value(case: Prepared, entry: Entry, typed: str) -> str:
    """Return the typed text as a value with a unit; a number without a unit is taken in the unit that is shown.

    Raises :class:`LatheSimError` if it is no value, or has two readings.
    """
    text = _in_shown_unit(entry, typed.strip())
    part, item = Place.of(entry.name)
    if item:
        component = next(found.component for found in case.machinery.parts if found.name == part)
        take_value(part, component, item, Given(text, entry.name, entry.name), {}, {})
    elif entry.name == "seed":
        if not (text.isascii() and text.isdigit()):
            raise UnitError("the seed is a whole number from 0 on.", place=entry.name, remedy="Write digits only.")
    else:
        seconds(Given(text, entry.name, entry.name))
    return text


def _in_shown_unit(entry: Entry, typed: str) -> str:
    with placed_at(entry.name):
        shown = split_quantity(entry.text)[1] or entry.unit
        if "," in typed:
            raise UnitError(f"the comma of '{typed}' may be a decimal or a thousands separator.", remedy="Write a decimal point.")
        number, unit = split_quantity(typed)
        if unit or shown == "1" or not math.isfinite(number):
            return typed
    return f"{typed} {shown}"


def with_entry(setup: Setup, entry: Entry, text: str | None) -> Setup:
    """Return the setup with another value of an entry; None takes the lesson's own."""
    if entry.name == "seed":
        return replace(setup, seed=None if text is None else int(text))
    if "." not in entry.name:
        return setup.with_simulation(entry.name, text)
    part, item = Place.of(entry.name)
    position = inserted_at(setup, part)
    return setup.with_value(entry.name, text) if position is None else setup.with_insert_value(position, item, text)


def candidates(case: Prepared, registry: Registry, part: Part) -> dict[str, type[Component]]:
    """Return the components that can stand in the place of a part.

    They give every output that a wire takes from it, and the machine feeds every input they cannot do without. Wires to inputs that they do
    not have are dropped, as 'replace:' in a lesson does.
    """
    needed = {Place.of(wire.source).port for wire in case.machinery.wires if Place.of(wire.source).part == part.name}
    fed = {Place.of(wire.target).port for wire in case.machinery.wires if Place.of(wire.target).part == part.name}
    found = {}
    for name, component in registry.components.items():
        declared = component.declarations
        wanted = {item for item, input_ in component.declared(Input).items() if input_.default is None}
        if needed <= set(declared) and wanted <= fed:
            found[name] = component
    return found


def proposed_place(case: Prepared, effect: type[Component], chosen: str) -> str:
    """Return the part to put an effect on, which has the ports it sits on: the chosen one, one wired to it, or the first."""
    roles = set(effect.pairs()) if issubclass(effect, Effect) else set()
    fitting = [part.name for part in case.machinery.parts if roles <= set(part.component.ports)]
    ends = [(Place.of(wire.source).part, Place.of(wire.target).part) for wire in case.machinery.wires]
    beside = {name for pair in ends if chosen in pair for name in pair}
    return min(fitting, key=lambda name: (name != chosen, name not in beside), default=chosen)


def with_component(setup: Setup, part: str, component: type[Component]) -> Setup:
    """Return the setup with another component in a place; values of names it does not have are dropped."""
    values = {
        name: text for name, text in setup.values.items() if (place := Place.of(name)).part != part or place.port in component.declarations
    }
    return setup.with_part(part, component.__name__, values)


def inserted_at(setup: Setup, part: str) -> int | None:
    """Return where among the setup's inserted effects a part stands; None where it is none of them."""
    from lathesim.lessons.insertion import effect_part_name

    for position, entry in enumerate(setup.inserted):
        if (entry.get("name") or effect_part_name(entry["at"], entry["effect"])) == part:
            return position
    return None


def _inserted_value(setup: Setup, part: str, item: str) -> str | None:
    position = inserted_at(setup, part)
    return setup.inserted[position].get(item) if position is not None else None


def _written(case: Prepared, setup: Setup, part: Part, item: str) -> str:
    """Return a value as it is written in the setup, the lesson or the machine; empty where nothing is written."""
    inserted = _inserted_value(setup, part.name, item)
    if inserted is not None:
        return inserted
    given = case.case.changed.set.get(f"{part.name}.{item}")
    if given is not None:
        return str(given.value)
    of_template = case.case.parts.get(part.name)
    if of_template is not None:
        entries: Mapping[str, str] = {**of_template.entry.set, **of_template.entry.start}
        if item in entries and item in part.component.declarations:
            return str(entries[item])
    for insertion in case.case.insert:
        if insertion.part_name == part.name and item in insertion.further:
            return str(insertion.further[item].value)
    values = {**part.parameters, **part.start}
    return shown_with_unit(values[item], part.component.declarations[item].unit, 6) if item in values else ""


def _in_unit_of(text: str, value: float, unit: str) -> str:
    """Return a value [``unit``] as text in the unit of ``text``, so that both can be compared."""
    try:
        written = split_quantity(text)[1]
        if written and written != unit:
            return f"{value / conversion(written, unit):.6g} {written}"
    except LatheSimError:
        pass
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"


def _bounds(low: str, high: str) -> str:
    if low and high:
        number, _, unit = low.partition(" ")
        return f"{number if high.endswith(f' {unit}') and unit else low} to {high}"
    return f"from {low}" if low else f"to {high}" if high else ""
