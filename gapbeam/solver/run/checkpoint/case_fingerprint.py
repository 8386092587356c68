"""Fingerprint of a case: every key but those that do not change the results."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.record_checksums import with_checksums

FREE = {
    "title",
    "mesh.file",
    "output.checkpoint_interval",
    "output.keep_checkpoint",
    "output.keep_states",
    "output.wall_time",
    "time.end",
    "gates.accept_lack_of_memory",
}
MESH_FILE = "contents of mesh.file"
NOTHING = "nothing"


def keys_of(case: Case) -> dict[str, Any]:
    """Return the values of a case by their dotted keys, with checksums for the paths of its files; for JSON."""
    case = with_checksums(case)
    keys = dict(_flat("", case.model_dump(mode="json")))
    for load in case.load:
        keys.pop(f"load.{load.name}.file", None)
    if case.mesh.file is not None:
        keys[MESH_FILE] = "sha256 " + checksum_of(Path(case.mesh.file))
    return keys


def checksum_of(path: Path) -> str:
    """Return the SHA-256 of a file, which is not held in memory as a whole."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def differences(keys: dict[str, Any], expected: dict[str, Any], free: set[str] | frozenset[str]) -> list[str]:
    """Return a line for every key in which two cases differ: what was found, what was expected."""
    names = sorted((keys.keys() | expected.keys()) - free)
    return [
        f"{name}: found {keys.get(name, NOTHING)!r}, expected {expected.get(name, NOTHING)!r}"
        for name in names
        if keys.get(name, NOTHING) != expected.get(name, NOTHING)
    ]


def _flat(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from _flat(f"{key}.{name}" if key else name, entry)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for number, entry in enumerate(value):
            yield from _flat(f"{key}.{entry.get('name', number)}", entry)
    else:
        yield key, value
