"""Ensembles: many members of a scene in lock-step, 64 to a block, blocks over threads, by the kernel of one march.

Features are computed on the fly, block by block: contact forces, harmonics, strobes and histories.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive
from gapbeam.solver.scene.ensemble_members import (
    SAMPLES,
    EnsembleFolder,
    LaneFigures,
    Members,
    ensemble_key,
    joined,
    lane_figure_faults,
    untrusted,
)
from gapbeam.solver.scene.linear_scheme import MIDPOINT, Linear, LinearScheme, Slabs, StepRecords, step_sums
from gapbeam.solver.scene.marcher import BLOCK, Marcher
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.touch_kernel import WIDTH
from gapbeam.solver.schema.record_table import faces_of
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class FeaturePlan:
    """Features that an ensemble takes, in steps.

    Attributes:
        steps: Steps of the march.
        settle: Steps before features count.
        period: Steps of a period; 0: none.
        harmonics: Harmonics of the period.
        strobes: Ends of the last periods at which states are kept.
        every: Steps from one kept place of a history to the next; 0: no histories.
    """

    steps: int
    settle: int = 0
    period: int = 0
    harmonics: int = -1
    strobes: int = 0
    every: int = 0

    def blocks(self, longest: int) -> list[int]:
        """Return numbers of steps: up to where features count, up to the strobes, then periods."""
        strobed = self.strobes * self.period
        found: list[int] = []
        for count in (self.settle, self.steps - self.settle - strobed):
            found += [min(longest, count - done) for done in range(0, count, longest)]
        return found + [self.period] * self.strobes


class LaneFeatures:
    """Features of the lanes of one march: sums of its kernel, and from its records histories and figures of one's own.

    Args:
        scene: The scene.
        plan: The requested features.
        lanes: Members side by side.
        h: Step, s.
        t0: Time of the start, s.
        figures: Figures of one's own.
    """

    def __init__(
        self, scene: Scene, plan: FeaturePlan, lanes: int, h: float, t0: float, figures: Sequence[Figure] = ()
    ) -> None:  # fmt: skip
        self.scene, self.plan, self.h = scene, plan, h
        self.own = LaneFigures(scene, figures, lanes)
        self.done, turns = 0, np.zeros((0, 0))
        if plan.harmonics >= 0:  # the period repeats, so that a table of one period is enough
            phase = 2.0 * np.pi * np.arange(plan.harmonics + 1)[:, None] * np.arange(1, plan.period + 1) / plan.period
            phase = phase + 2.0 * np.pi * np.arange(plan.harmonics + 1)[:, None] * t0 / (plan.period * h)
            turns = np.vstack([np.cos(phase), -np.sin(phase)])
        first = np.asarray(scene.first, dtype=np.int64)
        self.names = [one.name or i for i, one in enumerate(scene.contacts)]
        self.faces = {
            name: [self.names.index(one) for one in points]
            for name, points in faces_of(self.names).items() if len(points) > 1 and name not in self.names
        }  # fmt: skip
        face = np.full(len(self.names), -1, dtype=np.int64)
        for i, points in enumerate(self.faces.values()):
            face[points] = i
        self.sums = step_sums(scene.watched, first, face, lanes, turns, plan.settle)
        self.kept: list[Array] = []
        self.felt: list[Array] = []
        self.states: list[Array] = []

    def begin(self, marcher: Marcher) -> None:
        """Begin to count, at the present state of a march."""
        sizes, watch = self._sizes(marcher.F[None])[0], marcher.linear.watch
        whole = [sizes[points].sum(axis=0)[None] for points in self.faces.values()]
        self.sums.before[:] = np.concatenate([sizes, *whole]) > 0.0
        marcher.sums, marcher.slabs.spent[:] = self.sums, 0.0
        if self.own.parts:
            self.own.begin(marcher.t, watch @ marcher.q, watch @ marcher.v, sizes)

    @property
    def needs_records(self) -> bool:
        """True where sums are not enough."""
        return self.plan.every > 0 or bool(self.own.parts)

    def add(self, steps: int, kept: StepRecords) -> None:
        """Take in a block of steps."""
        if self.own.parts:
            self.own.add(self.h, kept.seen, kept.speeds, self._sizes(kept.felt))
        if self.plan.every:
            pick = slice(-(self.done + 1) % self.plan.every, None, self.plan.every)
            self.kept.append(kept.seen[pick].copy())
            self.felt.append(kept.felt[pick].copy())
        self.done += steps

    def strobe(self, q: Array, v: Array) -> None:
        """Keep a state."""
        self.states.append(np.vstack([q, v]))

    def _sizes(self, felt: Array) -> Array:
        """Return the size of each contact's force, (steps, contacts, lanes), N."""
        if self.scene.motions == len(self.scene.contacts):
            return np.abs(felt)
        parts = zip(self.scene.contacts, self.scene.first, strict=False)
        return np.stack([np.sqrt((felt[:, at : at + one.motions] ** 2).sum(axis=1)) for one, at in parts], axis=1)

    def _whole(self, parts: list[Array]) -> Array | None:
        """Return a history; where the march ended early, followed by NaN."""
        plan = self.plan
        if not plan.every:
            return None
        shape = (self.scene.watched if parts is self.kept else self.scene.motions, self.sums.before.shape[1])
        rows = (plan.steps - plan.settle) // plan.every - sum(map(len, parts))
        whole: Array = np.concatenate([*parts, np.full((rows, *shape), np.nan)])
        return whole

    def contact_features(self, slabs: Slabs, cut: Array) -> dict[str, Any]:
        """Return features by their name, then by contact; only the lanes of `cut`, which is added."""
        sums, count, work = self.sums, len(cut), np.zeros((len(self.names), self.sums.top.shape[1]))
        work[np.searchsorted(self.scene.first[:-1], slabs.motion)] = slabs.spent
        hard = np.array([one.is_impulsive for one in self.scene.contacts], dtype=bool)
        sums.top[[*hard, *(hard[points].any() for points in self.faces.values())]] = np.nan
        tables = {
            "peak_force": sums.top, "impulse": self.h * sums.total, "impacts": sums.closings,
            "closed": self.h * sums.closed, "work": work,
        }  # fmt: skip
        names = [*self.names, *self.faces]
        return {
            key: {name: one[:count] + cut for name, one in zip(names, table, strict=False)}
            for key, table in tables.items()
        }

    def point_features(self, cut: Array) -> dict[str, Any]:
        """Return peaks, harmonics and histories by point, histories of forces by contact."""
        count, at, steps, sums = len(cut), 0, self.plan.steps - self.plan.settle, self.sums
        waves, kept, forces, peak, rms = (dict[Any, Any]() for _ in range(5))
        slots = sums.at[1]  # what the window holds
        cosines, sines = np.split(sums.waves + sums.turned[:, :slots] @ sums.window[:, :slots], 2, axis=1)
        half = cosines.shape[1]
        scale = np.where(np.arange(half) == 0, 1.0, 2.0)[:, None, None] / steps
        whole = scale * (cosines + 1j * sines).swapaxes(0, 1)
        seen = self._whole(self.kept)
        for name, point in self.scene.point_names.items():
            rows = slice(at, at + len(point.rows)) if len(point.rows) > 1 else at
            at += len(point.rows)
            peak[name] = sums.most[rows, :count] + cut
            rms[name] = np.sqrt(sums.square[rows, :count] / steps) + cut
            if half:
                waves[name] = whole[:, rows, :count] + cut
            if seen is not None:
                kept[name] = seen[:, rows, :count] + cut
        if seen is not None:
            felt = self._whole(self.felt)
            assert felt is not None
            for i, (one, first) in enumerate(zip(self.scene.contacts, self.scene.first, strict=False)):
                rows = slice(first, first + one.motions) if one.motions > 1 else int(first)
                forces[one.name or i] = felt[:, rows, :count] + cut
        return {"peak": peak, "rms": rms, "harmonics": waves, "displacement": kept, "force": forces}


FEW = 6
"""Members of a block up to which each marches alone: a block of 64 lanes costs as much as some six single marches."""


def _lanes(count: int) -> int:
    """Return the lanes of a block, a power of two: one of 8 lanes takes half the time that one of 64 takes."""
    return 1 << (count - 1).bit_length()


@checked
def ensemble(
    scene: Scene, values: Mapping[str, Any] | None = None, *, step: Any, end: Any, start: SceneState | None = None,
    members: int | None = None, threads: int | None = None, scheme: LinearScheme = MIDPOINT, settle: Any = None,
    period: Any = None, harmonics: int | None = None, strobes: int = 0, every: int = 0,
    output: str | Path | None = None, figures: Sequence[Figure] = (),
) -> Members:  # fmt: skip
    """March many members of a scene at once, and return their features.

    Members of one step march 64 side by side; those that have a step (or a damping, or a flow) of their own march
    alone, which costs some eight times more each.

    Args:
        scene: The scene that all members share.
        values: Their differences: arrays (members,) by path, as in `scene.with_`; an offset of two motions:
            (members, 2).
        step: s; a number, or one for each member, such as the period of its load over a number of steps.
        end: s; likewise; all members take as many steps.
        start: One state for all, or lanes of one for each member.
        members: Their number, where neither values nor start say so.
        threads: Blocks of 64 members side by side; default the processors of this process.
        scheme: Scheme of the time integration.
        settle: Time from which features count, s; default the start.
        period: Period of the load, s: a whole number of steps.
        harmonics: Amplitudes of so many harmonics of the period, and of the mean; over whole periods.
        strobes: States at the ends of the last so many periods.
        every: Steps from one place of kept histories to the next; 0 keeps none.
        output: A folder for finished blocks. A call with the same folder continues there, to the same bits.
        figures: Figures of one's own (`gapbeam.figure`), from the time `settle` on: of displacements and velocities at
            points and contact forces; all statistics but quantile and probability.

    Raises:
        UserError: A figure cannot be gathered in lock-step, a path names nothing, lengths differ, times are no whole
            number of steps, the folder has another ensemble, or a structure is too large for ensembles.
        NotWritten: The folder takes no block.
    """
    given = {path: np.atleast_1d(finite(value, path)) for path, value in (values or {}).items()}
    lengths = {path: len(value) for path, value in given.items()}
    if deep := [path for path, value in given.items() if value.ndim > 1 and not path.endswith(".offset")]:
        raise UserError(f"ensemble: {deep[0]}: found shape {given[deep[0]].shape}, expected one value for each member")
    times = {"step": step, "end": end, "settle": settle, "period": period}
    clock = {name: finite(value, f"ensemble: {name}") for name, value in times.items() if value is not None}
    if missing := [name for name in ("step", "end") if name not in clock]:
        raise UserError(f"ensemble: {' and '.join(missing)}: found None, expected times, s")
    if flat := [name for name, value in clock.items() if value.ndim > 1]:
        raise UserError(f"ensemble: {' and '.join(flat)}: expected a number, or one for each member")
    lengths |= {name: len(value) for name, value in clock.items() if value.ndim == 1}
    if start is not None and start.q.shape[1] > 1:
        lengths["start"] = start.q.shape[1]
    if members is not None:
        lengths["members"] = members
    if len(set(lengths.values())) != 1 or min(lengths.values()) < 1:
        found = ", ".join(f"{name}: {count}" for name, count in lengths.items()) or "none"
        raise UserError(f"ensemble: expected one length for all values (members); found {found}")
    if scene.is_large:
        raise UserError("ensemble: a structure is too large; reduce it: gapbeam.reduced_at_points")
    grown = next((one for one in scene.contacts if one.grows), None)
    if grown is not None:
        raise UserError(
            f"ensemble: found contact {grown.name or '?'}, region {grown.region.kind.name}, whose clearance changes, "
            "expected half planes or constant clearances; march the scenes one by one"
        )
    count = next(iter(lengths.values()))
    state = start or scene.state()
    steps = {name: np.broadcast_to(value, (count,)) for name, value in clock.items()}
    plan = _planned(steps, state.t, harmonics, strobes, every)
    for one, words in lane_figure_faults(scene, figures):
        raise UserError(f"ensemble: figure {one.name}: {words}")
    scene.with_({path: value[0] for path, value in given.items()})  # all faults now, not in a thread
    factors = sorted(path for path in given if scene.is_condensed(path))
    job = _Job(scene, given, steps["step"], plan, state, scheme, factors, tuple(figures))
    folder = None
    if output is not None:
        when = state.t + float(steps["step"].max()) * plan.steps * np.linspace(0.0, 1.0, SAMPLES)
        whole = scene.with_({path: value for path, value in given.items() if path not in factors})
        key = ensemble_key(whole, given, count, state, when, scheme, plan, steps["step"].tolist(), *figures)
        folder = EnsembleFolder(Path(output), key)
    return job.run(folder, threads or len(os.sched_getaffinity(0)))


def _planned(times: dict[str, Array], t0: float, harmonics: int | None, strobes: int, every: int) -> FeaturePlan:
    """Return all times as numbers of steps, the same for all members."""
    h = positive(times["step"], "ensemble: step")

    def steps(name: str, span: Array, least: int) -> int:
        found = np.round(span / h)
        if found.min() < least or found.max() != found.min():
            raise UserError(
                f"ensemble: {name} is {found.min():.0f} to {found.max():.0f} steps after the start; expected one "
                f"number for all members, from {least} on"
            )
        return int(found[0])

    end, settle = steps("end", times["end"] - t0, 1), 0
    if "settle" in times:
        settle = steps("settle", times["settle"] - t0, 0)
    if settle >= end:
        raise UserError(f"ensemble: features count from step {settle} on, but the march has {end} steps")
    period = 0
    if "period" in times:
        period = steps("period", times["period"], 1)
        if not np.all(np.abs(times["period"] / h - period) <= 1e-6 * period):
            raise UserError("ensemble: the period is no whole number of steps; take step = period / n")
    if min(strobes, every, harmonics or 0) < 0:
        raise UserError("ensemble: strobes, harmonics and every are numbers from 0 on")
    if (harmonics is not None or strobes) and not period:
        raise UserError("ensemble: harmonics and strobes need the period of the load: period=...")
    if harmonics is not None and ((end - settle) % period or 2 * harmonics >= period):
        raise UserError(
            f"ensemble: features count over {end - settle} steps, of {period} each period, with {harmonics} harmonics; "
            "expected whole periods, and more than two steps for each harmonic"
        )
    if strobes * period > end - settle:
        raise UserError(
            f"ensemble: {strobes} strobes need {strobes * period} steps after settling; found {end - settle}"
        )
    return FeaturePlan(end, settle, period, -1 if harmonics is None else harmonics, strobes, every)


@dataclass(frozen=True, eq=False)
class _Job:
    scene: Scene
    values: dict[str, Array]
    step: Array
    plan: FeaturePlan
    start: SceneState
    scheme: LinearScheme
    factors: list[str]
    figures: tuple[Figure, ...]

    @cached_property
    def groups(self) -> list[Any]:
        """Members of one step and damping, 64 to a block."""
        keys = np.column_stack([self.step, *(self.values[path] for path in self.factors)])
        _, which = np.unique(keys, axis=0, return_inverse=True)
        blocks = []
        for group in range(which.max() + 1):
            some = np.flatnonzero(which.ravel() == group)
            blocks += [some[i : i + WIDTH] for i in range(0, len(some), WIDTH)]
        return blocks

    def run(self, folder: EnsembleFolder | None, threads: int) -> Members:
        """March all blocks that are not in the folder, side by side."""
        linears: dict[Any, Linear] = {}
        lock = Lock()

        def condensed(index: Any) -> Linear:
            key = (self.step[index[0]], *(self.values[path][index[0]] for path in self.factors))
            with lock:
                if key not in linears:
                    if len(linears) > 64:  # members with a step of their own: memory stays bounded
                        linears.clear()
                    part = self.scene.with_({path: float(self.values[path][index[0]]) for path in self.factors})
                    if part.states != len(self.start.z) and self.start.z.any():
                        raise UserError(
                            f"ensemble: the feedback has {len(self.start.z)} states at the start and {part.states} in "
                            "a member; begin where the states are 0, or march that member alone"
                        )
                    part.check_feedback(self.start.z, self.plan.steps * float(self.step[index[0]]))
                    linears[key] = part.condensed(float(self.step[index[0]]), self.scheme)
                return linears[key]

        def one(number: int) -> Members:
            found = folder.block(number, self.scene) if folder else None
            if found is None:
                index = self.groups[number]
                found = self.block(index, condensed(index))
                if folder:
                    folder.keep(number, found)
            return found

        for lanes in {1 if len(group) <= FEW else _lanes(len(group)) for group in self.groups}:
            index = np.full(lanes, self.groups[0][0])  # compiles in this thread: numba's typing is not for several
            part = self.scene.with_(self._values(index))
            h, start = float(self.step[index[0]]), self._start(part, index)
            Marcher(part, h, start, lanes, self.scheme, condensed(index)).advance(0)
        with ThreadPoolExecutor(threads) as pool:
            tasks = [pool.submit(one, number) for number in range(len(self.groups))]
            try:
                parts = [task.result() for task in tasks]
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
        return joined(parts, np.argsort(np.concatenate(self.groups), kind="stable"))

    def block(self, members: Any, linear: Linear) -> Members:
        """March one block; where one member fails, or they are few, they march one by one."""
        count, plan = len(members), self.plan
        if 1 < count <= FEW:
            return self._apart(members, linear)
        lanes = _lanes(count)
        index = members[np.minimum(np.arange(lanes), count - 1)]
        h, part = float(self.step[index[0]]), self.scene.with_(self._values(index))
        marcher = Marcher(part, h, self._start(part, index), lanes, self.scheme, linear)
        features = LaneFeatures(part, plan, lanes, h, marcher.t, self.figures)
        first = np.array(marcher.balance, ndmin=1)
        failed, done = np.zeros(count, dtype=bool), 0
        if plan.settle == 0:
            features.begin(marcher)
        records, speeds = features.needs_records, any(one.figure.quantity == "velocity" for one in features.own.parts)
        try:
            with np.errstate(all="ignore"):  # a member that fails is found by its step
                for steps in plan.blocks(BLOCK // 4):
                    counts = done >= plan.settle
                    kept = marcher.advance(steps, record=counts and records, energies=counts and speeds)
                    done += steps
                    if done > plan.settle:
                        features.add(steps, kept)
                    elif done == plan.settle:
                        features.begin(marcher)
                    if done > plan.steps - plan.strobes * plan.period:
                        features.strobe(marcher.q, marcher.v)
        except NotConverged:
            if count > 1:
                return self._apart(members, linear)
            failed[:] = True
        return self._found(marcher, features, failed, first)

    def _apart(self, members: Any, linear: Linear) -> Members:
        parts = [self.block(members[i : i + 1], linear) for i in range(len(members))]
        return joined(parts, np.arange(len(members)))

    def _found(self, marcher: Marcher, features: LaneFeatures, failed: Any, first: Array) -> Members:
        plan, count = self.plan, len(failed)
        cut = np.where(failed, np.nan, 0.0)
        energy = {name: np.array(value, ndmin=1)[:count] + cut for name, value in marcher.energy.items()}
        balance = (np.array(marcher.balance, ndmin=1) - first)[:count] + cut
        q, v, z = (one[:, :count] + cut for one in (marcher.q, marcher.v, marcher.z))
        strobes = np.array(features.states).reshape(len(features.states), 2 * len(q), marcher.lanes)[..., :count]
        if len(strobes) < plan.strobes:
            strobes = np.full((plan.strobes, 2 * len(q), count), np.nan)
        keeps = self.scheme.level == 0.5 and self.scheme.law == 0.0 and not self.scheme.is_accelerated
        return Members(
            q=q, v=v, z=z, span=np.full(count, marcher.h * (plan.steps - plan.settle)),
            **features.contact_features(marcher.slabs, cut), **features.point_features(cut), energy=energy,
            balance=balance, strobes=strobes, failed=failed,
            figures={name: value[:count] + cut for name, value in features.own.values().items()},
            untrusted=untrusted(energy, balance, first[:count], keeps),
        )  # fmt: skip

    def _values(self, index: Any) -> dict[str, Any]:
        """Return the values of these members; one member: numbers, so that its march is that of a scene of its own."""
        if len(index) == 1:
            return {path: value[index[0]] for path, value in self.values.items()}
        return {path: value[index[0]] if path in self.factors else value[index] for path, value in self.values.items()}

    def _start(self, part: Scene, index: Any) -> SceneState:
        state = self.start
        state = state if len(state.z) == part.states else replace(state, z=np.zeros((part.states, 1)))

        def pick(a: Array) -> Array:
            return a[:, index] if a.shape[1] > 1 else np.repeat(a, len(index), axis=1)

        a, memory = (None if one is None else pick(one) for one in (state.a, state.memory))
        return SceneState(state.t, pick(state.q), pick(state.v), pick(state.z), pick(state.F), a, memory)
