"""Rows of numbers by face, as runs write them: one line a row, the face first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gapbeam.postprocess.results_errors import ResultsError

LARGEST = 200_000_000  # bytes, more than a run writes


def rows_by_face(path: Path, columns: int, contents: str, may_lack: int = 0) -> dict[str, np.ndarray]:
    """Return the rows of each face, (k, columns); empty where the file is not there, as in runs of earlier releases.

    Args:
        path: Of the file.
        columns: Behind the face.
        contents: What the file should hold, for messages.
        may_lack: How many of the last cells may be empty, which are read as not-a-number.

    Raises:
        ResultsError: The file cannot be read.
    """
    if not path.is_file():
        return {}
    found: dict[str, list[list[float]]] = {}
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError(f"{path.stat().st_size} bytes")
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            face, *cells = line.split(",")
            if len(cells) != columns:
                raise ValueError(f"the line {line[:80]!r}")
            cells[columns - may_lack :] = [cell or "nan" for cell in cells[columns - may_lack :]]
            found.setdefault(face, []).append([float(cell) for cell in cells])
        rows = {face: np.array(lines) for face, lines in found.items()}
        if not all(np.all(np.isfinite(one[:, : columns - may_lack])) for one in rows.values()):
            raise ValueError("numbers that are not finite")
    except (OSError, ValueError) as fault:
        raise ResultsError(path, str(fault)[:200], contents, "repeat the run") from fault
    return rows
