"""Frequency responses in files: CSV, MAT and universal files (UFF 58)."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.hdf5_guard import stands_elsewhere
from lathesim.record import FloatArray
from lathesim.recordings.delimited_text import read_text
from lathesim.recordings.number_rows import head_lines
from lathesim.stability.tool_point import (
    SI_UNITS,
    Complex,
    FrequencyResponse,
    Quantity,
    checked,
    from_receptance,
    quantity_and_scale,
    to_receptance,
    unit_of,
)
from lathesim.stability.uff58 import COHERENCE, RESPONSE, SPECTRUM, Function58, read_uff58, write_uff58
from lathesim.whole_file import make_folder, whole_file

UNIVERSAL = (".uff", ".unv", ".uf", ".ufb", ".58")
NUMERATORS: dict[int, Quantity] = {8: "receptance", 11: "mobility", 12: "accelerance"}
"""Specific data type of the ordinate -> what a response over force is."""
HIT = "hit "
"""How the title of a response of a single hit begins."""
NOTE = re.compile(r"(window_rate|pulse_length|pulse_lead|force_density) ([-+.\deE]+)")
_SAID = "Say what it is, as in --quantity accelerance --unit g/N."
_FREQUENCY = ("frequency", "freq", "f", "hz", "frequencies", "f_hz", "freq_hz")
_REAL = ("real", "re", "real_part")
_IMAG = ("imag", "im", "imaginary", "imag_part", "imaginary_part")
_MAGNITUDE = ("magnitude", "abs", "amplitude", "mag")
_PHASE = ("phase", "angle", "arg")
_VALUES = ("response", "frf", "h", "g", "receptance", "mobility", "accelerance", "h1", "values", "inertance")


def read_response(path: Path, quantity: str | None = None, unit: str | None = None) -> FrequencyResponse:
    """Return the frequency response in a file; ``quantity`` and ``unit`` say what it is, where the file does not or says it wrongly.

    Raises :class:`RecordingError` in one sentence where the file cannot be used.
    """
    if not path.is_file():
        raise RecordingError("there is no such file.", place=str(path), remedy="Give a CSV, MAT or UFF 58 file.")
    told = quantity_and_scale(quantity, unit, str(path))
    kind = path.suffix.lower()
    with path.open("rb") as file:
        beginning = file.read(80).strip()
    if kind in UNIVERSAL or beginning[:2] == b"-1":
        return checked(_from_universal(path, told), str(path))
    return checked(_from_mat(path, told) if kind == ".mat" else _from_text(path, told), str(path))


def _from_universal(path: Path, told: tuple[Quantity, float] | None) -> FrequencyResponse:
    functions = read_uff58(path)
    responses = [item for item in functions if item.function_type in (RESPONSE, 0) and np.iscomplexobj(item.y)]
    means = [item for item in responses if not item.title.lower().startswith(HIT)]
    if not means:
        if any(item.function_type == RESPONSE for item in functions):
            raise RecordingError("the response has no phase: it is real.", place=str(path), remedy="Export it complex.")
        raise RecordingError("no function in it is a frequency response.", place=str(path), remedy="Export one of function type 4.")
    mean = means[0]
    same = [item for item in responses if item.title.lower().startswith(HIT) and len(item.y) == len(mean.y)]
    coherences = [item for item in functions if item.function_type == COHERENCE and len(item.y) == len(mean.y)]
    known = told or _of_axes(mean, str(path))
    coherence = np.asarray(coherences[0].y.real, dtype=np.float64) if coherences else None
    hits = np.stack([item.y for item in same]) if same else None
    spectra = [item.y for item in functions if item.function_type == SPECTRUM and item.title == "force" and len(item.y) == len(mean.y)]
    forces = spectra[0] if spectra else None
    found = _response(mean.x, np.asarray(mean.y, dtype=np.complex128), known, coherence, hits, mean.title, forces)
    if len(means) > 1:
        found = replace(found, findings=(f"the file holds {len(means)} responses; the first is used, '{mean.title}'",))
    return found


def _of_axes(function: Function58, place: str) -> tuple[Quantity, float]:
    """Return the quantity and scale that the axes of a universal file tell."""
    above, below = function.numerator[2].replace(" ", ""), function.denominator[2].replace(" ", "")
    if above and below:
        return unit_of(f"{above}/{below}", place)
    if above and "/" in above and function.numerator[0] in (0, 1):
        return unit_of(above, place)
    if function.numerator[0] in NUMERATORS:
        quantity = NUMERATORS[function.numerator[0]]
        return (quantity, unit_of(f"{above}/N", place)[1]) if above else (quantity, 1.0)
    raise RecordingError("the file does not say whether it holds displacement, velocity or acceleration.", place=place, remedy=_SAID)


def _response(
    frequency: FloatArray,
    values: Complex,
    known: tuple[Quantity, float],
    coherence: FloatArray | None,
    hits: Complex | None,
    title: str,
    forces: FloatArray | None = None,
) -> FrequencyResponse:
    frequency = np.asarray(frequency, dtype=np.float64)
    dropped = known[0] != "receptance" and len(frequency) > 0 and frequency[0] == 0.0
    if len(frequency) != len(values):
        raise RecordingError(f"there are {len(frequency)} frequencies and {len(values)} values of the response.")
    f, h = to_receptance(frequency, values, *known)
    single = None if hits is None else np.stack([to_receptance(frequency, row, *known)[1] for row in hits])
    kept = None if coherence is None else coherence[1:] if dropped else coherence
    spectrum = None if forces is None else forces[1:] if dropped else forces
    notes: dict[str, Any] = {name.replace("force_density", "force_noise"): float(value) for name, value in NOTE.findall(title)}
    return FrequencyResponse(f, h, kept, single, spectrum, known[0], title=title, **notes)


def _from_text(path: Path, told: tuple[Quantity, float] | None) -> FrequencyResponse:
    raw = read_text(path)
    names = [f"{name} [{unit}]" if (unit := raw.units[name]) else name for name in raw.columns]
    if all(name.startswith("column_") for name in names):
        names = ["frequency [Hz]", "real", "imag", "coherence"][: len(names)]
    comments = " ".join(line for line in head_lines(path) if line.lstrip().startswith("#"))
    try:
        return _of_columns(names, np.stack(list(raw.columns.values()), axis=1), told, str(path), comments)
    except RecordingError as error:
        raise error if error.place else RecordingError(error.fact, place=str(path), remedy=error.remedy) from None


def _of_columns(names: list[str], table: FloatArray, told: tuple[Quantity, float] | None, place: str, comments: str) -> FrequencyResponse:
    plain = [_plain(name) for name in names]
    units = [match[1] if (match := re.search(r"[\[(]([^\])]*)[\])]\s*$", name)) else "" for name in names]

    def column(choices: tuple[str, ...]) -> int | None:
        return next((at for at, name in enumerate(plain) if name in choices or any(name.startswith(f"{word}_") for word in choices)), None)

    at_frequency = column(_FREQUENCY)
    frequency = table[:, at_frequency if at_frequency is not None else 0]
    if at_frequency is not None and units[at_frequency].lower() == "khz":
        frequency = frequency * 1e3
    elif at_frequency is not None and units[at_frequency].replace(" ", "").lower() == "rad/s":
        frequency = frequency / (2.0 * np.pi)
    real, imag, magnitude, phase = column(_REAL), column(_IMAG), column(_MAGNITUDE), column(_PHASE)
    if real is not None and imag is not None:
        values, at = table[:, real] + 1j * table[:, imag], real
    elif magnitude is not None and phase is not None:
        turn = table[:, phase] if units[phase].lower() in ("rad", "radian", "radians") else np.radians(table[:, phase])
        values, at = table[:, magnitude] * np.exp(1j * turn), magnitude
    else:
        raise RecordingError("the response has no phase.", place=place, remedy="Give its real and imaginary part, or magnitude and phase.")
    known = told or (unit_of(units[at], place) if units[at] else None)
    if known is None:
        raise RecordingError("the file gives no unit of the response.", place=place, remedy=_SAID)
    coherence = column(("coherence", "coh", "gamma2"))
    force = column(("force", "mean_force"))
    hit = [at for at, name in enumerate(plain) if re.fullmatch(r"hit_\d+_real", name)]
    hits = np.stack([table[:, at] + 1j * table[:, at + 1] for at in hit]) if hit else None
    spectrum = table[:, force] if force is not None else None
    return _response(frequency, values, known, None if coherence is None else table[:, coherence], hits, comments, spectrum)


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", re.sub(r"[\[(][^\])]*[\])]\s*$", "", name).strip().lower()).strip("_")


def _from_mat(path: Path, told: tuple[Quantity, float] | None) -> FrequencyResponse:
    arrays = _mat_arrays(path)
    names = {name.lower(): name for name in arrays}
    columns = {name: value.reshape(-1) for name, value in arrays.items() if value.ndim <= 2 and max(value.shape, default=0) == value.size}

    def named(choices: tuple[str, ...]) -> Any:
        for word in choices:
            if word in names and names[word] in columns:
                return columns[names[word]]
        return None

    frequency = named(_FREQUENCY)
    values = named(_VALUES)
    if values is None:
        complex_columns = [value for value in columns.values() if np.iscomplexobj(value)]
        values = complex_columns[0] if complex_columns else None
    if values is None and (real := named(_REAL)) is not None and (imag := named(_IMAG)) is not None:
        values = real + 1j * imag
    if values is None and (magnitude := named(_MAGNITUDE)) is not None and (phase := named(_PHASE)) is not None:
        values = magnitude * np.exp(1j * np.radians(phase))
    if frequency is None or values is None:
        have = ", ".join(sorted(arrays)) or "nothing"
        raise RecordingError(f"the file holds {have}, and no frequencies with a response.", place=str(path), remedy="Name them freq and H.")
    if not np.iscomplexobj(values):
        raise RecordingError("the response has no phase: it is real.", place=str(path), remedy="Store it complex.")
    text = "".join(str(item) for item in arrays.get(names.get("unit", ""), np.array([])).reshape(-1))
    known = told or (unit_of(text, str(path)) if text else None)
    if known is None:
        raise RecordingError("the file gives no unit of the response.", place=str(path), remedy=_SAID)
    coherence, force = named(("coherence", "coh", "gamma2")), named(("force", "mean_force"))
    hits = arrays.get(names.get("hits", ""))
    if hits is not None and (hits.ndim != 2 or hits.shape[1] != len(values)):
        hits = None
    if force is not None and len(force) != len(values):
        force = None
    notes = "".join(str(item) for item in arrays.get(names.get("notes", ""), np.array([])).reshape(-1))
    try:
        return _response(frequency.real, np.asarray(values, dtype=np.complex128), known, coherence, hits, notes, force)
    except RecordingError as error:
        raise RecordingError(error.fact, place=str(path), remedy=error.remedy) from None


def _mat_arrays(path: Path) -> dict[str, Any]:
    """Return the arrays of a MAT file, up to version 7 or of version 7.3."""
    import h5py
    import scipy.io

    if h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            found = {}
            for name in file:
                item = None if stands_elsewhere(file, name) else file[name]
                if isinstance(item, h5py.Dataset):
                    value = item[()]
                    fields = getattr(value, "dtype", np.dtype(float)).names or ()
                    found[name] = value["real"] + 1j * value["imag"] if "real" in fields else np.asarray(value)
            return found
    try:
        stored = scipy.io.loadmat(path)
    except Exception as error:
        raise RecordingError(f"the MAT file cannot be read: {str(error).rstrip('.')}.", place=str(path)) from None
    return {name: np.asarray(value) for name, value in stored.items() if not name.startswith("__")}


_NUMERATORS: dict[Quantity, tuple[int, str, str]] = {
    "receptance": (8, "Displacement", "m"),
    "mobility": (11, "Velocity", "m/s"),
    "accelerance": (12, "Acceleration", "m/s^2"),
}


def write_response(response: FrequencyResponse, path: Path, *, binary: bool = True) -> None:
    """Write a response [m/N, m/s/N or m/s^2/N] with its coherence, mean force, single hits, and notes on window and noise.

    The ending of the name (.csv, .mat, .uff) gives the format.
    """
    kind = path.suffix.lower()
    if kind not in (*UNIVERSAL, ".mat", ".csv"):
        raise RecordingError(
            f"a response is not written as '{path.suffix}'.", place=str(path), remedy="End the name in .csv, .mat or .uff."
        )
    make_folder(path.parent)
    if kind in UNIVERSAL:
        _universal(response, path, binary)
    elif kind == ".csv":
        _text(response, path)
    else:
        import scipy.io

        mean, hits = _measured(response)
        columns: dict[str, object] = {"freq": response.frequency, "H": mean, "unit": SI_UNITS[response.quantity], "notes": response.notes}
        further = {"coherence": response.coherence, "force": response.forces, "hits": np.stack(hits) if hits else None}
        with whole_file(path) as part:
            scipy.io.savemat(part, columns | {name: value for name, value in further.items() if value is not None}, appendmat=False)


def _measured(response: FrequencyResponse) -> tuple[Complex, list[Complex]]:
    """Return the mean response and the responses of single hits in the measured quantity."""
    rows = [response.receptance_values, *(response.hits if response.hits is not None else ())]
    mean, *hits = (from_receptance(response.frequency, row, response.quantity) for row in rows)
    return mean, hits


def _text(response: FrequencyResponse, path: Path) -> None:
    unit = SI_UNITS[response.quantity]
    mean, hits = _measured(response)
    names = ["frequency [Hz]", f"real [{unit}]", f"imag [{unit}]"]
    columns = [response.frequency, mean.real, mean.imag]
    if response.coherence is not None:
        names.append("coherence")
        columns.append(response.coherence)
    if response.forces is not None:
        names.append("force [N*s]")
        columns.append(response.forces)
    for number, row in enumerate(hits, 1):
        names += [f"hit {number} real [{unit}]", f"hit {number} imag [{unit}]"]
        columns += [row.real, row.imag]
    with whole_file(path) as part, part.open("w", encoding="utf-8") as file:
        if response.notes:
            file.write(f"# {response.notes}\n")
        file.write(",".join(names) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in np.stack(columns, axis=1).tolist())


def _universal(response: FrequencyResponse, path: Path, binary: bool) -> None:
    above, below = _NUMERATORS[response.quantity], (13, "Force", "N")
    mean, hits = _measured(response)
    functions = [Function58(response.frequency, mean, RESPONSE, response.notes or "tool point", above, below)]
    if response.coherence is not None:
        functions.append(Function58(response.frequency, response.coherence, COHERENCE, "coherence"))
    if response.forces is not None:
        functions.append(Function58(response.frequency, response.forces, SPECTRUM, "force", (13, "Force", "N*s")))
    for number, row in enumerate(hits, 1):
        functions.append(Function58(response.frequency, row, RESPONSE, f"{HIT}{number}", above, below))
    write_uff58(functions, path, binary=binary)
