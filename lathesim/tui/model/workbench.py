"""The workbench: the registry, the setup with its undo, the runs made and opened, and who wants to hear of changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lathesim.errors import LatheSimError, LessonError
from lathesim.whole_file import write_text

if TYPE_CHECKING:
    from lathesim.lessons.lesson import Lesson
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry
    from lathesim.record import Record
    from lathesim.tui.model.live_run import LiveRun
    from lathesim.tui.model.machine_tree import Setup


SETUP, RUN, RUNS, REGISTRY = "setup", "run", "runs", "registry"
"""What changed, as listeners are told: the setup, the run under way, the list of runs, the parts at hand."""


@dataclass
class BenchRun:
    """A run of this session, or an older record with its path ``place``; ``name`` describes it."""

    name: str
    place: Path
    setup: Setup | None = None
    live: LiveRun | None = None
    loaded: Record | None = None

    @property
    def lesson(self) -> Lesson | None:
        """The lesson that was run; None of an older record."""
        return self.setup.lesson if self.setup is not None else None

    @property
    def path(self) -> Path:
        """The path of the record; a run may get a higher number until its record is written."""
        return self.live.path if self.live is not None else self.place

    @property
    def title(self) -> str:
        """The number of a run with its note and its setup, or the name of an older record with its note."""
        words = (self.path.stem, self.note, self.name) if self.live is not None else (self.name, self.note)
        return " ".join(word for word in words if word)

    @property
    def note(self) -> str:
        """The name a person gave the run, and behind a colon the note; it stands in a file beside the record."""
        try:
            return self._note_file.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError):
            return ""

    @note.setter
    def note(self, text: str) -> None:
        write_text(self._note_file, f"{text}\n")

    @property
    def _note_file(self) -> Path:
        return self.path.with_suffix(".note.txt")

    def record(self) -> Record:
        """Return the record, from memory where it is there, else from its file; :class:`RecordError` where that cannot be read."""
        if self.live is not None and (self.live.kept is not None or not self.live.is_over):
            return self.live.record()
        if self.loaded is None:
            from lathesim.record import load

            self.loaded = load(self.path)
        return self.loaded


class Workbench:
    """What stands on the bench. Every change goes through a method here, so that all screens hear of it."""

    def __init__(self, load_registry: Callable[[], Registry]) -> None:
        self._load_registry = load_registry
        self._registry: Registry | None = None
        self.setup: Setup | None = None
        """The setup on the bench; None before a lesson is opened."""
        self._past: list[Setup] = []
        self._undone: list[Setup] = []
        self.runs: list[BenchRun] = []
        self.shown: BenchRun | None = None
        self.pace = 0.0
        self.is_opening = False
        """Whether a lesson is still to be read; a run asked for meanwhile begins once it is there (:attr:`run_is_wanted`)."""
        self.run_is_wanted = False
        self._listeners: list[Callable[[str], None]] = []
        self._prepared: tuple[Setup, Prepared | LatheSimError] | None = None

    @property
    def registry(self) -> Registry:
        """The parts, effects and metrics at hand."""
        if self._registry is None:
            self._registry = self._load_registry()
        return self._registry

    def listen(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Return what ends the telling of changes to ``listener``, which begins now."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def tell(self, what: str) -> None:
        """Notify the listeners that something changed."""
        for listener in list(self._listeners):
            listener(what)

    @property
    def live(self) -> LiveRun | None:
        """The run under way, or None."""
        found = self.runs[-1].live if self.runs else None
        return found if found is not None and not found.is_over else None

    def want_run(self, wanted: bool) -> None:
        """Note that a run shall begin once the lesson is there, or that it shall not."""
        self.run_is_wanted = wanted
        self.tell(RUN)

    def open_lesson(self, lesson: str | Path | Lesson, variant: str | None = None) -> None:
        """Put a lesson on the bench, its first variant where none is asked for.

        Raises what :func:`load_lesson` raises, and :class:`LessonError` for a variant that the lesson does not have.
        """
        from lathesim.lessons.case import variant_changes
        from lathesim.lessons.lesson import load_lesson
        from lathesim.tui.model.machine_tree import Setup

        found = load_lesson(lesson) if isinstance(lesson, (str, Path)) else lesson
        if variant is not None:
            variant_changes(found, variant)
        self._put(Setup(found, variant if variant is not None else next(iter(found.variants), None)))
        self.shown = self.shown if self.live is not None else None
        self.tell(SETUP)

    def open_record(self, path: Path) -> BenchRun:
        """Open an older record; raises :class:`RecordError`."""
        from lathesim.record import load

        run = BenchRun(path.stem, path, loaded=load(path))
        self.runs.insert(len(self.runs) - 1 if self.live is not None else len(self.runs), run)
        self.shown = run
        self.tell(RUNS)
        return run

    def change(self, setup: Setup) -> None:
        """Put a changed setup on the bench; :meth:`undo` takes it back."""
        if self.setup is not None and setup != self.setup:
            self._put(setup)
            self.tell(SETUP)

    def _put(self, setup: Setup) -> None:
        """Put another setup on the bench; one that is equal changes nothing."""
        if setup == self.setup:
            return
        if self.setup is not None:
            self._past.append(self.setup)
            self._undone.clear()
        self.setup = setup

    def undo(self) -> bool:
        """Take the last change back; False where there is none."""
        return self._moved(self._past, self._undone)

    def redo(self) -> bool:
        """Make an undone change again; False where there is none."""
        return self._moved(self._undone, self._past)

    def _moved(self, origin: list[Setup], target: list[Setup]) -> bool:
        if self.setup is None or not origin:
            return False
        target.append(self.setup)
        self.setup = origin.pop()
        self.tell(SETUP)
        return True

    def prepared(self) -> Prepared:
        """Return the setup assembled and wired, made once for each setup; raises :class:`LatheSimError` where it cannot be."""
        setup = self.setup
        if setup is None:
            raise LessonError("there is no lesson on the bench.", remedy="Choose one.")
        if self._prepared is None or self._prepared[0] is not setup:
            try:
                self._prepared = setup, setup.prepared(self.registry)
            except LatheSimError as error:
                self._prepared = setup, error
        found = self._prepared[1]
        if isinstance(found, LatheSimError):
            raise found.with_traceback(None)
        return found

    def fault(self) -> str:
        """Return why the setup cannot run, in one message; empty where it can."""
        try:
            self.prepared()
        except LatheSimError as error:
            return fault_words(error)
        return ""

    def reload_plugins(self) -> None:
        """Read the plug-ins again and work with them from now on."""
        self._registry = self._load_registry()
        self._registry.ask()
        self._prepared = None
        self.tell(REGISTRY)

    def new_run(self) -> LiveRun:
        """Return a run of the setup, ready for a thread to call its ``run``; raises :class:`LatheSimError` where the setup cannot run."""
        from lathesim.lessons.lesson import results_folder
        from lathesim.tui.model.live_run import LiveRun, numbered

        setup, prepared = self.setup, self.prepared()
        assert setup is not None
        if self.live is not None:
            raise LessonError("a run is under way.", remedy="Stop it first.")
        folder = results_folder(setup.lesson)
        text = setup.lesson_text(folder) if setup.needs_file else ""
        live = LiveRun(prepared, folder / numbered(_newest(folder) + 1), lesson_text=text, seed=setup.seed, pace=self.pace)
        run = BenchRun(setup.summary, live.path, setup, live)
        self.runs.append(run)
        self.shown = run
        self.tell(RUN)
        return live

    def command(self) -> str:
        """Return the command that runs the setup on the bench; after a run the one that makes its record again."""
        setup = self.setup
        if setup is None:
            return "lathesim lessons"
        shown = self.shown
        if shown is not None and shown.setup is setup:
            return setup.command(out=shown.path, file=shown.path.with_suffix(".yaml"))
        return setup.command()


def _newest(folder: Path) -> int:
    """Return the largest number of a record or lesson in a folder, or 0."""
    found = (path.stem for path in folder.glob("*") if path.suffix in (".h5", ".yaml")) if folder.is_dir() else ()
    return max((int(stem) for stem in found if stem.isdecimal()), default=0)


def fault_words(error: Exception) -> str:
    """Return what is said of an error, in a sentence: with a capital, unless a place or a name stands first."""
    if isinstance(error, OSError):
        return f"{error.filename or 'A file'}: {error.strerror or error}."
    if isinstance(error, LatheSimError):
        text = str(error)
        return text if error.place or not text.partition(" ")[0].isalpha() else text[0].upper() + text[1:]
    return f"This is a fault of the program, not of your input: {type(error).__name__}: {error}"


def short_name(path: Path, among: list[Path]) -> str:
    """Return the number of a run, with its folder where another of the same number is shown too."""
    return path.stem if len([other for other in among if other.stem == path.stem]) < 2 else f"{path.parent.name}/{path.stem}"
