"""Files of results, read in bounded memory: no devices, no pipes, nothing larger than gapbeam writes."""

from __future__ import annotations

from pathlib import Path

from gapbeam.postprocess.results_errors import ResultsError

LARGEST = 256 * 2**20
"""The largest file that is read, bytes."""


def read_plain(path: Path, expected: str, remedy: str, largest: int = LARGEST) -> bytes:
    """Read a file.

    Args:
        path: The file.
        expected: What it should be, for the message.
        remedy: What to try where it is something else.
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
