"""JSON files of results and studies, read in bounded memory, their texts fit for a terminal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from postprocess.damage import printable
from postprocess.errors import ResultsError

LARGEST = 256 * 2**20
"""The largest file that is read, bytes."""
DEEPEST = 50
"""Lists and objects within each other."""


def read_json(path: Path, remedy: str) -> Any:
    """Read a JSON file.

    Args:
        path: The file.
        remedy: What to try where it cannot be read.

    Returns:
        Its contents, in whose texts control characters are written out.

    Raises:
        ResultsError: No plain file, too large, not JSON, NaN or infinite, or nested too deep.
    """
    expected = "a JSON file"
    try:
        if not path.is_file():
            raise ResultsError(path, "no such file" if not path.exists() else "no plain file", expected, remedy)
        size = path.stat().st_size
        if size > LARGEST:
            raise ResultsError(path, f"{size} bytes", f"a JSON file of at most {LARGEST} bytes", remedy)
        return _shown(json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse), 0)
    except (OSError, ValueError, RecursionError) as fault:
        told = printable(fault.strerror if isinstance(fault, OSError) else fault)
        raise ResultsError(path, f"text that is not JSON ({told})", expected, remedy) from fault


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant}, which gapbeam writes as null")


def _shown(value: Any, depth: int) -> Any:
    if depth > DEEPEST:
        raise ValueError(f"more than {DEEPEST} lists and objects within each other")
    if isinstance(value, str):
        return value if value.isprintable() else "\n".join(printable(line) for line in value.split("\n"))
    if isinstance(value, list):
        return [_shown(entry, depth + 1) for entry in value]
    if isinstance(value, dict):
        return {printable(key): _shown(entry, depth + 1) for key, entry in value.items()}
    return value
