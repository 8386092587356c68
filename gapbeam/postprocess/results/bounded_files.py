"""Files of results, read in bounded memory: no devices, no pipes, nothing larger than gapbeam writes.

Texts of JSON files are made fit for a terminal. A response curve is divided into parts of one branch and one stability.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, NoReturn

from gapbeam.postprocess.results.damaged_files import printable
from gapbeam.postprocess.results_errors import ResultsError

LARGEST = 256 * 2**20
"""The largest file that is read, bytes."""


def read_plain(path: Path, expected: str, remedy: str, largest: int = LARGEST) -> bytes:
    """Read a file.

    Args:
        path: The file.
        expected: Expectation, for the message.
        remedy: Advice where it is something else.
        largest: Bytes that it may have.

    Raises:
        ResultsError: No such file, no plain file, or too large.
        OSError: It cannot be read.
    """
    if not path.is_file():
        raise ResultsError(path, "no plain file" if path.exists() else "no such file", expected, remedy)
    size = path.stat().st_size
    if size > largest:
        raise ResultsError(path, f"{size} bytes", f"{expected} of at most {largest} bytes", remedy)
    return path.read_bytes()


DEEPEST = 50
"""Lists and objects within each other."""
MOST = 12_000_000
"""Entries of lists and objects: they take up to 75 bytes each. A sweep of 256 MB has 10 million."""


def read_json(path: Path, remedy: str) -> Any:
    """Read a JSON file.

    Args:
        path: The file.
        remedy: Advice where it cannot be read.

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


Point = Mapping[str, Any]


def branch_parts(points: Sequence[Point]) -> Iterator[tuple[int, slice]]:
    """Yield the number and the points of every branch.

    Args:
        points: Those of curve.json.
    """
    start = 0
    for number, branch in groupby(points, lambda point: int(point.get("branch", 1))):
        stop = start + len(list(branch))
        yield number, slice(start, stop)
        start = stop


def stable_parts(points: Sequence[Point]) -> Iterator[tuple[bool | None, slice]]:
    """Yield the parts of a branch with whether their responses are stable; neighbors share a point.

    Between two points the first decides on the stability; where it is an event, at which stability changes, the second
    does.

    Args:
        points: Those of one branch.
    """
    between = [(last if first["event"] else first)["stable"] for first, last in pairwise(points)]
    start = 0
    for stable, part in groupby(between):
        stop = start + len(list(part))
        yield stable, slice(start, stop + 1)
        start = stop
