"""A screen that goes, a closed pipe or terminal, does not end the command: what it computes is worth more than that."""

from __future__ import annotations

import errno
import io
import os
import stat
import sys
from typing import Any

GONE = {errno.EPIPE, errno.EIO}


def outlive_the_screen() -> None:
    """Let standard output and standard error lead nowhere once nobody reads them any more."""
    sys.stdout, sys.stderr = _outliving(sys.stdout), _outliving(sys.stderr)


class _Screen(io.FileIO):
    """A file descriptor that leads nowhere once its reader is gone."""

    def write(self, data: Any) -> int:
        """Write; pretend to, where nobody reads it."""
        try:
            return super().write(data)
        except OSError as error:
            if error.errno not in GONE or stat.S_ISREG(os.fstat(self.fileno()).st_mode):
                raise
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())  # for the libraries that write to it as well
        os.close(nowhere)
        return super().write(data)


def _outliving(stream: Any) -> Any:
    """Return a text stream on the same file descriptor; the same stream where it has none."""
    try:
        place = stream.fileno()
        stream.flush()
    except (AttributeError, OSError, ValueError):  # closed before the command was started, or no file
        return stream
    return io.TextIOWrapper(
        io.BufferedWriter(_Screen(place, "w", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
