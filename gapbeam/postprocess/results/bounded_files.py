"""Files of results, read in bounded memory: no devices, no pipes, nothing larger than gapbeam writes.

Texts of JSON files are made fit for a terminal. A response curve is divided into parts of one branch and one stability.

Files that are not as gapbeam wrote them are reported as faults of the input, wherever in the reading they show.

HDF5 files of results may have plain datasets in the file itself, no larger than the file.
"""

from __future__ import annotations

import errno
import json
import os
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, NoReturn

import h5py

from gapbeam.postprocess.results_errors import ResultsError

FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
_LONGEST = 200  # characters of a foreign message


@contextmanager
def as_written(*places: Path, into: Path | None = None) -> Iterator[None]:
    """Turn errors from foreign or damaged contents into one error that names the place.

    What files must hold is checked where they are read; this is for all that a file can hold besides. The message
    reports where in gapbeam it showed, so that an error of ours is not taken for one of the file.

    Args:
        places: Files or folders that are read meanwhile.
        into: File or folder that is written meanwhile; None: one of the places.

    Raises:
        ResultsError: Instead of any error without an exit status of its own.
        OSError: A disk is full; it has a place.
    """
    place = Path(" or ".join(map(str, places)))
    try:
        yield
    except OSError as fault:
        if hasattr(fault, "exit_status"):
            raise
        if fault.errno in FULL:  # it writes a picture or a report of the files
            fault.filename = fault.filename or str(into or place)
            raise
        raise ResultsError(
            Path(fault.filename) if isinstance(fault.filename, str) else place,
            found=printable(fault.strerror or fault)[:_LONGEST],
            expected="files that can be read, and a folder that can be written",
            remedy="look at permissions and free space, or choose another `output=`",
        ) from fault
    except Exception as fault:  # of any of the libraries that read and draw
        if hasattr(fault, "exit_status") or hasattr(fault, "exit_code"):
            raise
        frames = traceback.extract_tb(fault.__traceback__)
        ours = [frame for frame in frames if "postprocess" in frame.filename] or list(frames)
        shown = printable(f"{type(fault).__name__}: {fault}")[:_LONGEST]
        raise ResultsError(
            place,
            found=f"contents that do not go together ({shown}; at {Path(ours[-1].filename).name}:{ours[-1].lineno})",
            expected="files as gapbeam wrote them",
            remedy="repeat what wrote them; if they are as gapbeam wrote them, this is an error of gapbeam: report it",
        ) from fault


def printable(text: object) -> str:
    """Return a text as it may be shown: control characters of a file do not reach the terminal."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode("ascii") for one in str(text))


_SPARE = 64 * 2**20  # bytes: room that is reserved but not yet written
_DEEPEST = 8
_MOST = 1_000_000  # datasets


def check_hdf5(path: Path, file: h5py.File) -> None:
    """Refuse links to other files, data that lie in them, and data that are larger than the file.

    gapbeam writes neither links nor compressed data, so whatever is read fits in about the size of the file.

    Args:
        path: Path of the file, for the message.
        file: The same, open.

    Raises:
        ResultsError: The file has such an entry.
    """
    size = os.fstat(file.id.get_vfd_handle()).st_size  # another file may stand in its place by now
    room = 2 * size + _SPARE
    needed = 0
    for count, (name, data) in enumerate(_datasets(path, file, 0)):
        needed += data.size * data.dtype.itemsize if data.shape is not None else 0
        if data.external or data.is_virtual:
            raise _refused(path, f"{name}, whose data lie in another file", "data in the file itself")
        if needed > room or count > _MOST:
            found = f"{name} of {printable(data.shape)}, in a file of {size} bytes"
            raise _refused(path, found, "data that are all there")


def _datasets(path: Path, group: h5py.Group, depth: int) -> Iterator[tuple[str, h5py.Dataset]]:
    if depth > _DEEPEST:
        raise _refused(path, f"more than {_DEEPEST} groups within each other", "datasets, some of them in a group")
    for key in group:
        name = printable(f"{group.name.rstrip('/')}/{key}")
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            raise _refused(path, f"{name}, a link to somewhere else", "data in the file itself")
        entry = group[key]
        if isinstance(entry, h5py.Dataset):
            yield name, entry
        elif isinstance(entry, h5py.Group):
            yield from _datasets(path, entry, depth + 1)


def _refused(path: Path, found: str, expected: str) -> ResultsError:
    return ResultsError(path, found, f"{expected}, as gapbeam writes them", "repeat the run that wrote it")


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
        OSError: The file cannot be read.
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
        points: Points of curve.json.
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
        points: Points of one branch.
    """
    between = [(last if first["event"] else first)["stable"] for first, last in pairwise(points)]
    start = 0
    for stable, part in groupby(between):
        stop = start + len(list(part))
        yield stable, slice(start, stop + 1)
        start = stop
