"""A case over a grid of stiffness, step and scheme: trials, tables and maps of where it can be trusted."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gapbeam.postprocess.study_figures.stability_map import QUANTITIES, draw_stability_map
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import StudyPlan, study_folder, write_json, write_table
from gapbeam.studies.trials.axes import Axis
from gapbeam.studies.trials.response import run_grid, sound_cases
from gapbeam.studies.trials.scene_subject import CaseSubject
from gapbeam.studies.trials.subject import shared_inputs

LOG = logging.getLogger(__name__)
SCHEME = "time.scheme"
JOURNAL = "trials.jsonl"  # while the study is under way
OF_STIFFNESS, OF_STEP = (1e-4, 1e-2, 1.0, 1e2), (0.1, 1.0, 10.0)
"""Contact stiffnesses and steps that are tried, over those of the case."""


@dataclass(frozen=True, repr=False)
class StabilityResult(PrintedResult):
    """Result of a stability study.

    Attributes:
        folder: Folder of its files.
        records: One record a trial: the values of the keys, verdict and figures.
        pictures: The maps.
    """

    folder: Path
    records: Sequence[dict[str, Any]]
    pictures: Sequence[Path]

    def summaries(self) -> list[str]:
        """Return one line a scheme: verdicts by number, and the largest residual of the trials that passed."""
        lines = []
        for name in dict.fromkeys(record[SCHEME] for record in self.records):
            mine = [record for record in self.records if record[SCHEME] == name]
            counts = Counter(record["verdict"] for record in mine)
            verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
            residuals = [abs(record["residual"]) for record in mine if record["verdict"] == "passed"]
            worst = f"; largest residual of those that passed {max(residuals):.1e}" if residuals else ""
            lines.append(f"{name}: {verdicts}{worst}")
        return lines

    def headline(self) -> str:
        """Return the number of trials that passed."""
        passed = sum(record["verdict"] == "passed" for record in self.records)
        return f"{passed} of {len(self.records)} trials passed"

    def tables(self) -> list[str]:
        """Return the line of each scheme."""
        return self.summaries()


def run_stability(
    case: Path,
    axes: Sequence[Axis],
    folder: Path,
    fixed: Sequence[str] = (),
    workers: Workers | None = None,
    progress: Callable[[int, int], None] | None = None,
    overwrite: bool = False,
) -> StabilityResult:
    """Try a case at every point of a grid, and write tables and maps; resumes where it stopped.

    Args:
        case: Path of the case file.
        axes: Axes of the study; "time.scheme" must be among the keys. Where contact stiffness or step are not, values
            about those of the case are tried.
        folder: Folder for the files.
        fixed: Overrides of every point, KEY=VALUE.
        workers: Workers that compute; by default one a core of this machine.
        progress: Called with the number of trials that are done, and of all.
        overwrite: Begin anew.

    Raises:
        CaseError: The case has faults at every point; those of the first are reported.
        UserError: The grid is too large, or the folder cannot be written or holds a study of other inputs.
        NotWritten: A trial could not be written.
    """
    axes = [*usual_axes(case, axes, fixed), *axes]
    sound = sound_cases(case, fixed, axes)
    inputs = shared_inputs([CaseSubject(one) for one in sound], axes)
    with study_folder(folder, plan=StudyPlan(inputs, overwrite, (JOURNAL,))):
        records = run_grid(case, fixed, axes, workers, progress, folder / JOURNAL, sound)
        write_json(folder / "stability.json", records)
        write_table(folder / "stability.csv", records[0], [one.values() for one in records])
        pictures = [folder / f"stability-{name}.png" for name in QUANTITIES]
        for picture, quantity in zip(pictures, QUANTITIES.values(), strict=True):
            draw_stability_map(records, picture, shown=quantity)
    return StabilityResult(folder, records, pictures)


def usual_axes(case: Path, axes: Sequence[Axis], fixed: Sequence[str] = ()) -> list[Axis]:
    """Return the axes of contact stiffness and step that a study leaves out: multiples of the case's own.

    A stiffness that acts at no support has no axis. Arguments as of `run_stability`.

    Raises:
        CaseError: The case has faults at every point.
    """
    given = {axis.key for axis in axes}
    missing = [key for key in ("contact.stiffness", "time.step") if key not in given]
    if not missing:
        return []
    subject = CaseSubject(sound_cases(case, fixed, axes)[0])
    model, acts = subject.model, subject.case.contact.formulation.takes_stiffness
    values = {one.key: one.value for one in model.defaults if acts} | {"time.step": model.step}
    times = {"contact.stiffness": OF_STIFFNESS, "time.step": OF_STEP}
    found = [
        Axis(key, tuple(f"{factor * values[key]:.4g}" for factor in times[key]) if key in values else ("auto",))
        for key in missing
    ]
    LOG.info("tried: %s", "; ".join(f"{axis.key} = {', '.join(axis.values)}" for axis in found))
    return found
