"""JSON files of results and studies, read in bounded memory, their texts fit for a terminal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NoReturn

from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results.damaged_files import printable
from gapbeam.postprocess.results_errors import ResultsError

DEEPEST = 50
"""Lists and objects within each other."""
MOST = 12_000_000
"""Entries of lists and objects: they take up to 75 bytes each. A sweep of 256 MB has 10 million."""


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
        content = read_plain(path, expected, remedy)
        if sum(content.count(mark) for mark in (b",", b"[", b"{")) > MOST:
            raise ValueError(f"more than {MOST} entries")
        return _shown(json.loads(content.decode("utf-8"), parse_constant=_refuse), 0)
    except (OSError, ValueError, RecursionError) as fault:
        words = printable(fault.strerror if isinstance(fault, OSError) else fault)
        raise ResultsError(path, f"text that is not JSON ({words})", expected, remedy) from fault


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
