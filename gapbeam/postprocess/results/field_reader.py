"""Fields of a run, read one time after the other, also during the run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any
from xml.etree import ElementTree

import h5py
import numpy as np
from meshio import CellBlock
from meshio.xdmf import TimeSeriesReader

from gapbeam.postprocess.results.bounded_files import LARGEST, check_hdf5, printable
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.schema.record_table import FIELD_FOLDER, FIELDS_DATA_FILE, STRESS_FIELDS


@dataclass(frozen=True)
class Frame:
    """The fields at one time.

    Attributes:
        time: s.
        displacement: (points, 3), m, relative to the support.
        velocity: (points, 3), m/s, relative to the support.
        contact_pressure: (points,), Pa; zero away from the contact faces.
        stress: Axial and von Mises stress, (points,) each, Pa, by name; empty where the run wrote none.
    """

    time: float
    displacement: np.ndarray
    velocity: np.ndarray
    contact_pressure: np.ndarray
    stress: Mapping[str, np.ndarray] = field(default_factory=dict)


class FieldSeries:
    """Series of fields that one state of the XML names; a run may remove its data later.

    meshio reads the time series, since the XDMF reader of VTK ends the process on one (pyvista issue 6303).

    Args:
        path: The `.xdmf` file; its data files lie beside it.

    Attributes:
        text: The XML.
        points: (points, 3), m.
        cells: Their corners, by type of cell.

    Raises:
        ResultsError: The series cannot be read.
    """

    points: np.ndarray
    cells: list[CellBlock]

    def __init__(self, path: Path) -> None:
        self._path = path
        self._open = ExitStack()
        try:
            self.text = _checked_text(path)
            self._reader = self._open.enter_context(TimeSeriesReader(path))
            self._open.enter_context(self._data_file(FIELDS_DATA_FILE))
            points, self.cells = self._reader.read_points_cells()
            self.points = _three_columns(points)
            _check_mesh(self.points, self.cells)
        except ResultsError:
            self._open.close()
            raise
        except Exception as fault:  # of three libraries
            self._open.close()
            raise self._unreadable(fault) from fault

    def __len__(self) -> int:
        """Count the times."""
        return int(self._reader.num_steps)

    def time(self, number: int) -> float:
        """Return the time of a field, s, from the XML alone; not-a-number where it names none.

        Args:
            number: 0 for the first time.
        """
        named = self._reader.collection[number].find("Time")
        try:
            return math.nan if named is None else float(named.get("Value", "nan"))
        except ValueError:
            return math.nan

    def close(self) -> None:
        """Close the data file."""
        self._open.close()

    def frame(self, number: int) -> Frame:
        """Read the fields at one time.

        Args:
            number: 0 for the first time.

        Raises:
            ResultsError: The data are not there, or do not fit the mesh.
        """
        try:
            time, data = self._data(number)
            frame = Frame(
                time=float(time),
                displacement=_three_columns(data["displacement"]),
                velocity=_three_columns(data["velocity"]),
                contact_pressure=np.asarray(data["contact_pressure"], dtype=float).reshape(-1),
                stress={
                    name: np.asarray(data[name], dtype=float).reshape(-1) for name in STRESS_FIELDS if name in data
                },
            )
        except ResultsError:
            raise
        except Exception as fault:  # of three libraries
            raise self._unreadable(fault) from fault
        scalars = (frame.contact_pressure, *frame.stress.values())
        if not all(np.isfinite(values).all() for values in (frame.displacement, *scalars)):
            raise self._unreadable(ValueError(f"values that are not finite at t = {frame.time:g} s"))
        fit = all(values.shape == self.points.shape[:1] for values in scalars)
        if frame.displacement.shape != self.points.shape or not fit:
            raise self._unreadable(ValueError(f"fields that do not fit the mesh at t = {frame.time:g} s"))
        return frame

    def _data(self, number: int) -> tuple[float, dict[str, Any]]:
        """Return a time and its data, of a file that is open no longer than that takes."""
        items = self._reader.collection[number].iterfind("Attribute/DataItem")
        names = {_file_of(item) for item in items} - {FIELDS_DATA_FILE}
        with ExitStack() as files:
            for name in names:
                files.enter_context(self._data_file(name))
            time, data, _ = self._reader.read_data(number)
        return time, data

    @contextmanager
    def _data_file(self, name: str) -> Iterator[None]:
        """Open a file where meshio looks for it: a run that goes on holds a lock that h5py would respect there."""
        path = self._path.resolve().parent / name
        if not path.is_file():
            raise FileNotFoundError(f"{name} is not there, or is no plain file")
        with h5py.File(path, "r", locking=False) as file:
            check_hdf5(path, file)
            self._reader.hdf5_files[path] = file
            try:
                yield
            finally:
                del self._reader.hdf5_files[path]

    def _unreadable(self, fault: Exception) -> ResultsError:
        return ResultsError(
            self._path,
            found=f"fields that cannot be read ({printable(f'{type(fault).__name__}: {fault}')[:200]})",
            expected="a temporal collection with displacement, velocity and contact_pressure at the points",
            remedy="if the run goes on or was killed, wait or resume it; else repeat it",
        )


def _checked_text(path: Path) -> str:
    """Refuse an XML file that is large, expands itself, or takes data from elsewhere than the HDF5 files beside it."""
    if path.stat().st_size > LARGEST:
        raise ValueError(f"{path.stat().st_size} bytes of XML, more than {LARGEST}")
    text = path.read_text(encoding="utf-8")
    if "<!" in text.replace("<!--", ""):
        raise ValueError("a document type or entities")
    for entry in ElementTree.fromstring(text).iter():
        if entry.tag.endswith("include") and "xpointer" not in entry.attrib:
            raise ValueError("an inclusion of another file")
        words = (entry.text or "").strip()
        if entry.tag == "DataItem" and not (entry.get("Format") == "HDF" and _is_ours(path.parent, entry)):
            raise ValueError(f"data from {words[:60]!r}; expected them from {FIELDS_DATA_FILE}")
    return text


def _check_mesh(points: np.ndarray, cells: list[CellBlock]) -> None:
    """Refuse cells with corners that are no points, and places that are not finite."""
    if not np.isfinite(points).all():
        raise ValueError("points that are not finite")
    for block in cells:
        corners = np.asarray(block.data)
        if corners.dtype.kind not in "iu" or corners.ndim != 2:
            raise ValueError(f"corners of cells of type {corners.dtype} and shape {corners.shape}")
        if corners.size and not (corners.min() >= 0 and corners.max() < len(points)):
            raise ValueError(f"corners from {corners.min()} to {corners.max()}, and {len(points)} points")


def _three_columns(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.ndim != 2 or not 1 <= values.shape[1] <= 3:
        raise ValueError(f"values of shape {values.shape}; expected two or three columns")
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def _file_of(item: ElementTree.Element) -> str:
    """Return the file that an item takes its data from, a name relative to the folder of the XML file."""
    return (item.text or "").strip().partition(":")[0]


def _is_ours(folder: Path, item: ElementTree.Element) -> bool:
    """Return whether data lie in the HDF5 file of the fields, or in those of a run that has not ended yet."""
    name, place = _file_of(item), (item.text or "").strip().partition(":")[2]
    own = name == FIELDS_DATA_FILE or re.fullmatch(rf"{FIELD_FOLDER}/[0-9]+\.h5", name) is not None
    return own and place.startswith("/") and not (folder / name).is_symlink()


__all__ = ["Fields", "Frame"]

READINGS = 5
"""Attempts to read a field that a run moves from one file to another: once at its end, once more when resumed."""


class Fields:
    """Reader of `fields.xdmf`; a context manager that closes the data file.

    It has the times that were there when it was opened. A run that goes on gathers its fields in another file, and one
    that is resumed takes back those after its checkpoint: where data are gone, the series is opened anew.

    Attributes:
        path: The `.xdmf` file.
        points: (points, 3), m.
        cells: Their corners, by type of cell.
    """

    def __init__(self, path: Path) -> None:
        """Open the series.

        Args:
            path: The `.xdmf` file; its `.h5` file lies beside it.

        Raises:
            ResultsError: The series cannot be read.
        """
        self.path = path
        self._series = FieldSeries(path)
        self._count = len(self._series)
        self.points: np.ndarray = self._series.points
        self.cells: list[CellBlock] = self._series.cells

    def __enter__(self) -> Fields:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the data file."""
        self._series.close()

    def __len__(self) -> int:
        """Count the times that were there when the series was opened."""
        return self._count

    def __iter__(self) -> Iterator[Frame]:
        """Read the frames in order of time."""
        return (self.frame(index) for index in range(len(self)))

    @cached_property
    def dimension(self) -> int:
        """2 for plane cells, 3 for solids."""
        return 3 if any(block.type in ("tetra", "hexahedron") for block in self.cells) else 2

    @property
    def times(self) -> np.ndarray:
        """The times of all fields, (fields,), s, from the XML alone; not-a-number where it names none."""
        return np.array([self._series.time(number) for number in range(min(len(self), len(self._series)))])

    def frame(self, index: int) -> Frame:
        """Read the fields at one time.

        Args:
            index: 0 for the first time, -1 for the last.

        Raises:
            ResultsError: The data are not there (a run killed while it wrote), do not fit the mesh, or were taken back
                by a resume since the series was opened.
        """
        number = range(len(self))[index]
        for _ in range(READINGS - 1):
            try:
                return self._series.frame(number)
            except ResultsError:
                if not self._opened_anew(number):
                    raise
        return self._series.frame(number)

    def _opened_anew(self, number: int) -> bool:
        """Open the series as it stands now; return whether a run has changed it since it was opened.

        Before data go from where they were, the XML no longer names them: if it is the same, they are damaged.

        Raises:
            ResultsError: The series can no longer be read, no longer has this field, or belongs to another model.
        """
        series = FieldSeries(self.path)
        try:
            if series.text == self._series.text:
                return False
            self._check_goes_on(series, number)
            series, self._series = self._series, series
        finally:
            series.close()
        return True

    def _check_goes_on(self, series: FieldSeries, number: int) -> None:
        """Refuse a series that lacks a field, or that another run has written."""
        if number >= len(series):
            raise ResultsError(
                self.path,
                found=f"{len(series)} fields, where {len(self)} were when it was opened",
                expected=f"field number {number}, which a resumed run has taken back to compute it again",
                remedy="open the results again, or wait until the run has come as far",
            )
        if not np.array_equal(series.points, self.points):
            raise ResultsError(
                self.path,
                found="fields at other points than when it was opened",
                expected="those of one run; another one has taken its place",
                remedy="open the results again",
            )
