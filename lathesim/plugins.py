"""What is at hand: parts, effects, metrics, readers, commands and screens, stock or of plug-ins, through the hooks of ``hookspecs``.

A plug-in at fault costs one line in ``Registry.problems``, with file, line and reason; the rest goes on, and only a lesson that needs
what the plug-in would have given stops. The examples that came with the program come in only when a machine names one of their parts.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import sys
from collections.abc import Callable, Iterable, Mapping
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import TYPE_CHECKING, Any

from lathesim import hookspecs
from lathesim.errors import LatheSimError, PluginError, nearest
from lathesim.hookspecs import ENTRY_POINTS, HOOKS, MARK, PROJECT, CommandEntry, DoorEntry, ScreenEntry, hookimpl, no_package_has_plugins
from lathesim.shipped import shipped_files

if TYPE_CHECKING:
    import pluggy

    from lathesim.component import Component

KINDS = ("components", "effects", "remedies", "metrics", "readers", "commands", "screens")
"""What is registered: attributes of a :class:`Registry`."""
ROOMS = (
    "lathesim.cli", "lathesim.cli.diagnosis", "lathesim.cli.contour", "lathesim.cli.experiments", "lathesim.cli.stability",
    "lathesim.cli.live", "lathesim.cli.speed", "lathesim.tui",
)  # fmt: skip
"""The stock rooms: plug-ins that give commands and screens, in the order of ``lathesim --help``."""


def plugin_files(folder: Path) -> list[Path]:
    """Return the files of a folder that hold code: plug-ins and FMUs."""
    return sorted(path for path in folder.glob("*") if path.suffix in (".py", ".fmu"))


class StockParts:
    """The stock lists, handed in through the same hooks as a guest's; each is imported only when asked for."""

    @hookimpl
    def register_components(self) -> list[type[Component]]:
        """Return the stock components."""
        return _stock("lathesim.components.stock_parts", "stock_components")

    @hookimpl
    def register_effects(self) -> list[type[Component]]:
        """Return the stock effects."""
        return _stock("lathesim.effects.register", "stock_effects")

    @hookimpl
    def register_remedies(self) -> list[type[Component]]:
        """Return the stock remedies."""
        return _stock("lathesim.effects.register", "stock_remedies")

    @hookimpl
    def register_metrics(self) -> list[Any]:
        """Return the stock metrics."""
        return _stock("lathesim.analysis.metric", "stock_metrics")

    @hookimpl
    def register_recording_readers(self) -> list[Any]:
        """Return the stock recording readers."""
        return _stock("lathesim.recordings.stock_readers", "stock_readers")


def _stock(module: str, function: str) -> list[Any]:
    return _listed(getattr(importlib.import_module(module), function)())


def _listed(given: Any) -> list[Any]:
    """Return what a hook gave as a list; a mapping counts by its values."""
    return list(given.values()) if isinstance(given, Mapping) else list(given)


class Registry:
    """Everything that was registered, by name; each kind is asked for once, when it is first needed."""

    def __init__(self) -> None:
        self.problems: list[str] = []
        """One line for each plug-in or registered thing that is left out."""
        self.origins: dict[str, str] = {}
        """Name of whatever was registered -> where it comes from."""
        self.plugins: list[str] = []
        """The plug-ins that were loaded."""
        self._lost: dict[str, str] = {}
        self._stock: dict[str, Any] = {"stock": StockParts()}

    @functools.cached_property
    def _guests(self) -> pluggy.PluginManager:
        import pluggy

        manager = pluggy.PluginManager(PROJECT)
        for name in HOOKS:
            pluggy.HookspecMarker(PROJECT)(getattr(hookspecs, name))
        manager.add_hookspecs(hookspecs)
        return manager

    @functools.cached_property
    def components(self) -> dict[str, type[Component]]:
        """Component classes by class name."""
        return dict(sorted(self._collected("register_components").items()))

    @functools.cached_property
    def effects(self) -> dict[str, type[Component]]:
        """Effect classes by class name."""
        return dict(sorted(self._collected("register_effects").items()))

    @functools.cached_property
    def remedies(self) -> dict[str, type[Component]]:
        """Remedy classes by class name: what compensates an effect. A diagnosis does not look for them."""
        return dict(sorted(self._collected("register_remedies").items()))

    @functools.cached_property
    def metrics(self) -> dict[str, Any]:
        """Metrics by name, in the order in which they are shown."""
        return self._collected("register_metrics")

    @functools.cached_property
    def readers(self) -> dict[str, Any]:
        """Recording readers by name."""
        return self._collected("register_recording_readers")

    @functools.cached_property
    def commands(self) -> dict[str, CommandEntry]:
        """Commands by name, in the order of ``lathesim --help``."""
        self._open_rooms()
        return self._collected("register_commands")

    @functools.cached_property
    def screens(self) -> dict[str, ScreenEntry]:
        """Screens of the app by name."""
        self._open_rooms()
        return self._collected("register_screens")

    def _open_rooms(self) -> None:
        """Let the stock rooms in; only a command line and the app need them."""
        for room in ROOMS:
            if room not in self._stock:
                self._stock[room] = importlib.import_module(room)

    def component(self, name: str) -> type[Component]:
        """Return the component of a name, or that of an FMU by its file; :class:`PluginError` with the nearest name where there is none."""
        if name.endswith(".fmu"):
            fmu: type[Component] = importlib.import_module("lathesim.fmi.importing").fmu_of(name, self.origins)
            return fmu
        found: type[Component] = self._found(name, self.components, "component")
        return found

    def effect(self, name: str) -> type[Component]:
        """Return the effect of a name, or the remedy; :class:`PluginError` with the nearest name where there is none."""
        if name not in self.effects and name in self.remedies:
            return self.remedies[name]
        found: type[Component] = self._found(name, self.effects, "effect")
        return found

    def metric(self, name: str) -> Any:
        """Return the metric of a name; :class:`PluginError` with the nearest name where there is none."""
        return self._found(name, self.metrics, "metric")

    def ask(self, *kinds: str) -> None:
        """Ask every plug-in for some kinds (all without any), so that ``problems`` is complete for them."""
        for kind in kinds or KINDS:
            getattr(self, kind)

    def add_folder(self, folder: Path, hook: str = "") -> None:
        """Load the plug-in files of a folder (``*.py``, those that begin with ``_`` left out), or one file; FMUs (``*.fmu``) are noted.

        With a ``hook`` files that do not mention it are not run.
        """
        if not folder.exists():
            raise PluginError(f"there is no plug-in folder '{folder}'.")
        files = [folder] if folder.is_file() else plugin_files(folder)
        self.origins |= (fmus := {path.name: str(path) for path in files if path.suffix == ".fmu"})
        self.plugins += fmus.values()
        for path in files:
            if path.name not in fmus and not path.name.startswith("_") and (not hook or hook in _text(path)):
                self._add_file(path)

    def add_installed(self) -> None:
        """Load the plug-ins that installed packages announce as entry points ``lathesim.plugins``."""
        if no_package_has_plugins():
            return
        from importlib.metadata import entry_points

        for entry in entry_points(group=ENTRY_POINTS):
            name = f"{entry.name} ({entry.value})"
            try:
                plugin = entry.load()
            except Exception as error:
                self.problems.append(f"{name}: the plug-in cannot be imported: {type(error).__name__}: {error}")
                continue
            self._add(plugin, name)

    def _add_file(self, path: Path) -> None:
        try:
            module = _imported(path)
        except (Exception, SystemExit) as error:
            self._lose(path, _import_fault(path, error))
            return
        self._add(module, str(path))

    def _lose(self, path: Path, problem: str) -> None:
        self.problems.append(problem)
        for name in _classes_in(path):
            self._lost.setdefault(name, problem)

    def _add(self, plugin: Any, name: str) -> None:
        hooks = 0
        for item in dir(plugin):
            value = getattr(plugin, item, None)
            if not callable(value) or (inspect.ismodule(plugin) and getattr(value, "__module__", None) != plugin.__name__):
                continue
            marked = isinstance(getattr(value, MARK, None), dict)
            if marked and item not in HOOKS:
                self.problems.append(
                    f"{_line_of(value, name)}: there is no hook '{item}'. {nearest(item, HOOKS) or 'Hooks: ' + ', '.join(HOOKS) + '.'}"
                )
                return self._lost_names(value)
            if item in HOOKS and not marked:
                self.problems.append(f"{_line_of(value, name)}: {item} is not marked as a hook. Write @hookimpl above it.")
                return self._lost_names(value)
            hooks += marked
        if not hooks:
            remedy = f"Write a function {HOOKS[0]} marked @hookimpl that gives a list."
            self.problems.append(f"{name}: the plug-in registers nothing. {remedy}")
            return None
        import pluggy

        try:
            self._guests.register(plugin, name=name)
        except (pluggy.PluginValidationError, ValueError) as error:
            self.problems.append(f"{name}: {str(error).splitlines()[-1].strip()}.")
            return None
        self.plugins.append(name)
        return None

    def _lost_names(self, function: Callable[..., Any]) -> None:
        path = inspect.getsourcefile(function)
        for name in _classes_in(Path(path)) if path else ():
            self._lost.setdefault(name, self.problems[-1])

    def _collected(self, hook: str) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for source in self._stock.values():
            for item in _listed(getattr(source, hook)()) if hasattr(source, hook) else ():
                found[_name_of(item)] = item
                entry = isinstance(item, DoorEntry)
                self.origins[_name_of(item)] = item.target.partition(":")[0] if entry else str(getattr(item, "__module__", "lathesim"))
        for implementation in getattr(self._guests.hook, hook).get_hookimpls() if self.plugins else ():
            try:
                items = _listed(implementation.function())
            except Exception as error:
                self.problems.append(f"{_line_of(implementation.function, implementation.plugin_name)}: {hook} fails: {_told(error)}")
                self._lost_names(implementation.function)
                continue
            for item in items:
                self._take(item, found, hook, implementation)
        return found

    def _take(self, item: Any, found: dict[str, Any], hook: str, implementation: pluggy.HookImpl) -> None:
        name, is_entry = _name_of(item), isinstance(item, DoorEntry)
        place = _line_of(implementation.function if is_entry else item, str(implementation.plugin_name))
        fault = _fault(hook, item, found)
        problem = f"{place}: {fault}" if fault else ""
        if not problem and name in found:
            problem = f"{place}: there is already a '{name}', from {self.origins[name]}. Give this one another name."
        if not problem and inspect.isclass(item):
            problem = _contract_fault(item)
        if not problem:
            found[name] = item
            self.origins[name] = place
            return
        self.problems.append(problem)
        if name not in found:
            self._lost[name] = problem

    def _found(self, name: str, known: dict[str, Any], word: str) -> Any:
        if name in known:
            return known[name]
        if name in self._lost:
            raise PluginError(f"the {word} '{name}' is missing, because of a plug-in at fault: {self._lost[name]}")
        if word == "component" and self._take_shipped(name):
            return self.components[name]
        if word == "component" and name in self.effects:
            raise PluginError(f"'{name}' is an effect, not a component.", remedy="Effects go under 'insert:'.")
        if word == "effect" and name in self.components:
            raise PluginError(
                f"'{name}' is a component, not an effect.", remedy="Components go under 'parts:' of a machine, or 'replace:'."
            )
        raise PluginError(f"there is no {word} '{name}'.", remedy=nearest(name, known) or f"See 'lathesim {word}s'.")

    def _take_shipped(self, name: str) -> bool:
        """Take the components of the example plug-in that came with the program and defines ``name``; say whether there is one.

        It is as trusted and as tested as the stock parts, so that a shipped lesson that uses it runs from any folder.
        """
        for path in shipped_files("plugins", "*.py"):
            if name in _classes_in(path):
                for item in _imported(path).register_components():
                    self.components.setdefault(item.__name__, item)
                    self.origins.setdefault(item.__name__, _line_of(item, str(path)))
        return name in self.components


def _name_of(item: Any) -> str:
    return str(getattr(item, "name", None) or getattr(item, "__name__", None) or type(item).__name__)


def load_registry(plugin_folders: Iterable[Path] = (), *, installed: bool = True, hook: str = "") -> Registry:
    """Return the registry of stock parts, installed plug-ins and the files of plug-in folders, of which a ``hook`` leaves out others."""
    registry = Registry()
    if installed:
        registry.add_installed()
    for folder in plugin_folders:
        registry.add_folder(Path(folder), hook)
    return registry


class _FromSource(SourceFileLoader):
    """Loads a plug-in from its text only: byte code that a full disk has cut off would look like a fault of the plug-in."""

    def get_code(self, fullname: str) -> CodeType:
        """Return the byte code of the current text of the file."""
        return compile(self.get_data(self.path), self.path, "exec", dont_inherit=True)


def _imported(path: Path) -> ModuleType:
    import importlib.util
    import zlib

    name = f"lathesim_plugin_{path.stem}"
    if getattr(sys.modules.get(name), "__file__", str(path.absolute())) != str(path.absolute()):
        name = f"{name}_{zlib.crc32(str(path.absolute()).encode()):08x}"  # a file of this name lies in another folder too
    spec = importlib.util.spec_from_file_location(name, path, loader=_FromSource(name, str(path.absolute())))
    if path.suffix != ".py" or spec is None or spec.loader is None:
        raise PluginError("it is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _import_fault(path: Path, error: BaseException) -> str:
    own = str(path.absolute())
    if isinstance(error, SyntaxError):
        where = error.lineno if error.filename == own else None
        return f"{path}:{where or 1}: this is not Python: {error.msg}."
    import traceback

    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == own]
    place = f"{path}:{lines[-1]}" if lines else str(path)
    if isinstance(error, LatheSimError):
        return f"{place}: {_told(error)}"
    return f"{place}: the plug-in cannot be imported: {_told(error)}"


def _told(error: BaseException) -> str:
    if isinstance(error, LatheSimError):
        subject = error.place.rpartition(".")[2]
        told = f"{subject}: {error.fact}" if subject else error.fact
        return f"{told} {error.remedy}".strip()
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def _classes_in(path: Path) -> list[str]:
    """Return the names of the classes a file would define, as far as its text shows."""
    return [line[6:].partition("(")[0].partition(":")[0].strip() for line in _text(path).splitlines() if line.startswith("class ")]


def _text(path: Path) -> str:
    """Return the text of a file; empty where it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def shown_path(path: str) -> str:
    """Return a path as a person would write it where they stand."""
    return str(Path(path).relative_to(Path.cwd())) if Path(path).is_relative_to(Path.cwd()) else path


def _line_of(item: Any, otherwise: str) -> str:
    try:
        target = item if inspect.isclass(item) or inspect.isroutine(item) else type(item)
        return f"{shown_path(inspect.getsourcefile(target) or otherwise)}:{inspect.getsourcelines(target)[1]}"
    except (OSError, TypeError):
        return otherwise


_EXPECTED = {
    "register_components": "lathesim.component:Component",
    "register_effects": "lathesim.effects.effect:Effect",
    "register_remedies": "lathesim.effects.remedy:Remedy",
    "register_commands": "lathesim.hookspecs:CommandEntry",
    "register_screens": "lathesim.hookspecs:ScreenEntry",
}
"""Hook -> what a plug-in gives by it: classes that inherit from this one, or entries."""


def _fault(hook: str, item: Any, found: Mapping[str, Any]) -> str:
    """Return what is wrong with a thing that a plug-in gives, beside the ``found`` ones of its kind."""
    if hook not in _EXPECTED:
        return ""
    kind = DoorEntry(hook, _EXPECTED[hook]).load()
    if not issubclass(kind, DoorEntry):
        is_one = inspect.isclass(item) and issubclass(item, kind)
        return "" if is_one else f"{hook} gives {item!r}, which is no {kind.__name__.lower()} class."
    if not isinstance(item, kind):
        return f"{hook} gives {item!r}, which is no {kind.__name__}."
    module, _, attribute = item.target.partition(":")
    loaded = sys.modules.get(module)
    if not attribute or (loaded is not None and not hasattr(loaded, attribute)):
        return f"{hook} names '{attribute or item.target}', which is not there. Write f\"{{__name__}}:NAME\" of what stands in the file."
    return _taken_key(item, found) if isinstance(item, ScreenEntry) else ""


def _taken_key(item: ScreenEntry, found: Mapping[str, ScreenEntry]) -> str:
    taken = {"f5": "Run", **{other.key: other.title for other in found.values() if other.over == item.over}}
    return f"the key {item.key} of the screen '{item.name}' is that of {taken[item.key]}. Choose another." if item.key in taken else ""


def _contract_fault(item: type[Any]) -> str:
    from lathesim.component import Component
    from lathesim.guest_check import guest_fault

    return guest_fault(item) if issubclass(item, Component) else ""
