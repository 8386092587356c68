"""Fields of a run, read one time after the other, also during the run."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from types import TracebackType

import numpy as np
from meshio import CellBlock

from gapbeam.postprocess.results.field_series import FieldSeries, FloatArray, Frame
from gapbeam.postprocess.results_errors import ResultsError

__all__ = ["Fields", "FloatArray", "Frame"]

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
        self.points: FloatArray = self._series.points
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
    def times(self) -> FloatArray:
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
            ResultsError: It cannot be read any more, no longer has this field, or is that of another model.
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
