"""Forces and moments of all supports and elastic joints of a scene over the steps of a march.

    R = K u + C u' + M u'' - f

along rows of the scene's coordinates u: of supports see `support_force`; a joint has K and C alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import Load
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene.support_force import HELD
from gapbeam.solver.system.operators import Array

AXES = ("x", "y", "z")
"""Axes of space in records of supports."""


class ReactionRows:
    """Forces and moments of the supports and joints of a scene, from rows that a march records.

    Attributes:
        names: Their names; "structure.support" where several share one.
        owners: Their structures; of joints the first one.
        axes: Axes of forces and of moments; none where there is no support.
        rows: Rows of K, C and M of each support, (18 supports, n).
    """

    def __init__(self, scene: Scene) -> None:
        held = [(one, name, force) for one in scene.structures for name, force in one.reactions.items()]
        joints = [one for one in scene.feedbacks if isinstance(one, Joint) and one.force]
        self.owners = (*(one for one, _, _ in held), *(_owner(scene, joint.points[0]) for joint in joints))
        every = [*(name for _, name, _ in held), *(joint.name for joint in joints)]
        self.axes = AXES if every else ()
        self.names = tuple(
            name if every.count(name) == 1 else f"{one.name}.{name}"
            for name, one in zip(every, self.owners, strict=True)
        )
        rows: list[Array] = [np.zeros((0, scene.size))]
        for one, _, force in held:
            none = np.zeros_like(force.stiffness)
            rows.append(scene.rows_of(one, np.vstack([force.stiffness, none, force.mass])))
        rows += [_pulled(scene, joint) for joint in joints]
        self.rows = np.vstack(rows)
        self.loads: list[tuple[Load, Array]] = []
        for load in scene.loads if every else ():
            owner = scene.structures[scene.place_of(load.structure, "load")]
            felt = [load.on_support(name, force) if one is owner else np.zeros(HELD) for one, name, force in held]
            felt += [load.held.get(joint.name, np.zeros(HELD)) for joint in joints]
            self.loads.append((load, np.array(felt)))

    def at_rest(self, time: float, place: Array) -> Array:
        """Return forces and moments where nothing is accelerated, (1, supports, 6), N and N m.

        Args:
            time: s.
            place: Displacements along the rows, (1, 18 supports).
        """
        still = np.zeros_like(place)
        return self._forces((place, still, still), lambda load: load.table(np.array([time])))

    def _forces(self, motions: Sequence[Array], pushed: Callable[[Load], Array]) -> Array:
        """Return K u + C u' + M u'' - f, (times, supports, 6), for u, u' and u'' along all rows and values of loads."""
        split = (len(motions[0]), len(self.names), len(motions), HELD)
        found = np.sum([one.reshape(split)[:, :, k] for k, one in enumerate(motions)], axis=0)
        for load, felt in self.loads:
            if np.any(felt):
                found -= pushed(load)[:, :1, None] * felt
        return np.asarray(found)

    def motion_in(self, q: Array, v: Array) -> Array:
        """Return displacement and velocity along the rows in a state, (2, 18 supports)."""
        return np.array([self.rows @ q, self.rows @ v])

    def over_steps(
        self, times: Array, h: float, before: Array, place: Array, speed: Array, chosen: Any = slice(None)
    ) -> Array:
        """Return the means over steps of h, (chosen steps, supports, 6), N and N m.

        Args:
            times: Ends of the steps, s.
            h: Step, s.
            before: As `motion_in` returns it before the first step.
            place: Displacements along the rows after each step, (steps, 18 supports).
            speed: Their velocities, likewise.
            chosen: Steps that are wanted, a mask or a slice.
        """
        u, v = (np.vstack([first, rest]) for first, rest in zip(before, (place, speed), strict=True))
        ends = np.append(times[:1] - h, times)
        motions = [0.5 * (u[1:] + u[:-1]), np.diff(u, axis=0) / h, np.diff(v, axis=0) / h]
        return self._forces([one[chosen] for one in motions], lambda load: load.over_steps(ends)[chosen])


def _owner(scene: Scene, point: StructurePoint) -> Structure:
    return scene.structures[scene.place_of(point.structure, "joint")]


def _pulled(scene: Scene, joint: Joint) -> Array:
    """Return the force of a joint on its first point along x, y and z, no moment and no inertia, (18, n)."""
    along = joint.points[0].directions
    assert along is not None
    stiffness, damping = (along.T @ part @ scene.rows([joint.sense]) for part in np.split(joint.D, 2, axis=1))
    none = np.zeros((HELD - len(stiffness), scene.size))
    return np.vstack([stiffness, none, damping, none, np.zeros((HELD, scene.size))])
