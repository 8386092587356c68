"""A grid of values over the keys of a case, and its trials side by side."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from solver.case_file.faults import CaseError
from solver.case_file.reader import read_case
from solver.errors import UserError
from solver.studies.trial import Trial, try_case

MOST_POINTS = 100_000


class Axis(NamedTuple):
    """A key of the case and the values that it takes, as one would type them after `--set key=`."""

    key: str
    values: tuple[str, ...]


class Row(NamedTuple):
    """One point of the grid: its values in the order of the axes, and what became of it."""

    values: tuple[str, ...]
    trial: Trial


def read_axis(text: str) -> Axis:
    """Read KEY=a,b,c or KEY=first:last:count (spaced evenly in the logarithm).

    Commas inside brackets and braces belong to the value.

    Raises:
        UserError: Neither of the two.
    """
    key, _, given = text.partition("=")
    if not key or not given:
        raise UserError(f'--vary "{text}": found no values; expected KEY=a,b,c or KEY=first:last:count')
    parts = given.split(":")
    if len(parts) == 3 and "{" not in given:
        try:
            first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        except ValueError:
            raise UserError(f'--vary "{text}": expected numbers in first:last:count, such as 1e8:1e18:11') from None
        if first <= 0.0 or last <= 0.0 or not 1 <= count <= MOST_POINTS:
            raise UserError(f'--vary "{text}": expected first and last above 0 and a count from 1 to {MOST_POINTS}')
        return Axis(key, tuple(f"{value:.6g}" for value in np.geomspace(first, last, count)))
    return Axis(key, tuple(_split(given)))


def run_grid(
    case: Path,
    fixed: Sequence[str],
    axes: Sequence[Axis],
    jobs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Row]:
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
        CaseError: The case has faults at every point; those of the first are told.
        UserError: The grid is too large.
    """
    points = list(product(*(axis.values for axis in axes)))
    if len(points) > MOST_POINTS:
        raise UserError(f"the grid has {len(points)} points; expected at most {MOST_POINTS}")
    overrides = [
        [*fixed, *(f"{axis.key}={value}" for axis, value in zip(axes, point, strict=True))] for point in points
    ]
    rows: list[Row | None] = [None] * len(points)
    context = multiprocessing.get_context("spawn")  # a forked MPI process would share its parent's connections
    with ProcessPoolExecutor(jobs or os.cpu_count() or 1, mp_context=context) as pool:
        waiting = {pool.submit(_try_point, case, given): place for place, given in enumerate(overrides)}
        for done, future in enumerate(as_completed(waiting), 1):
            place = waiting[future]
            rows[place] = Row(points[place], future.result())
            if progress is not None:
                progress(done, len(points))
    finished = [row for row in rows if row is not None]
    if all(row.trial.verdict == "refused" for row in finished):
        read_case(case, overrides[0])
    return finished


def _try_point(case: Path, overrides: Sequence[str]) -> Trial:
    try:
        read = read_case(case, overrides)
    except CaseError as error:
        return Trial(verdict="refused", message=str(error))
    return try_case(read)


def _split(text: str) -> list[str]:
    """Split at commas that are not inside brackets or braces."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]


def table(rows: Sequence[Row], axes: Sequence[Axis]) -> list[dict[str, Any]]:
    """Return the grid as one flat record a point."""
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, row.values, strict=True)) | row.trial.as_dict() for row in rows]
