"""The folder `fields`: files of one or more fields each, which are not gathered in fields.h5 yet."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

import h5py

from gapbeam.solver.errors import UserError
from gapbeam.solver.record_table import FIELD_FOLDER
from gapbeam.solver.run.output.atomic_files import own_folder, to_disk
from gapbeam.solver.run.output.field_grid import FieldGrid, dataset
from gapbeam.solver.run.output.hdf5_contents import refuse_other_data
from gapbeam.solver.run.output.repeated_hdf5 import RepeatedFile
from gapbeam.solver.system.operators import Array

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
            OSError: It could not be written.
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
            UserError: One is missing, or is not one of this mesh.
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
        for start, count in zip(self._starts, self._counts, strict=True):
            with h5py.File(self.path(start), "r") as piece:
                for name in self._grid.names:
                    for at in range(min(count, end - start)):
                        piece.copy(dataset(name, at), whole[name], str(start + at))

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
