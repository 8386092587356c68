"""JSON files of studies, read with a message where they are damaged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gapbeam.postprocess.results.bounded_files import read_json
from gapbeam.postprocess.results_errors import ResultsError

_REMEDY = "repeat the study that wrote it"


def read_object(path: Path, keys: Sequence[str] = (), remedy: str = _REMEDY) -> dict[str, Any]:
    """Read an object.

    Args:
        path: The file.
        keys: Keys that the object must have.
        remedy: Advice where it cannot be read.

    Raises:
        ResultsError: The file cannot be read, is no object, or lacks a key.
    """
    found = read_json(path, remedy)
    if not isinstance(found, dict):
        raise ResultsError(path, f"a {type(found).__name__}", "a JSON object", remedy)
    _check(path, found, keys)
    return found


def read_records(path: Path, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Read a list of one object or more.

    Args:
        path: The file.
        keys: Keys that each object must have.

    Raises:
        ResultsError: The file cannot be read, is no such list, or an object lacks a key.
    """
    found = read_json(path, _REMEDY)
    if not isinstance(found, list) or not found or not all(isinstance(one, dict) for one in found):
        raise ResultsError(path, f"a {type(found).__name__}", "a JSON list of one object or more", _REMEDY)
    for one in found:
        _check(path, one, keys)
    return found


def _check(path: Path, found: dict[str, Any], keys: Sequence[str]) -> None:
    lacking = [key for key in keys if key not in found]
    if lacking:
        raise ResultsError(path, f"no {', '.join(lacking)}", f"the keys {', '.join(keys)}", _REMEDY)
