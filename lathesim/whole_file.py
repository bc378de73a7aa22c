"""Write every file of lathesim: under a temporary name beside its place, and moved there once complete. An older file stays until then."""

from __future__ import annotations

import contextlib
import errno
import functools
import itertools
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from lathesim.errors import WriteError

_PART = re.compile(r"\..+\.(\d+)-\d+\.part")
_LONGEST_NAME = 100
"""Characters of the file name that its temporary name repeats; file systems limit names to 255 bytes."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NUMBERS = itertools.count(1)


class PartFile:
    """An empty file ``part`` beside ``path``, locked as long as this process writes it; :meth:`keep` moves it to ``path``.

    Raises :class:`WriteError` if ``path`` cannot be written, see :func:`check_place`.
    """

    def __init__(self, path: Path) -> None:
        check_place(path)
        remove_dead_parts(path.parent)
        self.path = path
        self.part = path.with_name(f".{path.name[:_LONGEST_NAME]}.{os.getpid()}-{next(_NUMBERS)}.part")
        self._hold: int | None = os.open(self.part, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
        _lock(self._hold)

    def keep(self, *, durable: bool = True) -> None:
        """Move the file to its place; with ``durable`` it is first flushed to the disk."""
        if self._hold is not None:
            if durable:
                self.settle()
            self._let_go()
            self.part.replace(self.path)

    def keep_new(self, place: Path) -> bool:
        """Move the file to ``place`` unless a file exists there, and return whether it was moved.

        The move is exclusive: of two processes that want one place, only one gets it.
        """
        try:
            os.link(self.part, place)
        except FileExistsError:
            return False
        except OSError:  # a file system without hard links
            try:
                os.close(os.open(place, os.O_CREAT | os.O_EXCL))
            except FileExistsError:
                return False
            self.part.replace(place)
        self.path = place
        self.discard()
        return True

    def settle(self) -> None:
        """Flush the file to the disk."""
        if self._hold is not None:
            os.fsync(self._hold)

    def discard(self) -> None:
        """Remove the file unless it was kept."""
        if self._hold is not None:
            self._let_go()
            self.part.unlink(missing_ok=True)

    def _let_go(self) -> None:
        hold, self._hold = self._hold, None
        if hold is not None:
            os.close(hold)


class WholeFiles:
    """Files that belong together: all are moved to their places at the end of a ``with``, in the order of their creation, or none.

    Raises :class:`WriteError` if one of them cannot be written.
    """

    def __init__(self, *, durable: bool = True) -> None:
        self._durable = durable
        self._parts: list[PartFile] = []

    def place(self, path: Path) -> Path:
        """Return the temporary path to which the file ``path`` is written."""
        try:
            self._parts.append(PartFile(path))
        except OSError as error:
            raise refusal(path, error) from error
        return self._parts[-1].part

    def write_text(self, path: Path, text: str) -> Path:
        """Write one of the files in UTF-8 and return its final path."""
        self.place(path).write_bytes(text.encode())
        return path

    def __enter__(self) -> WholeFiles:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            for part in self._parts if error is None and self._durable else ():
                part.settle()
            for part in self._parts if error is None else ():
                part.keep(durable=False)
        except OSError as refused:
            error = refused
        finally:
            for part in self._parts:
                part.discard()
        if isinstance(error, OSError) and self._parts:
            raise refusal(self._parts[-1].path, error) from error


@contextmanager
def whole_file(path: str | Path, *, durable: bool = True) -> Iterator[Path]:
    """Yield a temporary path, and move its file to ``path`` at the end of the block; after an exception nothing is moved.

    Raises :class:`WriteError` if the file cannot be written.
    """
    with WholeFiles(durable=durable) as files:
        yield files.place(Path(path))


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file in UTF-8 with the line ends of ``text``, and return its path. Raises :class:`WriteError`."""
    return write_bytes(path, text.encode())


def write_bytes(path: str | Path, content: bytes, *, durable: bool = True) -> Path:
    """Write a file and return its path. Raises :class:`WriteError`."""
    with whole_file(path, durable=durable) as part, part.open("wb") as file:
        file.write(content)
    return Path(path)


def write_new(places: Iterable[Path], write: Callable[[Path], object]) -> Path:
    """Write a file with ``write(temporary path)``, move it to the first free one of ``places``, and return that place.

    Raises :class:`WriteError` if the file cannot be written, and FileExistsError if every place is taken.
    """
    part: PartFile | None = None
    place = Path()
    try:
        for place in places:
            if part is None:
                part = PartFile(place)
                write(part.part)
            if part.keep_new(place):
                return place
    except OSError as error:
        raise refusal(place, error) from error
    finally:
        if part is not None:
            part.discard()
    raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(place))


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, so that only one process at a time changes a file in it.

    Left out: file systems without locks.
    """
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError):
            file = os.open(folder, os.O_RDONLY)
            held.callback(os.close, file)
            _wait_for_lock(file)
        yield


def make_folder(folder: Path) -> Path:
    """Make a folder for output files, with its parents, and return it. Raises :class:`WriteError` if it cannot be made or written."""
    check_folder(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refusal(folder, error) from error
    return folder


def check_output(path: Path) -> Path:
    """Check an output file before the work begins, and return its path; its folder may be missing. Raises :class:`WriteError`."""
    check_folder(path.parent)
    if path.parent.exists():
        check_place(path)
    return path


def check_folder(folder: Path) -> None:
    """Raise :class:`WriteError` if the folder cannot be made, or exists and cannot be written."""
    there = next((one for one in (folder, *folder.parents) if os.path.lexists(one)), folder)
    if not there.is_dir():
        raise WriteError(f"'{there}' is no folder.", place=str(folder), remedy="Choose another place.")
    if not os.access(there, os.W_OK):
        raise WriteError(f"the folder '{there}' cannot be written.", place=str(folder), remedy="Choose another place.")


def check_place(path: Path) -> None:
    """Raise :class:`WriteError` if no file can be put there: without a folder, or on a folder, a device, a pipe or a link."""
    place = str(path)
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        mode = stat.S_IFREG
    except NotADirectoryError:
        raise WriteError(f"'{path.parent}' is no folder.", place=place, remedy="Choose another place.") from None
    except (OSError, ValueError) as error:
        raise refusal(path, error) from None
    if not path.parent.is_dir():
        raise WriteError(f"there is no folder '{path.parent}'.", place=place, remedy="Make it, or choose another place.")
    if stat.S_ISDIR(mode):
        raise WriteError("this is a folder.", place=place, remedy="Give the name of a file.")
    if not stat.S_ISREG(mode):
        kind = "a link" if stat.S_ISLNK(mode) else "no regular file (a device or a pipe)"
        raise WriteError(f"this is {kind}, and it is not replaced.", place=place, remedy="Give the name of a file.")
    if not os.access(path.parent, os.W_OK):
        raise WriteError(f"the folder '{path.parent}' cannot be written.", place=place, remedy="Choose another folder.")


def refusal(path: Path, error: BaseException) -> WriteError:
    """Return the error for a file that could not be written."""
    if isinstance(error, OSError) and error.errno in _FULL:
        return WriteError("the disk is full.", place=str(path), remedy="Make room, or choose another folder; nothing was replaced.")
    return WriteError(f"the file cannot be written: {_reason(error)}.", place=str(path), remedy="Choose another; nothing was replaced.")


def _reason(error: BaseException) -> str:
    return (str(getattr(error, "strerror", None) or error).splitlines() or [type(error).__name__])[0].rstrip(".")


@functools.lru_cache(maxsize=64)
def remove_dead_parts(folder: Path) -> None:
    """Remove the incomplete files of killed processes from a folder; each process looks once."""
    with contextlib.suppress(OSError):
        for name in [entry.name for entry in os.scandir(folder) if entry.name.endswith(".part")]:
            found = _PART.fullmatch(name)
            if found and not is_alive(int(found[1])):
                _remove_unlocked(folder / name)


def _remove_unlocked(part: Path) -> None:
    """Remove an incomplete file unless it is locked: a process of another computer may be writing it in a shared folder."""
    with contextlib.suppress(OSError):
        file = os.open(part, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
        try:
            _lock(file)
        finally:
            os.close(file)
        part.unlink()


if os.name == "nt":

    def is_alive(process: int) -> bool:
        """Return whether a process is this one; on Windows an open file cannot be removed, so any other may be tried."""
        return process == os.getpid()

    def _lock(file: int) -> None:
        pass

    def _wait_for_lock(file: int) -> None:
        pass

else:
    import fcntl

    def is_alive(process: int) -> bool:
        """Return whether a process runs."""
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return False
        except (OSError, OverflowError):
            return True
        return True

    def _lock(file: int) -> None:
        """Lock a file, or raise OSError if another process holds it; file systems without locks are accepted."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:
            return

    def _wait_for_lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX)
