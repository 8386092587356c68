"""The command `gapbeam modes`."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import click
import typer
from rich.console import Console

COUNT = 4
WIDTH = 180  # columns of the tables where there is no terminal to fit them to
UNKNOWN = "-"
LEAST = 2  # measured frequencies, for two springs
NOT_REPRODUCED = 5


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
        raise click.BadParameter("--measured: " + "; ".join(faults))
    return found


def modes(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML)")],
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case; may be repeated")
    ] = None,
    count: Annotated[int, typer.Option(min=2, help="bending modes")] = COUNT,
    measured: Annotated[
        str | None, typer.Option(metavar="HZ,HZ,...", help="measured frequencies of the modes 1, 2, ...; - for unknown")
    ] = None,
    accuracy: Annotated[str, typer.Option(help="standard deviation of a frequency, for the intervals")] = "1%",
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-modes")] = None,
) -> int:
    """Find the modes of the seated beam and the end springs that reproduce them, or those measured; also under mpirun.

    Exit status: 0 done, 5 no end springs reproduce the frequencies, 2 a fault of the input.
    """
    from gapbeam.compare import fraction

    given, deviation = measured_frequencies(measured, count), fraction(accuracy)
    from mpi4py import MPI

    from gapbeam.modal.comparison import FITTED, ModesComparison, compare_modes
    from gapbeam.modal.told import as_data, frequency_table, other_modes, remarks, spring_table
    from gapbeam.study_folder import study_folder
    from meshes.rank_zero import on_rank_zero
    from postprocess.figures.mode_shapes import draw_mode_shapes
    from solver.analyses.modes import SEATED, held_modes
    from solver.case import Exciter
    from solver.case_file.reader import read_case
    from solver.model import build_model
    from solver.output.folder import write_beside
    from solver.output.mode_fields import write_mode_fields
    from solver.output.records import FIELDS_FILE
    from solver.output.summary import describe_model, finite, versions

    comm = MPI.COMM_WORLD
    read = on_rank_zero(comm, lambda: read_case(case, override or []))
    folder = output if output is not None else Path("results") / f"{case.stem}-modes"
    with study_folder(folder, comm):
        on_rank_zero(comm, lambda: _made(folder / SEATED))
        model = build_model(read, comm)
        states = held_modes(model, max(count, FITTED))
        write_mode_fields(folder / SEATED, model, states[0])
        described = describe_model(model)

        def tell() -> int:
            found: ModesComparison = compare_modes(model.case, states, count, given, deviation)
            data = {"title": model.case.title, "versions": versions(), "model": described} | as_data(found)
            write_beside(folder / "modes.json", json.dumps(finite(data), indent=1, allow_nan=False) + "\n")
            picture = draw_mode_shapes(as_data(found), folder / "modes.png")
            screen = Console(soft_wrap=True, highlight=False)
            if not screen.is_terminal:
                screen.width = max(screen.width, WIDTH)
            screen.print(frequency_table(found))
            if found.fits:
                screen.print(spring_table(found.fits))
            exciters = [
                load.name for load in model.case.load if isinstance(load, Exciter) and load.mass + load.stiffness > 0
            ]
            carried = [f"{', '.join(exciters)} moves along with the model, not with the theory"] if exciters else []
            for line in [
                other_modes(states[0]),
                *carried,
                *remarks(found),
                f"{folder / 'modes.json'}\n{picture}\n{folder / SEATED / FIELDS_FILE}",
            ]:
                screen.print(line, markup=False)
            sources = {one.source for one in found.fits}
            failed = [
                name for name in sources if not any(one.fit.reproduces for one in found.fits if one.source == name)
            ]
            for name in sorted(failed):
                screen.print(f"no end springs reproduce the {name} frequencies within twice {accuracy}", markup=False)
            return NOT_REPRODUCED if failed else 0

        return on_rank_zero(comm, tell)


def _made(folder: Path) -> None:
    from solver.errors import UserError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder} cannot be made ({error.strerror}); choose another --output") from error
