"""Pool of Dask workers: started, given points, and ended; jobs that end before their study are submitted again."""

from __future__ import annotations

import asyncio
import logging
import queue
import shutil
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from importlib.machinery import PathFinder
from importlib.metadata import version
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gapbeam.solver.memory.memory_check import GIGABYTE
from gapbeam.solver.messages.errors import OutOfMemory, UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.studies.engine.workers import INSTALL, Result, Work, Workers, computed, hushed, introduced, silence

if TYPE_CHECKING:
    from distributed import Client, Future

LOSSES = 2  # of workers over one point that are put up with; after a third one the point is a suspect
ANSWER = 15.0  # s in which a scheduler must answer
SETUP = "gapbeam.studies.engine.workers"
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
        workers: Kind of the workers.
        size: Number of workers that are started.
        memory: Memory that a worker may take, bytes; None: not known.
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
        words = f"{plan.size} workers could not be started ({error}); `workers=1` takes this process"
        raise UserError(words) from error


@contextmanager
def once() -> Iterator[None]:
    """Keep processes that start from running the script of this one again, unless it is made for that.

    They import the main module. A script that does not look whether it is that would begin its study in each of them,
    and so on without end.
    """
    main = vars(sys.modules["__main__"])
    try:
        guarded = "__main__" in Path(main["__file__"]).read_text(encoding="utf-8", errors="replace")
    except (KeyError, OSError):
        guarded = False
    kept: dict[str, Any] = {} if guarded else {one: main[one] for one in ("__file__", "__spec__") if one in main}
    main.update(dict.fromkeys(kept))
    try:
        yield
    finally:
        main.update(kept)


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


GRACE = 20.0  # s without any worker of a job after which it counts as ended
IN_VAIN = 3  # jobs for each that was asked for which may end without a point in between


class JobWatch:
    """Notices jobs all of whose workers have gone: at a time limit, with a machine, out of memory.

    Args:
        cluster: Cluster of jobs.
        plan: Their number.
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


LOOK = 1.0  # s between two looks at what a user may want to know
CLOSING = 2.0  # s
RESULTS = 10.0  # s for results to come from their workers
PATIENCE = 60.0  # s without any worker after which it is reported, again and again
AT_HAND, MOST_AT_HAND = 0.2, 50  # s of work that a worker has at hand, and points at most; at least two


class DaskPool:
    """Workers that stay for one batch of points after the other.

    Points are given out as workers come free, so that a study of any length takes little memory; workers may come and
    go meanwhile. What a lost worker had at hand is computed by others.

    Attributes:
        count: Workers that were there when they were counted last.

    Args:
        plan: Machines, number and size of the workers.

    Raises:
        UserError: The workers cannot be had.
    """

    def __init__(self, plan: PoolPlan) -> None:
        self._plan, self._script = plan, ExitStack()
        self._script.enter_context(once())
        try:
            self._cluster, self._client = started(plan)
        except BaseException:
            self._script.close()
            raise
        self._jobs = JobWatch(self._cluster, plan) if plan.jobs else None
        self._seen = self._looked = time.monotonic()
        self.count = 0
        if plan.workers.elsewhere:
            folder = None if plan.folder is None else plan.folder.absolute()
            for _ in self.done(introduced, [(version("gapbeam"), folder)], None, None):
                pass

    def close(self) -> None:
        """End the workers that were started here; others are asked for nothing more."""
        if self._cluster is not None:
            quiet = threading.Thread(target=self._hush, daemon=True)
            quiet.start()
            quiet.join(CLOSING)  # a worker that computes may not answer
        with suppress(Exception):  # what is on its way is of no interest any more
            self._client.close(timeout=CLOSING)
        if self._cluster is not None:
            with suppress(Exception):
                self._cluster.close(timeout=20.0)
        self._script.close()

    def _hush(self) -> None:
        with suppress(Exception):
            self._client.run(hushed)

    def done(
        self,
        task: Callable[[Work], Result],
        works: Sequence[Work],
        tick: Callable[[], None] | None,
        lost: Callable[[Work, str], Result] | None,
    ) -> Iterator[tuple[int, Result]]:
        """Compute points; arguments as in `Engine.done`.

        A point whose worker is lost too often is a suspect, as are those that were at hand there: each is computed
        again when nothing else is, so that no point is blamed for another.
        """
        arrived: queue.SimpleQueue[Future] = queue.SimpleQueue()
        waiting: dict[str, tuple[int, Future]] = {}
        begun, ended = time.monotonic() - LOOK, 0
        places, suspects, alone = deque(range(len(works))), deque[int](), set[int]()
        try:
            while places or suspects or waiting:
                self._look(ended)
                count = max(self.count, 1)
                in_time = AT_HAND * ended / (time.monotonic() - begun)
                room = int(min(max(2 * count, in_time), MOST_AT_HAND * count)) - len(waiting)
                batch = [places.popleft() for _ in range(min(room, len(places)))]
                if not batch and not waiting:
                    batch = [suspects.popleft()]
                    alone.update(batch)
                if batch:
                    futures = self._client.map(
                        partial(computed, task), [works[place] for place in batch], pure=False, key="point"
                    )
                    for place, future in zip(batch, futures, strict=True):
                        waiting[future.key] = place, future
                        future.add_done_callback(arrived.put)
                together = _together(arrived)
                results = self._gathered(together)
                for future in together:
                    place, _ = waiting[future.key]
                    try:
                        result: Result = results[future.key] if future.key in results else self._result(future)
                    except TimeoutError:  # a worker was lost with the result: it is computed again
                        future.add_done_callback(arrived.put)
                        continue
                    except _LostError as loss:
                        if place not in alone:
                            del waiting[future.key]
                            suspects.append(place)
                            continue
                        if lost is None:
                            raise OutOfMemory(f"a point could not be computed: {loss}") from None
                        result = lost(works[place], str(loss))
                    del waiting[future.key]
                    future.release()
                    ended += 1
                    yield place, result
                if tick is not None:
                    tick()
        finally:
            if waiting:
                with suppress(Exception):
                    self._client.cancel([future for _, future in waiting.values()], force=True)

    def _gathered(self, futures: Sequence[Future]) -> dict[str, Any]:
        """Return the results of several points in one message, by key; those of points with errors are left out."""
        sound = [future for future in futures if future.status == "finished"]
        loop = self._client.loop.asyncio_loop
        together = asyncio.run_coroutine_threadsafe(self._client.gather(sound, asynchronous=True), loop)
        try:
            return dict(zip([future.key for future in sound], together.result(RESULTS), strict=True))
        except Exception:  # a worker was lost with its results: each is asked for alone
            together.cancel()
            return {}

    def _result(self, future: Future) -> Any:
        """Return the result of a point that is done; an error of the point is raised unchanged.

        Raises:
            TimeoutError: The result no longer exists.
        """
        from distributed import CancelledError, KilledWorker

        try:
            return future.result(timeout=LOOK)
        except KilledWorker:
            words = f"{LOSSES + 1} workers that computed nothing else were lost: killed, or out of memory"
            raise _LostError(words + self._plan.limit_words) from None
        except CancelledError:
            raise OutOfMemory(
                "the scheduler of Dask is gone, and its workers with it; what is done is on disk: call the study again"
            ) from None

    def _look(self, ended: int) -> None:
        """Count the workers, report that there are none, and replace jobs; given is how many points have ended."""
        now = time.monotonic()
        if self.count and now - self._looked < LOOK:
            return
        self._looked = now
        self.count = _workers_of(self._client)
        if self.count:
            self._seen = now
        elif now - self._seen > PATIENCE:
            self._seen = now
            LOG.warning("no worker has answered for %.0f s; %s", PATIENCE, self._plan.where_to_look)
        if self._jobs is not None:
            self._jobs.look(now, ended)


class _LostError(Exception):
    """A point whose workers were lost too often."""


def _workers_of(client: Client) -> int:
    """Return the number of workers; 0 where the scheduler does not answer."""
    try:
        return len(client.nthreads())
    except Exception:  # of the network, of whatever kind
        return 0


def _together(arrived: queue.SimpleQueue[Future]) -> list[Future]:
    """Return the arrived results, after waiting for the first for a while."""
    found = []
    with suppress(queue.Empty):
        found.append(arrived.get(timeout=LOOK))
        while True:
            found.append(arrived.get_nowait())
    return found
