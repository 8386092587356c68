"""Records on disk, written by rank 0: histories in history.h5, which xarray opens, and contact points in points.csv.

While a run goes on, what every checkpoint adds is put in place as a piece in the folder `history`, when it is whole
and on the disk; a piece that is small yet is continued instead. At the end all pieces are gathered in history.h5. So a
checkpoint costs what is new, and whatever happens to the run, the records up to the last checkpoint can be read.

The table points.csv has the contact of each point in a run, one point a line.

First touch, time in contact and largest penetration are those at the instants of the records. The angle is defined as
in wear.csv. Cells of what is not known are empty: the first touch of a point that was never in contact at a record, and
the impulses of a face that was pressed between records only, or that yields.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gapbeam.solver.case.figure_table import Figure, figure_values
from gapbeam.solver.diagnostics.contact_episodes import ImpactList
from gapbeam.solver.diagnostics.point_contact import PointContact
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.run.output.atomic_files import Sink, copy_beside, own_folder, part_of, put_in_place, written
from gapbeam.solver.run.output.hdf5_files import Shape, refuse_other_data
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.run.output.wear_file import angles
from gapbeam.solver.schema.record_table import (
    FIELDS_DATA_FILE,
    FORMAT_VERSION,
    HISTORY,
    HISTORY_FILE,
    HISTORY_FOLDER,
    IMPACT_COLUMNS,
    IMPACTS_FILE,
    POINT_COLUMNS,
    POINTS_FILE,
    history_pieces,
    unit_of_places,
)
from gapbeam.solver.system.operators import Array

BLOCK = 1024  # records that lie side by side in a file
KEPT = 2**13  # records kept in memory between writes, at most
KEPT_BYTES = 2**23  # their size at most, where that leaves LEAST_KEPT of them
LEAST_KEPT = 256
GATHERED = 2**14  # records copied at once
SMALL = 2**20  # bytes of a piece that is continued


class HistoryWriter:
    """Appends records to a netCDF-like HDF5 file with dimension scales.

    Args:
        folder: Results folder.
        labels: Names along each labeled dimension: probe, component, face, load.
        kept: Records there to keep and go on after; None: make a new history. Files change with the first record.
        variables: Names of the variables that are recorded; None: all of `records.HISTORY`.

    Raises:
        UserError: The records to go on after cannot be read, or are fewer.
    """

    def __init__(
        self, folder: Path, labels: dict[str, tuple[str, ...]], kept: int | None = None,
        variables: Collection[str] | None = None,
    ) -> None:  # fmt: skip
        self._folder, self._labels = folder, labels
        self._shapes = _shapes(labels, variables)
        self._rows: list[dict[str, Array]] = []
        self._waiting = 0
        self._length, self._begun = kept or 0, False
        self._first = 0  # record of the file that is written
        self._file: h5py.File | None = None
        self._columns: dict[str, h5py.Dataset] = {}  # of the file that is written
        self._sink: Sink
        self._target = folder / HISTORY_FILE
        if kept is not None:
            _check_there(folder, kept, self._shapes)

    @property
    def records(self) -> int:
        """Number of records so far."""
        return self._length + self._waiting

    def append(self, rows: dict[str, Array]) -> None:
        """Add records: `time` and every variable of `records.HISTORY`, each with a leading axis of times.

        Raises:
            NotWritten: The records could not be written.
        """
        self._rows.append(rows)
        self._waiting += len(rows["time"])
        size = sum(values.nbytes for values in rows.values()) // max(len(rows["time"]), 1)
        if self._waiting >= min(KEPT, max(LEAST_KEPT, KEPT_BYTES // max(size, 1))):
            self.flush()

    def flush(self) -> None:
        """Write every record so far to the temporary file."""
        if not self._rows:
            return
        end = self._length + self._waiting
        with written(part_of(self._target)):
            file = self._file or self._begin()
            for name, data in self._columns.items():
                data.resize(end - self._first, axis=0)
                data[self._length - self._first :] = np.concatenate([rows[name] for rows in self._rows])
            file.flush()
            self._sink.check()
        self._length = end
        self._rows.clear()
        self._waiting = 0

    def commit(self) -> None:
        """Commit the records so far to the disk."""
        self.flush()
        if self._file is None:
            return
        with written(self._target):
            file, self._file, self._columns = self._file, None, {}
            self._put(file, self._target)

    def close(self) -> None:
        """Make history.h5 all that has been recorded, on the disk."""
        self.commit()
        (_, whole), *pieces = history_pieces(self._folder)
        if not pieces or not self._begun:
            return
        with written(whole):
            self._sink = Sink(copy_beside(whole), new=False)
            file = self._file = h5py.File(self._sink, "r+")
            ends = [first for first, _ in pieces[1:]] + [self._length]
            columns = along_time(file)
            _resize(columns, pieces[0][0])
            for (first, path), end in zip(pieces, ends, strict=True):
                _copy(path, columns, min(end, self._length) - first)
            self._file = None
            self._put(file, whole)
        for _, path in pieces:  # in order: those that are left go on after what was gathered
            with suppress(OSError):
                path.unlink()
        with suppress(OSError):
            (self._folder / HISTORY_FOLDER).rmdir()

    def abandon(self) -> None:
        """Leave the records as they were last put in place."""
        self._rows.clear()
        self._waiting = 0
        if self._file is not None:
            with suppress(OSError, RuntimeError, ValueError):
                self._file.close()
            self._file, self._columns = None, {}
        with suppress(OSError, AttributeError):
            self._sink.close()
            part_of(self._target).unlink()

    def _begin(self) -> h5py.File:
        """Open a file to write to: the last piece where it is small, a new one elsewhere."""
        self._first, self._target = 0, self._folder / HISTORY_FILE
        begun, self._begun = self._begun, True
        if self._length == 0:
            return self._open_new()
        if not begun:
            self._cut()
        first, path = history_pieces(self._folder)[-1]
        if path.stat().st_size <= SMALL:
            self._first, self._target = first, path
            self._sink = Sink(copy_beside(path), new=False)
            self._file = h5py.File(self._sink, "r+")
            self._columns = along_time(self._file)
            _resize(self._columns, self._length - first)
            return self._file
        own_folder(self._folder / HISTORY_FOLDER)
        self._first, self._target = self._length, self._folder / HISTORY_FOLDER / f"{self._length:012d}.h5"
        return self._open_new()

    def _cut(self) -> None:
        """Remove records of a march that had come further than the start of this one, the last piece first."""
        for first, path in reversed(history_pieces(self._folder)[1:]):
            if first >= self._length:
                path.unlink()
        for part in (self._folder / HISTORY_FOLDER).glob("*.h5.part"):
            part.unlink()

    def _open_new(self) -> h5py.File:
        self._sink = Sink(part_of(self._target), new=True)
        self._file = h5py.File(self._sink, "w")
        self._columns = _create(self._file, self._labels, self._shapes)
        return self._file

    def _put(self, file: h5py.File, path: Path) -> None:
        """Close the temporary file, and put it in place."""
        file.close()
        self._sink.check()
        self._sink.close()
        put_in_place(part_of(path), path)


def along_time(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return the data sets with a row for every record, by name."""
    dims = {name: [scale.keys()[0] for scale in data.dims if len(scale)] for name, data in file.items()}
    return {name: data for name, data in file.items() if name == "time" or "time" in dims[name]}


def _create(
    file: h5py.File, labels: dict[str, tuple[str, ...]], shapes: Mapping[str, Shape]
) -> dict[str, h5py.Dataset]:
    """Make all datasets of a file; return those along time, by name."""
    file.attrs["format"] = FORMAT_VERSION
    time = file.create_dataset("time", (0,), "f8", maxshape=(None,), chunks=(BLOCK,))
    time.attrs["units"], time.attrs["long_name"] = "s", "time"
    time.make_scale("time")
    scales = {"time": time}
    for dimension, names in labels.items():
        if names:
            scales[dimension] = file.create_dataset(dimension, data=list(names), dtype=h5py.string_dtype())
            scales[dimension].make_scale(dimension)
    columns = {"time": time}
    for record in HISTORY:
        if record.name not in shapes:
            continue
        shape = shapes[record.name][1:]
        data = file.create_dataset(record.name, (0, *shape), "f8", maxshape=(None, *shape), chunks=(BLOCK, *shape))
        data.attrs["units"], data.attrs["long_name"] = record.unit, record.meaning
        for axis, dimension in enumerate(record.dims):
            data.dims[axis].attach_scale(scales[dimension])
        columns[record.name] = data
    return columns


def _shapes(labels: dict[str, tuple[str, ...]], variables: Collection[str] | None) -> dict[str, Shape]:
    """Return the shape of every variable along time, by name; those without entries are left out."""
    shapes: dict[str, Shape] = {
        record.name: (None, *(len(labels.get(dimension, ())) for dimension in record.dims[1:]))
        for record in HISTORY
        if variables is None or record.name in variables
    }
    return {"time": (None,)} | {name: shape for name, shape in shapes.items() if 0 not in shape}


def _check_there(folder: Path, kept: int, shapes: Mapping[str, Shape]) -> None:
    """Refuse to continue after records that are missing, or of another form."""
    pieces = history_pieces(folder)
    ends = [first for first, _ in pieces[1:]] + [kept]
    last = -np.inf  # time before a piece
    for (first, path), end in zip(pieces, ends, strict=True):
        wanted = min(end, kept) - first
        if wanted <= 0:
            continue
        try:
            with h5py.File(path, "r") as stored:
                refuse_other_data(stored, shapes, along_time=True)
                there = min(len(data) for data in along_time(stored).values())
                times = np.concatenate([[last], stored["time"][: min(there, wanted)]])
                if not np.all(np.diff(times) > 0.0) or not np.all(np.isfinite(times[1:])):
                    raise ValueError("its times do not increase")
                last = times[-1]
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            raise _unreadable(path, error) from error
        if there < wanted:
            raise UserError(
                f"{path} holds {counted(there, 'record')}; expected at least {wanted}, those up to the checkpoint; "
                "start again with `overwrite=True`"
            )


def refuse_cut(folder: Path) -> None:
    """Refuse the results of a run that is done whose histories are missing or cut, or whose fields are cut.

    Raises:
        UserError: A file cannot be read.
    """
    fields = folder / FIELDS_DATA_FILE
    for path in (folder / HISTORY_FILE, *([fields] if fields.exists() else [])):
        try:
            h5py.File(path, "r").close()
        except OSError as error:
            raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> UserError:
    return UserError(f"{path} cannot be read ({error}); start again with `overwrite=True`")


def _resize(columns: Mapping[str, h5py.Dataset], count: int) -> None:
    for data in columns.values():
        data.resize(count, axis=0)


def _copy(path: Path, columns: Mapping[str, h5py.Dataset], count: int) -> None:
    """Add the first records of a piece."""
    with h5py.File(path, "r") as piece:
        for name, data in columns.items():
            begin = len(data)
            data.resize(begin + count, axis=0)
            for first in range(0, count, GATHERED):
                taken = slice(first, min(first + GATHERED, count))
                data[begin + taken.start : begin + taken.stop] = piece[name][taken]


HEAD = ",".join(["face", *(f"{name} ({unit})" if unit else name for name, unit in POINT_COLUMNS.items())])


def write_points(folder: Path, points: PointContact | None, impulses: Array) -> None:
    """Write the results of all contact points; nothing where they were not asked for.

    Args:
        folder: Folder of the results.
        points: Contact of the points up to the end of the run.
        impulses: Impulses of the faces, (faces,), N s.

    Raises:
        NotWritten: The results could not be written.
    """
    if points is None:
        return
    names, faces = points.system.contact.face_names, points.system.contact.faces
    lines = [HEAD]
    for face, row in zip(faces, point_rows(points, impulses), strict=True):
        cells = (repr(float(cell)) if np.isfinite(cell) else "" for cell in row)
        lines.append(",".join([names[face], *cells]))
    path = folder / POINTS_FILE
    with written(path):
        write_beside(path, "\n".join(lines) + "\n")


def point_rows(points: PointContact, impulses: Array) -> Array:
    """Return the columns of `POINT_COLUMNS`, (m, 8); arguments as in `write_points`."""
    contact = points.system.contact
    x, y = contact.positions[:, 0], contact.positions[:, 1]
    found = points.shares, points.deepest, points.impulses(impulses), points.first_touch
    return np.column_stack([x, y, angles(contact), contact.surfaces, *found])


def recorded_figures(
    figures: Sequence[Figure], folder: Path, labels: Mapping[str, tuple[str, ...]]
) -> dict[str, dict[str, Any]]:
    """Return figures of one's own by name, of the history in a results folder; errors as they say.

    Args:
        figures: Figures that are asked for.
        folder: The results folder, its history closed.
        labels: Names along the dimensions of the history.
    """
    wanted = {"time", *(one.quantity for one in figures)}
    try:
        with h5py.File(folder / HISTORY_FILE, "r") as file:
            records = {name: np.asarray(file[name]) for name in wanted & set(file)}
    except OSError:
        return {}  # a history that cannot be read is reported by what reads it
    found = figure_values(figures, records, labels) if "time" in records and len(records["time"]) else {}
    for name, one in found.items():
        if one["value"] is None:
            LOG.warning("the figure %s has no value: %s", name, one["reason"])
    return found


def write_impacts(
    folder: Path, faces: Sequence[str], impacts: Sequence[ImpactList], turning: Collection[str] = ()
) -> None:
    """Write the impacts that were kept of each face, with how many each of them stands for.

    Args:
        folder: The results folder.
        faces: Names of the faces.
        impacts: Impacts of each.
        turning: Places that rotate, whose speeds are rad/s and impulses of moments.

    Raises:
        NotWritten: The impacts could not be written.
    """
    units = {name: unit_of_places(unit, faces, turning) for name, unit in IMPACT_COLUMNS.items()}
    lines = [",".join(["face", *(f"{name} ({unit})" if unit else name for name, unit in units.items())])]
    for face, kept in zip(faces, impacts, strict=True):
        lines += [f"{face},{','.join(map(repr, row))},{kept.every}" for row in kept.rows.tolist()]
    path = folder / IMPACTS_FILE
    with written(path):
        write_beside(path, "\n".join(lines) + "\n")
