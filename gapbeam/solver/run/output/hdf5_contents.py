"""Check of the contents of an HDF5 file before any of it is read: only what a run writes is accepted."""

from __future__ import annotations

from collections.abc import Mapping

import h5py
import numpy as np

Shape = tuple[int | None, ...]  # None: any length


def refuse_other_data(file: h5py.File, shapes: Mapping[str, Shape], along_time: bool = False) -> None:
    """Refuse data of another shape or type, that lie in other files, or are not all there.

    Args:
        file: The file, open.
        shapes: Shape of each dataset of numbers, by name.
        along_time: Whether they must be marked as having a row for every time of the file, as long as that.

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
