"""Help and plug-ins: keys, manual, a page for each component and effect; what is loaded, what is at fault, and loading it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Button, Input, Markdown, Static, Tree
from textual.widgets.tree import TreeNode

from lathesim.errors import LatheSimError
from lathesim.manual.chapters import GROUPS, chapter
from lathesim.manual.component_page import checked_plugin, plugin_lines
from lathesim.tui.model.workbench import REGISTRY, fault_words
from lathesim.tui.screens.workbench_screen import WorkbenchScreen

if TYPE_CHECKING:
    from lathesim.plugins import Registry
    from lathesim.tui.app import LathesimApp


KEYS, CHAPTER, COMPONENT, EFFECT = "keys", "chapter", "component", "effect"
Page = tuple[str, str]
"""What a page is of, and its name."""


class HelpScreen(WorkbenchScreen):
    """The list at the left is searched by typing; the page stands at the right."""

    DEFAULT_CSS = """
    HelpScreen #contents { width: 38; }
    HelpScreen.-narrow #contents { width: 28; }
    HelpScreen Tree { height: 1fr; }
    HelpScreen #wanted { height: 1; border: none; padding: 0 1; }
    HelpScreen VerticalScroll { padding: 0 1; }
    """
    BINDINGS = [Binding("slash", "search", "Search", key_display="/")]

    def __init__(self) -> None:
        super().__init__()
        self._page: Page = (KEYS, "")

    def compose_body(self) -> Iterable[Widget]:
        """Return the contents and the page."""
        with Horizontal():
            with Vertical(id="contents"):
                yield Input(placeholder="type to find", id="wanted", compact=True)
                yield Tree[Page]("Help", id="tree")
            with VerticalScroll(id="page"):
                yield Markdown("", id="chapter", open_links=False)
                yield Static("", id="text", markup=False)

    def show_changes(self, changed: set[str]) -> None:
        """Fill the contents; parts may have come or gone."""
        if REGISTRY in changed:
            self._fill(self.query_one("#wanted", Input).value)
            self._show(self._page)

    def _fill(self, wanted: str) -> None:
        wanted = wanted.lower()
        registry = self.workbench.registry
        tree = self.query_one("#tree", Tree)
        tree.show_root = False
        tree.clear()
        groups: list[tuple[str, list[tuple[str, Page]]]] = [
            *(
                (group, [(found.title, (CHAPTER, found.topic)) for found in map(chapter, topics) if _fits(wanted, found.title, found.text)])
                for group, topics in GROUPS.items()
            ),
            ("Components", [(name, (COMPONENT, name)) for name, item in registry.components.items() if _fits(wanted, name, item.__doc__)]),
            ("Effects", [(name, (EFFECT, name)) for name, item in registry.effects.items() if _fits(wanted, name, item.__doc__)]),
        ]
        tree.root.add_leaf("Keys", (KEYS, ""))
        for title, entries in groups:
            node: TreeNode[Page] = tree.root.add(f"{title} ({len(entries)})", expand=bool(wanted) or title in GROUPS)
            for label, page in entries:
                node.add_leaf(Text(label), page)

    @on(Input.Changed, "#wanted")
    def _search(self, event: Input.Changed) -> None:
        self._fill(event.value)

    @on(Input.Submitted, "#wanted")
    def _to_tree(self) -> None:
        self.query_one("#tree", Tree).focus()

    @on(Tree.NodeHighlighted)
    def _highlight(self, event: Tree.NodeHighlighted[Page]) -> None:
        if event.node.data is not None:
            self._show(event.node.data)

    def show_page(self, kind: str, name: str) -> None:
        """Show a page: the palette and other screens ask for it."""
        self._page = (kind, name)
        if self.is_mounted:
            self._show(self._page)

    def _show(self, page: Page) -> None:
        self._page = page
        kind, name = page
        markdown, text = self.query_one("#chapter", Markdown), self.query_one("#text", Static)
        markdown.display = kind == CHAPTER
        text.display = kind != CHAPTER
        if kind == CHAPTER:
            markdown.update(chapter(name).text)
        elif kind == KEYS:
            text.update(_keys(self.lathesim))
        else:
            try:
                text.update(part_page(self.workbench.registry, kind, name, max(40, self.query_one("#page").size.width - 3)))
            except LatheSimError as error:
                text.update(fault_words(error))
        self.query_one("#page", VerticalScroll).scroll_home(animate=False)
        self.show_command()

    def command(self) -> str:
        """Return the command that prints the page."""
        kind, name = self._page
        return {KEYS: "lathesim help app", CHAPTER: f"lathesim help {name}", COMPONENT: f"lathesim components {name}"}.get(
            kind, f"lathesim effects {name}"
        )

    def action_search(self) -> None:
        """Go to the field to search in."""
        self.query_one("#wanted", Input).focus()


def part_page(registry: Registry, kind: str, name: str, width: int) -> str:
    """Return the page of a component or an effect in lines of ``width`` characters; raises :class:`LatheSimError` for an unknown name."""
    from lathesim.manual.component_page import component_page, effect_page

    if kind == EFFECT:
        return effect_page(cast("Any", registry.effect(name)), registry.origins[name], width)
    return component_page(registry.component(name), registry.origins[name])


def _fits(wanted: str, *texts: str | None) -> bool:
    return any(wanted in (text or "").lower() for text in texts)


class KeysView(ModalScreen[None]):
    """Shows what a screen is for and the keys that hold there, in groups."""

    BINDINGS = [Binding("escape,question_mark,enter", "dismiss(None)", "Close")]
    DEFAULT_CSS = """
    KeysView .dialog { height: auto; max-height: 90%; }
    """

    def __init__(self, about: str, groups: Mapping[str, Sequence[Any]]) -> None:
        super().__init__()
        self._about, self._groups = about, groups

    def compose(self) -> ComposeResult:
        """Return the keys, and how the dialog is left."""
        text = Text(f"{self._about}\nEsc closes this; F1 opens the manual.\n".lstrip(), style="not bold")
        for title, bindings in self._groups.items():
            if any(binding.description for binding in bindings):
                text.append(f"\n{title}\n", style="bold")
                _add_keys(text, bindings)
        with VerticalScroll(classes="dialog"):
            yield Static(text)


def _keys(app: LathesimApp) -> Text:
    """Return all keys, as the screens declare them."""
    found = Text("Keys everywhere\n", style="bold")
    _add_keys(found, app.keys)
    _add_keys(found, [Binding("ctrl+p", "", "Find anything"), Binding("tab", "", "Next field or list")])
    for entry in app.entries:
        found.append(f"\n{entry.title} ({entry.key.upper()})\n", style="bold")
        _add_keys(found, app.keys_of(entry))
    return found


_SIGNS = {"slash": "/", "plus": "+", "minus": "-"}


def _add_keys(text: Text, bindings: Iterable[Any]) -> None:
    listed: set[str] = set()
    for binding in bindings:
        if isinstance(binding, Binding) and binding.description and binding.description not in listed:
            listed.add(binding.description)
            key = binding.key_display or _SIGNS.get(binding.key, binding.key).replace("ctrl+", "Ctrl+")
            key = key.upper() if key.startswith("f") and key[1:].isdigit() else key
            text.append(f"  {key:<10} ", style="not bold cyan")
            text.append(f"{binding.tooltip or binding.description}\n", style="not bold")


class PluginsScreen(WorkbenchScreen):
    """The plug-ins at hand, each checked; a button and a key load them again."""

    DEFAULT_CSS = """
    PluginsScreen VerticalScroll { padding: 0 1; }
    PluginsScreen #said { height: auto; }
    """
    BINDINGS = [Binding("r", "reload", "Load again")]

    def compose_body(self) -> Iterable[Widget]:
        """Return the button and what is said."""
        with Vertical():
            yield Button("Load again (r)", id="reload", compact=True, variant="primary")
            with VerticalScroll():
                yield Static("", id="said", markup=False)

    def show_changes(self, changed: set[str]) -> None:
        """Show what is loaded and what is at fault."""
        if REGISTRY in changed:
            self.query_one("#said", Static).update(self._said())

    def _said(self) -> Text:
        registry = self.workbench.registry
        lines = plugin_lines(registry)
        found = Text()
        for problem in registry.problems:
            found.append("✗ at fault: ", style="bold red")
            found.append(f"{problem}\n")
        for name in registry.plugins:
            if Path(name).is_file():
                try:
                    found.append(f"✓ {name}: {checked_plugin(Path(name))}\n")
                except LatheSimError as error:
                    found.append(f"✗ {name}: {error}\n", style="bold red")
        if not registry.plugins and not registry.problems:
            found.append("No plug-ins. 'lathesim init FOLDER' makes a folder with examples in plugins/; open the app there.\n")
        found.append("\n" + "\n".join(lines))
        return found

    def on_button_pressed(self) -> None:
        """Load again."""
        self.action_reload()

    def action_reload(self) -> None:
        """Read the plug-ins again; the machine on the bench is wired anew with them."""
        with self.lathesim.faults_told():
            self.workbench.reload_plugins()
            problems = self.workbench.registry.problems
            words = f"{len(problems)} at fault." if problems else "All are OK."
            self.notify(f"{len(self.workbench.registry.plugins)} plug-ins are loaded. {words}")
            fault = self.workbench.fault()
            if fault:
                self.tell_fault(f"The machine on the bench cannot be wired now: {fault}")

    def command(self) -> str:
        """Return the command that lists the same."""
        return "lathesim plugins"
