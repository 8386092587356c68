"""HDF5 files of fields: written as copies of one, gathered in a document that grows, and checked before they are read.

The folder `fields` has files of one or more fields each, which are not gathered in fields.h5 yet.

Files of the same shape are copies of one that HDF5 wrote, with other numbers.

What HDF5 writes around the numbers is the same in each, and takes ten times the time of the numbers. So one file is
made in memory, the places of the numbers in it are asked for, and every file is one write of these bytes.

During a run fields.xdmf grows in place and is whole at any moment.

What comes behind the end of an XML document may be a processing instruction, whose text is not looked at:

    HEAD grid ... grid TAIL<?room                                     ?>

A further grid is written into that room first, with another `TAIL<?room ` behind it. Then the first `TAIL<?room `,
which lies within one sector, is overwritten with blanks. A process that is killed in between leaves the document as it
was. Where there is no room left, the document is written anew beside itself with room for as much again.
"""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.output.atomic_files import new_file, own_folder, to_disk
from gapbeam.solver.run.output.parallel_tables import FieldGrid, dataset
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.schema.record_table import FIELD_FOLDER
from gapbeam.solver.system.operators import Array

Shape = tuple[int | None, ...]  # None: any length


def refuse_other_data(file: h5py.File, shapes: Mapping[str, Shape], along_time: bool = False) -> None:
    """Refuse data of another shape or type, data in other files, and incomplete data.

    Args:
        file: The file, open.
        shapes: Shape of each dataset of numbers, by name.
        along_time: True if each must be marked as having a row for every time of the file.

    Raises:
        ValueError: Something is missing or of another kind; with its name, what was found and expected.
    """
    for name, shape in shapes.items():
        if not isinstance(file.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{name} is missing, or a link")
        data = file[name]
        if not isinstance(data, h5py.Dataset) or data.is_virtual or data.external:
            raise ValueError(f"{name} is a group, or lies in other files")
        if data.dtype.kind not in "fi":
            raise ValueError(f"{name} holds {data.dtype}, expected numbers")
        fits = len(data.shape) == len(shape) and all(
            wanted in (None, found) for wanted, found in zip(shape, data.shape, strict=True)
        )
        if not fits:
            raise ValueError(f"{name} has the shape {data.shape}, expected {shape}")
        if data.id.get_storage_size() < np.prod(data.shape, dtype=float) * data.dtype.itemsize:
            raise ValueError(f"{name} is not all there")
        if along_time and name != "time" and not _has_time(file, data):
            raise ValueError(f"{name} does not belong to the times of the file")


def _has_time(file: h5py.File, data: h5py.Dataset) -> bool:
    try:
        return bool(data.dims[0][0] == file["time"]) and data.maxshape[0] is None and file["time"].maxshape[0] is None
    except (KeyError, RuntimeError, IndexError, OSError):
        return False


class RepeatedFile:
    """A file that is written again and again with other numbers.

    Args:
        shapes: Shape of each dataset of double precision, by name; groups stand before their names, with a slash.
    """

    def __init__(self, shapes: Mapping[str, tuple[int, ...]]) -> None:
        with h5py.File("in memory", "w", driver="core", backing_store=False) as file:
            found = _new_datasets(file, shapes)
            file.flush()
            places = {name: one.get_offset() for name, one in found.items()}
            self._bytes = bytearray(file.id.get_file_image())
        self._numbers: dict[str, NDArray[np.float64]] = {
            name: np.frombuffer(self._bytes, count=int(np.prod(shape)), offset=places[name] or 0).reshape(shape)
            for name, shape in shapes.items()
        }

    def write(self, path: Path, pieces: Callable[[str], Iterable[Array]]) -> None:
        """Write a file.

        Args:
            path: The file; it is removed where it could not be written.
            pieces: Rows of a dataset, in their order.

        Raises:
            OSError: The file could not be written.
        """
        for name, numbers in self._numbers.items():
            begin = 0
            for piece in pieces(name):
                numbers[begin : begin + len(piece)] = piece
                begin += len(piece)
        place = new_file(path)
        try:
            rest = memoryview(self._bytes)
            while len(rest):
                rest = rest[os.write(place, rest) :]
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        finally:
            os.close(place)


def _new_datasets(file: h5py.File, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, h5py.h5d.DatasetID]:
    """Make datasets whose room is in the file at once; h5py itself takes several times as long for each."""
    created, links = h5py.h5p.create(h5py.h5p.DATASET_CREATE), h5py.h5p.create(h5py.h5p.LINK_CREATE)
    created.set_obj_track_times(False)
    created.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    created.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    links.set_create_intermediate_group(True)
    double = h5py.h5t.IEEE_F64LE
    return {
        name: h5py.h5d.create(file.id, name.encode(), double, h5py.h5s.create_simple(shape), created, links)
        for name, shape in shapes.items()
    }


AT_ONCE = 16  # fields of a file, at most


class FieldPieces:
    """The files, each named after its first field.

    Args:
        folder: Results folder.
        grid: Common parts of all fields.
    """

    def __init__(self, folder: Path, grid: FieldGrid) -> None:
        self._folder, self._grid = folder / FIELD_FOLDER, grid
        self._starts: list[int] = []  # number of the first field of each file
        self._counts: list[int] = []  # its fields
        self._forms: dict[int, RepeatedFile] = {}  # by how many fields a file has

    def write(self, first: int, count: int, pieces: Callable[[str], Iterable[Array]]) -> None:
        """Write a file.

        Args:
            first: Number of its first field.
            count: Its fields.
            pieces: Rows of the values of a quantity, by `dataset` with the number in the file.

        Raises:
            OSError: The file could not be written.
        """
        path = self.path(first)
        own_folder(path.parent)
        if count not in self._forms:
            self._forms[count] = RepeatedFile(self._shapes(count))
        part = path.with_suffix(".part")
        self._forms[count].write(part, pieces)
        part.replace(path)
        self._enter(first, count)

    def find(self, first: int, end: int) -> None:
        """Find the files of fields that were written before.

        Args:
            first: Number of the first field.
            end: The number after the last one.

        Raises:
            UserError: A file is missing, or belongs to another mesh.
        """
        while first < end:
            path = self.path(first)
            if not path.is_file():
                raise UserError(f"{path} is missing, a field before the checkpoint; start anew with `overwrite=True`")
            count = self._counted(path)
            self._enter(first, count)
            first += count

    def path(self, first: int) -> Path:
        """Return the file whose first field has a number."""
        return self._folder / f"{first:06d}.h5"

    def place(self, number: int) -> tuple[str, int]:
        """Return the file of a field, relative to the results folder, and the number of the field in it."""
        start = self._starts[bisect_right(self._starts, number) - 1]
        return f"{self._folder.name}/{self.path(start).name}", number - start

    def to_disk(self, first: int) -> None:
        """Wait until all files from a field on are on the disk."""
        for start in self._starts[max(0, bisect_right(self._starts, first) - 1) :]:
            to_disk(self.path(start))

    def cut(self, end: int) -> None:
        """Remove files of fields from a number on, which a march left that had come further."""
        for path in self._folder.glob("*.h5"):
            if path.stem.isdecimal() and int(path.stem) >= end:
                path.unlink()

    def copy_into(self, whole: h5py.File, end: int) -> None:
        """Copy all fields before a number to one file, by their number among all."""
        groups = {name: whole[name].id for name in self._grid.names}
        for start, count in zip(self._starts, self._counts, strict=True):
            with h5py.File(self.path(start), "r") as piece:
                for name, group in groups.items():
                    for at in range(min(count, end - start)):
                        h5py.h5o.copy(piece.id, dataset(name, at).encode(), group, str(start + at).encode())

    def remove(self) -> None:
        """Remove the files, and the folder if it is empty then."""
        with suppress(OSError):
            for start in self._starts:
                self.path(start).unlink()
            self._folder.rmdir()
        self._starts, self._counts = [], []

    def _shapes(self, count: int) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the values in a file of so many fields."""
        return {dataset(name, at): self._grid.shape(name) for at in range(count) for name in self._grid.names}

    def _enter(self, first: int, count: int) -> None:
        self._starts.append(first)
        self._counts.append(count)

    def _counted(self, path: Path) -> int:
        """Return the number of fields in a file; refuse one that is not of this mesh."""
        try:
            with h5py.File(path, "r") as file:
                count = len(file[self._grid.names[0]])
                refuse_other_data(file, self._shapes(count))
        except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
            raise UserError(f"{path} cannot be read ({error}); start again with `overwrite=True`") from error
        if not count:
            raise UserError(f"{path} holds no field; start again with `overwrite=True`")
        return count


HEAD = (
    '<?xml version="1.0" encoding="utf-8"?>\n'
    '<Xdmf Version="3.0"><Domain><Grid Name="gapbeam" GridType="Collection" CollectionType="Temporal">'
)
TAIL = "</Grid></Domain></Xdmf>"
SWITCH = f"{TAIL}<?room "
END = "?>\n"
ROOM = 2**16  # bytes, at least
SECTOR = 512


class GrowingSeries:
    """An XDMF file to which grids are added.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._switch = self._end = 0  # where SWITCH and END are, bytes

    def write(self, grids: Sequence[str]) -> None:
        """Write the document anew, with room behind it.

        Raises:
            OSError: The document could not be written; the one before it is unchanged.
        """
        body = HEAD + "".join(grids)
        self._switch = _within_a_sector(len(body.encode()))
        body += " " * (self._switch - len(body.encode())) + SWITCH
        room = " " * max(ROOM, len(body))
        write_beside(self._path, body + room + END)
        self._end = len(body.encode()) + len(room)

    def add(self, grids: Sequence[str], count: int = 1) -> None:
        """Add the last ones of all grids.

        Args:
            grids: All.
            count: Number of new ones.

        Raises:
            OSError: The document could not be written, and is unchanged.
        """
        begin, grid = self._switch + len(SWITCH), "".join(grids[-count:]).encode()
        switch = _within_a_sector(begin + len(grid))
        if switch + len(SWITCH) > self._end:
            self.write(grids)
            return
        text = grid.ljust(switch - begin) + SWITCH.encode()
        place = os.open(self._path, os.O_WRONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
        try:
            for at, part in ((begin, text), (self._switch, b" " * len(SWITCH))):
                if os.pwrite(place, part, at) < len(part):
                    raise OSError("no room on the disk")
        finally:
            os.close(place)
        self._switch = switch

    def finish(self, grids: Sequence[str]) -> None:
        """Write the document as it stays.

        Raises:
            OSError: The document could not be written; the one before it is unchanged.
        """
        write_beside(self._path, f"{HEAD}{''.join(grids)}{TAIL}\n")


def _within_a_sector(place: int) -> int:
    """Return the first place from one on where SWITCH lies in one sector of the disk."""
    return place if place % SECTOR + len(SWITCH) <= SECTOR else -(-place // SECTOR) * SECTOR
