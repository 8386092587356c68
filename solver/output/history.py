"""history.h5: labeled time histories that xarray opens, written by rank 0.

Records go to a file beside it, which takes its place whenever a checkpoint is written and at the end: whatever happens
to the run, `history.h5` is whole, and holds at least the records up to the last checkpoint.
"""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np

from solver.errors import UserError
from solver.operators import Array
from solver.output.records import FORMAT_VERSION, HISTORY
from solver.output.storage import Sink, put_in_place, written

BLOCK = 256  # records kept in memory between writes
PART = ".part"


class HistoryWriter:
    """Appends records to a netCDF-like HDF5 file with dimension scales.

    Args:
        path: File to create, or to go on with.
        labels: Names along each labeled dimension: probe, component, face, load.
        kept: Records of the file to keep and go on after; None: make a new file.

    Raises:
        UserError: The file to go on with cannot be read, or holds fewer records.
        NotWritten: The file cannot be written.
    """

    def __init__(self, path: Path, labels: dict[str, tuple[str, ...]], kept: int | None = None) -> None:
        self._path, self._part = path, path.with_name(path.name + PART)
        self._rows: list[dict[str, Array]] = []
        self._waiting = 0
        self._length = kept or 0
        if kept is None:
            with written(self._part):
                self._open("w+b", "w")
                self._create(labels)
        else:
            self._go_on(kept)

    @property
    def records(self) -> int:
        """How many records there are so far."""
        return self._length + self._waiting

    def _create(self, labels: dict[str, tuple[str, ...]]) -> None:
        self._file.attrs["format"] = FORMAT_VERSION
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

    def _go_on(self, kept: int) -> None:
        try:
            with h5py.File(self._path, "r") as stored:
                there = min(len(data) for data in self._along_time(stored).values())
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            raise UserError(f"{self._path} cannot be read ({error}); start again with --overwrite") from error
        if there < kept:
            raise UserError(
                f"{self._path} holds {there} records; expected at least {kept}, those up to the checkpoint; "
                "start again with --overwrite"
            )
        with written(self._part):
            shutil.copyfile(self._path, self._part)
            self._open("r+b", "r+")
            for data in self._along_time(self._file).values():
                data.resize(kept, axis=0)

    @staticmethod
    def _along_time(file: h5py.File) -> dict[str, h5py.Dataset]:
        def has_time(data: h5py.Dataset) -> bool:
            return "time" in [scale.keys()[0] for scale in data.dims if len(scale)]

        return {name: data for name, data in file.items() if name == "time" or has_time(data)}

    def append(self, rows: dict[str, Array]) -> None:
        """Add records: `time` and every variable of `records.HISTORY`, each with a leading axis of times.

        Raises:
            NotWritten: They could not be written.
        """
        self._rows.append(rows)
        self._waiting += len(rows["time"])
        if self._waiting >= BLOCK:
            self.flush()

    def flush(self) -> None:
        """Bring every record so far to the file that is written beside."""
        if not self._rows:
            return
        end = self._length + self._waiting
        with written(self._part):
            for name, data in self._along_time(self._file).items():
                data.resize(end, axis=0)
                data[self._length : end] = np.concatenate([rows[name] for rows in self._rows])
            self._file.flush()
            self._sink.check()
        self._length = end
        self._rows.clear()
        self._waiting = 0

    def commit(self) -> None:
        """Make history.h5 what has been recorded so far, on the disk, and go on."""
        self.close()
        with written(self._part):
            shutil.copyfile(self._path, self._part)
            self._open("r+b", "r+")

    def close(self) -> None:
        """Make history.h5 what has been recorded so far, on the disk, and close it."""
        self.flush()
        with written(self._path):
            self._file.close()
            self._sink.check()
            self._sink.close()
            put_in_place(self._part, self._path)

    def abandon(self) -> None:
        """Leave history.h5 as it was last put in place."""
        with suppress(OSError, RuntimeError, ValueError):
            self._file.close()
        with suppress(OSError):
            self._sink.close()
            self._part.unlink()

    def _open(self, mode: str, access: str) -> None:
        self._sink = Sink(self._part, mode)
        self._file = h5py.File(self._sink, access)
