"""Trials of a case at every point of a grid, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.faults import CaseError
from gapbeam.studies.trials.axes import Axis, overrides_of, points_of
from gapbeam.studies.trials.trial import Trial, try_case
from gapbeam.studies.trials.worker_processes import side_by_side


class GridRow(NamedTuple):
    """One point of the grid: its values in the order of the axes, and its result."""

    values: tuple[str, ...]
    trial: Trial


def run_grid(
    case: Path,
    fixed: Sequence[str],
    axes: Sequence[Axis],
    jobs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[GridRow]:
    """Try a case at every point of a grid, in several processes.

    Args:
        case: Path of the case file.
        fixed: Overrides of every point, KEY=VALUE.
        axes: What varies.
        jobs: Processes; by default one a core.
        progress: Called with the number of points done and all.

    Returns:
        One row a point, in the order of the product of the axes; a point whose case has faults has the verdict
        "refused".

    Raises:
        CaseError: The case has faults at every point; those of the first are reported.
        UserError: The grid is too large.
    """
    points = points_of(axes)
    works = [(case, overrides_of(axes, point, fixed)) for point in points]
    rows: list[GridRow | None] = [None] * len(points)
    for done, (place, trial) in enumerate(side_by_side(_try_point, works, jobs), 1):
        rows[place] = GridRow(points[place], trial)
        if progress is not None:
            progress(done, len(points))
    finished = [row for row in rows if row is not None]
    if all(row.trial.verdict == "refused" for row in finished):
        read_case(*works[0])
    return finished


def _try_point(work: tuple[Path, list[str]]) -> Trial:
    try:
        read = read_case(*work)
    except CaseError as error:
        return Trial(verdict="refused", message=str(error))
    return try_case(read)


def table(rows: Sequence[GridRow], axes: Sequence[Axis]) -> list[dict[str, Any]]:
    """Return the grid as one flat record a point."""
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, row.values, strict=True)) | row.trial.as_dict() for row in rows]
