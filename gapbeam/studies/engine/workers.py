"""Where a study computes its points: in this process, in workers of this machine, or on many machines."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.machinery import PathFinder
from math import inf

from gapbeam.solver.errors import UserError
from gapbeam.solver.run.rank_threads import cores
from gapbeam.studies.engine.slurm_options import JobOptions, read_job_options

INSTALL = "pip install 'gapbeam[workers]'"


@dataclass(frozen=True)
class Workers:
    """Where the points of a study are computed; one point at a time in each worker, on one thread.

    Attributes:
        count: Workers; None: one a core of this machine, or those of one job under Slurm. 1: this process itself.
        scheduler: Address of a running scheduler of Dask, such as "tcp://node7:8786", whose workers are taken.
        slurm: Options of sbatch, such as "--time=2:00:00 --cpus-per-task=16": jobs with a worker a core are submitted.

    Raises:
        UserError: The count is below 1, there is no such option of sbatch, or two of them exclude each other.
    """

    count: int | None = None
    scheduler: str | None = None
    slurm: str | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise UserError(f"`workers=`: found {self.count!r}; expected at least 1")
        if self.scheduler is not None and self.slurm is not None:
            raise UserError("`scheduler=` takes workers that run, `slurm=` submits jobs with new ones: give one")
        if self.scheduler is not None and self.count is not None:
            raise UserError(
                "`workers=` starts workers, `scheduler=` takes those that run already, all of them: give one"
            )
        if self.scheduler is not None and "://" not in self.scheduler:
            raise UserError(f"`scheduler=`: found {self.scheduler!r}; expected an address such as tcp://node7:8786")
        if self.slurm is not None:
            read_job_options(self.slurm)
        asked = (self.count or 1) > 1 or self.elsewhere
        if asked and not dask_is_here():
            raise UserError(
                f"workers need Dask, which is not installed: {INSTALL}; `workers=1` computes in this process without"
            )

    @property
    def elsewhere(self) -> bool:
        """Whether workers may run on other machines, which then must see the folders of this one."""
        return self.scheduler is not None or self.slurm is not None

    @property
    def job(self) -> JobOptions:
        """What is asked of Slurm for each job."""
        return read_job_options(self.slurm or "")

    def here(self, points: int, room: float = inf) -> int:
        """Return how many workers this machine starts.

        Args:
            points: That are to be computed.
            room: Workers that the free memory has room for.
        """
        wanted = self.count or (cores() if dask_is_here() else 1)
        return int(max(1, min(wanted, points, room)))


def dask_is_here() -> bool:
    """Return whether Dask is installed, without loading it."""
    return PathFinder.find_spec("distributed") is not None


def as_workers(workers: int | Workers | None) -> Workers:
    """Return workers as a Python session gives them: a number, or all about them."""
    return workers if isinstance(workers, Workers) else Workers(workers)
