"""Contacts of a scene over a block of steps: penetration, forces, work of sliding, speed of approach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.scene.marcher import TOLERANCE
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array


@dataclass
class ContactBlock:
    """The contacts over a block of steps, (steps, contacts).

    Attributes:
        depth: Penetration, m.
        force: Normal force, N.
        friction: Friction force, N.
        rubbed: Work of sliding in each step, |F_n| times the motion across the normal, J; 0 at points of one motion.
        closed: Whether the contact is closed at the end of a step: it penetrates, or has an impulse in the step.
        approach: Speed of approach before a step, m/s; 0 but for laws of impulses.
    """

    depth: Array
    force: Array
    friction: Array
    rubbed: Array
    closed: Array
    approach: Array


def contacts_of(
    scene: Scene, places: Array, forces: Array, before: Array | None = None, rates: Array | None = None
) -> ContactBlock:
    """Return the contacts over steps.

    Args:
        scene: The scene.
        places: Places of the contact motions, (steps, motions), m.
        forces: Contact forces, (steps, motions), N. The normal force is -F . n, and friction what is across it.
        before: Places before the first step, (motions,); default none: nothing has slid.
        rates: Velocities before each step, (steps, motions), m/s; default none: all are at rest.
    """
    shape = len(places), len(scene.contacts)
    found = ContactBlock(*(np.zeros(shape) for _ in range(6)))
    found.closed = np.zeros(shape, dtype=bool)
    moved = np.diff(places, axis=0, prepend=places[:1] if before is None else before[None])
    for i, (one, first) in enumerate(zip(scene.contacts, scene.first, strict=False)):
        mine = slice(first, first + one.region.motions)
        found.depth[:, i], normals = one.penetration(places[:, first : first + one.motions])
        found.force[:, i] = -(forces[:, mine] * normals).sum(axis=1) + 0.0
        found.closed[:, i] = (found.force if one.is_impulsive else found.depth)[:, i] > 0.0
        if one.is_impulsive and rates is not None:
            opened = rates[:, mine.stop : first + one.motions].sum(axis=1)
            found.approach[:, i] = np.maximum((rates[:, mine] * normals).sum(axis=1) - opened, 0.0)
        if one.region.motions > 1:
            found.friction[:, i] = _across(forces[:, mine], normals) if one.is_rough else 0.0
            slid = _across(moved[:, mine], normals)
            slid[slid <= TOLERANCE * np.abs(found.depth[:, i])] = 0.0  # of a contact that sticks
            found.rubbed[:, i] = np.maximum(found.force[:, i], 0.0) * slid
    return found


def _across(vectors: Array, normals: Array) -> Array:
    """Return the sizes of the parts of vectors across normals, (steps,)."""
    if vectors.shape[1] == 3:
        return np.asarray(np.linalg.norm(np.cross(vectors, normals), axis=1))
    return np.asarray(np.abs(vectors[:, 0] * normals[:, 1] - vectors[:, 1] * normals[:, 0]))
