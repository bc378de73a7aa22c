"""Configure: the machine part by part, its values, its wiring and its part program; save and load as a lesson."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from rich.text import Text
from textual import on
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import Static, TabbedContent, TabPane, Tree
from textual.widgets.tree import TreeNode

from lathesim.analysis.display_unit import plain_name
from lathesim.engine.assembly import Part, Place
from lathesim.errors import LatheSimError, WriteError
from lathesim.lessons.simulate import Prepared
from lathesim.manual.component_page import first_sentence
from lathesim.tui.model.machine_tree import (
    EFFECTS,
    SIMULATION,
    Entry,
    Setup,
    candidates,
    grouped_parts,
    part_entries,
    simulation_entries,
    taken_value,
    with_component,
    with_entry,
)
from lathesim.tui.model.workbench import REGISTRY, SETUP, fault_words
from lathesim.tui.screens.workbench_screen import WorkbenchScreen
from lathesim.tui.widgets.machine_panes import ValuesPane, WiringView
from lathesim.tui.widgets.program_listing import ProgramPane
from lathesim.whole_file import make_folder, write_new, write_text


@dataclass(frozen=True)
class _Choice:
    """What is chosen in the tree: a part, or the simulation where it is empty."""

    part: str


class ConfigureScreen(WorkbenchScreen):
    """The tree at the left; values, wiring and part program of what is chosen at the right."""

    DEFAULT_CSS = """
    ConfigureScreen #machine { width: 34; }
    ConfigureScreen.-narrow #machine { width: 26; }
    ConfigureScreen #about { height: auto; max-height: 3; padding: 0 1; background: $panel; }
    ConfigureScreen TabbedContent { height: 1fr; }
    ConfigureScreen TabPane { padding: 0; }
    """
    BINDINGS = [
        Binding("c", "component", "Part", tooltip="Put another component in the place of the part"),
        Binding("i", "effect", "Effect", tooltip="Insert an effect at the part"),
        Binding("delete,x", "take_back", "Reset", key_display="x", tooltip="Take the lesson's own value or part, or take the effect out"),
        Binding("g", "program", "Program", tooltip="Choose a part program"),
        Binding("n", "cut", "Cut", tooltip="Write a straight or taper cut from a form"),
        Binding("ctrl+s", "save", "Save"),
        Binding("ctrl+o", "load", "Load", show=False),
        Binding("ctrl+z", "app.undo", "Undo", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._choice = _Choice("")
        self._saved: set[Path] = set()
        """Files that this app wrote: they may be written again."""
        self._placed: TreeNode[_Choice] | None = None
        """Node on which the cursor is to be put; none once it is there."""

    def compose_body(self) -> Iterable[Widget]:
        """Return the tree, and values, wiring and program as tabs."""
        with Horizontal():
            yield Tree[_Choice]("Machine", id="machine")
            with Vertical():
                yield Static("", id="about", markup=False)
                with TabbedContent(id="tabs"):
                    with TabPane("Values", id="values"):
                        yield ValuesPane(lambda entry, typed: taken_value(self.workbench.prepared(), entry, typed))
                    with TabPane("Wiring", id="wiring"), VerticalScroll():
                        yield WiringView(id="box")
                    with TabPane("Program", id="program"):
                        yield ProgramPane()

    def show_changes(self, changed: set[str]) -> None:
        """Show the machine of the setup."""
        if not changed & {SETUP, REGISTRY} or self._setup is None:
            return
        try:
            case = self.workbench.prepared()
        except LatheSimError as error:
            self.query_one(ValuesPane).say(f"This setup cannot run: {error} Undo with Ctrl+Z.")
            return
        self._fill_tree(case)
        self._show_part(case)
        self.query_one(ProgramPane).show(case.case.program, case.case.lesson.settings.dialect)

    @property
    def _setup(self) -> Setup | None:
        return self.workbench.setup

    def _fill_tree(self, case: Prepared) -> None:
        tree = self.query_one("#machine", Tree)
        assert self._setup is not None
        changed = {Place.of(name).part for name in self._setup.values} | set(self._setup.replaced)
        open_before = {str(node.label) for node in tree.root.children if node.is_expanded} or set()
        first = not tree.root.children
        tree.show_root = False
        tree.clear()
        chosen = None
        for group, parts in grouped_parts(case).items():
            node = tree.root.add(group, expand=first or group in open_before or group == EFFECTS)
            for part in parts:
                sign = "*" if part.name in changed or group == EFFECTS else " "
                leaf = node.add_leaf(Text(f"{sign} {plain_name(part.name)}"), _Choice(part.name))
                chosen = leaf if part.name == self._choice.part else chosen
        leaf = tree.root.add_leaf(Text(f"{'*' if self._setup.simulation else ' '} {SIMULATION}"), _Choice(""))
        start = tree.root.children[0].children[0] if first and not self._choice.part else leaf
        self._placed = chosen or start
        self.call_after_refresh(self._place_cursor)

    def _place_cursor(self) -> None:
        """Put the cursor of the tree on what was chosen last, once the tree stands; several changes may have come before."""
        if self._placed is not None:
            self.query_one("#machine", Tree).move_cursor(self._placed)
            self.call_after_refresh(self._cursor_is_placed, self._placed)

    def _cursor_is_placed(self, node: TreeNode[_Choice]) -> None:
        """From now on the cursor goes where a person moves it."""
        if self._placed is node:
            self._placed = None

    @on(Tree.NodeHighlighted, "#machine")
    def _highlight(self, event: Tree.NodeHighlighted[_Choice]) -> None:
        if self._placed is not None and event.node is not self._placed:
            return  # the tree is being filled, and its cursor goes by
        if event.node.data is None or event.node.data == self._choice:
            return
        self._choice = event.node.data
        with self.lathesim.faults_told():
            self._show_part(self.workbench.prepared())

    def _part(self, case: Prepared) -> Part | None:
        return next((part for part in case.machinery.parts if part.name == self._choice.part), None)

    def _show_part(self, case: Prepared) -> None:
        setup, part = self._setup, self._part(case)
        assert setup is not None
        about = self.query_one("#about", Static)
        if part is None:
            entries = simulation_entries(case, setup)
            about.update("The simulation: periods and seed")
            self.query_one(WiringView).show(case, "")
        else:
            entries = part_entries(case, setup, part)
            about.update(f"{part.name}: {part.component.__name__}. {first_sentence(part.component)}")
            self.query_one(WiringView).show(case, part.name)
        self.query_one(ValuesPane).show(entries)

    @property
    def entry(self) -> Entry | None:
        """What the cursor of the table stands on."""
        return self.query_one(ValuesPane).entry

    @on(ValuesPane.ValueTaken)
    def _take(self, event: ValuesPane.ValueTaken) -> None:
        if self._setup is not None:
            self._try(with_entry(self._setup, event.entry, event.text))

    @on(Tree.NodeSelected, "#machine")
    def _go_to_values(self, event: Tree.NodeSelected[_Choice]) -> None:
        if event.node.data is not None:
            self.query_one("#tabs", TabbedContent).active = "values"
            self.query_one(ValuesPane).focus_table()

    def _try(self, setup: Setup) -> bool:
        """Put a setup on the bench where it can run; else say why not."""
        try:
            setup.prepared(self.workbench.registry)
        except LatheSimError as error:
            self.query_one(ValuesPane).say(fault_words(error))
            self.tell_fault(fault_words(error))
            return False
        self.workbench.change(setup)
        return True

    def action_take_back(self) -> None:
        """Take the lesson's own value, component or wire again."""
        setup, entry, part = self._setup, self.entry, self._choice.part
        if setup is None:
            return
        if entry is not None and entry.changed:
            self._try(with_entry(setup, entry, None))
        elif part in setup.replaced:
            self._try(setup.with_part(part, None))
        else:
            from lathesim.tui.model.machine_tree import inserted_at

            position = inserted_at(setup, part)
            if position is None:
                self.notify("This is as in the lesson.")
            elif self._try(setup.without_insert(position)):
                self._choice = _Choice("")

    def action_component(self) -> None:
        """Choose the component of a place."""
        from lathesim.tui.screens.choices import PartChoice

        with self.lathesim.faults_told():
            case = self.workbench.prepared()
            part = self._part(case)
            if part is None:
                self.notify("Choose a part in the tree first.")
                return
            found = candidates(case, self.workbench.registry, part)
            title = f"What stands at {part.name}: {len(found)} components fit its wires"
            present = part.component.__name__
            self.app.push_screen(PartChoice(title, found, self.workbench.registry.origins, present=present), self._take_component)

    def _take_component(self, chosen: tuple[str, str] | None) -> None:
        if chosen is not None and self._setup is not None:
            self._try(with_component(self._setup, self._choice.part, self.workbench.registry.component(chosen[0])))

    def action_effect(self) -> None:
        """Insert an effect at the part that is chosen."""
        from lathesim.tui.screens.choices import effect_choice

        with self.lathesim.faults_told():
            self.app.push_screen(effect_choice(self.workbench.prepared(), self.workbench.registry, self._choice.part), self._take_effect)

    def _take_effect(self, chosen: tuple[str, str] | None) -> None:
        if chosen is None or self._setup is None:
            return
        effect, at = chosen
        if not at:
            self.tell_fault("An effect needs a place: a part, or part.name.")
            return
        from lathesim.lessons.insertion import effect_part_name

        if self._try(self._setup.with_insert({"effect": effect, "at": at})):
            self._choice = _Choice(effect_part_name(at, effect))
            self._show_part(self.workbench.prepared())

    def action_program(self) -> None:
        """Choose the part program."""
        from lathesim.tui.screens.choices import program_choice

        if self._setup is not None:
            self.app.push_screen(program_choice(self._setup.lesson.path.parent), self._take_program)

    def action_cut(self) -> None:
        """Make a part program from a form."""
        from lathesim.tui.screens.forms import CutForm

        self.app.push_screen(CutForm(), self._take_program)

    def _take_program(self, path: Path | None) -> None:
        if path is not None and self._setup is not None and self._try(replace(self._setup, program=path)):
            self.set_focus(None)
            self.query_one(TabbedContent).active = "program"

    def action_save(self) -> None:
        """Save the setup as a lesson."""
        from lathesim.tui.screens.forms import TextQuestion

        if self._setup is not None:
            self.app.push_screen(TextQuestion("Save as a lesson (.yaml)", f"{self._setup.lesson.name}_mine.yaml"), self._save)

    def _save(self, name: str | None) -> None:
        if name is None or self._setup is None:
            return
        path = Path(name).with_suffix(".yaml")
        try:
            if path.exists() and path.resolve() == self._setup.lesson.path.resolve():
                self.tell_fault("The lesson itself is not written over. Choose another name.")
                return
            make_folder(path.parent)
            text = self._setup.lesson_text(path.parent)
            if path in self._saved:
                write_text(path, text)
            else:
                write_new((path,), lambda part: part.write_bytes(text.encode()))
            self._saved.add(path)
        except FileExistsError:
            self.tell_fault(f"'{path}' is there already. Choose another name.")
            return
        except WriteError as error:
            self.tell_fault(fault_words(error))
            return
        self.notify(f"Saved. {shlex.join(['lathesim', 'run', str(path)])} runs it.", markup=False)

    def action_load(self) -> None:
        """Load a lesson file."""
        from lathesim.tui.screens.choices import lesson_choice

        self.app.push_screen(lesson_choice(), self._load)

    def _load(self, path: Path | None) -> None:
        if path is None:
            return
        with self.lathesim.faults_told():
            self.workbench.open_lesson(str(path))

    def show_parameter(self, name: str) -> None:
        """Show where a parameter is set: the palette asks for it."""
        part, port = Place.of(name)
        self._choice = _Choice(part if port else "")
        case = self.workbench.prepared()
        self._fill_tree(case)
        self._show_part(case)
        self.query_one(ValuesPane).go_to(name)
