"""Motion of a cross-section, fitted to its mesh points, and the surface of a beam in a hole unrolled: x and angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_BESIDE = 1.0e-6  # of the length of the beam: points so near to each other along it are of one cross-section


@dataclass(frozen=True)
class CarryingSection:
    """A rigid motion u = a + w x (X - c) by least squares.

    Attributes:
        points: Numbers of the mesh points of the section, (p,).
        center: c, their mean place, m, (3,).
        fit: From their displacements, (3 p,), to a and w, (6, 3 p).
    """

    points: np.ndarray
    center: np.ndarray
    fit: np.ndarray

    def of(self, displacement: np.ndarray, place: np.ndarray) -> np.ndarray:
        """Return the displacement of a place that the section carries, m, (3,).

        Args:
            displacement: Displacement of all points of the mesh, m, (n, 3).
            place: X, m, (3,).
        """
        motion = self.fit @ displacement[self.points].reshape(-1)
        return np.asarray(motion[:3] + np.cross(motion[3:], place - self.center))


def carrying_section(points: np.ndarray, x: float) -> CarryingSection:
    """Return the motion of the cross-section of mesh points that is nearest to x.

    What the points do not show, such as a twist of those of a line, is none.

    Args:
        points: Points of the mesh, m, (n, 3).
        x: Along the beam, m.
    """
    away = np.abs(points[:, 0] - x)
    nearest = points[np.argmin(away), 0]
    (chosen,) = (np.abs(points[:, 0] - nearest) <= _BESIDE * np.ptp(points[:, 0])).nonzero()
    center = points[chosen].mean(axis=0)
    rows = []
    for a, b, c in points[chosen] - center:
        turn = np.array([[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]])  # w x r
        rows.append(np.hstack([np.eye(3), turn]))
    return CarryingSection(chosen, center, np.linalg.pinv(np.vstack(rows)))


_TOP = 179.99  # degrees


def unrolled(numbers: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points around a beam with x, m, and the angle from its lowest line, degrees; those at the top twice.

    Args:
        numbers: Numbers of the points around the beam, (p,).
        points: Points of the mesh, (n, 3), m.

    Returns:
        Numbers, x and angle of each, positive toward +y; the points at the top are at 180 degrees and again at -180.
    """
    x, y, z = points[numbers].T
    angles = np.degrees(np.arctan2(y, -(z - 0.5 * (z.max() + z.min()))))
    top = np.flatnonzero(np.abs(angles) > _TOP)
    angles[top] = 180.0
    return np.r_[numbers, numbers[top]], np.r_[x, x[top]], np.r_[angles, np.full(len(top), -180.0)]
