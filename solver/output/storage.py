"""Writing so that a reader sees a whole file or none, and so that a full disk is told as such."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from solver.errors import NotWritten


@contextmanager
def written(path: Path) -> Iterator[None]:
    """Turn what goes wrong while a file is written into an error that says where, what, and what to try.

    Args:
        path: The file.

    Raises:
        NotWritten: By the operating system or by HDF5.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error).split("\n")[0]
        raise NotWritten(
            f"{path} could not be written: {reason}; look for a full disk, a quota, or a folder that was moved or made "
            "read-only, then go on with --resume"
        ) from error


def to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    place = os.open(path, os.O_RDONLY)
    try:
        os.fsync(place)
    finally:
        os.close(place)


def put_in_place(part: Path, path: Path) -> None:
    """Put a file that was written beside in its place, after its contents are on the disk."""
    to_disk(part)
    part.replace(path)
    to_disk(path.parent)
