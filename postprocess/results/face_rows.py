"""Rows of numbers by face, as runs write them: one line a row, the face first."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gapbeam.postprocess.results_errors import ResultsError

LARGEST = 200_000_000  # bytes, more than a run writes


def rows_by_face(path: Path, columns: int, contents: str, may_lack: bool = False) -> dict[str, np.ndarray]:
    """Return the rows of each face, (k, columns); empty where the file is not there, as in runs of earlier releases.

    Args:
        path: Of the file.
        columns: Behind the face.
        contents: What the file should hold, for messages.
        may_lack: Whether the last cell may be empty, which is read as not-a-number.

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
            if may_lack and not cells[-1]:
                cells[-1] = "nan"
            found.setdefault(face, []).append([float(cell) for cell in cells])
        rows = {face: np.array(lines) for face, lines in found.items()}
        if not all(np.all(np.isfinite(one[:, :-1] if may_lack else one)) for one in rows.values()):
            raise ValueError("numbers that are not finite")
    except (OSError, ValueError) as fault:
        raise ResultsError(path, str(fault)[:200], contents, "repeat the run") from fault
    return rows
