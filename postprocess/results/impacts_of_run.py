"""The impacts of a run, from impacts.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.record_table import IMPACTS_FILE

_COLUMNS = 6  # face, closing time, approach speed, impulse, duration, stands for
LARGEST = 200_000_000  # bytes, more than a run writes


def impacts_of(folder: Path) -> dict[str, np.ndarray]:
    """Return the impacts of each face that met any: (k, 5).

    The columns are closing time, s, approach speed, m/s, impulse, N s, duration, s, and how many impacts a row stands
    for. Empty for runs of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    path = folder / IMPACTS_FILE
    if not path.is_file():
        return {}
    found: dict[str, list[list[float]]] = {}
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError(f"{path.stat().st_size} bytes")
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            face, *cells = line.split(",")
            if len(cells) != _COLUMNS - 1:
                raise ValueError(f"the line {line[:80]!r}")
            found.setdefault(face, []).append([float(cell) for cell in cells])
        rows = {face: np.array(lines) for face, lines in found.items()}
        if not all(np.all(np.isfinite(one)) for one in rows.values()):
            raise ValueError("numbers that are not finite")
    except (OSError, ValueError) as fault:
        raise ResultsError(path, str(fault)[:200], "impacts, one a line", "repeat the run") from fault
    return rows
