"""Blocks of solid cells without a mesher: a grid of hexahedra or tetrahedra, distorted where that is asked for."""

from __future__ import annotations

from typing import Any

import meshio
import numpy as np

import gapbeam as gb
from gapbeam.solver.scene.solid_cells import KINDS
from gapbeam.solver.system.operators import Array

TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
TRIANGLES = ((0, 1, 2), (0, 2, 3))


def grid(kind: str, counts: tuple[int, ...], size: tuple[float, ...], distortion: float = 0.0) -> meshio.Mesh:
    """Return a block from the origin; inner nodes are moved by up to a part of a cell, all the same at each call."""
    d, lines = len(counts), [np.linspace(0.0, 1.0, n + 1) for n in counts]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    inner = np.all([(x > 0.0) & (x < 1.0) for x in np.moveaxis(places, -1, 0)], axis=0)
    moved = np.random.default_rng(1).uniform(-1.0, 1.0, places.shape) / np.array(counts)
    places = (places + distortion * inner[..., None] * moved).reshape(-1, d) * np.array(size)
    number = np.arange(len(places)).reshape([n + 1 for n in counts])
    first = number[tuple(slice(0, -1) for _ in counts)].ravel()
    steps = [int(np.prod([n + 1 for n in counts[k + 1 :]])) for k in range(d)]
    corners = np.array(KINDS["quad" if d == 2 else "hexahedron"].corners, dtype=int)
    cells = first[:, None] + corners @ np.array(steps)
    if kind.startswith(("tri", "tetra")):
        cells = np.concatenate([cells[:, list(one)] for one in (TRIANGLES if d == 2 else TETRAHEDRA)])
    known: dict[frozenset[int], int] = {}
    more = [places]
    rows = []
    for cell in cells:
        row = list(cell)
        for one in KINDS[kind].between:
            key = frozenset(int(cell[i]) for i in one)
            if key not in known:
                known[key] = len(places) + len(known)
                more.append(places[sorted(key)].mean(axis=0)[None])
            row.append(known[key])
        rows.append(row)
    x = np.vstack(more)
    points = np.zeros((len(x), 3))
    points[:, :d] = x
    return meshio.Mesh(points, [(kind, np.array(rows))])


def with_sets(mesh: meshio.Mesh, **sets: Any) -> meshio.Mesh:
    """Add sets of nodes, each by a condition on x, y, z."""
    mesh.point_sets = {name: np.flatnonzero(inside(*mesh.points.T)) for name, inside in sets.items()}
    return mesh


def nodes_of(points: Array, x: float) -> Array:
    """Return the nodes of a plane x = constant."""
    return np.flatnonzero(np.abs(points[:, 0] - x) < 1e-9)


MODULI, RATIOS, SHEARS = (1.4e11, 1e10, 9e9), (0.3, 0.25, 0.4), (5e9, 4e9, 3e9)
AXIS, ACROSS = np.array([2.0, 1.0, 0.5]), np.array([-0.5, 0.0, 2.0])
PLY = gb.orthotropic(MODULI, RATIOS, SHEARS, 1600.0, AXIS, ACROSS)


def ply_stress(strain: Array) -> Array:
    """Return the stress of the ply in space: strain from stress as written in its axes, solved for stress."""
    E, nu = MODULI, RATIOS
    axes = np.column_stack([AXIS, np.cross(ACROSS, AXIS), ACROSS])
    axes = axes / np.linalg.norm(axes, axis=0)
    own = axes.T @ strain @ axes
    flexible = np.array([[1 / E[0], -nu[0] / E[0], -nu[1] / E[0]], [-nu[0] / E[0], 1 / E[1], -nu[2] / E[1]],
                         [-nu[1] / E[0], -nu[2] / E[1], 1 / E[2]]])  # fmt: skip
    sigma = np.diag(np.linalg.solve(flexible, np.diag(own)))
    for (i, j), modulus in zip(((0, 1), (0, 2), (1, 2)), SHEARS, strict=True):
        sigma[i, j] = sigma[j, i] = 2.0 * modulus * own[i, j]
    return np.asarray(axes @ sigma @ axes.T)
