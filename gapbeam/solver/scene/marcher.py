"""The marcher: a scene with a step, a scheme and a state, which advances in blocks of compiled steps in its modes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene import force_solve
from gapbeam.solver.scene.contact_pair import refuse_impulses
from gapbeam.solver.scene.feedback import aligned, outputs_of
from gapbeam.solver.scene.force_law import SPEEDS
from gapbeam.solver.scene.lane_code import kernels
from gapbeam.solver.scene.linear_scheme import (
    MIDPOINT,
    Linear,
    LinearScheme,
    StepRecords,
    check_limit,
    rest,
    rooms,
    step_records,
    step_sums,
)
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.step_kernel import DAMPED, LAW, LOADED, RUBBED, STORED, WALLED
from gapbeam.solver.system.operators import Array

BLOCK = 2048
"""Steps between two looks of Python at a march."""
TOLERANCE = 1e-12
"""Tolerance of the contact solve, over the places of the contacts."""


class Marcher:
    """A scene with a step, a scheme and a state; it advances in blocks, members in lanes.

    Args:
        scene: The scene.
        step: s.
        start: State at the start; default at rest, undeformed.
        lanes: Members side by side.
        scheme: Scheme of the time integration.
        linear: The condensed scene for that step and scheme, where it is known.
        watch: More rows that records have behind those of points, (rows, n).

    Raises:
        UserError: The step is not above 0, or the start is of another scene.
    """

    def __init__(
        self, scene: Scene, step: float, start: SceneState | None = None, lanes: int = 1,
        scheme: LinearScheme = MIDPOINT, linear: Linear | None = None, watch: Array | None = None,
    ) -> None:  # fmt: skip
        if not (np.isfinite(step) and step > 0.0):
            raise UserError(f"march: found step {step!r} s, expected a time above 0")
        self.scene, self.h, self.lanes, self.scheme = scene, float(step), lanes, scheme
        if scheme != MIDPOINT:
            refuse_impulses(scene.contacts, "march", "a spring, or the default scheme, the midpoint rule")
        if scheme.is_conditional:
            check_limit(scheme, self.h, self.fastest())
        self.linear = linear or self.condensed()
        if watch is not None:
            self.linear = self.linear._replace(watch=aligned(np.vstack([self.linear.watch, watch])))
        self.slabs = scene.slabs(lanes, step, self.linear.delassus, scheme.law)
        state = _of(scene, start or scene.state()).spread(lanes)
        self.t0, self.count = state.t, 0
        self.space, self.room = rooms(self.linear, self.slabs, lanes)
        self.q, self.v, self.z, self.F = (aligned(one) for one in (state.q, state.v, state.z, state.F))
        self.y, self.inputs = self.places(), scene.inputs(self.q)
        self.a: Array = np.zeros((0, lanes))
        if scheme.is_accelerated:
            self.a = np.ascontiguousarray(state.a) if state.a is not None else self.accelerations()
        self.ledger, self.passes = np.zeros((6, lanes)), 0
        self.sums = step_sums(0, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64), lanes, np.zeros((0, 0)), 0)
        self.kept = step_records(self.linear, 0, lanes, False, False)
        self._recall(state.memory)
        self.ledger[STORED] = rest(self.slabs, self.y)[2]

    def rates(self) -> Array:
        """Return the velocities of the contacts, walls at their mean over the next step, (motions, lanes), m/s."""
        times = np.array([self.t, self.t + self.h])
        walls: Array = np.diff(self.scene.walls(times, self.lanes), axis=0)[0]
        return np.asarray(self.scene.contact_rows @ self.v - walls / self.h)

    def _recall(self, memory: Array | None) -> None:
        """Give laws their memory, (values, lanes); None: nothing but the speed of their contacts."""
        parts = list(self.slabs.memory())
        if memory is not None:
            ends = np.cumsum([part.shape[0] * part.shape[1] for part in parts])
            for part, values in zip(parts, np.split(memory, ends[:-1]), strict=True):
                part[:] = values.reshape(part.shape)
            return
        speed = self.rates()
        for s, part in enumerate(parts):
            here = self.slabs.motion[self.slabs.start[s] : self.slabs.start[s + 1]]
            names = self.scene.contacts[int(np.searchsorted(self.scene.first, here[0], "right")) - 1].law.kind.memory
            for k, name in enumerate(SPEEDS[: self.slabs.motions[s]]):
                if name in names:
                    part[names.index(name)] = speed[here + k]

    def fastest(self) -> float:
        """Return the largest angular frequency of the scene with springs of its feedback, rad/s."""
        scene = self.scene
        if scene.is_large:
            raise UserError(
                "march: a scheme with a limit of stability is for modes; reduce the structure: structure.reduced(modes)"
            )
        K = np.diag(scene.squares)
        for one in scene.feedbacks:
            sense = scene.rows([one.sense])
            K = K - scene.rows([one.act]).T @ one.D[:, : len(sense)] @ sense
        return float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))

    def condensed(self) -> Linear:
        """Return the arrays of the scene for the step."""
        return self.scene.condensed(self.h, self.scheme)

    def rows(self, times: Array) -> Array:
        """Return the rows of contact motions at points that move, (times, motions, n): here none."""
        return np.zeros((len(times), 0, self.scene.size))

    def places(self) -> Array:
        """Return the places of the contacts at the start, (motions, lanes), m."""
        return self.scene.places(self.q, self.t0)

    @property
    def t(self) -> float:
        """Time of the present state, s."""
        return self.t0 + self.count * self.h

    def accelerations(self) -> Array:
        """Return the accelerations at the start, from the equation of motion, (n, lanes)."""
        scene, at = self.scene, 0
        force = scene.contact_rows.T @ self.F
        for load, column in zip(scene.loads, scene.load_columns.T, strict=False):
            force += column[:, None] * load.table(np.array([self.t]), self.lanes)
        for one in scene.feedbacks:
            sense, z = scene.rows([one.sense]), self.z[at : at + len(one.A)]
            read = np.vstack([sense @ self.q, sense @ self.v])
            force += scene.rows([one.act]).T @ (one.C @ z + one.D @ read)
            at += len(z)
        return self.without_inertia(force)

    def without_inertia(self, force: Array) -> Array:
        """Return M^-1 (force - C v - K q)."""
        C = self.linear.damping
        drag: Array = C.T * self.v if len(C) == 1 else C @ self.v
        return force - self.linear.squares[:, None] * self.q - drag

    def tables(self, steps: int) -> tuple[Array, Array, Array]:
        """Return times, loads and places of the walls for a block of steps; one place where no wall moves."""
        times = self.t0 + (self.count + np.arange(steps + 1)) * self.h
        loads = np.zeros((steps, len(self.linear.patterns), self.lanes))
        for j, load in enumerate(self.scene.loads):
            loads[:, j] = load.over_steps(times, self.lanes, self.scheme.level)
        moving = any(one.is_moved for one in self.scene.contacts)
        return times, loads, self.scene.walls(times if moving else times[:1], self.lanes)

    def advance(self, steps: int, record: bool = False, energies: bool = False) -> StepRecords:
        """March so many steps.

        Args:
            steps: Number of steps.
            record: Whether to record displacements and contact forces of each step.
            energies: Whether to record speeds, places and energies, too.

        Raises:
            NotConverged: The contact forces of a step did not converge;
                the state is that at the start of this step, and `kept` has the records before it.
        """
        times, loads, walls = self.tables(steps)
        self.kept = step_records(self.linear, steps, self.lanes, record, energies)
        done = self.march(steps, loads, walls)
        if done < 0:
            self.count -= done + 1
            self.kept = StepRecords(*(one[: -done - 1] for one in self.kept))
            self.fail(self.count + 1, float(times[-done]))
        self.passes += done
        self.count += steps
        return self.kept

    def march(self, steps: int, loads: Array, walls: Array) -> int:
        """March so many steps into `kept`; return passes, or minus the number of the step that failed."""
        return int(
            kernels(self.lanes)["march"](
                self.linear, self.slabs, self.h, steps, self.q, self.v, self.a, self.y, self.F, self.z, self.inputs,
                loads, walls, self.ledger, self.sums, self.kept, self.space, self.room, TOLERANCE,
            )
        )  # fmt: skip

    def fail(self, step: int, time: float) -> None:
        """Raise NotConverged for a step."""
        raise NotConverged(
            f"step {step}, t = {time:.9g} s: the contact forces did not converge in {force_solve.PASSES} passes; try "
            "a smaller step"
        )

    @property
    def state(self) -> SceneState:
        """A copy of the present state: another march may start from it."""
        a = self.a.copy() if len(self.a) else None
        parts = (one.reshape(-1, self.lanes) for one in self.slabs.memory())
        memory = np.concatenate([np.zeros((0, self.lanes)), *parts])
        return SceneState(
            self.t, self.q.copy(), self.v.copy(), self.z.copy(), self.F.copy(), a, memory if len(memory) else None
        )

    def inertia(self) -> tuple[Array, Array]:
        """Return kinetic and strain energy, (lanes,), J."""
        return 0.5 * (self.v**2).sum(0), 0.5 * (self.linear.squares[:, None] * self.q**2).sum(0)

    @property
    def energy(self) -> dict[str, Any]:
        """Kinetic, strain and contact energy, losses, and work brought in since the start, J."""
        L = self.ledger
        kinetic, strain = self.inertia()
        parts = {
            "kinetic": kinetic, "strain": strain, "contact": L[STORED], "damping": L[DAMPED], "law": L[LAW],
            "friction": L[RUBBED], "loads": L[LOADED], "feedback": self.worked.sum(0), "walls": L[WALLED],
        }  # fmt: skip
        return {name: float(np.ravel(one)[0]) if self.lanes == 1 else one.copy() for name, one in parts.items()}

    @property
    def worked(self) -> Array:
        """Work of each force of the feedback since the start, (outputs, lanes), J."""
        return self.space.worked

    @property
    def work(self) -> dict[str | int, Any]:
        """Work of each feedback since the start by its name, else its number, J: such as the work of a flow."""
        outputs = outputs_of(self.scene.feedbacks)
        parts = {
            one.name or i: self.worked[some].sum(0)
            for i, (one, some) in enumerate(zip(self.scene.feedbacks, outputs, strict=True))
        }
        return {name: float(part[0]) if self.lanes == 1 else part for name, part in parts.items()}

    @property
    def balance(self) -> Any:
        """Energy that the midpoint rule never changes: stored, plus lost, less brought in, J."""
        e = self.energy
        return (
            e["kinetic"] + e["strain"] + e["contact"] + e["damping"] + e["law"] + e["friction"]
            - e["loads"] - e["feedback"] - e["walls"]
        )  # fmt: skip


def _of(scene: Scene, state: SceneState) -> SceneState:
    """Return a state of a scene; forces of other contacts count as none.

    Raises:
        UserError: Its displacements or states are those of another scene.
    """
    found, wanted = (len(state.q), len(state.v), len(state.z)), (scene.size, scene.size, scene.states)
    if found != wanted:
        a, b = (f"{counted(one[0], 'DOF')} and {counted(one[2], 'state')} of the feedback" for one in (found, wanted))
        raise UserError(f"start: found a state of another scene, of {a}; expected {b}")
    if len(state.F) == scene.motions:
        return state
    return replace(state, F=np.zeros((scene.motions, state.q.shape[1])), memory=None)
