"""Write a frequency response as CSV, MAT or universal file, in the measured quantity, to which its noise belongs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError
from lathesim.stability.tool_point.frequency_response import SI_UNITS, Complex, FrequencyResponse, Quantity, from_receptance
from lathesim.stability.tool_point.read_response import HIT, UNIVERSAL
from lathesim.stability.tool_point.uff58 import COHERENCE, RESPONSE, SPECTRUM, Function58, write_uff58
from lathesim.whole_file import make_folder, whole_file

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
