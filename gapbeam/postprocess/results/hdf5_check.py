"""Contents that the HDF5 files of results may have: plain datasets in the file itself, no larger than the file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import h5py

from gapbeam.postprocess.results.damaged_files import printable
from gapbeam.postprocess.results_errors import ResultsError

_SPARE = 64 * 2**20  # bytes: room that is reserved but not yet written
_DEEPEST = 8
_MOST = 1_000_000  # datasets


def check_hdf5(path: Path, file: h5py.File) -> None:
    """Refuse links to other files, data that lie in them, and data that are larger than what is on disk.

    gapbeam writes neither links nor compressed data, so whatever is read fits in about the size of the file.

    Args:
        path: Of the file, for the message.
        file: The same, open.

    Raises:
        ResultsError: There is such an entry.
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
