"""Jobs with workers that end before their study: others are submitted in their place."""

from __future__ import annotations

import logging
from typing import Any

from gapbeam.solver.errors import OutOfMemory
from gapbeam.studies.engine.dask_clusters import PoolPlan

LOG = logging.getLogger("gapbeam")
GRACE = 20.0  # s without any worker of a job after which it counts as ended
IN_VAIN = 3  # jobs for each that was asked for which may end without a point in between


class JobWatch:
    """Notices jobs all of whose workers have gone: at a time limit, with a machine, out of memory.

    Args:
        cluster: Of jobs.
        plan: How many there shall be.
    """

    def __init__(self, cluster: Any, plan: PoolPlan) -> None:
        self._cluster, self._plan = cluster, plan
        self._seen: dict[str, float] = {}
        self._in_vain, self._ended = 0, 0

    def look(self, now: float, ended: int) -> None:
        """Submit jobs instead of those that have ended.

        Args:
            now: Time, s.
            ended: Points of the study that have ended so far.

        Raises:
            OutOfMemory: One job after the other ends without computing a point.
        """
        if ended != self._ended:
            self._ended, self._in_vain = ended, 0
        names = [str(worker.name) for worker in self._cluster.scheduler.workers.values()]
        for job in self._cluster.worker_spec:
            if any(name == str(job) or name.startswith(f"{job}-") for name in names):
                self._seen[job] = now
        gone = [job for job, last in self._seen.items() if now - last > GRACE]
        for job in gone:
            del self._seen[job]
            self._cluster.worker_spec.pop(job, None)
        if not gone:
            return
        self._in_vain += len(gone)
        if self._in_vain > IN_VAIN * self._plan.jobs:
            raise OutOfMemory(f"{self._in_vain} jobs ended without computing a point; {self._plan.where_to_look}")
        LOG.info("%d jobs have ended before the study: others are submitted", len(gone))
        self._cluster.scale(jobs=self._plan.jobs)
