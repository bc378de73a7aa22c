"""What the command palette finds: lessons, channels, parameters, parts, effects, screens, and what the keys do."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, cast

from textual.command import DiscoveryHit, Hit, Hits, Provider

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp

Entry = tuple[str, str, Callable[[], object]]
"""What is found, a word about it, and what to do."""


class WorkbenchProvider(Provider):
    """Finds what stands on the workbench."""

    @property
    def _app(self) -> LathesimApp:
        return cast("LathesimApp", self.app)

    async def discover(self) -> Hits:
        """Return the screens before anything is typed."""
        for name, about, action in self._screens():
            yield DiscoveryHit(name, action, help=about)

    async def search(self, query: str) -> Hits:
        """Return what fits the text typed."""
        matcher = self.matcher(query)
        for name, about, action in self._entries():
            score = matcher.match(name)
            if score > 0.0:
                yield Hit(score, matcher.highlight(name), action, help=about)

    def _screens(self) -> Iterator[Entry]:
        from lathesim.tui.app import navigation

        for name, key, title in navigation():
            if name != "run":
                yield title, f"screen, {key.upper()}", partial(self._app.switch_mode, name)
        yield "Run or stop", "F5", self._app.action_run_or_stop

    def _actions(self) -> Iterator[Entry]:
        """Return what the keys of each screen do."""
        import importlib

        from lathesim.tui.app import SCREENS, navigation

        for name, _, title in navigation():
            if name == "run":
                continue
            module, _, screen = SCREENS[name][2].partition(":")
            for binding in getattr(importlib.import_module(module), screen).BINDINGS:
                if binding.description:
                    key = binding.key_display or binding.key
                    about = f"{binding.tooltip or binding.description} ({title}, key {key})"
                    yield binding.description, about, partial(self._app.do_on, name, binding.action)

    def _entries(self) -> Iterator[Entry]:
        from lathesim.errors import LatheSimError
        from lathesim.lessons.lesson_list import lesson_files

        app, workbench = self._app, self._app.workbench
        yield from self._screens()
        yield from self._actions()
        for path in lesson_files():
            yield path.stem, "lesson: put on the bench", partial(app.open_lesson, path)
        for name, component in workbench.registry.components.items():
            yield name, f"component: {_first_line(component)}", partial(app.show_help, "component", name)
        for name, component in workbench.registry.effects.items():
            yield name, f"effect: {_first_line(component)}", partial(app.show_help, "effect", name)
        try:
            plan = workbench.prepared().plan
        except LatheSimError:
            return
        for name in plan.channels:
            yield name, f"channel: {plan.doc(name)}", partial(app.show_channel, name)
        for name in plan.parameters:
            yield name, f"parameter: {plan.doc(name)}", partial(app.show_parameter, name)


def _first_line(component: type) -> str:
    return (component.__doc__ or "").strip().partition("\n")[0]
