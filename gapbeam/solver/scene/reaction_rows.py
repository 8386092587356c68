"""Forces and moments of all supports of a scene over the steps of a march."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import Load
from gapbeam.solver.scene.support_force import HELD
from gapbeam.solver.system.operators import Array

AXES = ("x", "y", "z")
"""Axes of space in records of supports."""


class ReactionRows:
    """Forces and moments of the supports of a scene, from rows that a march records.

    Attributes:
        names: Names of the supports; "structure.support" where several share one.
        owners: Their structures.
        axes: Axes of forces and of moments; none where there is no support.
        rows: Rows of D^T K and D^T M of each support, (12 supports, n).
    """

    def __init__(self, scene: Scene) -> None:
        found = [(one, name, force) for one in scene.structures for name, force in one.reactions.items()]
        every = [name for _, name, _ in found]
        self.axes, self.owners = AXES if found else (), tuple(one for one, _, _ in found)
        self.names = tuple(name if every.count(name) == 1 else f"{one.name}.{name}" for one, name, _ in found)
        rows = [scene.rows_of(one, np.vstack([force.stiffness, force.mass])) for one, _, force in found]
        self.rows = np.vstack([np.zeros((0, scene.size)), *rows])
        self.loads: list[tuple[Load, Array]] = []
        for load in scene.loads if found else ():
            owner = scene.structures[scene.place_of(load.structure, "load")]
            felt = [load.on_support(name, force) if one is owner else np.zeros(HELD) for one, name, force in found]
            self.loads.append((load, np.array(felt)))

    def at_rest(self, time: float, place: Array) -> Array:
        """Return forces and moments where nothing is accelerated, (1, supports, 6), N and N m.

        Args:
            time: s.
            place: Displacements along the rows, (1, 12 supports).
        """
        return self._forces(place, np.zeros_like(place), lambda load: load.table(np.array([time])))

    def _forces(self, place: Array, gained: Array, pushed: Callable[[Load], Array]) -> Array:
        """Return K u + M v'- f, (times, supports, 6), for u and v' along the rows and the values of each load."""
        split = (len(place), len(self.names), 2, HELD)
        found = place.reshape(split)[:, :, 0] + gained.reshape(split)[:, :, 1]
        for load, felt in self.loads:
            if np.any(felt):
                found -= pushed(load)[:, :1, None] * felt
        return np.asarray(found)

    def motion_in(self, q: Array, v: Array) -> Array:
        """Return displacement and velocity along the rows in a state, (2, 12 supports)."""
        return np.array([self.rows @ q, self.rows @ v])

    def over_steps(
        self, times: Array, h: float, before: Array, place: Array, speed: Array, chosen: Any = slice(None)
    ) -> Array:
        """Return the means over steps of h, (chosen steps, supports, 6), N and N m.

        Args:
            times: Ends of the steps, s.
            h: Step, s.
            before: As `motion_in` returns it before the first step.
            place: Displacements along the rows after each step, (steps, 12 supports).
            speed: Their velocities, likewise.
            chosen: Steps that are wanted, a mask or a slice.
        """
        u, v = (np.vstack([first, rest]) for first, rest in zip(before, (place, speed), strict=True))
        ends, gained = np.append(times[:1] - h, times), np.diff(v, axis=0)[chosen] / h
        return self._forces(0.5 * (u[1:] + u[:-1])[chosen], gained, lambda load: load.over_steps(ends)[chosen])
