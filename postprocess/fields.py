"""The fields of a run, read one time after the other from the XDMF time series."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from xml.etree import ElementTree

import h5py
import numpy as np
from meshio import CellBlock
from meshio.xdmf import TimeSeriesReader

from postprocess.damage import printable
from postprocess.errors import ResultsError
from postprocess.hdf5_check import check_hdf5
from solver.output.records import FIELD_FOLDER, FIELDS_DATA_FILE

FloatArray = np.ndarray
LARGEST = 256 * 2**20  # bytes of the XML file


@dataclass(frozen=True)
class Frame:
    """The fields at one time.

    Attributes:
        time: s.
        displacement: (points, 3), m, relative to the support.
        velocity: (points, 3), m/s, relative to the support.
        contact_pressure: (points,), Pa; zero away from the contact faces.
    """

    time: float
    displacement: FloatArray
    velocity: FloatArray
    contact_pressure: FloatArray


class Fields:
    """Reader of `fields.xdmf`; a context manager that closes the data file.

    meshio reads the time series, since the XDMF reader of VTK ends the process on one (pyvista issue 6303).
    """

    def __init__(self, path: Path) -> None:
        """Open the series.

        Args:
            path: The `.xdmf` file; its `.h5` file lies beside it.

        Raises:
            ResultsError: The series cannot be read.
        """
        self.path = path
        self._open = ExitStack()
        try:
            _check_items(path)
            self._reader = self._open.enter_context(TimeSeriesReader(path))
            # opened here, since a run that goes on holds a lock on the file that h5py would respect
            data_path = path.resolve().with_name(FIELDS_DATA_FILE)
            self._reader.hdf5_files[data_path] = h5py.File(data_path, "r", locking=False)
            check_hdf5(data_path, self._reader.hdf5_files[data_path])
            points, self.cells = self._reader.read_points_cells()
            self.points = _three_columns(points)
            _check_mesh(self.points, self.cells)
        except ResultsError:
            self._open.close()
            raise
        except Exception as fault:  # of three libraries
            self._open.close()
            raise self._unreadable(fault) from fault

    points: FloatArray
    cells: list[CellBlock]

    def __enter__(self) -> Fields:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the data file."""
        self._open.close()

    def __len__(self) -> int:
        """Count the times."""
        return int(self._reader.num_steps)

    def __iter__(self) -> Iterator[Frame]:
        """Read the frames in order of time."""
        return (self.frame(index) for index in range(len(self)))

    @cached_property
    def dimension(self) -> int:
        """2 for cells of a plane, 3 for those of a solid."""
        return 3 if any(block.type in ("tetra", "hexahedron") for block in self.cells) else 2

    def frame(self, index: int) -> Frame:
        """Read the fields at one time.

        Args:
            index: 0 for the first time, -1 for the last.

        Raises:
            ResultsError: The data are not there (a run killed while it wrote) or do not fit the mesh.
        """
        try:
            time, data, _ = self._reader.read_data(range(len(self))[index])
            frame = Frame(
                time=float(time),
                displacement=_three_columns(data["displacement"]),
                velocity=_three_columns(data["velocity"]),
                contact_pressure=np.asarray(data["contact_pressure"], dtype=float).reshape(-1),
            )
        except Exception as fault:  # of three libraries
            raise self._unreadable(fault) from fault
        if not np.isfinite(frame.displacement).all() or not np.isfinite(frame.contact_pressure).all():
            raise self._unreadable(ValueError(f"values that are not finite at t = {frame.time:g} s"))
        if frame.displacement.shape != self.points.shape or frame.contact_pressure.shape != self.points.shape[:1]:
            raise self._unreadable(ValueError(f"fields that do not fit the mesh at t = {frame.time:g} s"))
        return frame

    def _unreadable(self, fault: Exception) -> ResultsError:
        return ResultsError(
            self.path,
            found=f"fields that cannot be read ({printable(f'{type(fault).__name__}: {fault}')[:200]})",
            expected="a temporal collection with displacement, velocity and contact_pressure at the points",
            remedy="if the run goes on or was killed, wait or resume it; else repeat it",
        )


def _check_items(path: Path) -> None:
    """Refuse an XML file that is large, expands itself, or takes data from elsewhere than the HDF5 file beside it."""
    if path.stat().st_size > LARGEST:
        raise ValueError(f"{path.stat().st_size} bytes of XML, more than {LARGEST}")
    text = path.read_text(encoding="utf-8")
    if "<!" in text.replace("<!--", ""):
        raise ValueError("a document type or entities")
    for entry in ElementTree.fromstring(text).iter():
        if entry.tag.endswith("include") and "xpointer" not in entry.attrib:
            raise ValueError("an inclusion of another file")
        words = (entry.text or "").strip()
        if entry.tag == "DataItem" and not (entry.get("Format") == "HDF" and _is_ours(path.parent, words)):
            raise ValueError(f"data from {words[:60]!r}; expected them from {FIELDS_DATA_FILE}")


def _check_mesh(points: FloatArray, cells: list[CellBlock]) -> None:
    """Refuse cells with corners that are no points, and places that are not finite."""
    if not np.isfinite(points).all():
        raise ValueError("points that are not finite")
    for block in cells:
        corners = np.asarray(block.data)
        if corners.dtype.kind not in "iu" or corners.ndim != 2:
            raise ValueError(f"corners of cells of type {corners.dtype} and shape {corners.shape}")
        if corners.size and not (corners.min() >= 0 and corners.max() < len(points)):
            raise ValueError(f"corners from {corners.min()} to {corners.max()}, and {len(points)} points")


def _three_columns(values: FloatArray) -> FloatArray:
    values = np.asarray(values, dtype=float)
    if values.ndim != 2 or not 1 <= values.shape[1] <= 3:
        raise ValueError(f"values of shape {values.shape}; expected two or three columns")
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def _is_ours(folder: Path, words: str) -> bool:
    """Return whether data lie in the HDF5 file of the fields, or in those of a run that has not ended yet."""
    name, _, place = words.partition(":")
    own = name == FIELDS_DATA_FILE or re.fullmatch(rf"{FIELD_FOLDER}/[0-9]+\.h5", name) is not None
    return own and place.startswith("/") and not (folder / name).is_symlink()
