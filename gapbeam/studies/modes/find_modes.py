"""The modes of a case: computed, compared with the theory, written and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.versions.installed_versions import versions
from gapbeam.postprocess.figures.curve_figures import draw_mode_shapes
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.output.field_files import write_mode_fields
from gapbeam.solver.run.output.run_summary import describe_model
from gapbeam.solver.schema.record_table import FIELDS_FILE
from gapbeam.solver.seat.contact_modes import SEATED, held_modes
from gapbeam.studies.modes.theory_comparison import (
    FITTED,
    ModesComparison,
    as_data,
    compare_modes,
    frequency_table,
    moving_along,
    other_modes,
    remarks,
    spring_table,
)
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import StudyPlan, study_folder, write_json
from gapbeam.studies.trials.scene_subject import CaseSubject
from gapbeam.studies.trials.subject import shared_inputs

if TYPE_CHECKING:
    from mpi4py import MPI

COUNT, ACCURACY = 4, 0.01
NOT_REPRODUCED = 5


@dataclass(frozen=True, repr=False)
class ModesResult(PrintedResult):
    """Modes of a case, compared with theory.

    Attributes:
        folder: Folder of the files.
        comparison: The modes of the seated, free and closed body, those of the theory, and the end springs.
        remarks: Warnings.
        paths: modes.json, the picture and the shapes.
    """

    folder: Path
    comparison: ModesComparison
    remarks: tuple[str, ...]
    paths: tuple[Path, ...]

    @property
    def frequencies(self) -> list[float]:
        """Frequencies of the bending modes of the seated body, Hz."""
        seated = self.comparison.states[SEATED]
        return [float(frequency) for frequency in seated.bending()[0][: self.comparison.count]]

    @property
    def not_reproduced(self) -> list[str]:
        """Sources whose frequencies no end springs reproduce: "seated" or "measured"."""
        fits = self.comparison.fits
        sources = {one.source for one in fits}
        return sorted(
            name for name in sources if not any(one.fit.reproduces for one in fits if one.source == name)
        )  # fmt: skip

    @property
    def exit_status(self) -> int:
        """0, or 5 where no end springs reproduce the frequencies."""
        return NOT_REPRODUCED if self.not_reproduced else 0

    def headline(self) -> str:
        """Return the frequencies in one line."""
        return "bending modes of the seated beam, Hz: " + ", ".join(f"{value:.4g}" for value in self.frequencies)

    def tables(self) -> list[Table]:
        """Return the tables of frequencies and, where there are fits, of end springs."""
        springs = [spring_table(self.comparison.fits)] if self.comparison.fits else []
        return [frequency_table(self.comparison), *springs]


def find_modes(
    case: Case,
    folder: Path,
    comm: MPI.Comm,
    count: int = COUNT,
    measured: Mapping[int, float] | None = None,
    accuracy: float = ACCURACY,
    overwrite: bool = False,
) -> ModesResult:
    """Find the modes of the seated beam and the end springs that reproduce them, or those measured.

    Args:
        case: The case.
        folder: Folder for the files.
        comm: The ranks that share the work.
        count: Bending modes, at least 2.
        measured: Measured frequencies by mode, Hz; None: none.
        accuracy: Standard deviation of a frequency, relative, for the intervals.
        overwrite: Begin anew.

    Raises:
        UserError: The folder cannot be written or holds modes of other inputs, or the case cannot be assembled.
        NotConverged: The beam finds no seat.

    Collective.
    """
    settings = {"count": count, "measured": dict(measured or {}), "accuracy": accuracy}
    inputs = on_rank_zero(comm, lambda: shared_inputs([CaseSubject(case)]) | settings)
    with study_folder(folder, comm, StudyPlan(inputs, overwrite)):
        on_rank_zero(comm, lambda: _made(folder / SEATED))
        model = build_model(case, comm)
        states = held_modes(model, count, FITTED)
        write_mode_fields(folder / SEATED, case, model, states[0])
        described = describe_model(case, model)

        section = None if case.mesh.file is None else model.body.meshed.section

        def compared() -> ModesResult:
            found = compare_modes(case, states, count, measured or {}, accuracy, section)
            data = {"title": case.title, "versions": versions(), "model": described} | as_data(found)
            write_json(folder / "modes.json", data)
            picture = draw_mode_shapes(as_data(found), folder / "modes.png")
            moving = moving_along(case)
            carried = (
                [f"{', '.join(moving)} moves along with the model, not with the theory"]
                if moving and found.free
                else []
            )
            if not case.profile.prismatic:
                carried.append("beam with [[segment]]: not compared, the theory is for prismatic beams")
            lines = (other_modes(states[0]), *carried, *remarks(found))
            paths = (folder / "modes.json", picture, folder / SEATED / FIELDS_FILE)
            return ModesResult(folder, _without_shapes(found), lines, paths)

        return on_rank_zero(comm, compared)


def _without_shapes(found: ModesComparison) -> ModesComparison:
    """Return a comparison without the shapes: each rank has only its own part of them, and they are in a file."""
    return replace(
        found, states={name: replace(state, shapes=state.shapes[:0]) for name, state in found.states.items()}
    )  # fmt: skip


def _made(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder} cannot be made ({error.strerror}); choose another `output=`") from error
