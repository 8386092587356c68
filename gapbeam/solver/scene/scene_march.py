"""The march of a scene: a generator of steps, or whole histories at once, by the same blocks of steps.

Small scenes march in the modes of their structures; their state advances in blocks of compiled steps. Matrices of large
structures are factored once, around the same compiled feedback and contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.marcher import BLOCK, Marcher
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.recorded_places import gauges_of
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.sparse_march import MovingMarcher, SparseMarcher
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array


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
    """The present step of a march: step["tip"].displacement, step.contacts["left"].force, step.energy.

    Only the present one has values: keep numbers, `step.state` or a `history`, not steps.
    """

    def __init__(self, marcher: Marcher) -> None:
        self._marcher, self.t = marcher, marcher.t

    @property
    def marcher(self) -> Marcher:
        """The march, while it is at this step.

        Raises:
            UserError: A later step was marched since.
        """
        if self._marcher.t != self.t:
            raise UserError(
                f"march: found a step of {self.t:.6g} s, and the march is at {self._marcher.t:.6g} s; expected the "
                "present step: keep numbers of it or step.state, or take gapbeam.history"
            )
        return self._marcher

    def __repr__(self) -> str:
        """Return the step in one line."""
        return f"<step at {self.t:.6g} s>"

    def __getitem__(self, key: StructurePoint | str) -> PointMotion:
        """Return the motion of a point."""
        scene = self.marcher.scene
        rows = scene.rows_at(scene.point(key))
        return PointMotion(plain(rows @ self.marcher.q), plain(rows @ self.marcher.v))

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
        spans = [(at, at + one.region.motions) for one, at in zip(scene.contacts, scene.first, strict=False)]
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
        scheme: Scheme of the time integration; the default conserves energy in contact at any step.

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
        UserError: There is no step up to the end.
    """
    steps = round((end - begin) / step) if np.isfinite(end) else 0
    if steps < 1:
        raise UserError(f"march: found end {end!r} s, expected at least one step of {step:g} s after {begin:g} s")
    if not end + step > end:
        raise UserError(f"march: found {end:g} s in steps of {step:g} s; round-off of the time is larger than a step")
    return steps


def marcher_of(
    scene: Scene, step: float, start: SceneState | None = None, scheme: LinearScheme = MIDPOINT,
    watch: Array | None = None,
) -> Marcher:  # fmt: skip
    """Return the marcher of a scene: in its modes, with sparse matrices where a structure is large, or points move.

    It also watches more rows, (rows, n), behind those of points.
    """
    kind = MovingMarcher if scene.is_moving else SparseMarcher if scene.is_large else Marcher
    return kind(scene, step, start, scheme=scheme, watch=watch)


@dataclass(frozen=True, eq=False)
class History:
    """Every step of a march.

    Attributes:
        t: Times, (steps,), s.
        displacement: Displacement by point, (steps,) for one motion, else (steps, motions), m.
        velocity: Velocity by point, likewise, m/s.
        force: Force by contact, likewise, N: the mean over the step on the first point.
        last: The last step.
        reaction: Force along x, y and z, N, and moment about them, N m, on the structure by each support with a
            reaction, (steps, 6): means over the step.
        stress: Stress along the axis at the surface, positive in tension, (steps,), Pa, by point with a gauge; by
            "point 1" and so on where it has several motions.
    """

    __repr__ = result_words

    t: Array
    displacement: dict[str, Array]
    velocity: dict[str, Array]
    force: dict[str | int, Array]
    last: SceneStep
    stress: dict[str, Array] = field(default_factory=dict)
    reaction: dict[str, Array] = field(default_factory=dict)


@checked
def history(
    scene: Scene, step: float, end: float, start: SceneState | None = None, scheme: LinearScheme = MIDPOINT
) -> History:
    """March a scene, and return every step: displacements and velocities of all points, and forces of all contacts.

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
    gauges, supports = gauges_of(scene), ReactionRows(scene)
    axial = np.array([rows[0] for rows in gauges.values()]).reshape(-1, scene.size)
    marcher = marcher_of(scene, step, start, scheme, np.vstack([axial, supports.rows]))
    begin = supports.motion_in(marcher.q[:, 0], marcher.v[:, 0])
    steps = steps_to(end, marcher.t, step)
    scene.check_feedback(marcher.z, end - marcher.t)
    parts = [marcher.advance(min(BLOCK, steps - done), energies=True)[:3] for done in range(0, steps, BLOCK)]
    seen, felt, speeds = (np.concatenate(some)[..., 0] for some in zip(*parts, strict=True))
    displacement, velocity, at = dict[str, Array](), dict[str, Array](), 0
    for name, point in scene.point_names.items():
        mine, at = slice(at, at + len(point.rows)), at + len(point.rows)
        displacement[name], velocity[name] = _squeezed(seen[:, mine]), _squeezed(speeds[:, mine])
    force: dict[str | int, Array] = {}
    for i, (one, first) in enumerate(zip(scene.contacts, scene.first, strict=False)):
        force[one.name or i] = _squeezed(felt[:, first : first + one.region.motions])
    times = marcher.t0 + step * np.arange(1, steps + 1)
    stress, held = dict(zip(gauges, seen[:, at : at + len(axial)].T, strict=True)), slice(at + len(axial), None)
    found = np.moveaxis(supports.over_steps(times, step, begin, seen[:, held], speeds[:, held]), 1, 0)
    reaction = dict(zip(supports.names, found, strict=True))
    return History(times, displacement, velocity, force, SceneStep(marcher), stress, reaction)


def _squeezed(columns: Array) -> Array:
    return columns[:, 0] if columns.shape[1] == 1 else columns
