"""A support around the beam as a ring: a round bore, a profile, or flat walls that may leave it open."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gapbeam.postprocess.results.supports_of_run import RunFace

if TYPE_CHECKING:
    import pyvista as pv

RING = 0.3  # thickness of a ring over that of the beam
CORNERS = 1.3  # radius over the distance of flat walls: room for the corners between them
TURNS = np.arange(-180.0, 181.0)  # degrees


def outer_radius(met: RunFace, thickness: float, scale: float) -> float:
    """Return the outer radius of a ring, m.

    Args:
        met: The face.
        thickness: Of the beam, m.
        scale: Enlarges its gaps.
    """
    widest = 0.5 * thickness + float(met.walls(scale)[1].max())
    return (CORNERS if met.flat else 1.0) * widest + RING * thickness


def inner_radii(met: RunFace, thickness: float, scale: float, turns: np.ndarray) -> np.ndarray:
    """Return where a ring begins at some angles from straight down, infinite where it is open, m."""
    angles, distances = met.walls(scale)
    radii = 0.5 * thickness + distances
    if not met.flat:
        return np.asarray(np.interp(turns, angles, radii, period=360.0))
    toward = np.cos(np.radians(turns[:, None] - angles))
    return np.asarray(np.where(toward > 0.0, radii / np.where(toward > 0.0, toward, 1.0), np.inf).min(axis=1))


def ring_of(
    met: RunFace, along: tuple[float, float], middle: tuple[float, float], thickness: float, scale: float
) -> pv.PolyData:
    """Return the surface of a ring.

    Args:
        met: The face.
        along: Where it begins and ends along the beam, m.
        middle: y and z of its middle, m.
        thickness: Of the beam, m.
        scale: Enlarges its gaps.
    """
    import pyvista as pv  # for solids alone

    walls = np.sort(met.angles) if met.flat else np.empty(0)
    corners = 0.5 * (walls + np.roll(walls, -1)) + 180.0 * (walls > np.roll(walls, -1))
    turns = np.union1d(TURNS, (corners + 180.0) % 360.0 - 180.0)
    outer = outer_radius(met, thickness, scale)
    inner = np.minimum(inner_radii(met, thickness, scale, turns), outer)
    directions = np.stack([np.sin(np.radians(turns)), -np.cos(np.radians(turns))], axis=1)
    rims = [np.array(middle) + radius[:, None] * directions for radius in (inner, np.full_like(inner, outer))]
    points = [np.column_stack([np.full(len(turns), x), rim]) for x in along for rim in rims]
    count, open_at = len(turns), inner >= outer
    solid = np.flatnonzero(~(open_at[:-1] & open_at[1:]))
    sheets = ((0, 1), (2, 3), (0, 2), (1, 3))  # both ends, the inside and the outside: pairs of rims
    quads = [
        np.stack(
            [one * count + solid, one * count + solid + 1, other * count + solid + 1, other * count + solid], axis=1
        )
        for one, other in sheets
    ]
    faces = np.vstack(quads)
    return pv.PolyData(np.vstack(points), np.column_stack([np.full(len(faces), 4), faces]).ravel()).clean()
