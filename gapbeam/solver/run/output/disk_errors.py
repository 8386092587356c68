"""Errors of a disk that cannot be written: full, broken, read-only, or beyond a quota or a limit of file sizes."""

from __future__ import annotations

import errno
import re
from pathlib import Path

from gapbeam.solver.messages.errors import NotWritten, RunError, UserError

NUMBERS = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EROFS)
ADVICE = "look for a full disk, a quota, or a folder that was moved or made read-only"


def is_of_disk(error: BaseException) -> bool:
    """Return whether an error says that a disk takes nothing more; HDF5 gives the number in its text alone."""
    if not isinstance(error, OSError):
        return False
    found = re.search(r"errno = (\d+)", str(error))
    return (error.errno or (int(found[1]) if found else 0)) in NUMBERS


def no_place(folder: Path, error: OSError) -> RunError:
    """Return the error of a folder that cannot be made or written, before anything is computed.

    Args:
        folder: The folder.
        error: By the operating system. A disk without room is no fault of the input: `NotWritten`.
    """
    if is_of_disk(error) and error.errno != errno.EROFS:
        return NotWritten(f"{error.filename or folder} could not be written: {error.strerror}; {ADVICE}")
    return UserError(f"{folder} cannot be written ({error.strerror}); choose another `output=`")
