"""The two calls of a Python session. Heavy imports wait until they are needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.surroundings import refuse_cramped

if TYPE_CHECKING:
    from postprocess.results import Results
    from solver.run import Outcome

RESULTS = "results"


def run(
    case: str | Path,
    overrides: Mapping[str, object] | Sequence[str] = (),
    output: str | Path | None = None,
    overwrite: bool = False,
    resume: bool = False,
) -> Outcome:
    """Run a case file.

    Args:
        case: Path of the TOML file.
        overrides: Keys to replace, such as {"support.clearance": 0.1e-3} or ["support.clearance=0.1e-3"].
        output: Results folder; by default results/<name of the case file>.
        overwrite: Replace the results of an earlier run.
        resume: Go on from its last checkpoint; from the start where it has none yet.

    Returns:
        The outcome: folder, exit status, message, summary. A run that created energy or did not converge is
        returned with an exit status that is not zero, not raised.

    Raises:
        CaseError: The case file has faults; all of them are in the message.
        MeshError: The mesh file does not fit the case.
        OutOfMemory: The limit of addresses of this process is too low to begin with.
        UserError: The folder holds results, or those of another case, or a point lies outside the mesh.

    Collective under mpirun.
    """
    refuse_cramped()
    from mpi4py import MPI

    from gapbeam.launcher import end_with_launcher
    from meshes.rank_zero import on_rank_zero
    from solver.case_file.reader import read_case
    from solver.errors import UserError
    from solver.run import run_case

    end_with_launcher()
    comm = MPI.COMM_WORLD
    if isinstance(output, str) and not output.strip():
        raise UserError(f"output = {output!r}: nothing but an empty word; expected a folder, or None")
    read = on_rank_zero(comm, lambda: read_case(Path(case), overrides))
    folder = Path(output) if output is not None else Path(RESULTS) / Path(case).stem
    return run_case(read, folder, comm, overwrite, resume)


def open_results(folder: str | Path) -> Results:
    """Open a results folder, complete or not; needs neither DOLFINx nor MPI.

    Raises:
        ResultsError: There are no readable results.
    """
    from postprocess.results import open_results as open_folder

    return open_folder(Path(folder))
