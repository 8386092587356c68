"""The impacts of a run, from impacts.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gapbeam.postprocess.results.face_rows import rows_by_face
from gapbeam.solver.record_table import IMPACTS_FILE

_COLUMNS = 5  # closing time, approach speed, impulse, duration, stands for


def impacts_of(folder: Path) -> dict[str, np.ndarray]:
    """Return the impacts of each face that met any: (k, 5).

    The columns are closing time, s, approach speed, m/s, impulse, N s, duration, s, and how many impacts a row stands
    for. Empty for runs of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    return rows_by_face(folder / IMPACTS_FILE, _COLUMNS, "impacts, one a line")
