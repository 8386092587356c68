"""Energies of structures whose clamps move, beside the motion that they follow slowly.

A clamp that moves by s acts on the other DOFs q as the force f s, see `driven_rows`, and they follow it slowly by g s
with K g = f. Their energies as if the clamp were at rest, q^T K q / 2 and more, are those of a stretched structure,
many times what it exchanges. Those of w = q - g s are relative to the moving clamp, as those of base motions are:

    V = V_q - s f^T q + s^2 g^T f / 2,     T = T_q - s' g^T M q' + s'^2 g^T M g / 2,

and the damping takes w'^T C w'. The work of the clamp changes by as much: the balance stays as it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gapbeam.solver.scene.linear_scheme import LinearScheme, StepRecords
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import ClampMotion
from gapbeam.solver.scene.step_kernel import DAMPED, KINETIC, LOADED, STRAIN
from gapbeam.solver.system.operators import Array

STILL = 1e-12
"""Part of the largest squared frequency below which a motion follows no clamp."""


class ClampEnergies:
    """Changes of the energies of a march in modes by moving clamps; none in other marches.

    Attributes:
        rows: Rows of f, of g and of C g, (3 clamps, n), whose motions a march records last.
        state: Time, s, change of the losses by damping since the start, J, of what was stored at the start, J, and
            the motions along the rows, (3 + 3 clamps,).
    """

    def __init__(self, scene: Scene, scheme: LinearScheme) -> None:
        seen = not (scene.is_large or scene.is_moving or scheme.exact)
        mine = [i for i, one in enumerate(scene.loads) if seen and isinstance(one, ClampMotion)]
        self.loads: list[Any] = [scene.loads[i] for i in mine]
        self.forces = f = scene.load_columns[:, mine].T
        self.follows = g = np.zeros_like(f)
        self.rows = np.zeros((0, scene.size))
        if mine:
            elastic = scene.squares > STILL * scene.squares.max()
            g[:, elastic] = f[:, elastic] / scene.squares[elastic]
            C = scene.damping
            self.rows = np.vstack([f, g, g * C[0] if len(C) == 1 else 0.5 * g @ (C + C.T)])

    def begin(self, marcher: Marcher) -> tuple[float, float]:
        """Return the changes of kinetic and strain energy by clamps at the start of a march, J."""
        self.state = np.concatenate([[marcher.t, 0.0, 0.0], self.rows @ marcher.q[:, 0]])
        if not self.loads:
            return 0.0, 0.0
        speed = self.rows @ marcher.v[:, 0]
        kinetic, strain = self._stored(np.array([marcher.t]), self.state[None, 3:], speed[None])
        self.state[2] = kinetic[0] + strain[0]
        return float(kinetic[0]), float(strain[0])

    def follow(self, times: Array, kept: StepRecords, energies: Array, state: Array) -> None:
        """Bring the changes by clamps into the energies of a block of steps, and their sum into the work of loads.

        Args:
            times: Ends of the steps, s.
            kept: Records of the march, whose last rows are those here.
            energies: As of `StepRecords`, (steps, 8), J.
            state: See `state`: that before the block, which is brought to its end.
        """
        if not self.loads or not len(times):
            return
        place, speed = kept.seen[:, -len(self.rows) :, 0], kept.speeds[:, -len(self.rows) :, 0]
        whole, before = np.append(state[0], times), np.vstack([state[3:], place])
        moved, along = np.diff(self._moved(whole)[0], axis=0), np.diff(before[:, 2 * len(self.loads) :], axis=0)
        drag = self.follows @ self.rows[2 * len(self.loads) :].T
        taken = 2.0 * (_half_square(moved, drag) - (moved * along).sum(axis=1)) / np.diff(whole)
        lost = np.cumsum(np.append(state[1], taken))[1:]  # the same bits however a march is cut in blocks
        kinetic, strain = self._stored(times, place, speed)
        energies[:, KINETIC] += kinetic
        energies[:, STRAIN] += strain
        energies[:, DAMPED] += lost
        energies[:, LOADED] += kinetic + strain + lost - state[2]
        state[0], state[1], state[3:] = times[-1], lost[-1], place[-1]

    def _stored(self, times: Array, place: Array, speed: Array) -> tuple[Array, Array]:
        """Return the changes of kinetic and strain energy by clamps, (times,), J, for motions along the rows."""
        count, (s, rate) = len(self.loads), self._moved(times)
        kinetic = _half_square(rate, self.follows @ self.follows.T) - (rate * speed[:, count : 2 * count]).sum(axis=1)
        return kinetic, _half_square(s, self.follows @ self.forces.T) - (s * place[:, :count]).sum(axis=1)

    def _moved(self, times: Array) -> tuple[Array, Array]:
        """Return displacements and velocities of the clamps, (times, clamps)."""
        s = np.array([one.table(times)[:, 0] for one in self.loads])
        return s.T, np.array([one.rate(times) for one in self.loads]).T


def _half_square(x: Array, A: Array) -> Array:
    """Return x^T A x / 2 of rows, (times,)."""
    return np.asarray(0.5 * ((x @ A) * x).sum(axis=1))
