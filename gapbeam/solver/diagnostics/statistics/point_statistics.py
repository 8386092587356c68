"""Statistics of a run with those of the work of sliding at every contact point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.statistics.batch_interval import BATCHES, Interval, interval_of_mean
from gapbeam.solver.diagnostics.statistics.block_ends import BlockEnds
from gapbeam.solver.diagnostics.statistics.block_means import MOST
from gapbeam.solver.diagnostics.statistics.run_statistics import EVEN, Array, RunStatistics

FEW = 128  # blocks of each point that a run keeps: many points have to fit in memory and in checkpoints


@dataclass
class PointStatistics(RunStatistics):
    """Gathers the records of a run whose `ContactOperator.maps_sliding`.

    Attributes:
        points: Number of contact points.
        most_blocks: Blocks of each point for which there is room; with as many as of the other figures, they are the
            same blocks.
        point_blocks: Their work at the ends of blocks.
    """

    points: int = 0
    most_blocks: int = MOST
    point_blocks: BlockEnds = field(init=False)
    _work: Array | None = None
    _left_out: Array = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.point_blocks = BlockEnds(self.points, self.most_blocks)
        self._left_out = np.zeros(self.points)

    def see(self, rows: Mapping[str, Array]) -> None:
        """Take in records, each with a leading axis of times."""
        before = self._time
        super().see(rows)
        times, work = np.atleast_1d(rows["time"]), rows["point_work"]
        if before is None or self._work is None:
            before, self._work, times, work = float(times[0]), work[0].copy(), times[1:], work[1:]
            self.point_blocks.begin(self._work)
        if not len(times):
            return
        even = np.abs(np.diff(times, prepend=before) - self.interval) <= EVEN * self.interval
        if np.all(even):
            self.point_blocks.add(work - self._left_out if self._left_out.any() else work)
        else:
            changes = np.diff(work, axis=0, prepend=self._work[None])
            gone = self._left_out + np.add.accumulate(np.where(even[:, None], 0.0, changes), axis=0)
            self.point_blocks.add((work - gone)[even])
            self._left_out = gone[-1]
        self._work = work[-1].copy()

    def point_series(self) -> Array:
        """Return the work rate of each point over blocks behind the burn-in, (blocks, points), W; none: too short."""
        found, means = self.series(), self.point_blocks.changes / self.interval
        if not found or not len(means):
            return np.zeros((0, self.points))
        burned = 1.0 - len(found[0].values) / len(self.blocks.means)
        rest = means[round(burned * len(means)) :]
        return rest if len(rest) >= BATCHES else np.zeros((0, self.points))

    def work_rates(self) -> list[Interval]:
        """Return the work rate of each point behind the burn-in with its interval, W; none of far too short records."""
        series = self.point_series()
        return [interval_of_mean(one, positive=True) for one in series.T] if len(series) else []

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        work = None if self._work is None else self._work.tolist()
        return super().as_json() | {
            "point_blocks": self.point_blocks.as_json(),
            "point_work": work,
            "points_left_out": self._left_out.tolist(),
        }

    def restore(self, data: Mapping[str, Any]) -> None:
        """Bring statistics, as they are at a start, to what was stored; raises as `RunStatistics.restore`."""
        super().restore(data)
        self.point_blocks.restore(data["point_blocks"])
        work = data["point_work"]
        self._work = None if work is None else np.array(work, dtype=float).reshape(self.points)
        self._left_out = np.array(data["points_left_out"], dtype=float).reshape(self.points)
