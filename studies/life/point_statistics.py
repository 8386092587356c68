"""Statistics of a run with those of the work of sliding at every contact point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gapbeam.solver.diagnostics.statistics.batch_interval import Interval, interval_of_mean
from gapbeam.solver.diagnostics.statistics.block_means import BlockMeans
from gapbeam.solver.diagnostics.statistics.run_statistics import EVEN, Array, RunStatistics


@dataclass
class PointStatistics(RunStatistics):
    """Gathers the records of a run whose `ContactOperator.maps_sliding`.

    Attributes:
        points: Number of contact points.
        point_blocks: Means of their work rates over the blocks of the other figures.
    """

    points: int = 0
    point_blocks: BlockMeans = field(init=False)
    _work: Array | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self.point_blocks = BlockMeans(self.points)

    def see(self, rows: Mapping[str, Array]) -> None:
        """Take in records, each with a leading axis of times."""
        before = self._time
        super().see(rows)
        times, work = np.atleast_1d(rows["time"]), rows["point_work"]
        if before is None or self._work is None:
            before, self._work, times, work = float(times[0]), work[0], times[1:], work[1:]
        if not len(times):
            return
        intervals = np.diff(times, prepend=before)
        changes = np.diff(work, axis=0, prepend=self._work[None])
        self._work = work[-1]
        self.point_blocks.add((changes / self.interval)[np.abs(intervals - self.interval) <= EVEN * self.interval])

    def work_rates(self) -> list[Interval]:
        """Return the work rate of each point behind the burn-in with its interval, W; none of far too short records."""
        found = self.series()
        if not found:
            return []
        means = self.point_blocks.means
        return [interval_of_mean(series, positive=True) for series in means[len(means) - len(found[0].values) :].T]
