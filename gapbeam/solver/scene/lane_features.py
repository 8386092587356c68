"""Features of lanes on the fly: contact forces, harmonics, strobes and histories, block by block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.scene.condensed_arrays import Slabs
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class FeaturePlan:
    """Features that an ensemble takes, in steps.

    Attributes:
        steps: Of the march.
        settle: Steps before features count.
        period: Steps of a period; 0: none.
        harmonics: Of the period.
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
    """Sums, peaks and counts of the lanes of one march.

    Args:
        scene: The scene.
        plan: The requested features.
        lanes: Members side by side.
        h: Step, s.
        t0: Time of the start, s.
    """

    def __init__(self, scene: Scene, plan: FeaturePlan, lanes: int, h: float, t0: float) -> None:
        self.scene, self.plan, self.h = scene, plan, h
        zero = np.zeros((len(scene.contacts), lanes))
        self.top, self.impulse, self.impacts, self.closed = zero.copy(), zero.copy(), zero.copy(), zero.copy()
        self.before = zero > 0.0
        self.done, self.watched = 0, sum(len(one.rows) for one in scene.point_names.values())
        self.waves, self.turns = np.zeros((2 * plan.harmonics + 2, self.watched, lanes)), np.zeros((0, 0))
        if plan.harmonics >= 0:  # the period repeats, so that a table of one period is enough
            phase = 2.0 * np.pi * np.arange(plan.harmonics + 1)[:, None] * np.arange(1, plan.period + 1) / plan.period
            phase = phase + 2.0 * np.pi * np.arange(plan.harmonics + 1)[:, None] * t0 / (plan.period * h)
            self.turns = np.vstack([np.cos(phase), -np.sin(phase)])
        self.kept: list[Array] = []
        self.felt: list[Array] = []
        self.states: list[Array] = []

    def begin(self, F: Array) -> None:
        """Begin to count, at a state with contact forces F."""
        self.before = self._sizes(F[None])[0] > 0.0

    def add(self, seen: Array, felt: Array) -> None:
        """Count a block of steps: displacements (steps, watched, lanes), forces (steps, motions, lanes)."""
        size = self._sizes(felt)
        touched = size > 0.0
        self.top = np.maximum(self.top, size.max(axis=0, initial=0.0))
        self.impulse += self.h * size.sum(axis=0)
        self.closed += self.h * touched.sum(axis=0)
        self.impacts += (touched[0] & ~self.before) + (touched[1:] & ~touched[:-1]).sum(axis=0)
        self.before = touched[-1]
        if len(self.turns):
            index = (self.plan.settle + self.done + np.arange(len(seen))) % self.plan.period
            self.waves += np.tensordot(self.turns[:, index], seen, axes=1)
        if self.plan.every:
            pick = slice(-(self.done + 1) % self.plan.every, None, self.plan.every)
            self.kept.append(seen[pick].copy())
            self.felt.append(felt[pick].copy())
        self.done += len(seen)

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
        shape = (self.watched if parts is self.kept else self.scene.motions, self.top.shape[1])
        rows = (plan.steps - plan.settle) // plan.every - sum(map(len, parts))
        whole: Array = np.concatenate([*parts, np.full((rows, *shape), np.nan)])
        return whole

    def contact_features(self, slabs: Slabs, cut: Array) -> dict[str, Any]:
        """Return features by their name, then by contact; only the lanes of `cut`, which is added."""
        work, count = np.zeros_like(self.top), len(cut)
        work[np.searchsorted(self.scene.first[:-1], slabs.motion)] = slabs.spent
        tables = {
            "peak_force": self.top, "impulse": self.impulse, "impacts": self.impacts, "closed": self.closed,
            "work": work,
        }  # fmt: skip
        names = [one.name or i for i, one in enumerate(self.scene.contacts)]
        return {key: {name: table[i, :count] + cut for i, name in enumerate(names)} for key, table in tables.items()}

    def point_features(self, cut: Array) -> dict[str, Any]:
        """Return harmonics and histories by point, histories of forces by contact."""
        count, at = len(cut), 0
        waves, kept, forces = dict[Any, Any](), dict[Any, Any](), dict[Any, Any]()
        half = len(self.waves) // 2
        scale = np.where(np.arange(half) == 0, 1.0, 2.0)[:, None, None] / max(self.done, 1)
        whole = scale * (self.waves[:half] + 1j * self.waves[half:])
        seen = self._whole(self.kept)
        for name, point in self.scene.point_names.items():
            rows = slice(at, at + len(point.rows)) if len(point.rows) > 1 else at
            at += len(point.rows)
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
        return {"harmonics": waves, "displacement": kept, "force": forces}
