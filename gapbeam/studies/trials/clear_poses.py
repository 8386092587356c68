"""Rigid motions that take a beam out of faces that have come closer.

With the motions V, x the penetrations at a pose u and a the amplitudes,

    least sum |a_i| + 1000 t,    x(u + V a) <= allowed + t

At points x is linear in a. At stations in round holes it is convex, |r| - c: it is replaced by its tangents, of which
every pose that is found adds some (the cutting planes of Kelley, 1960), until no point is deeper than allowed.
"""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.optimize import linprog

from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator

SOFT = 2.0 * pi  # rad/s: springs on the mass that leave a free body its rigid motions, far below bending
STOPPED = 1.0e-6  # of the largest motion at the faces: less is none
LEFT_OVER = 1000.0  # cost of depth that is left, of that of motion
MOST_CUTS = 30
CLEARED = 1.0e-7  # of the largest excess: the tolerance of linear programs


def slack(allowed: Array) -> float:
    """Return what depths may differ by, m."""
    return 1.0e-9 * float(np.max(allowed)) + 1.0e-12


def rigid_motions(model: Model) -> Array:
    """Return rigid motions of the body that its supports stop, (n, k).

    Heave and pitch and, where a support is around the beam, sway and yaw: what soft springs on the mass of the body let
    forces at the faces do. Motions that the model does not have are left out.
    """
    contact, operators = model.system.contact, model.system.operators
    soft = operators.factor(SOFT**2, 1.0)
    lever = contact.positions[:, 0] - float(np.mean(contact.positions[:, 0]))
    motions = list[Array]()
    for pushed, along in _pushed(model):
        upward = contact.weights * along
        for forces in (upward, upward * lever):
            right_side = np.zeros(operators.size)
            contact.interface.add(right_side, pushed.resultant(forces))
            motions.append(soft.solve(right_side))
    moved = np.array([_largest(model, motion) for motion in motions])
    return np.stack([motion for motion, far in zip(motions, moved, strict=True) if far > STOPPED * moved.max()], axis=1)


def moved_clear(model: Model, u: Array, time: float, allowed: Array) -> tuple[Array, float, float]:
    """Return u with the least rigid motion that clears the faces, its size at the faces, and what is left, m.

    Args:
        model: The model.
        u: Its marched DOFs, deeper in a face than allowed.
        time: When, s.
        allowed: Depths that stay, (m,), m.

    Collective.
    """
    contact, operators = model.system.contact, model.system.operators
    motions, values = rigid_motions(model), contact.interface.trace(u, operators)
    motions = motions / np.array([_largest(model, motion) for motion in motions.T])
    traces = np.stack([contact.interface.trace(motion, operators) for motion in motions.T], axis=1)
    depth = contact.depth(values, time)
    unit = float(np.max(depth - allowed))
    shift, tangents, rooms = np.zeros(motions.shape[1]), list[Array](), list[Array]()
    for _ in range(MOST_CUTS):
        deeper = np.asarray(-(contact.at(values + traces @ shift, time).gap_matrix @ traces))
        tangents.append(deeper)
        rooms.append((allowed - depth + deeper @ shift) / unit)
        found = _least(np.concatenate(tangents), np.concatenate(rooms))
        if found is None:
            break
        shift = unit * found
        depth = contact.depth(values + traces @ shift, time)
        if contact.turning is None or np.max(depth - allowed) <= CLEARED * unit:
            break
    left = float(np.max(depth - allowed))
    return u + motions @ shift, float(np.abs(deeper @ shift).max()), left if left > CLEARED * unit else 0.0


def _least(deeper: Array, room: Array) -> Array | None:
    """Return a of the least sum |a_i| + 1000 t with deeper a <= room + t, a = a+ - a-; None: not found."""
    count = deeper.shape[1]
    cost = np.concatenate([np.ones(2 * count), [LEFT_OVER]])
    found = linprog(cost, np.hstack([deeper, -deeper, -np.ones((len(room), 1))]), room, method="highs")
    return None if found.x is None else np.asarray(found.x[:count] - found.x[count : 2 * count])


def _pushed(model: Model) -> list[tuple[ContactOperator, Array]]:
    """Return the contact with stations that look up, and what its points have of that direction, (m,); and aside."""
    contact, found = model.system.contact, list[tuple[ContactOperator, Array]]()
    for axis in (1, 0) if contact.support.around else (1,):
        stations = None if contact.turning is None else np.tile(np.eye(2)[axis], (len(contact.turning.points), 1))
        turned = contact.turned(stations)
        found.append((turned, turned.across[:, axis]))
    return found


def _largest(model: Model, motion: Array) -> float:
    """Return by how much a motion changes gaps at most, along y and z at stations, no unit or m. Collective."""
    values = model.system.contact.interface.trace(motion, model.system.operators)
    return max(float(np.abs(contact.gap_matrix @ values).max()) for contact, _ in _pushed(model))
