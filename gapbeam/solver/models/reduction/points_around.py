"""The contact points around the stations of supports: the angles and areas of the contact points of the mesh.

A force at a point is shared among the points of the mesh on the same line along the beam that are nearest to its
station.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import ContactOperator

ONE_LINE = 1.0e-6  # rad, between the contact points of a line along the beam
CUT = 1.0  # rad, where angles begin: no line of points lies there


@dataclass(frozen=True)
class PointsAround:
    """Contact points around stations, one station after the other.

    Attributes:
        positions: (m, 3), m.
        weights: Areas, (m,), m^2.
        gaps: Of the undeformed beam, (m,), m.
        faces: Index of the face of each, (m,).
        stations: Number of the station of each, (m,).
        shares: How a force on each is shared among the points of the mesh, (m, points).
    """

    positions: Array
    weights: Array
    gaps: Array
    faces: Indices
    stations: Indices
    shares: csr_matrix


def points_around(contact: ContactOperator, places: Array, areas: Array, faces: Indices) -> PointsAround:
    """Return the points around stations.

    Args:
        contact: The operator at the points of the mesh, all of them around the beam.
        places: x of the stations, face by face, (k,), m.
        areas: Surface that belongs to each, (k,), m^2.
        faces: Index of the face of each, (k,).
    """
    positions, weights, owners, stations = list[Array](), list[Array](), list[Indices](), list[Indices]()
    shares = list[tuple[Indices, Array]]()
    for face in range(len(contact.face_names)):
        here, ringed = contact.points_of_faces[face], np.flatnonzero(faces == face)
        parts = areas[ringed] / areas[ringed].sum()
        lines = _lines(contact, here)
        across = np.array([contact.positions[line, 1:].mean(axis=0) for line in lines])
        surfaces = np.array([contact.weights[line].sum() for line in lines])
        for number, station in enumerate(ringed):
            positions.append(np.column_stack([np.full(len(lines), places[station]), across]))
            weights.append(parts[number] * surfaces)
            owners.append(np.full(len(lines), face))
            stations.append(np.full(len(lines), station))
            shares += [_share(contact, line, parts, number) for line in lines]
    spots, owned = np.concatenate(positions), np.concatenate(owners)
    gaps = np.empty(len(spots))
    for face, met in enumerate(contact.support.faces):
        gaps[owned == face] = met.gaps(spots[owned == face])
    ends = np.cumsum([0, *(len(line) for line, _ in shares)])
    columns = (np.concatenate([share for _, share in shares]), np.concatenate([line for line, _ in shares]), ends)
    return PointsAround(
        spots,
        np.concatenate(weights),
        gaps,
        owned,
        np.concatenate(stations),
        csr_matrix(columns, (len(spots), contact.size)),
    )


def _lines(contact: ContactOperator, points: Indices) -> list[Indices]:
    """Return the contact points of a face line by line along the beam, each in the order along it."""
    y, z = contact.positions[points, 1:].T
    turns = np.mod(np.arctan2(z, y) + CUT, 2.0 * np.pi)
    order = np.argsort(turns, kind="stable")
    breaks = np.flatnonzero(np.diff(turns[order]) > ONE_LINE) + 1
    return [line[np.argsort(contact.positions[line, 0])] for line in np.split(points[order], breaks)]


def _share(contact: ContactOperator, line: Indices, parts: Array, number: int) -> tuple[Indices, Array]:
    """Return the points of a line among which a station shares its force, and their shares.

    Stations own parts of the line one after the other, and points those of their areas.

    Args:
        contact: The points.
        line: Some of them, in the order along the beam.
        parts: Of the line that belong to the stations, (k,).
        number: The station.
    """
    ends = np.cumsum(contact.weights[line]) / contact.weights[line].sum()
    begins = np.concatenate([[0.0], ends[:-1]])
    last = parts[: number + 1].sum()
    overlap = np.minimum(ends, last) - np.maximum(begins, last - parts[number])
    met = overlap > 0.0
    return line[met], overlap[met] / overlap[met].sum()
