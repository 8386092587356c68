"""history.h5: labeled time histories that xarray opens, written by rank 0 in blocks."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from solver.operators import Array
from solver.output.records import FORMAT_VERSION, HISTORY

BLOCK = 256  # records kept in memory between writes


class HistoryWriter:
    """Appends records to a netCDF-like HDF5 file with dimension scales.

    Args:
        path: File to create.
        labels: Names along each labeled dimension: probe, component, face, load.
    """

    def __init__(self, path: Path, labels: dict[str, tuple[str, ...]]) -> None:
        self._file = h5py.File(path, "w")
        self._file.attrs["format"] = FORMAT_VERSION
        self._rows: list[dict[str, Array]] = []
        self._waiting = 0
        self._length = 0
        self._create(labels)

    def _create(self, labels: dict[str, tuple[str, ...]]) -> None:
        time = self._file.create_dataset("time", (0,), "f8", maxshape=(None,), chunks=(BLOCK,))
        time.attrs["units"], time.attrs["long_name"] = "s", "time"
        time.make_scale("time")
        for dimension, names in labels.items():
            if names:
                scale = self._file.create_dataset(dimension, data=list(names), dtype=h5py.string_dtype())
                scale.make_scale(dimension)
        for record in HISTORY:
            shape = tuple(len(labels[dimension]) for dimension in record.dims[1:])
            if 0 in shape:
                continue
            data = self._file.create_dataset(
                record.name, (0, *shape), "f8", maxshape=(None, *shape), chunks=(BLOCK, *shape)
            )
            data.attrs["units"], data.attrs["long_name"] = record.unit, record.meaning
            for axis, dimension in enumerate(record.dims):
                data.dims[axis].attach_scale(self._file[dimension])
        self._file.flush()

    def append(self, rows: dict[str, Array]) -> None:
        """Add records: `time` and every variable of `records.HISTORY`, each with a leading axis of times."""
        self._rows.append(rows)
        self._waiting += len(rows["time"])
        if self._waiting >= BLOCK:
            self.flush()

    def flush(self) -> None:
        """Bring every record so far to the file."""
        if not self._rows:
            return
        end = self._length + self._waiting
        for name, data in self._file.items():
            if name == "time" or "time" in [scale.keys()[0] for scale in data.dims if len(scale)]:
                data.resize(end, axis=0)
                data[self._length : end] = np.concatenate([rows[name] for rows in self._rows])
        self._length = end
        self._rows.clear()
        self._waiting = 0
        self._file.flush()

    def close(self) -> None:
        """Write what is left and close."""
        self.flush()
        self._file.close()
