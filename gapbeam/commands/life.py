"""The command `gapbeam life`."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import Overrides, Overwrite, StudyCommand, print_study, progress_bar, shipped_kind
from gapbeam.process.usage_errors import BadParameter


def life(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML) with wear.depth_limit")],
    override: Overrides = None,
    tolerance: Annotated[str, typer.Option(help="error of a block, as a share of its depth")] = "2%",
    at_most: Annotated[
        str | None,
        typer.Option(
            help="time at which the march ends with the depths of all faces, such as 40y or 300d; by default none"
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=2, max=10_000, help="most runs that are made")] = 40,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-life")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the time until a support face is worn to wear.depth_limit; resumes where it stopped.

    Exit status: 0 the limit was reached, or --at-most with the depth of each face then, 5 neither, 3 energy was created
    or 4 not converged in a run, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.studies.life.run_life import run_life
    from gapbeam.studies.life.worn_case import long_time

    longest = inf if at_most is None else long_time(at_most)
    if longest is None:
        raise BadParameter(
            f'found "{at_most}"; expected a time such as 40y, 300d, 2000h or 90 (seconds)', param_hint="--at-most"
        )
    folder = output if output is not None else Path("results") / f"{case.stem}-life"
    share = fraction(tolerance, "--tolerance")
    with progress_bar("runs on worn gaps") as bar:
        result = run_life(case, folder, override or (), share, longest, runs, overwrite, bar.show)
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


STUDY = StudyCommand(life, shipped_kind("life"))
