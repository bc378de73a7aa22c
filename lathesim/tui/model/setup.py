"""A setup: a lesson with the changes a person made to it, ready to be run, saved, or told as a command."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.shipped import shipped_files

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

    def with_variant(self, variant: str | None) -> Setup:
        """Return the setup with another variant of the lesson and the same changes."""
        return replace(self, variant=variant)

    def with_value(self, name: str, quantity: str) -> Setup:
        """Return the setup with another value of ``part.parameter`` or ``part.state``."""
        return replace(self, values={**self.values, name: quantity})

    def without_value(self, name: str) -> Setup:
        """Return the setup with the lesson's own value of ``name``."""
        return replace(self, values={key: value for key, value in self.values.items() if key != name})

    def with_part(self, part: str, component: str, values: Mapping[str, str] | None = None) -> Setup:
        """Return the setup with another component in the place of a part, and with other ``values`` where they are given."""
        return replace(self, replaced={**self.replaced, part: component}, values=self.values if values is None else dict(values))

    def without_part(self, part: str) -> Setup:
        """Return the setup with the lesson's own component in a place."""
        return replace(self, replaced={key: value for key, value in self.replaced.items() if key != part})

    def with_insert(self, entry: Insert) -> Setup:
        """Return the setup with one effect more."""
        return replace(self, inserted=(*self.inserted, dict(entry)))

    def with_insert_value(self, position: int, item: str, quantity: str | None) -> Setup:
        """Return the setup with another value of an inserted effect's parameter; None takes the effect's own."""
        entry = {key: value for key, value in self.inserted[position].items() if key != item}
        entry |= {item: quantity} if quantity is not None else {}
        return replace(self, inserted=tuple(entry if place == position else other for place, other in enumerate(self.inserted)))

    def with_simulation(self, name: str, quantity: str) -> Setup:
        """Return the setup with another sample period, step or duration."""
        return replace(self, simulation={**self.simulation, name: quantity})

    def without_simulation(self, name: str) -> Setup:
        """Return the setup with the lesson's own sample period, step or duration."""
        return replace(self, simulation={key: value for key, value in self.simulation.items() if key != name})

    def with_seed(self, seed: int | None) -> Setup:
        """Return the setup with another seed; None takes the lesson's."""
        return replace(self, seed=seed)

    def without_insert(self, position: int) -> Setup:
        """Return the setup with one of its inserted effects taken out."""
        return replace(self, inserted=tuple(entry for place, entry in enumerate(self.inserted) if place != position))

    def with_program(self, program: Path | None) -> Setup:
        """Return the setup with another part program."""
        return replace(self, program=program)

    def lesson_text(self, folder: Path) -> str:
        """Return the setup as the YAML text of a lesson for a file in ``folder``; ``lathesim run`` takes it unchanged."""
        return changed_lesson(
            self.lesson,
            self.inserted,
            self.values,
            folder,
            variant=self.variant,
            replace=self.replaced,
            program=self.program,
            seed=self.seed,
            further=self.simulation,
        )

    def prepared(self, registry: Registry) -> Prepared:
        """Return the setup assembled and wired; raises what :func:`lathesim.lessons.simulate.prepare` raises."""
        if self.needs_file:
            return prepare(lesson_from_text(self.lesson_text(self.lesson.path.parent), self.lesson.path), registry)
        return prepare(self.lesson, registry, self.variant, self.values, program=self.program)

    def command(self, out: Path | None = None, file: Path | None = None) -> str:
        """Return the command that runs the same; ``file`` is the lesson file it was written to where it needs one."""
        words = ["lathesim", "run", str(file) if file is not None and self.needs_file else self._lesson_word()]
        if not (file is not None and self.needs_file):
            words += ["--variant", self.variant] if self.variant else []
            for name, quantity in self.values.items():
                words += ["--set", f"{name}={quantity}"]
            words += ["--program", _shortened(self.program)] if self.program is not None else []
            words += ["--seed", str(self.seed)] if self.seed is not None else []
        words += ["--out", str(out)] if out is not None else []
        return shlex.join(words)

    def _lesson_word(self) -> str:
        shipped = {path.resolve() for path in shipped_files("lesson_configs", "*.yaml")}
        own = Path("lesson_configs").resolve()
        path = self.lesson.path.resolve()
        return self.lesson.name if path in shipped or path.parent == own else _shortened(self.lesson.path)


def _shortened(path: Path) -> str:
    """Return a path as seen from here where that is shorter."""
    here = Path.cwd().resolve()
    resolved = path.resolve()
    return str(resolved.relative_to(here)) if resolved.is_relative_to(here) else str(path)
