"""HDF5 files of the same shape, of which HDF5 writes one and the others are copies with other numbers.

What HDF5 writes around the numbers is the same in each, and takes ten times the time of the numbers. So one file is
made in memory, the places of the numbers in it are asked for, and every file is one write of these bytes.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.run.output.atomic_files import new_file
from gapbeam.solver.system.operators import Array


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
            OSError: It could not be written.
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
