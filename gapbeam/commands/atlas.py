"""The command `gapbeam atlas`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gapbeam.commands.terminal import Overrides, StudyCommand, print_study, progress_bar, shipped_kind


def atlas(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="file (TOML) with loads that repeat, or with a flow")],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUES", help="a key and its values, a,b,c or first:last:count; at most two"),
    ] = None,
    override: Overrides = None,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="starts at each point")] = 64,
    settle: Annotated[int, typer.Option(min=1, help="periods before responses are looked for")] = 100,
    rounds: Annotated[int, typer.Option(min=1, help="marches of so many periods at most")] = 4,
    orders: Annotated[int, typer.Option(min=1, help="most periods after which a response repeats")] = 8,
    reach: Annotated[
        float, typer.Option(help="largest velocity of a start, relative to the motion from the seat")
    ] = 2.0,
    seed: Annotated[int, typer.Option(min=0, help="of the starts")] = 0,
    follow: Annotated[bool, typer.Option("--follow", help="follow responses over the key, to where they end")] = False,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-atlas")] = None,
) -> int:
    """Find all stable responses of a case, with the share of starts that come to each, over values of keys.

    An atlas that was killed resumes after its last point.

    Exit status: 0 done, 5 some starts did not settle, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import scenes_of
    from gapbeam.studies.atlas.run_atlas import run_atlas
    from gapbeam.studies.trials.axes import read_axis
    from gapbeam.studies.trials.subject import read_subject

    axes = [read_axis(text, "linear", "--vary ") for text in vary or []]
    folder = output if output is not None else Path("results") / f"{case.stem}-atlas"
    subject = read_subject(case, override or [])
    with progress_bar("points") as bar:
        result = run_atlas(
            scenes_of(case, override or []), axes, folder, starts=starts, settle=settle, rounds=rounds, orders=orders,
            reach=reach, seed=seed, progress=bar.show, inputs=subject.tables | subject.contents, follow=follow,
        )  # fmt: skip
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


STUDY = StudyCommand(atlas, shipped_kind("atlas"))
