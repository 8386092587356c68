"""The fields of a run, read one time after the other from the XDMF time series."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from meshio import CellBlock, ReadError
from meshio.xdmf import TimeSeriesReader

from postprocess.errors import ResultsError
from solver.output.records import FIELDS_DATA_FILE

FloatArray = np.ndarray


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
            self._reader = self._open.enter_context(TimeSeriesReader(path))
            # opened here, since a run that goes on holds a lock on the file that h5py would respect
            data_path = path.resolve().with_name(FIELDS_DATA_FILE)
            self._reader.hdf5_files[data_path] = h5py.File(data_path, "r", locking=False)
            points, self.cells = self._reader.read_points_cells()
        except (OSError, ReadError, SyntaxError, KeyError, ValueError) as fault:
            self._open.close()
            raise self._unreadable(fault) from fault
        self.points = _three_columns(points)

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
        except (OSError, ReadError, KeyError, ValueError, IndexError) as fault:
            raise self._unreadable(fault) from fault
        if not np.isfinite(frame.displacement).all() or not np.isfinite(frame.contact_pressure).all():
            raise self._unreadable(ValueError(f"values that are not finite at t = {frame.time:g} s"))
        if frame.displacement.shape != self.points.shape or frame.contact_pressure.shape != self.points.shape[:1]:
            raise self._unreadable(ValueError(f"fields that do not fit the mesh at t = {frame.time:g} s"))
        return frame

    def _unreadable(self, fault: Exception) -> ResultsError:
        return ResultsError(
            self.path,
            found=f"fields that cannot be read ({type(fault).__name__}: {fault})",
            expected="a temporal collection with displacement, velocity and contact_pressure at the points",
            remedy="if the run goes on or was killed, wait or resume it; else repeat it",
        )


def _three_columns(values: FloatArray) -> FloatArray:
    values = np.asarray(values, dtype=float)
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
