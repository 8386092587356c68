"""Atomic writing: a reader sees a whole file or none, and a full disk is reported as one."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

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
        error: Error of the operating system. A disk without room is no fault of the input: `NotWritten`.
    """
    if is_of_disk(error) and error.errno != errno.EROFS:
        return NotWritten(f"{error.filename or folder} could not be written: {error.strerror}; {ADVICE}")
    return UserError(f"{folder} cannot be written ({error.strerror}); choose another `output=`")


@contextmanager
def written(path: Path) -> Iterator[None]:
    """Turn an error while a file is written into one with place, cause and advice.

    Args:
        path: The file.

    Raises:
        NotWritten: The operating system or HDF5 reports an error.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error).split("\n")[0]
        raise NotWritten(
            f"{path} could not be written: {reason}; {ADVICE}; a run then goes on with `resume=True`"
        ) from error


@contextmanager
def disk_reported(folder: Path) -> Iterator[None]:
    """Turn an error of a disk that cannot be written into one with advice.

    `written` names the file and stands closer to it; this is for what writes beside results: caches, libraries, tables.

    Args:
        folder: Results folder, named where the error names no file.

    Raises:
        NotWritten: The disk is full, broken, read-only, or a quota or a limit of file sizes was reached.
    """
    try:
        yield
    except OSError as error:
        if not is_of_disk(error):
            raise
        with written(Path(str(error.filename or folder))):
            raise


def to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    place = os.open(path, os.O_RDONLY)
    try:
        os.fsync(place)
    finally:
        os.close(place)


def new_file(path: Path) -> int:
    """Open a new file to read and to write; an existing one of its name is removed, a link as such.

    So nothing is ever written through a link that somebody put where a file is about to be written.

    Raises:
        OSError: The operating system reports an error, also where another process makes such a file at the same time.
    """
    path.unlink(missing_ok=True)
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)


def part_of(path: Path) -> Path:
    """Return the temporary file that a file is written to."""
    return path.with_name(path.name + ".part")


def copy_beside(path: Path) -> Path:
    """Copy a file to its temporary file, to continue there, and return that."""
    part = part_of(path)
    with path.open("rb") as source, os.fdopen(new_file(part), "wb") as target:
        shutil.copyfileobj(source, target, 2**20)
    return part


def own_folder(path: Path) -> None:
    """Make a folder in a results folder, if it is not there.

    Raises:
        OSError: The folder cannot be made, or is a link that leads elsewhere.
    """
    path.mkdir(exist_ok=True)
    if path.is_symlink():
        raise OSError("it is a link; gapbeam does not write through it")


def put_in_place(part: Path, path: Path) -> None:
    """Replace a file by its temporary file, after its contents are on the disk."""
    to_disk(part)
    part.replace(path)
    to_disk(path.parent)


class Sink:
    """File object below HDF5, which keeps the first error of writing: HDF5 itself misses that a disk is full.

    HDF5 that cannot write does not get over it: it tries again whenever something is let go, and ends the process. So
    the first trouble is kept, nothing more is written, and whoever writes asks for it.

    Args:
        path: The file.
        new: Whether to make it; it is there otherwise.

    Attributes:
        trouble: The first error.
    """

    def __init__(self, path: Path, new: bool) -> None:
        self._file: Any = os.fdopen(new_file(path), "w+b", buffering=0) if new else path.open("r+b", buffering=0)
        self.trouble: OSError | None = None

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place."""
        return int(self._file.seek(offset, whence))

    def tell(self) -> int:
        """Return the place."""
        return int(self._file.tell())

    def readinto(self, buffer: Any) -> int:
        """Read into a buffer."""
        return int(self._file.readinto(buffer))

    def read(self, size: int = -1) -> bytes:
        """Read."""
        return bytes(self._file.read(size))

    def write(self, data: Any) -> int:
        """Write all of it, or keep the error."""
        rest = memoryview(data)
        size = len(rest)
        try:
            while len(rest) and self.trouble is None:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self.trouble = error
        return size

    def truncate(self, size: int) -> int:
        """Change the size, or keep the error."""
        try:
            if self.trouble is None:
                self._file.truncate(size)
        except OSError as error:
            self.trouble = error
        return size

    def flush(self) -> None:
        """Nothing is kept back."""

    def check(self) -> None:
        """Raise the kept error.

        Raises:
            OSError: The operating system reports an error.
        """
        if self.trouble is not None:  # a new error each time: one that is raised again would become its own cause
            raise OSError(self.trouble.errno, self.trouble.strerror)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def new_hdf5(path: Path) -> Iterator[h5py.File]:
    """Write an HDF5 file.

    Args:
        path: The file; it is removed where it could not be written.

    Raises:
        OSError: The file could not be written.
    """
    sink = Sink(path, new=True)
    try:
        with h5py.File(sink, "w") as file:
            yield file
        sink.check()
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    finally:
        sink.close()
