"""What makes two cases the same run: every key but those that do not change what is computed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from solver.case import Case

FREE = {"title", "mesh.file", "output.checkpoint_interval", "output.wall_time", "time.end"}
MESH_FILE = "contents of mesh.file"
NOTHING = "nothing"


def keys_of(case: Case) -> dict[str, Any]:
    """Return the values of a case by their dotted keys, with a checksum of its mesh file; for JSON."""
    keys = dict(_flat("", case.model_dump(mode="json")))
    if case.mesh.file is not None:
        keys[MESH_FILE] = "sha256 " + hashlib.sha256(Path(case.mesh.file).read_bytes()).hexdigest()
    return keys


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
