"""The command `gapbeam tradeoff`, and the rung that `gapbeam run --tolerance` takes."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

LOG = logging.getLogger("gapbeam")
WIDTH = 180  # columns of the table where there is no terminal to fit it to
MINUTES = 12.0
NONE_INSIDE = 5


def tradeoff(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
    tolerance: Annotated[str, typer.Option(help="largest error of a figure that will do")] = "2%",
    minutes: Annotated[float, typer.Option(min=0.1, help="wall time that the study may take")] = MINUTES,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-tradeoff")] = None,
) -> int:
    """Measure time, memory and error of models, meshes, steps and schemes of a case; name the cheapest that will do.

    Exit status: 0 a rung is inside the tolerance, 5 none is, 2 a fault of the input.
    """
    from gapbeam.compare import fraction

    study, paths = _studied(case, override or [], fraction(tolerance), minutes, output or folder_of(case))
    from gapbeam.ladder.report import as_table, verdict

    screen = Console(soft_wrap=True, highlight=False)
    if not screen.is_terminal:
        screen.width = max(screen.width, WIDTH)
    screen.print(as_table(study))
    screen.print("(in brackets: below the uncertainty of the reference; *: the one to take)")
    if study.full_check is not None:
        told = ", ".join(f"{name} {100 * error:.2g} %" for name, error in study.full_check.items())
        screen.print(f"the reduced model against all DOFs on the mesh of the case: {told}")
    for rung, seconds in study.skipped:
        screen.print(f"skipped: {rung.name}, about {seconds:.0f} s", markup=False)
    screen.print("\n".join(map(str, paths)), markup=False)
    screen.print(f"{study.seconds:.0f} s; {verdict(study)}", markup=False)
    return 0 if study.chosen is not None else NONE_INSIDE


def folder_of(case: Path) -> Path:
    """Return where the trade-off of a case is kept."""
    return Path("results") / f"{case.stem}-tradeoff"


def _studied(case: Path, override: list[str], tolerance: float, minutes: float, folder: Path) -> tuple[Any, list[Path]]:
    from gapbeam.ladder.report import write_study
    from gapbeam.ladder.stored import study_key
    from gapbeam.ladder.study import overrides_as_mapping, run_study
    from gapbeam.study_folder import study_folder
    from solver.case_file.reader import read_case

    read = read_case(case, override)
    with study_folder(folder):
        study = run_study(case, overrides_as_mapping(override), tolerance, minutes, LOG.info)
        return study, write_study(folder, study, study_key(read))


def rung_for(case: Path, override: list[str], tolerance: str) -> tuple[str, dict[str, Any]]:
    """Return the cheapest rung of a case inside a tolerance, and all keys that it replaces; studied now if need be.

    Args:
        case: The case file.
        override: Overrides KEY=VALUE of the run.
        tolerance: "2%" or "0.02".

    Raises:
        UserError: No rung is inside the tolerance, or a study would have to be made under mpirun.
        CaseError: The case has faults.

    Collective under mpirun.
    """
    from mpi4py import MPI

    from meshes.rank_zero import on_rank_zero

    alone = MPI.COMM_WORLD.size == 1
    return on_rank_zero(MPI.COMM_WORLD, lambda: _rung_for(case, override, tolerance, alone))


def _rung_for(case: Path, override: list[str], tolerance: str, alone: bool) -> tuple[str, dict[str, Any]]:
    from gapbeam.compare import fraction
    from gapbeam.ladder.stored import stored_choice
    from gapbeam.ladder.study import overrides_as_mapping
    from solver.case_file.reader import read_case
    from solver.errors import UserError

    limit, folder, read = fraction(tolerance), folder_of(case), read_case(case, override)
    found = stored_choice(folder, read, limit)
    if found is None:
        if not alone:
            raise UserError(f"{folder} holds no trade-off of this case; run gapbeam tradeoff {case} first, on one rank")
        LOG.info("no trade-off of this case in %s: measured now, up to %g minutes", folder, MINUTES)
        _studied(case, override, limit, MINUTES, folder)
        found = stored_choice(folder, read, limit)
        assert found is not None
    name, changes = found
    LOG.info("--tolerance %s: %s, as measured in %s", tolerance, name, folder)
    return name, {**overrides_as_mapping(override), **changes}
