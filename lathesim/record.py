"""A Record: time, channels with units, and where they came from. A simulated run and a real recording are the same class.

Comparing a simulation with a recording is therefore subtraction. One HDF5 file holds one record: ``/time`` and ``/channels/<name>`` with
the attributes ``unit`` and ``description``; as JSON text ``/channel_roles`` by channel, and ``/meta`` (lesson, seed, versions, status).
Every block of numbers carries a checksum. A record is written beside its place and moved there when whole, so a half-written file never
replaces a good one. Only a record of what cannot be had again grows in its place, see :class:`lathesim.record_writer.RecordWriter`.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lathesim.errors import RecordError, nearest, visible
from lathesim.hdf5_guard import own_item, refuse_endless_heap
from lathesim.json_text import parsed_json

_LISTED = 6
"""Names that a message lists."""

FloatArray = npt.NDArray[np.float64]


def stretches(flags: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the begins and ends (behind the last sample) of the stretches in which a condition (samples,) holds."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


Meta = dict[str, str | float | int]

FORMAT = "lathesim-record"
VERSION = 1
CUT_OFF = "cut off"
"""The status of a record whose writer was killed; the record ends with its last written block."""
_BEFORE_ROLES = {
    "contour.error": ("contour_error",),
    "cutting.feed": ("feed_per_revolution",),
    "interpolator.radius": ("circle_radius",),
    "load.power": ("cutting_power",),
    "load.torque": ("cutting_torque",),
    "spindle.load_torque": ("cutting_torque",),
    "spindle.speed": ("spindle_speed",),
}
"""Roles of the channels of stock machines, for files that keep none: those written before there were roles, and those of a stream."""


_KEPT = 4096
"""Places that are kept once read, some thirty machines of them: wiring one asks for each of its places several times."""


class Place(NamedTuple):
    """A named thing of a part, ``part.port`` as text: an input, output, parameter or state; or the part alone, where ``port`` is empty.

    Files, command lines and plug-ins write places as text, and :meth:`of` reads it.
    """

    part: str
    port: str = ""

    @classmethod
    @lru_cache(maxsize=_KEPT)
    def of(cls, text: str) -> Place:
        """Return the place that a text names: what stands before its first point, and what stands after it."""
        part, _, port = text.partition(".")
        return cls(part, port)

    def __str__(self) -> str:
        return f"{self.part}.{self.port}" if self.port else self.part


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal: ``values`` (samples,) in the SI unit ``unit``; ``name`` is ``part.output``, ``roles`` those its part's class declares."""

    name: str
    unit: str
    values: FloatArray
    description: str = ""
    roles: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", _as_column(self.values, self.name))

    @property
    def port(self) -> str:
        """The name without its part."""
        place = Place.of(self.name)
        return place.port or place.part


@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """What was simulated or measured: ``time`` [s], (samples,), and channels by name, each as long as ``time``.

    ``meta`` says where it comes from: lesson text, seed, engine, status ("complete", "stopped", "failed: ..."), versions.
    Raises :class:`RecordError` where a channel and the time differ in length.
    """

    time: FloatArray
    channels: dict[str, Channel]
    meta: Meta = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", _as_column(self.time, "time"))
        for name, channel in self.channels.items():
            if len(channel.values) != len(self.time):
                fact = f"{name} has {len(channel.values)} values and the time has {len(self.time)}."
                raise RecordError(fact, remedy="Give every channel one value an instant.")

    def __getitem__(self, name: str) -> FloatArray:
        return self.channel(name).values

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __repr__(self) -> str:
        length = float(np.ptp(self.time)) if len(self) else 0.0
        return f"<Record: {len(self.channels)} channels, {len(self)} samples in {length:.4g} s, {self.status}>"

    def channel(self, name: str) -> Channel:
        """Return a channel with its unit; :class:`RecordError` with the nearest name where there is none."""
        found = self.channels.get(name)
        if found is None:
            raise RecordError(f"the record has no channel '{name}'.", remedy=nearest(name, self.channels) or _some_of(self.channels))
        return found

    def unit(self, name: str) -> str:
        """Return the SI unit of a channel."""
        return self.channel(name).unit

    @property
    def sample_period(self) -> float:
        """Time between two samples [s]: the one noted in ``meta``, else the median of the steps of ``time``; 0 with fewer than two."""
        noted = self.meta.get("sample_period")
        if isinstance(noted, (int, float)) and noted > 0.0:
            return float(noted)
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    @property
    def status(self) -> str:
        """How the run ended: "complete", "stopped", "failed: ..." or "cut off"; "complete" for a recording."""
        return str(self.meta.get("status", "complete"))

    def between(self, begin: float, end: float) -> Record:
        """Return the samples with ``begin <= time <= end`` [s], with their times as they are."""
        inside = (self.time >= begin) & (self.time <= end)
        channels = {name: dataclasses.replace(channel, values=channel.values[inside]) for name, channel in self.channels.items()}
        return Record(self.time[inside], channels, dict(self.meta))

    def with_channel(self, name: str, unit: str, values: npt.ArrayLike, description: str = "") -> Record:
        """Return the record with one channel more, or one replaced."""
        channel = Channel(name, unit, np.asarray(values, dtype=np.float64), description)
        return Record(self.time, {**self.channels, name: channel}, dict(self.meta))

    def with_meta(self, **entries: str | float | int) -> Record:
        """Return the record with further entries of ``meta``."""
        return Record(self.time, self.channels, {**self.meta, **entries})

    def by_role(self, role: str) -> list[str]:
        """Return the names of the channels that play a role: first those of which a part says so, then those that are called by it."""
        return list(self._roles.get(role, ()))

    @cached_property
    def _roles(self) -> dict[str, list[str]]:
        declared: dict[str, list[str]] = {}
        for name, channel in self.channels.items():
            for role in channel.roles:
                declared.setdefault(role, []).append(name)
        for name, channel in self.channels.items():
            found = declared.setdefault(channel.port, [])
            if name not in found:
                found.append(name)
        return declared

    def ending_with(self, *suffixes: str) -> list[str]:
        """Return the names of the channels that end with one of ``suffixes``, in the order of the suffixes."""
        return [name for suffix in suffixes for name in self.channels if name.endswith(suffix)]

    def to_pandas(self) -> Any:
        """Return the channels as a ``pandas.DataFrame`` over the time [s], with their SI units in ``attrs["units"]``."""
        units = {name: channel.unit for name, channel in self.channels.items()}
        return frame({name: channel.values for name, channel in self.channels.items()}, units, self.time)

    def to_xarray(self) -> Any:
        """Return the channels as an ``xarray.Dataset`` over ``time``; each has the attributes ``units`` and ``long_name``."""
        try:
            import xarray
        except ImportError:
            raise _missing("xarray") from None
        data = {
            name: ("time", channel.values, {"units": channel.unit, "long_name": channel.description or name})
            for name, channel in self.channels.items()
        }
        return xarray.Dataset(data, {"time": ("time", self.time, {"units": "s"})}, dict(self.meta))

    def plot(self, *names: str, title: str = "") -> Any:
        """Return a matplotlib figure of some channels over time, or of what matters in the run where none is named.

        A notebook shows the figure; ``figure.savefig("run.png")`` writes it.
        """
        from lathesim.analysis.plots import channels_figure, overview_figure

        return channels_figure(self, names, title) if names else overview_figure(self, title)


def frame(columns: Mapping[str, Any], units: Mapping[str, str], time: FloatArray | None = None) -> Any:
    """Return columns as a ``pandas.DataFrame``, with their units in ``attrs["units"]`` and the time [s] as its index."""
    try:
        import pandas
    except ImportError:
        raise _missing("pandas") from None
    made = pandas.DataFrame(dict(columns), index=None if time is None else pandas.Index(time, name="time"))
    made.attrs["units"] = dict(units)
    return made


def _missing(package: str) -> RecordError:
    return RecordError(f"the package '{package}' is not installed.", remedy="Install it with: python -m pip install 'lathesim[tables]'")


def load(path: str | Path) -> Record:
    """Read a record back whole.

    Raises :class:`RecordError` with one sentence where the file is missing, truncated, damaged, no record, or of a newer version.
    """
    place = Path(path)
    _check_file(place)
    import h5py

    try:
        refuse_endless_heap(place)
        file = h5py.File(place, "r")
    except Exception as error:
        fact = "the file is truncated." if "truncated" in str(error) else "the file is not HDF5, or it is damaged."
        raise RecordError(fact, place=str(place), remedy="Run the lesson again to make the record anew.") from error
    damaged = RecordError("the record is damaged.", place=str(place), remedy="Run the lesson again to make the record anew.")
    with file:
        try:
            given, version = _text(file.attrs.get("format", "")), int(file.attrs.get("version", 0))
        except Exception as error:
            raise damaged from error
        if given != FORMAT:
            raise RecordError(
                "the file is HDF5 but no record of this program.", place=str(place), remedy="Read it as a recording, with a mapping."
            )
        if version > VERSION:
            raise RecordError(f"the record has format {version}, larger than {VERSION}.", place=str(place), remedy="Update lathesim.")
        try:
            return _read(file)
        except RecordError as error:
            raise RecordError(error.fact, place=str(place), remedy=error.remedy) from error
        except Exception as error:
            raise damaged from error


def is_record(path: str | Path) -> bool:
    """Return whether a file is a record written by :func:`save`."""
    import h5py

    try:
        refuse_endless_heap(Path(path))
        with h5py.File(path, "r") as file:
            return _text(file.attrs.get("format", "")) == FORMAT
    except Exception:  # whatever the HDF5 library finds in a damaged file
        return False


def _read(file: Any) -> Record:
    group = own_item(file, "channels")
    roles = parsed_json(_text(file["channel_roles"][()])) if "channel_roles" in file else _BEFORE_ROLES
    channels = {}
    for name in parsed_json(_text(file["channel_names"][()])):
        dataset = own_item(group, name)
        unit, description = visible(_text(dataset.attrs["unit"])), visible(_text(dataset.attrs["description"]))
        channels[visible(name)] = Channel(visible(name), unit, dataset[:], description, tuple(map(visible, roles.get(name, ()))))
    time = own_item(file, "time")[:]
    if "meta" in file:
        return Record(time, channels, parsed_json(_text(file["meta"][()])))
    whole = min([len(time), *(len(channel.values) for channel in channels.values())])
    cut = {name: dataclasses.replace(channel, values=channel.values[:whole]) for name, channel in channels.items()}
    return Record(time[:whole], cut, {"status": CUT_OFF})


def _text(value: Any) -> str:
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def _as_column(values: Any, name: str) -> FloatArray:
    column = np.asarray(values, dtype=np.float64)
    if column.ndim != 1:
        raise RecordError(f"{name} has {column.ndim} dimensions.", remedy="Give one value an instant.")
    return column


def _some_of(names: Iterable[str]) -> str:
    listed = list(names)
    if not listed:
        return "It has no channels."
    return f"It has {', '.join(listed[:_LISTED])}{f' and {len(listed) - _LISTED} more' if len(listed) > _LISTED else ''}."


def _check_file(path: Path) -> None:
    if not path.exists():
        names = [other.name for other in path.parent.glob("*.h5")] if path.parent.is_dir() else []
        raise RecordError("there is no such file.", place=str(path), remedy=nearest(path.name, names))
    if path.is_dir():
        raise RecordError("this is a folder.", place=str(path), remedy="Give the name of a file.")
    if not os.access(path, os.R_OK):
        raise RecordError("the file cannot be read.", place=str(path), remedy="Change its permissions.")
