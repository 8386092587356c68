"""Ensembles: many members of a scene in lock-step, 64 to a block, blocks over threads, by the kernel of one march."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from gapbeam.solver.errors import NotConverged, UserError
from gapbeam.solver.scene.condensed_arrays import Linear
from gapbeam.solver.scene.given_numbers import finite
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.modal_march import BLOCK, Marcher
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_march import steps_to
from gapbeam.solver.scene.touch_kernel import WIDTH
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True, eq=False)
class Members:
    """Results of an ensemble; the last axis is the member, and values of a member that failed are NaN.

    Attributes:
        q: Coordinates at the end, (n, members).
        v: Velocities at the end.
        z: States of the feedback at the end.
        peak: By point, the largest displacement in absolute value, (members,), or (motions, members), m.
        rms: By point, the root of the mean square of the displacement, m.
        energy: As of `step.energy`, by name, (members,), J.
        balance: Energy that the scheme made or lost, (members,), J.
        failed: Members whose contact forces did not converge in some step.
    """

    q: Array
    v: Array
    z: Array
    peak: dict[str, Array]
    rms: dict[str, Array]
    energy: dict[str, Array]
    balance: Array
    failed: Any


def ensemble(
    scene: Scene, values: Mapping[str, Any] | None = None, *, step: float, end: float, start: SceneState | None = None,
    members: int | None = None, threads: int | None = None, scheme: LinearScheme = MIDPOINT,
) -> Members:  # fmt: skip
    """March many members of a scene at once.

    Args:
        scene: What all members share.
        values: What they differ in: arrays (members,) by path, as in `scene.with_`.
        step: s.
        end: s.
        start: One state for all, or lanes of one for each member.
        members: How many, where neither values nor start say so.
        threads: Blocks of 64 members side by side; default the processors of this process.
        scheme: Of the time integration.

    Raises:
        UserError: A path names nothing, lengths differ, or a structure is too large for ensembles.
    """
    given = {path: np.atleast_1d(finite(value, path)) for path, value in (values or {}).items()}
    lengths = {path: len(value) for path, value in given.items()}
    if start is not None and start.q.shape[1] > 1:
        lengths["start"] = start.q.shape[1]
    if members is not None:
        lengths["members"] = members
    if len(set(lengths.values())) != 1 or min(lengths.values()) < 1:
        found = ", ".join(f"{name}: {count}" for name, count in lengths.items()) or "none"
        raise UserError(f"ensemble: expected one length for all values (members); found {found}")
    alike = sorted(path for path in given if path.endswith((".offset", ".sliding")))
    if alike:
        raise UserError(f"ensemble: {', '.join(alike)}: all members share offset and sliding speed")
    if scene.is_large:
        raise UserError("ensemble: a structure has too many DOFs; reduce it: structure.reduced(modes)")
    count = next(iter(lengths.values()))
    scene.with_({path: float(value[0]) for path, value in given.items()})  # all faults now, not in a thread
    blocks = [slice(i, min(i + WIDTH, count)) for i in range(0, count, WIDTH)]
    job = _Job(scene, given, step, end, start, scheme, scene.condensed(step, scheme))
    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0))) as pool:
        return _joined(list(pool.map(job.block, blocks)))


@dataclass(frozen=True, eq=False)
class _Job:
    scene: Scene
    values: dict[str, Array]
    step: float
    end: float
    start: SceneState | None
    scheme: LinearScheme
    linear: Linear

    def block(self, block: slice) -> Members:
        """March one block; where one fails, its members march one by one."""
        count = block.stop - block.start
        index = np.minimum(np.arange(WIDTH) + block.start, block.stop - 1)
        part = self.scene.with_({path: value[index] for path, value in self.values.items()})
        marcher = Marcher(part, self.step, self._start(index), WIDTH, self.scheme, self.linear)
        steps, first, failed = steps_to(self.end, marcher.t, self.step), marcher.balance, np.zeros(count, dtype=bool)
        try:
            for done in range(0, steps, BLOCK // 4):
                marcher.advance(min(BLOCK // 4, steps - done))
        except NotConverged:
            if count > 1:
                return _joined([self.block(slice(i, i + 1)) for i in range(block.start, block.stop)])
            failed[:] = True
        cut = np.where(failed, np.nan, 0.0)
        peak, rms, at = {}, {}, 0
        for name, point in self.scene.point_names.items():
            rows = marcher.peaks[at : at + len(point.rows)]
            at += len(point.rows)
            large, square = rows[:, 0, :count] + cut, rows[:, 1, :count] + cut
            peak[name] = large[0] if len(rows) == 1 else large
            rms[name] = np.sqrt((square[0] if len(rows) == 1 else square) / steps)
        energy = {name: value[..., :count] + cut for name, value in marcher.energy.items()}
        q, v, z = (one[:, :count] + cut for one in (marcher.q, marcher.v, marcher.z))
        return Members(q, v, z, peak, rms, energy, (marcher.balance - first)[..., :count] + cut, failed)

    def _start(self, index: Any) -> SceneState:
        state = self.start or self.scene.state()

        def pick(a: Array) -> Array:
            return a[:, index] if a.shape[1] > 1 else np.repeat(a, len(index), axis=1)

        a = None if state.a is None else pick(state.a)
        return SceneState(state.t, pick(state.q), pick(state.v), pick(state.z), pick(state.F), a)


def _joined(parts: list[Members]) -> Members:
    """Return blocks one after the other."""

    def along(values: list[Any]) -> Any:
        if isinstance(values[0], dict):
            return {name: along([one[name] for one in values]) for name in values[0]}
        return np.concatenate(values, axis=-1)

    return Members(**{one.name: along([getattr(part, one.name) for part in parts]) for one in fields(Members)})
