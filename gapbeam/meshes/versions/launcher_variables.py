"""Rank of a process from the environment variables of MPI launchers, before MPI is loaded. Imports nothing heavy."""

from __future__ import annotations

import os

# Open MPI; launchers with PMIx, as Open MPI 5's; MPICH and others with PMI; Slurm's srun.
RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID")


def rank_of_launcher() -> str | None:
    """Return the rank as the launcher reports it; None where there is none."""
    names = RANK_VARIABLES[: 3 if "SLURM_STEP_ID" not in os.environ else 4]
    return next((os.environ[name] for name in names if name in os.environ), None)
