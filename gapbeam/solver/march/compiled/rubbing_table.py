"""The rows B of the system that motions of points with friction are made of, r = S B, as arrays for kernels.

A point at a place (y, z) of a section that keeps its shape moves along x by three motions of the section and around it
by its mean motion across and its rotation, the lever l = (y, z) . c of the direction c of the point:

    r_x = u + y a + z b,    r_around = +-(-c_z, c_y) . s + l w
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.solve.friction_equations import RubbingTable, rows_of_their_own
from gapbeam.solver.march.compiled.point_motions import SAME_ROWS, AroundPoints
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array, Indices


def rubbing_table(modal: ModalSystem, gaps: Array, around: AroundPoints | None) -> tuple[RubbingTable, Array]:
    """Return the shares of a system and the rows, (b, n).

    Args:
        modal: The system, whose points have tangents.
        gaps: G or, of points around sections, R, (g, n): the first rows.
        around: The points around sections; None: others.
    """
    tangents, stations = modal.tangents, modal.system.contact.circles.points
    points, along = tangents.shape[:2]
    rows, count, own = list[Array](), len(gaps), np.zeros(points, dtype=np.int64)
    alone = np.ones(points, dtype=bool)
    own[stations] = count + modal.surfaces.shape[1] * np.arange(len(stations))  # their directions: `rubbing_points.aim`
    rows, count, alone[stations] = [*modal.surfaces], count + modal.surfaces[..., 0].size, False
    shares = list[tuple[Indices, int, _Section]]()
    for members in [] if around is None or along == 1 else np.split(around.members, around.starts[1:-1]):
        assert around is not None
        section = _section(modal, gaps, around, members) if alone[members].all() and len(members) > 1 else None
        if section is not None:
            shares.append((members, count, section))
            rows, count, alone[members] = [*rows, section.rows], count + len(section.rows), False
    left = np.flatnonzero(alone)
    own[left] = count + along * np.arange(len(left))
    parts, share = rows_of_their_own(own, along)
    if around is not None:
        parts[:, 0, :2], share[:, 0, :2] = around.pairs, around.directions
        for members, first, section in shares:
            parts[members, 1], share[members, 1] = first + np.arange(3), section.places
            parts[members, 2] = np.column_stack([around.pairs[members], np.full(len(members), first + 3)])
            share[members, 2] = np.column_stack([section.axis, section.lever])
    rows.append(tangents[left].reshape(along * len(left), tangents.shape[2]))
    return RubbingTable(1 if around is None else 3, parts, share, own), np.concatenate([gaps, *rows])


class _Section(NamedTuple):
    """u, a, b and w of a section, (4, n); the shares of u, a and b, of s, and of w, in the motions of its points."""

    rows: Array
    places: Array
    axis: Array
    lever: Array


def _section(modal: ModalSystem, gaps: Array, around: AroundPoints, members: Indices) -> _Section | None:
    """Return the motions of a section; None where it changes its shape."""
    across, tangents = around.directions[members], modal.tangents[members]
    at = modal.system.contact.positions[members, 1:]
    middle = at.mean(axis=0)
    places = np.column_stack([np.ones(len(members)), (at - middle) / np.abs(at - middle).max()])
    lever = np.sum((at - middle) * across, axis=1)
    turned = np.column_stack([-across[:, 1], across[:, 0]])
    moved = turned @ gaps[around.pairs[members[0]]]
    sign = 1.0 if np.vdot(moved, tangents[:, 1]) >= 0.0 else -1.0
    along_x = np.linalg.lstsq(places, tangents[:, 0], rcond=None)[0]
    rest = tangents[:, 1] - sign * moved
    rotation = lever @ rest / (lever @ lever)
    missed = max(np.abs(places @ along_x - tangents[:, 0]).max(), np.abs(np.outer(lever, rotation) - rest).max())
    if missed > SAME_ROWS * np.abs(tangents).max():
        return None
    return _Section(np.vstack([along_x, rotation]), places, sign * turned, lever)
