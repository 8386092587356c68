"""The march of a scene: a generator of steps, or whole histories at once, by the same compiled block of steps.

Small scenes march in the modes of their structures; their state advances in blocks of compiled steps. Matrices of large
structures are factored once, around the same compiled feedback and contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.errors import NotConverged, UserError
from gapbeam.solver.scene import force_solve
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.feedback import outputs_of
from gapbeam.solver.scene.feedback_loop import aligned
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
)
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.step_kernel import DAMPED, LAW, LOADED, RUBBED, STORED, WALLED
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.dense_operators import SparseFactor
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
        scheme: Of the time integration.
        linear: The condensed scene for that step and scheme, where it is known.

    Raises:
        UserError: The step is not above 0.
    """

    def __init__(
        self, scene: Scene, step: float, start: SceneState | None = None, lanes: int = 1,
        scheme: LinearScheme = MIDPOINT, linear: Linear | None = None,
    ) -> None:  # fmt: skip
        if not (np.isfinite(step) and step > 0.0):
            raise UserError(f"march: found step {step!r} s, expected a time above 0")
        self.scene, self.h, self.lanes, self.scheme = scene, float(step), lanes, scheme
        if scheme.level < 0.5:
            check_limit(scheme, self.h, self.fastest())
        self.linear = linear or self.condensed()
        self.slabs = scene.slabs(lanes, step, self.linear.delassus, scheme.law)
        state = (start or scene.state()).spread(lanes)
        self.t0, self.count = state.t, 0
        self.space, self.room = rooms(self.linear, len(scene.contacts), lanes)
        self.q, self.v, self.z, self.F = (aligned(one) for one in (state.q, state.v, state.z, state.F))
        self.y, self.inputs = scene.places(self.q, state.t), scene.inputs(self.q)
        self.a: Array = np.zeros((0, lanes))
        if scheme.is_accelerated:
            self.a = np.ascontiguousarray(state.a) if state.a is not None else self.accelerations()
        self.ledger, self.peaks, self.passes = np.zeros((6, lanes)), np.zeros((len(self.linear.watch), 2, lanes)), 0
        self.kept = step_records(self.linear, 0, lanes, False, False)
        self._recall(state.memory)
        self.ledger[STORED] = rest(self.slabs, self.y)[2]

    def _recall(self, memory: Array | None) -> None:
        """Give laws what they remember, (values, lanes); None: nothing but the speed of their contacts."""
        parts = list(self.slabs.memory())
        if memory is not None:
            ends = np.cumsum([part.shape[0] * part.shape[1] for part in parts])
            for part, values in zip(parts, np.split(memory, ends[:-1]), strict=True):
                part[:] = values.reshape(part.shape)
            return
        times = np.array([self.t0, self.t0 + self.h])
        speed = self.scene.contact_rows @ self.v - np.diff(self.scene.walls(times, self.lanes), axis=0)[0] / self.h
        for s, part in enumerate(parts):
            here = self.slabs.motion[self.slabs.start[s] : self.slabs.start[s + 1]]
            names = self.scene.contacts[int(np.searchsorted(self.scene.first, here[0], "right")) - 1].law.kind.memory
            if "speed" in names:
                part[names.index("speed")] = speed[here]

    def fastest(self) -> float:
        """Return the largest angular frequency of the scene with springs of its feedback, rad/s."""
        scene = self.scene
        if scene.is_large:
            raise UserError("march: explicit schemes are for modes; reduce the structure: structure.reduced(modes)")
        K = np.diag(scene.squares)
        for one in scene.feedbacks:
            sense = scene.rows([one.sense])
            K = K - scene.rows([one.act]).T @ one.D[:, : len(sense)] @ sense
        return float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))

    def condensed(self) -> Linear:
        """Return the arrays of the scene for the step."""
        return self.scene.condensed(self.h, self.scheme)

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
        """Return times, values of the loads and places of the walls for a block of steps."""
        times = self.t0 + (self.count + np.arange(steps + 1)) * self.h
        loads = np.zeros((steps, len(self.linear.patterns), self.lanes))
        for j, load in enumerate(self.scene.loads):
            loads[:, j] = load.table(times[:-1] + self.scheme.level * self.h, self.lanes)
        return times, loads, self.scene.walls(times, self.lanes)

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
        peaks = self.peaks.reshape(-1, self.lanes)
        return int(
            kernels(self.lanes)["march"](
                self.linear, self.slabs, self.h, steps, self.q, self.v, self.a, self.y, self.F, self.z, self.inputs,
                loads, walls, self.ledger, peaks, self.kept, self.space, self.room, TOLERANCE,
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
        """Kinetic, strain and contact energy, what was lost, and what was brought in since the start, J."""
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
        """Energy that the midpoint rule never changes: stored, and lost, less what was brought in, J."""
        e = self.energy
        return (
            e["kinetic"] + e["strain"] + e["contact"] + e["damping"] + e["law"] + e["friction"]
            - e["loads"] - e["feedback"] - e["walls"]
        )  # fmt: skip


class SparseMarcher(Marcher):
    """A march in the degrees of freedom of the structures; one lane. A step is one back-substitution."""

    M: Any
    C: Any
    K: Any
    factor: Any

    def condensed(self) -> Linear:
        """Return the arrays of the scene for the step; factors the effective operator."""
        scene, h, scheme = self.scene, self.h, self.scheme
        if scheme.exact:
            raise UserError("march: exact frequencies are for modes; reduce the structure: structure.reduced(modes)")

        def block(name: str) -> Any:
            parts = (getattr(one, name) for one in scene.structures)
            zero = (sp.csr_matrix((one.size, one.size)) for one in scene.structures)
            return sp.block_diag(
                [none if part is None else sp.csr_matrix(part) for part, none in zip(parts, zero, strict=True)],
                format="csr",
            )

        self.M, self.C, self.K = block("M"), block("C"), block("K")
        effective = scheme.inertia[0] / h * self.M + scheme.drag[0] * self.C + scheme.level * h * self.K
        skew = abs(self.C - self.C.T).max() if self.C.nnz else 0.0
        # a symmetric factor has less fill
        self.factor = (SparseFactor if skew == 0.0 else sla.splu)(sp.csc_matrix(effective))

        def solve(right: Array) -> Array:
            return np.asarray(self.factor.solve(np.asfortranarray(right))) if right.size else np.zeros(right.shape)

        none = np.zeros(0)
        return scene.linear(h, scheme, none, none[None], none, none[None], none, solve)

    def without_inertia(self, force: Array) -> Array:
        """Return M^-1 (force - C v - K q)."""
        found: Array = sla.splu(sp.csc_matrix(self.M)).solve(force - self.C @ self.v - self.K @ self.q)
        return found

    def march(self, steps: int, loads: Array, walls: Array) -> int:
        """March so many steps into `kept`; see `Marcher.march`."""
        A, h, meet, kept, total = self.linear, self.h, kernels(1)["meet"], self.kept, 0
        (i0, d, e, g), space = A.scheme, self.space
        a: Array = self.a if len(self.a) else np.zeros_like(self.v)
        _, _, sensed, pushed = A.feed.matrices(len(self.v))
        ports, answers = np.vstack([A.ports, sensed]), np.vstack([A.answers, pushed])
        phi = space.u[len(ports) :][: len(pushed)]
        for k in range(steps):
            lag = d[1] * self.v + d[2] * h * a
            push = A.patterns.T @ loads[k] - self.M @ (i0[1] / h * self.v + i0[2] * a) - self.C @ lag - self.K @ self.q
            w = self.factor.solve(push[:, 0])[:, None]
            space.u[: len(ports)], space.u[len(ports) :], space.moved[:] = ports @ w, 0.0, walls[k + 1] - walls[k]
            passes = meet(
                A, self.slabs, h, loads[k], space.u, self.y, self.F, self.z, self.inputs, self.ledger, space, self.room,
                TOLERANCE,
            )  # fmt: skip
            if passes < 0:
                return -(k + 1)
            w += answers.T @ np.vstack([self.F, phi])
            self.ledger[DAMPED] += h * (w.T @ (self.C @ (d[0] * w + lag)))[0]
            self.q += h * w
            self.v[:], a = e[0] * w + e[1] * self.v + e[2] * h * a, (g[0] * w + g[1] * self.v) / h + g[2] * a
            total += passes
            if len(kept.seen):
                kept.seen[k], kept.felt[k] = A.watch @ self.q, self.F
            if len(kept.energies):
                kept.speeds[k], kept.places[k], kept.works[k] = A.watch @ self.v, self.y, self.worked
                kept.energies[k] = np.vstack([self.ledger, *self.inertia()])
        self.a = a if len(self.a) else self.a
        return total

    def inertia(self) -> tuple[Array, Array]:
        """Return kinetic and strain energy, (1,), J."""
        v, q = self.v[:, 0], self.q[:, 0]
        return np.array([0.5 * v @ (self.M @ v)]), np.array([0.5 * q @ (self.K @ q)])


@dataclass(frozen=True)
class PointMotion:
    """Displacement, m, and velocity, m/s, of a point: a number for one motion, else one for each."""

    displacement: Any
    velocity: Any


@dataclass(frozen=True)
class ContactForce:
    """Mean force of a step on the (first) point, N, and its place relative to the region, m."""

    force: Any
    place: Any


class SceneStep:
    """The present step of a march: step["tip"].displacement, step.contacts["left"].force, step.energy."""

    def __init__(self, marcher: Marcher) -> None:
        self.marcher = marcher

    def __getitem__(self, key: StructurePoint | str) -> PointMotion:
        """Return the motion of a point."""
        scene = self.marcher.scene
        rows = scene.rows_at(scene.point(key))
        return PointMotion(plain(rows @ self.marcher.q), plain(rows @ self.marcher.v))

    @property
    def t(self) -> float:
        """Time, s."""
        return self.marcher.t

    @property
    def energy(self) -> dict[str, Any]:
        """See `Marcher.energy`."""
        return self.marcher.energy

    @property
    def work(self) -> dict[str | int, Any]:
        """See `Marcher.work`."""
        return self.marcher.work

    @property
    def balance(self) -> float:
        """See `Marcher.balance`."""
        return float(self.marcher.balance)

    @property
    def state(self) -> SceneState:
        """A copy of the state."""
        return self.marcher.state

    @property
    def contacts(self) -> dict[str | int, ContactForce]:
        """Force and place of each contact, by its name, or its number where it has none."""
        m, scene = self.marcher, self.marcher.scene
        spans = [(at, at + one.motions) for one, at in zip(scene.contacts, scene.first, strict=False)]
        return {
            one.name or i: ContactForce(plain(m.F[a:b]), plain(m.y[a:b]))
            for i, (one, (a, b)) in enumerate(zip(scene.contacts, spans, strict=True))
        }


def plain(values: Array) -> Any:
    """Return the first lane; a number where there is one motion."""
    one = values[:, 0]
    return float(one[0]) if len(one) == 1 else one.copy()


@checked
def march(
    scene: Scene, step: float, end: float, start: SceneState | None = None, every: int = 1,
    scheme: LinearScheme = MIDPOINT,
) -> Iterator[SceneStep]:  # fmt: skip
    """Yield the scene after each step; between two of them a program may set `load.value` of loads.

    Args:
        scene: The scene.
        step: s.
        end: Time of the last step, s: a whole number of steps from the start.
        start: State at the start, as of `seat`, `scene.state` or `step.state`; default at rest, undeformed.
        every: Steps from one that is yielded to the next.
        scheme: Of the time integration; the default conserves energy in contact at any step.

    Raises:
        UserError: Step or end are out of range.
        NotConverged: The contact forces of a step did not converge.
    """
    marcher = marcher_of(scene, step, start, scheme)
    steps = steps_to(end, marcher.t, step)
    scene.check_feedback(marcher.z, end - marcher.t)
    if every < 1:
        raise UserError(f"march: found every = {every}, expected 1 or more")
    for done in range(0, steps, every):
        marcher.advance(min(every, steps - done))
        yield SceneStep(marcher)


def steps_to(end: float, begin: float, step: float) -> int:
    """Return the number of steps to the end.

    Raises:
        UserError: There is none.
    """
    steps = round((end - begin) / step) if np.isfinite(end) else 0
    if steps < 1:
        raise UserError(f"march: found end {end!r} s, expected at least one step of {step:g} s after {begin:g} s")
    if not end + step > end:
        raise UserError(f"march: found {end:g} s in steps of {step:g} s; round-off of the time is larger than a step")
    return steps


def marcher_of(scene: Scene, step: float, start: SceneState | None = None, scheme: LinearScheme = MIDPOINT) -> Marcher:
    """Return the marcher of a scene: in its modes, or with sparse matrices where a structure is large."""
    return (SparseMarcher if scene.is_large else Marcher)(scene, step, start, scheme=scheme)


@dataclass(frozen=True, eq=False)
class History:
    """Every step of a march.

    Attributes:
        t: Times, (steps,), s.
        displacement: By point, (steps,) for one motion, else (steps, motions), m.
        force: By contact, likewise, N: the mean over the step on the first point.
        last: The last step.
    """

    t: Array
    displacement: dict[str, Array]
    force: dict[str | int, Array]
    last: SceneStep


@checked
def history(
    scene: Scene, step: float, end: float, start: SceneState | None = None, scheme: LinearScheme = MIDPOINT
) -> History:
    """March a scene, and return every step: displacements of all points and forces of all contacts.

    Args:
        scene: See `march`.
        step: s.
        end: s.
        start: See `march`.
        scheme: See `march`.

    Raises:
        UserError: As `march`.
        NotConverged: As `march`.
    """
    marcher = marcher_of(scene, step, start, scheme)
    steps = steps_to(end, marcher.t, step)
    scene.check_feedback(marcher.z, end - marcher.t)
    parts = [marcher.advance(min(BLOCK, steps - done), record=True) for done in range(0, steps, BLOCK)]
    seen, felt = (np.concatenate([part[i] for part in parts])[..., 0] for i in (0, 1))
    displacement, at = dict[str, Array](), 0
    for name, point in scene.point_names.items():
        displacement[name], at = _squeezed(seen[:, at : at + len(point.rows)]), at + len(point.rows)
    force: dict[str | int, Array] = {}
    for i, (one, first) in enumerate(zip(scene.contacts, scene.first, strict=False)):
        force[one.name or i] = _squeezed(felt[:, first : first + one.motions])
    times = marcher.t0 + step * np.arange(1, steps + 1)
    return History(times, displacement, force, SceneStep(marcher))


def _squeezed(columns: Array) -> Array:
    return columns[:, 0] if columns.shape[1] == 1 else columns
