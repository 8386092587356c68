"""What the contact points of a run have met, from points.csv."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gapbeam.postprocess.results.face_rows import rows_by_face
from gapbeam.postprocess.results.place_means import means_by_place
from gapbeam.solver.record_table import POINT_COLUMNS, POINTS_FILE

_MAY_LACK = 2  # impulse and first touch


@dataclass(frozen=True)
class PointMap:
    """The contact points of a face, at the instants of the history records.

    Attributes:
        x: Places along the beam, (m,), m.
        angle: Directions of the walls, degrees from straight down, positive toward +y, (m,).
        area: That belongs to each point, (m,), m^2.
        share: Share of time in contact, (m,).
        deepest: Largest penetration, (m,), m; negative: the smallest gap.
        impulse: Part of the impulse of the face, (m,), N s; not a number where it is not known.
        first_touch: Time of the first record in contact, (m,), s; not a number: there is none.
    """

    x: np.ndarray
    angle: np.ndarray
    area: np.ndarray
    share: np.ndarray
    deepest: np.ndarray
    impulse: np.ndarray
    first_touch: np.ndarray

    @property
    def around(self) -> bool:
        """Whether the face is met in several directions."""
        return bool(np.ptp(self.angle) > 0.0)

    @property
    def pressed(self) -> np.ndarray:
        """Impulse per area, (m,), N s/m^2."""
        return np.asarray(self.impulse / self.area)

    def along(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places along the beam, m, and the mean of values of the points at each of them, by area."""
        return means_by_place(self.x, values * self.area, self.area)

    def turned(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return directions, degrees, and the mean of values of the points in each of them, by area."""
        return means_by_place(self.angle, values * self.area, self.area)

    @property
    def touched(self) -> bool:
        """Whether a point was in contact at some record."""
        return bool(np.any(np.isfinite(self.first_touch)))


def points_of(folder: Path) -> dict[str, PointMap]:
    """Return the points of each face; empty for runs without `output.points`, and of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    names = list(POINT_COLUMNS)
    rows = rows_by_face(folder / POINTS_FILE, len(names), "results of contact points, one a line", _MAY_LACK)
    found = {}
    for face, lines in rows.items():
        columns = dict(zip(names, lines.T, strict=True))
        kept = ("x", "angle", "area", "contact share", "deepest", "impulse", "first touch")
        found[face] = PointMap(*(columns[name] for name in kept))
    return found
