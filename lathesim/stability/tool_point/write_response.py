"""Writes a frequency response as CSV, MAT or universal file; what is written is read back equal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError
from lathesim.stability.tool_point.frequency_response import SI_UNITS, FrequencyResponse
from lathesim.stability.tool_point.read_response import HIT, UNIVERSAL
from lathesim.stability.tool_point.uff58 import COHERENCE, RESPONSE, SPECTRUM, Function58, write_uff58


def write_response(response: FrequencyResponse, path: Path, *, binary: bool = True) -> None:
    """Write a receptance [m/N] with its coherence and single hits; the ending of the name (.csv, .mat, .uff) says how."""
    kind = path.suffix.lower()
    path.parent.mkdir(parents=True, exist_ok=True)
    if kind in UNIVERSAL:
        _universal(response, path, binary)
    elif kind == ".mat":
        import scipy.io

        columns = {"freq": response.frequency, "H": response.receptance_values, "unit": SI_UNITS["receptance"]}
        scipy.io.savemat(path, columns | ({} if response.coherence is None else {"coherence": response.coherence}))
    elif kind == ".csv":
        _text(response, path)
    else:
        raise RecordingError(
            f"a response is not written as '{path.suffix}'.", place=str(path), remedy="End the name in .csv, .mat or .uff."
        )


def _text(response: FrequencyResponse, path: Path) -> None:
    unit = SI_UNITS["receptance"]
    names = ["frequency [Hz]", f"real [{unit}]", f"imag [{unit}]"]
    columns = [response.frequency, response.receptance_values.real, response.receptance_values.imag]
    if response.coherence is not None:
        names.append("coherence")
        columns.append(response.coherence)
    if response.forces is not None:
        names.append("force [N*s]")
        columns.append(response.forces)
    for number, row in enumerate(response.hits if response.hits is not None else (), 1):
        names += [f"hit {number} real [{unit}]", f"hit {number} imag [{unit}]"]
        columns += [row.real, row.imag]
    with path.open("w", encoding="utf-8") as file:
        if response.notes:
            file.write(f"# {response.notes}\n")
        file.write(",".join(names) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in np.stack(columns, axis=1).tolist())


def _universal(response: FrequencyResponse, path: Path, binary: bool) -> None:
    above, below = (8, "Displacement", "m"), (13, "Force", "N")
    functions = [Function58(response.frequency, response.receptance_values, RESPONSE, response.notes or "tool point", above, below)]
    if response.coherence is not None:
        functions.append(Function58(response.frequency, response.coherence, COHERENCE, "coherence"))
    if response.forces is not None:
        functions.append(Function58(response.frequency, response.forces, SPECTRUM, "force"))
    for number, row in enumerate(response.hits if response.hits is not None else (), 1):
        functions.append(Function58(response.frequency, row, RESPONSE, f"{HIT}{number}", above, below))
    write_uff58(functions, path, binary=binary)
