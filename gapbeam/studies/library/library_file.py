"""The file of a library as frozen pydantic models, and a library from it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.schema.table import Positive, Table, Whole
from gapbeam.studies.atlas.run_atlas import PeriodicScene, fit_figures
from gapbeam.studies.library.recording import Quantity
from gapbeam.studies.library.recording_library import FEWEST, MOST, Library, library
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.uncertain.uncertain_file import SceneStudy, read_scene_study, variable_faults


class RecordingTable(Table):
    """Point, quantity and length of the recordings."""

    point: str = Field(
        min_length=1,
        max_length=100,
        description="probe of the case whose motion across the beam is recorded",
        examples=["tip"],
    )
    quantity: Quantity = Field(
        description="recorded quantity, relative to the frame of the case", examples=["velocity"]
    )
    periods: Whole = Field(
        default=100, ge=8, le=10_000, multiple_of=2, description="periods of the load that an estimate is made from"
    )
    harmonics: Whole = Field(
        default=16,
        ge=3,
        le=200,
        description="harmonics of the load that are used; recordings have four samples in a period of the highest",
    )
    noise: Positive = Field(
        default=0.02, lt=1, description="largest noise of a recording, over the root mean square of its values, no unit"
    )


class LibraryStudy(SceneStudy):
    """A whole library."""

    members: Whole = Field(default=8192, ge=FEWEST, le=MOST, description="a power of two")
    recorded: RecordingTable = Field(description="the recordings")


def contradictions(tables: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the faults between the tables that are intact, arrays of tables as {number: entry}."""
    yield from variable_faults(tables.get("variable", {}))
    members = tables.get("members")
    if members is not None and members & (members - 1):
        yield Fault(
            ("members",),
            str(members),
            f"a power of two from {FEWEST} to {MOST}",
            str(2 ** round(members.bit_length() - 1)),
        )


def read_library_study(path: Path) -> LibraryStudy:
    """Read the file of a library; errors as in `read_scene_study`."""
    return read_scene_study(path, LibraryStudy, contradictions)


def run_library(
    study: LibraryStudy, one: PeriodicScene, folder: Path, progress: Callable[[int], None] | None = None
) -> Library:
    """March the members of a library into a folder; a call with the same folder continues there.

    Args:
        study: As read.
        one: The scene of its case.
        folder: Folder for the files.
        progress: Called with the number of members that are done.

    Raises:
        UserError: The scene has no such value or point, or does not take a value of the ranges.
        NotWritten: A file could not be written.
    """
    recorded = study.recorded
    with study_folder(folder):
        return library(
            one.scene, {variable.path: variable.frozen for variable in study.variable}, point=recorded.point,
            quantity=recorded.quantity, period=one.period, members=study.members, noise=recorded.noise,
            periods=recorded.periods, harmonics=recorded.harmonics, settle=study.settle,
            steps=one.steps, starts=study.begin(one), seed=study.seed, output=folder,
            progress=progress, figures=fit_figures(one),
        )  # fmt: skip
