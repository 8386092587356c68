"""The command `gapbeam modes`."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import CaseArgument, Overrides, Overwrite, StudyCommand, print_study
from gapbeam.process.usage_errors import BadParameter

COUNT = 4
UNKNOWN = "-"
LEAST = 2  # measured frequencies, for two springs


def measured_frequencies(text: str | None, count: int) -> dict[int, float]:
    """Read measured frequencies, Hz, of the bending modes 1, 2, ...: "43.2,268,770", and "-" for one not found.

    Raises:
        BadParameter: Not numbers, not positive, not ascending, fewer than two, or more than modes.
    """
    if text is None:
        return {}
    words = [word.strip() for word in text.split(",")]
    faults, found = [], {}
    for mode, word in enumerate(words, start=1):
        if word == UNKNOWN:
            continue
        try:
            found[mode] = float(word)
        except ValueError:
            faults.append(f'mode {mode}: found "{word}", expected a number of Hz, or - where it was not found')
            continue
        if not (math.isfinite(found[mode]) and found[mode] > 0.0):
            faults.append(f"mode {mode}: found {word}, expected more than 0 Hz")
    values = list(found.values())
    if not faults and any(after <= before for before, after in pairwise(values)):
        faults.append(f"found {text}; expected frequencies that ascend, mode by mode")
    if len(words) > count:
        faults.append(f"found {len(words)} frequencies and --count {count}; take --count {len(words)}")
    if not faults and len(found) < LEAST:
        faults.append(f"found {len(found)} frequency; expected at least {LEAST}, for two springs")
    if faults:
        raise BadParameter("--measured: " + "; ".join(faults))
    return found


def modes(
    case: CaseArgument,
    override: Overrides = None,
    count: Annotated[int, typer.Option(min=2, help="bending modes")] = COUNT,
    measured: Annotated[
        str | None, typer.Option(metavar="HZ,HZ,...", help="measured frequencies of the modes 1, 2, ...; - for unknown")
    ] = None,
    accuracy: Annotated[str, typer.Option(help="standard deviation of a frequency, for the intervals")] = "1%",
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-modes")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the modes of the seated beam and the end springs that reproduce them, or those measured; also under mpirun.

    Exit status: 0 done, 5 no end springs reproduce the frequencies, 2 a fault of the input.
    """
    from gapbeam.commands.compare import fraction

    given, deviation = measured_frequencies(measured, count), fraction(accuracy)
    from gapbeam.meshes.rank_zero import on_rank_zero
    from gapbeam.process.launcher import all_ranks
    from gapbeam.solver.case.reading.case_reader import read_case
    from gapbeam.studies.modes.find_modes import find_modes

    comm = all_ranks()
    read = on_rank_zero(comm, lambda: read_case(case, override or []))
    folder = output if output is not None else Path("results") / f"{case.stem}-modes"
    result = find_modes(read, folder, comm, count, given, deviation, overwrite)
    if comm.rank == 0:
        words = "no end springs reproduce the {} frequencies within twice {}"
        missed = [words.format(name, accuracy) for name in result.not_reproduced]
        print_study(result.tables(), [*result.remarks, *result.paths, *missed], width=180)
    return result.exit_status


STUDY = StudyCommand(modes, collective=True)
