"""Text for the terminal, without control characters and with options for keys; a lost terminal does not end the run."""

from __future__ import annotations

import errno
import fcntl
import io
import logging
import os
import re
import stat
import sys
from typing import Any

ARGUMENT = re.compile(r"`(\w+)=(?:True)?`")
OPTIONS = {"zipped": "zip", "overrides": "set"}  # where the option is not called as the argument is


def harmless(text: object) -> str:
    """Return a text whose control characters, which a file may have brought, are written out; lines stay lines."""
    return "".join(
        one if one.isprintable() or one in "\n\t" else one.encode("unicode_escape").decode("ascii") for one in str(text)
    )


def with_options(text: object) -> str:
    """Return a message with arguments of Python calls, `output=` or `resume=True`, as options: --output, --resume."""
    return ARGUMENT.sub(lambda found: f"--{OPTIONS.get(found[1], found[1]).replace('_', '-')}", str(text))


class OptionWords(logging.Filter):
    """Lets log lines of the command line name its options; a log line of a Python session names arguments."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Rewrite a log line."""
        record.msg, record.args = with_options(record.getMessage()), ()
        return True


GONE = {errno.EPIPE, errno.EIO}
FULL = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}
ERROR_STREAM = 2  # its file descriptor


def outlive_the_screen() -> None:
    """Let standard output and standard error lead nowhere once nobody reads them any more, or where they are closed.

    Some schedulers and daemons start programs with closed streams. The first files that such a program opens are taken
    for its streams: what libraries print would land in them.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if not _is_open(number, mode):
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, None)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    sys.stdout, sys.stderr = _outliving(sys.stdout), _outliving(sys.stderr)


def _is_open(number: int, mode: str) -> bool:
    """Return whether a file descriptor can be read or written; a file opened instead of it often cannot."""
    try:
        access = fcntl.fcntl(number, fcntl.F_GETFL) & os.O_ACCMODE
    except OSError:
        return False
    return access != (os.O_WRONLY if mode == "r" else os.O_RDONLY)


class NoRoomError(OSError):
    """Standard output is a file on a full disk: the output is lost."""

    exit_status = 6


class _Screen(io.FileIO):
    """A file descriptor that leads nowhere once its reader is gone, or its disk is full."""

    def write(self, data: Any) -> int:
        """Write; pretend to, where nobody reads it.

        Raises:
            NoRoomError: There is no room for standard output. What is said on standard error is less than the results.
        """
        try:
            return super().write(data)
        except OSError as error:
            full = error.errno in FULL
            if not full and (error.errno not in GONE or stat.S_ISREG(os.fstat(self.fileno()).st_mode)):
                raise
            reason = error.strerror
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())  # for the libraries that write to it as well
        os.close(nowhere)
        if full and self.fileno() != ERROR_STREAM:
            raise NoRoomError(f"standard output cannot be written: {reason}")
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
