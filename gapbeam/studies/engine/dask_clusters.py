"""Dask clusters: processes of this machine, workers of a running scheduler, or jobs under Slurm."""

from __future__ import annotations

import logging
import shutil
import sys
from importlib.machinery import PathFinder
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.engine.workers import INSTALL, Workers, silence

if TYPE_CHECKING:
    from distributed import Client

LOG = logging.getLogger("gapbeam")
LOSSES = 2  # of workers over one point that are put up with; after a third one the point is a suspect
ANSWER = 15.0  # s in which a scheduler must answer
SETUP = "gapbeam.studies.engine.workers"
GIGABYTE = 1.0e9
LEAST_MEMORY = 2.0e9  # bytes of a job that is predicted to take less
SETTINGS: dict[str, Any] = {
    "distributed.scheduler.allowed-failures": LOSSES,
    "distributed.scheduler.worker-ttl": None,  # a march or a factorization may keep a worker from answering for long
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
    "distributed.admin.tick.limit": "1h",
}
OF_JOBS = ("target", "spill", "pause", "terminate")


class PoolPlan(NamedTuple):
    """Plan of a pool of workers.

    Attributes:
        workers: Where.
        size: Number of workers that are started.
        memory: That one may take, bytes; None: not known.
        folder: Folder of the study.
    """

    workers: Workers
    size: int
    memory: float | None
    folder: Path | None

    @property
    def jobs(self) -> int:
        """Jobs under Slurm; 0: none."""
        return 0 if self.workers.slurm is None else ceil(self.size / self.workers.job.workers)

    @property
    def limit_words(self) -> str:
        """The limit of memory in words."""
        known = self.memory is not None and self.workers.scheduler is None
        return f" (each may take {(self.memory or 0.0) / GIGABYTE:.2g} GB)" if known else ""

    @property
    def logs(self) -> Path | None:
        """Folder of the logs of jobs."""
        return None if self.folder is None or self.workers.slurm is None else self.folder.absolute() / "workers"

    @property
    def where_to_look(self) -> str:
        """Advice for a user whose workers do not answer."""
        if self.workers.slurm is not None:
            return f"look at squeue, and at {self.logs or 'the output of the jobs'}"
        return "start some: dask worker ADDRESS --nthreads 1" if self.workers.scheduler else "look at the free memory"


def started(plan: PoolPlan) -> tuple[Any, Client]:
    """Return the cluster that was started, or None, and the connection to its scheduler.

    Raises:
        UserError: No scheduler answers, or the workers cannot be started.
    """
    import dask
    from distributed import Client

    silence()
    dask.config.set(SETTINGS)
    if plan.workers.scheduler is not None:
        return None, _connected(plan.workers.scheduler)
    cluster = _in_jobs(plan) if plan.workers.slurm is not None else _on_this_machine(plan)
    return cluster, Client(cluster, set_as_default=False)


def _on_this_machine(plan: PoolPlan) -> Any:
    from distributed import LocalCluster

    try:
        return LocalCluster(
            n_workers=plan.size,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address=None,
            memory_limit=0 if plan.memory is None else int(plan.memory),
            silence_logs=logging.CRITICAL,
            preload=[SETUP],
        )
    except (OSError, RuntimeError, TimeoutError) as error:
        main = sys.modules["__main__"]
        script = getattr(main, "__spec__", None) is None and hasattr(main, "__file__")
        guard = 'a script calls it below `if __name__ == "__main__":`, as workers import it again; ' if script else ""
        words = f"{plan.size} workers could not be started ({error}); {guard}`workers=1` takes this process"
        raise UserError(words) from error


def _connected(address: str) -> Client:
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise UserError(
            f"`scheduler=` {address}: no scheduler of Dask answered within {ANSWER:g} s ({reason}); is the one started "
            "by `dask scheduler` still running, and can this machine reach it?"
        ) from error
    if not client.nthreads():
        LOG.warning("the scheduler at %s has no workers yet: waiting; start some: dask worker %s", address, address)
    return client


def _in_jobs(plan: PoolPlan) -> Any:
    if PathFinder.find_spec("dask_jobqueue") is None:
        raise UserError(f"`slurm=` needs dask-jobqueue, which is not installed: {INSTALL}")
    if shutil.which("sbatch") is None:
        raise UserError("`slurm=`: found no sbatch on this machine; expected to be called where jobs are submitted")
    from dask_jobqueue import SLURMCluster

    job = plan.workers.job
    memory = job.memory or max(LEAST_MEMORY, plan.memory or 0.0) * job.workers
    variables = [f"export DASK_DISTRIBUTED__WORKER__MEMORY__{name.upper()}={_setting(name)}" for name in OF_JOBS]
    threads = [f"export {name}=1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")]
    if plan.logs is not None:
        plan.logs.mkdir(exist_ok=True)
    cluster = SLURMCluster(
        cores=job.workers,
        processes=job.workers,
        memory=f"{int(memory)}B",
        python=sys.executable,
        job_name="gapbeam-worker",
        job_extra_directives=list(job.directives),
        job_directives_skip=["#SBATCH -t "],  # the user's limit, or the cluster's, instead of Dask's
        job_script_prologue=[*variables, *threads],
        worker_extra_args=["--preload", SETUP],
        log_directory=None if plan.logs is None else str(plan.logs),
        scheduler_options={"dashboard": False, "dashboard_address": None},
        silence_logs=logging.CRITICAL,
    )
    cluster.scale(jobs=plan.jobs)
    LOG.info("%d jobs with %d workers each are submitted to Slurm", plan.jobs, job.workers)
    return cluster


def _setting(name: str) -> str:
    return str(SETTINGS[f"distributed.worker.memory.{name}"])
