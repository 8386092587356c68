"""Where the faces of a run wear, from wear.csv."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gapbeam.postprocess.results.face_rows import rows_by_face
from gapbeam.postprocess.results.place_means import means_by_place
from gapbeam.solver.record_table import WEAR_COLUMNS, WEAR_FILE


@dataclass(frozen=True)
class WearMap:
    """What wears at the contact points of a face.

    Attributes:
        x: Places along the beam, (m,), m.
        angle: Directions of the walls, degrees from straight down, positive toward +y, (m,).
        area: That belongs to each point, (m,), m^2.
        rate: Work rate of each point, (m,), W.
        depth_rate: Of each point by itself, (m,), m/s; None: no coefficient is known.
        settled: Work rate of each point behind the burn-in with the ends of its 95 % interval, (m, 3), W; None: the run
            has no statistics.
    """

    x: np.ndarray
    angle: np.ndarray
    area: np.ndarray
    rate: np.ndarray
    depth_rate: np.ndarray | None
    settled: np.ndarray | None = None

    @property
    def around(self) -> bool:
        """Whether the face is met in several directions."""
        return bool(np.ptp(self.angle) > 0.0)

    @property
    def density(self) -> np.ndarray:
        """Work rate per area, (m,), W/m^2."""
        return np.asarray(self.rate / self.area)

    @property
    def unevenness(self) -> float:
        """The largest work rate per area over that of the whole face; 0 where nothing slides."""
        mean = float(self.rate.sum() / self.area.sum())
        return float(self.density.max()) / mean if mean > 0.0 else 0.0

    def along(self) -> tuple[np.ndarray, np.ndarray]:
        """Return places along the beam, m, and the work rate per area of all points there, W/m^2."""
        return means_by_place(self.x, self.rate, self.area)

    def turned(self) -> tuple[np.ndarray, np.ndarray]:
        """Return directions, degrees, and the work rate per area of all points in each, W/m^2."""
        return means_by_place(self.angle, self.rate, self.area)


def wear_of(folder: Path) -> dict[str, WearMap]:
    """Return the map of each face; empty for runs without [wear], and of earlier releases.

    Raises:
        ResultsError: The file cannot be read.
    """
    names = list(WEAR_COLUMNS)
    rows = rows_by_face(folder / WEAR_FILE, len(names), "work at contact points, one a line", may_lack=4)
    maps = {}
    for face, found in rows.items():
        columns = dict(zip(names, found.T, strict=True))
        depth_rate = columns["depth rate"]
        known = None if np.any(np.isnan(depth_rate)) else depth_rate
        ends = np.column_stack([columns[name] for name in ("settled rate", "low", "high")])
        settled = None if np.any(np.isnan(ends)) else ends
        maps[face] = WearMap(columns["x"], columns["angle"], columns["area"], columns["work rate"], known, settled)
    return maps
