"""points.csv: contact of each point in a run, one point a line, readable by any program.

First touch, time in contact and largest penetration are those at the instants of the records. The angle is defined as
in wear.csv. Cells of what is not known are empty: the first touch of a point that was never in contact at a record, and
the impulses of a face that was pressed between records only, or that yields.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gapbeam.solver.diagnostics.point_contact import PointContact
from gapbeam.solver.record_table import POINT_COLUMNS, POINTS_FILE
from gapbeam.solver.run.output.atomic_files import written
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.run.output.wear_file import angles
from gapbeam.solver.system.operators import Array

HEAD = ",".join(["face", *(f"{name} ({unit})" if unit else name for name, unit in POINT_COLUMNS.items())])


def write_points(folder: Path, points: PointContact | None, impulses: Array) -> None:
    """Write the results of all contact points; nothing where they were not asked for.

    Args:
        folder: Of the results.
        points: At the end of the run.
        impulses: Of the faces, (faces,), N s.

    Raises:
        NotWritten: It could not be written.
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
