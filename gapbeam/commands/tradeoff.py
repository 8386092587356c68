"""The command `gapbeam tradeoff`, and the level of fidelity that `gapbeam run --tolerance` takes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gapbeam.commands.terminal import CaseArgument, Overrides, Overwrite, StudyCommand, print_study, shipped_kind

if TYPE_CHECKING:
    from gapbeam.solver.run.outcome import Outcome
    from gapbeam.studies.tradeoff.run_tradeoff import Taken

MINUTES = 12.0


def tradeoff(
    case: CaseArgument,
    tolerance: Annotated[str, typer.Option(help="largest error of a figure that will do")] = "2%",
    minutes: Annotated[float, typer.Option(min=0.1, help="wall time that the study may take")] = MINUTES,
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-tradeoff")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Measure time, memory and error of models, meshes, steps and schemes of a case; name the cheapest that will do.

    Exit status: 0 the tolerance holds over the span of the case with that level, 5 it cannot be promised, 2 a fault of
    the input.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.studies.tradeoff.run_tradeoff import run_tradeoff, tradeoff_folder
    from gapbeam.studies.tradeoff.tradeoff_study import overrides_as_mapping

    folder = output if output is not None else tradeoff_folder(case)
    fixed = overrides_as_mapping(override or [])
    result = run_tradeoff(case, folder, fixed, fraction(tolerance), minutes, overwrite=overwrite)
    study = result.study
    lines = ["(in brackets: below the uncertainty of the reference; *: the one to take)"]
    if study.full_check is not None:
        words = ", ".join(f"{name} {100 * error:.2g} %" for name, error in study.full_check.items())
        over = f"over the first {study.periods} forcing periods"
        lines.append(f"the reduced model against all DOFs on the mesh of the case, {over}: {words}")
    lines += [f"skipped: {level.name}, about {seconds:.0f} s" for level, seconds in study.skipped]
    print_study(result.tables(), [*lines, *result.paths, f"{study.seconds:.0f} s; {result.headline()}"], width=180)
    return result.exit_status


def level_within(case: Path, override: list[str], tolerance: str, wall_time: float | None = None) -> Taken:
    """Return the cheapest level of a case inside a tolerance, with all keys that it replaces; studied now if need be.

    Args:
        case: The case file.
        override: Overrides KEY=VALUE of the run.
        tolerance: "2%" or "0.02".
        wall_time: Limit of the whole command, s: a study made now takes at most half of it.

    Returns:
        The level, with the doubts about the tolerance; the nearest where none is inside.

    Raises:
        UserError: All levels failed, or a study would have to be made under mpirun.
        CaseError: The case has faults.

    Collective under mpirun.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.meshes.rank_zero import on_rank_zero
    from gapbeam.process.launcher import all_ranks
    from gapbeam.studies.tradeoff.run_tradeoff import level_for
    from gapbeam.studies.tradeoff.tradeoff_study import overrides_as_mapping

    comm, limit, fixed = all_ranks(), fraction(tolerance), overrides_as_mapping(override)
    minutes = MINUTES if wall_time is None else min(MINUTES, 0.5 * wall_time / 60.0)
    return on_rank_zero(comm, lambda: level_for(case, fixed, limit, comm.size == 1, minutes))


def judged_by(outcome: Outcome, taken: Taken) -> Outcome:
    """Return a run with the promise, or the doubts, of the level that it took; see `with_promise`.

    Collective under mpirun.
    """
    from gapbeam.process.launcher import all_ranks
    from gapbeam.studies.tradeoff.run_tradeoff import with_promise

    return with_promise(outcome, taken, all_ranks())


STUDY = StudyCommand(tradeoff, shipped_kind("tradeoff"))
