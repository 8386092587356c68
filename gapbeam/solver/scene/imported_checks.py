"""Checks of imported matrices by what every model has: mass everywhere, no negative energy, rigid motions.

Each finds a slip that no single file shows: DOFs in another order than the matrices, coordinates of another model,
other units than stated.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.scene.given_numbers import ArgumentError
from gapbeam.solver.scene.imported_points import DIRECTIONS, Rows
from gapbeam.solver.system.operators import Array

ROUND_OFF = 1e-8  # of the largest entry: what exports leave
NEGATIVE = 1e-9  # of the largest ratio of stiffness to mass on the diagonals
FEW_ROWS = 24
MOST = 0.6  # of the rows: clamps and springs leave most rows of a translation without force
SLOWEST, FASTEST = 20.0, 1e5
"""Usual speeds of waves from one node to the next, m/s; others are asked about."""
HEAVIEST = 3e4
"""Largest usual density, kg/m^3; larger ones are asked about."""
LOG = logging.getLogger("gapbeam")


def check_imported(K: Any, M: Any, rows: Rows, name: str = "") -> None:
    """Refuse matrices of which no model is made, and ask about units that make unusual waves or densities.

    Args:
        K: Stiffness of all rows, SI, sparse.
        M: Mass.
        rows: Their names and nodes.
        name: Of the structure.

    Raises:
        ArgumentError: M is not positive definite, K has a negative direction, or rows are in another order than their
            names.
    """
    for A, key in ((M, "mass"), (K, "stiffness")):
        skew, most = abs(A - A.T).max(), abs(A).max()
        if not skew <= ROUND_OFF * most:
            raise ArgumentError(
                f"found a matrix that differs from its transpose by up to {skew:.3g} of {most:.3g}, expected a "
                "symmetric one; complete an exported triangle as A + A.T - diag(A)",
                key,
            )
    diagonal = M.diagonal()
    if not np.all(diagonal > 0.0):
        bare = np.flatnonzero(~(diagonal > 0.0))
        raise ArgumentError(
            f"found {len(bare)} DOFs without mass, the first is {rows.labels[bare[0]]}, expected a positive "
            "definite M; leave them out by static condensation, or give them mass",
            "mass",
        )
    scale = sp.diags(1.0 / np.sqrt(diagonal))
    unit, elastic = sp.csc_matrix(scale @ M @ scale), sp.csc_matrix(scale @ K @ scale)
    if _negative(unit, 0.0):
        raise ArgumentError("found an M that is not positive definite, expected kinetic energy in every motion", "mass")
    if _negative(elastic + NEGATIVE * float(abs(elastic.diagonal()).max()) * unit, 0.0):
        raise ArgumentError(
            "found a K with a negative direction, expected none; look at how K was exported, and give forces that "
            "soften as a feedback",
            "stiffness",
        )
    motions = rows.rigid()
    if motions is not None:
        _check_order(K, motions, rows)
        for question in unit_questions(K, M, rows):
            LOG.warning("structure %s: %s", name or "?", question)


def _negative(A: Any, least: float) -> bool:
    """Return whether a symmetric matrix has a negative direction, by the signs of its pivots (Sylvester)."""
    try:
        factor = sla.splu(
            sp.csc_matrix(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # singular
        return True
    return bool(np.any(factor.U.diagonal() < least))


def _check_order(K: Any, motions: Array, rows: Rows) -> None:
    """Refuse rows in another order: rigid translations leave most rows without force, whatever holds a structure."""
    size = K.shape[0]
    if size < FEW_ROWS:
        return
    moved = np.flatnonzero(np.abs(motions).max(axis=0) > 0.0)
    force, most = np.abs(K @ motions), abs(K) @ np.abs(motions)
    strained = (force > ROUND_OFF * most).mean(axis=0)
    along = [k for k in moved if k < 3]
    if along and min(strained[along]) > MOST:
        raise ArgumentError(
            f"found that a rigid translation strains at {min(strained[along]):.0%} of the rows, expected few rows; the "
            "DOFs are not in the order of the matrices",
            "dofs",
        )
    about = [k for k in moved if k >= 3]
    solid = all(len(set(ways) & {0, 1, 2}) == 3 for ways in rows.of_node.values())
    if solid and about and max(strained[along]) == 0.0 and max(strained[about]) > MOST:
        raise ArgumentError(
            f"found that a rigid rotation strains at {max(strained[about]):.0%} of the rows, expected none of a free "
            "structure; the coordinates are not those of the matrices",
            "nodes",
        )


def unit_questions(K: Any, M: Any, rows: Rows) -> Iterator[str]:
    """Yield questions where waves are faster or slower, or the mass denser, than in usual materials."""
    assert rows.nodes is not None
    names = list(rows.of_node)
    places = rows.meter * np.array([rows.nodes.places[one] for one in names])
    node = np.empty(K.shape[0], dtype=int)
    for k, one in enumerate(names):
        node[list(rows.of_node[one].values())] = k
    entries = sp.coo_matrix(K)
    apart = node[entries.row] != node[entries.col]
    if not apart.any():
        return
    i, j = node[entries.row[apart]], node[entries.col[apart]]
    distance = np.linalg.norm(places[i] - places[j], axis=1)
    nearest = np.full(len(names), np.inf)
    np.minimum.at(nearest, i[distance > 0.0], distance[distance > 0.0])
    straight = np.array([DIRECTIONS[label.partition(".")[2]] < 3 for label in rows.labels])
    speeds = (np.sqrt(np.abs(K.diagonal() / M.diagonal())) * nearest[node])[straight & np.isfinite(nearest[node])]
    spans = np.ptp(places, axis=0)
    size = f"the nodes span {spans.max():.3g} m"
    if len(speeds) and not SLOWEST <= np.median(speeds) <= FASTEST:
        yield (
            f"waves run at about {np.median(speeds):.2g} m/s from node to node ({size}); usual are {SLOWEST:g} to "
            f"{FASTEST:g} m/s. Are the files in other units?"
        )
    volume = float(np.prod(spans))
    along = np.array([DIRECTIONS[label.partition(".")[2]] == 0 for label in rows.labels], dtype=float)
    if volume > 0.0 and along @ (M @ along) > HEAVIEST * volume:
        yield (
            f"a mass of {along @ (M @ along):.3g} kg fills {volume:.3g} m^3 ({size}); usual is less than "
            f"{HEAVIEST:g} kg/m^3. Are the files in other units?"
        )
