"""Plug-ins: what is loaded and what is at fault; loaded again with a key after an edit in any editor."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rich.text import Text
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import Button, Static

from lathesim.errors import LatheSimError
from lathesim.manual.plugin_list import checked_plugin, plugin_lines
from lathesim.tui.model.workbench import REGISTRY
from lathesim.tui.screens.workbench_screen import WorkbenchScreen


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
        try:
            self.workbench.reload_plugins()
        except LatheSimError as error:
            self.tell_fault(str(error))
            return
        problems = self.workbench.registry.problems
        words = f"{len(problems)} at fault." if problems else "All are in order."
        self.notify(f"{len(self.workbench.registry.plugins)} plug-ins are loaded. {words}")
        fault = self.workbench.fault()
        if fault:
            self.tell_fault(f"The machine on the bench cannot be wired now: {fault}")

    def command(self) -> str:
        """Return the command that lists the same."""
        return "lathesim plugins"
