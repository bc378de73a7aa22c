"""The sealed answer of a concealed recording: what was hidden stays with the teacher, its digest is published beside the recording.

    digest = SHA-256(answer as JSON with sorted keys and without white space),   the answer holds a random salt of 128 bits

Without the salt a class could try all effects and sizes until the digest fits. Whoever opens the answer later can check that it is the one
that was sealed, and that the recordings are those that were made with it. Source: FIPS 180-4 (SHA-256).
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import lathesim
from lathesim.errors import RecordingError
from lathesim.exercises.conceal import Concealed
from lathesim.json_text import digest_of, read_json

ANSWER = "lathesim-answer/1"
SEAL = "lathesim-seal/1"
HOW = "SHA-256 of the answer as JSON with sorted keys, no white space, ASCII only; the answer holds a random salt"


def answer_of(concealed: Concealed, lesson: str, files: Mapping[str, str], *, seed: int, noise: float) -> dict[str, Any]:
    """Return the answer: the hidden effects and the true values [SI], the digests of the recordings, and a salt."""
    return {
        "schema": ANSWER,
        "lesson": lesson,
        "effects": [
            {
                "effect": item.effect.__name__,
                "at": item.at,
                "family": item.effect.family,
                "parameters": {name: {"value": value, "unit": item.units[name]} for name, value in item.values.items()},
                "nuisance": [
                    name
                    for name in item.effect.identification.nuisance
                    if name in item.values and name not in item.effect.identification.size_of_recording
                ],
            }
            for item in concealed.hidden
        ],
        "true_values": {name: asdict(item) for name, item in concealed.true_values.items()},
        "moves_floors": {name: float(f"{value:.3g}") for name, value in concealed.moves.items()},
        "files": dict(files),
        "seed": seed,
        "noise": noise,
        "lathesim": lathesim.__version__,
        "salt": secrets.token_hex(16),
    }


def seal_of(answer: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is published of an answer."""
    return {"schema": SEAL, "lesson": answer["lesson"], "how": HOW, "digest": digest_of(answer), "files": answer["files"]}


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def opened(seal_path: Path, answer_path: Path) -> dict[str, Any]:
    """Return the answer that was sealed; :class:`RecordingError` where one of the two files is not what it was."""
    seal_path = seal_path / "seal.json" if seal_path.is_dir() else seal_path
    seal = read_json(seal_path, SEAL, "seal", "digest")
    answer = read_json(answer_path, ANSWER, "answer", "effects")
    if digest_of(answer) != seal["digest"]:
        raise RecordingError(
            f"the answer does not fit the seal: one of them was changed, or {answer_path.name} belongs to another case.",
            place=str(seal_path),
            remedy="Ask for the files as they were made.",
        )
    return answer


def changed_files(seal_path: Path, answer: Mapping[str, Any]) -> list[str]:
    """Return the names of the published files that are missing or no longer what they were."""
    folder = seal_path if seal_path.is_dir() else seal_path.parent
    return [name for name, digest in answer["files"].items() if not (folder / name).is_file() or file_digest(folder / name) != digest]
