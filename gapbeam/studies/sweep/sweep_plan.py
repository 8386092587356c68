"""Plan of a sweep, and the finished points in its folder."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.studies.study_folder import REMEDY, StoredResponse, StudyPlan, checked, refuse_links, study_written
from gapbeam.studies.trials.axes import Axis, overrides_of, points_of
from gapbeam.studies.trials.subject import Subject, read_subject, shared_inputs

POINTS = "points"
FORMAT = 1
AGAIN = "remove this file, and its response is computed again; the others stay"
_NUMBERED = re.compile(r"\d{6}\.json")


@dataclass(frozen=True)
class Sweep:
    """A sweep over the keys of a case or of a file of structures.

    Attributes:
        case: Path of the file.
        fixed: Overrides of every point, KEY=VALUE.
        axes: Axes of the study.
        zipped: Lists side by side instead of a grid.
        carry: Whether points along the last axis start from the end of the one before them.
        both: Whether they are carried downward too.
        starts: Starts of every point, or of every chain of carried points: the seat and starts - 1 kicks.
        seed: Seed of the kicks.
        transient: s after which a response counts; None: found out.
        tolerance: Tolerance of the periodicity, and of responses that are taken for the same.
    """

    case: Path
    fixed: tuple[str, ...]
    axes: tuple[Axis, ...]
    zipped: bool = False
    carry: bool = False
    both: bool = False
    starts: int = 1
    seed: int = 0
    transient: float | None = None
    tolerance: float = 0.02

    def points(self) -> list[tuple[str, ...]]:
        """The values of every point.

        Raises:
            UserError: Too many, a key twice, or lists of different lengths.
        """
        return points_of(self.axes, self.zipped)

    def overrides(self, point: Sequence[str]) -> list[str]:
        """The overrides of a point."""
        return overrides_of(self.axes, point, self.fixed)


class Task(NamedTuple):
    """One response to compute.

    Attributes:
        number: Number of the response in the sweep, which names its files.
        values: Values of the axes.
        direction: "up" or "down" along the last axis where the state is carried, or "".
        start: 0 the seat, else the number of a kick.
    """

    number: int
    values: tuple[str, ...]
    direction: str
    start: int


class Chain(NamedTuple):
    """Responses that one process computes one after the other; in a carried chain each starts from the last one."""

    sweep: Sweep
    folder: Path
    tasks: tuple[Task, ...]


def chains_of(sweep: Sweep, folder: Path) -> list[Chain]:
    """Return the chains of a sweep, in an order that does not depend on finished work."""
    points, folder = sweep.points(), folder.absolute()
    carried = replace(
        sweep, case=sweep.case.absolute(), axes=tuple(Axis(axis.key, ()) for axis in sweep.axes)
    )  # what a worker needs: thousands of values a chain would be sent with each of thousands of chains
    chains: list[list[tuple[tuple[str, ...], str, int]]] = []
    if sweep.carry:
        length = len(points) if sweep.zipped else len(sweep.axes[-1].values)
        lines = [points[first : first + length] for first in range(0, len(points), length)]
        for line in lines:
            for direction in ("up", "down") if sweep.both else ("up",):
                way = line if direction == "up" else line[::-1]
                chains += [[(values, direction, start) for values in way] for start in range(sweep.starts)]
    else:
        chains = [[(values, "", start)] for values in points for start in range(sweep.starts)]
    numbered, number = [], 0
    for chain in chains:
        tasks = tuple(Task(number + place, *task) for place, task in enumerate(chain))
        number += len(chain)
        numbered.append(Chain(carried, folder, tasks))
    return numbered


def read_points(sweep: Sweep) -> dict[tuple[str, ...], Subject | CaseError]:
    """Read the case or file of structures at every point; those with faults are results.

    Raises:
        CaseError: Every point has faults; those of the first are reported.
        UserError: The subject is no march, or a state cannot be carried along the last key.
    """
    found: dict[tuple[str, ...], Subject | CaseError] = {}
    for point in sweep.points():
        try:
            found[point] = read_subject(sweep.case, sweep.overrides(point))
        except CaseError as error:
            found[point] = error
    faults = [entry for entry in found.values() if isinstance(entry, CaseError)]
    if len(faults) == len(found):
        raise faults[0]
    sound = {point: one for point, one in found.items() if not isinstance(one, CaseError)}
    for one in sound.values():
        one.refuse()
    if sweep.carry:
        _check_carry(sweep, sound)
    return found


def _check_carry(sweep: Sweep, subjects: Mapping[tuple[str, ...], Subject]) -> None:
    """Refuse to carry a state along a key that changes the model of the state."""
    lines: dict[tuple[str, ...], list[Subject]] = {}
    for point, one in subjects.items():
        lines.setdefault(() if sweep.zipped else point[:-1], []).append(one)
    for line in lines.values():
        tables = [one.state_keys for one in line]
        if any(table != tables[0] for table in tables):
            name = next(name for name in tables[0] if any(table.get(name) != tables[0][name] for table in tables))
            raise UserError(
                f"`carry=True`: {name} changes along {sweep.axes[-1].key}, so a state does not fit the next point; "
                f"expected a last key that leaves mesh, material, model and places as they are, such as "
                f"{line[0].carried_keys}"
            )


def prepare(sweep: Sweep, folder: Path) -> int:
    """Make the folder of the responses of a sweep, and return the number of those that are on disk already.

    Raises:
        UserError: The folder holds links.
        ResultsError: A response cannot be read, or belongs to another sweep.
        NotWritten: The folder cannot be made.
    """
    refuse_links(folder / POINTS)
    with study_written(folder / POINTS):
        (folder / POINTS).mkdir(exist_ok=True)
    _check_responses(sweep, folder)
    return len(finished(folder))


def finished(folder: Path) -> dict[int, dict[str, Any]]:
    """Return the records of the responses that are on disk, by number.

    Raises:
        ResultsError: A record cannot be read, or is none.
    """
    paths = sorted(path for path in (folder / POINTS).glob("*.json") if _NUMBERED.fullmatch(path.name))
    return {
        int(path.stem): checked(read_object(path, remedy=AGAIN), StoredResponse, path, remedy=AGAIN) for path in paths
    }


def written_responses(folder: Path) -> int:
    """Return the number of responses on disk, by the names of their files."""
    return sum(_NUMBERED.fullmatch(path.name) is not None for path in (folder / POINTS).iterdir())


def _check_responses(sweep: Sweep, folder: Path) -> None:
    """Refuse records of other responses than those of the sweep.

    Raises:
        ResultsError: A record belongs to another response.
    """
    tasks = {task.number: task for chain in chains_of(sweep, folder) for task in chain.tasks}
    for number, record in finished(folder).items():
        values = tasks[number].values if number in tasks else ()
        wanted = dict(zip((axis.key for axis in sweep.axes), values, strict=False))
        if record["values"] != wanted:
            path = folder / POINTS / f"{number:06d}.json"
            expected = f"the response at {wanted}" if wanted else f"at most {counted(len(tasks), 'response')}"
            raise ResultsError(path, f"the response at {record['values']}", expected, REMEDY)


def point_file(folder: Path, task: Task, suffix: str = "json") -> Path:
    """Return the file of a response."""
    return folder / POINTS / f"{task.number:06d}.{suffix}"


def plan_of(sweep: Sweep, subjects: Sequence[Subject], overwrite: bool) -> StudyPlan:
    """Return the plan of a sweep.

    Args:
        sweep: The sweep.
        subjects: Subjects at the points, as far as they have no faults.
        overwrite: Remove what an earlier sweep left.
    """
    options = {f"--{key}": getattr(sweep, name) for key, name in _OPTIONS.items()}
    inputs = {"format": FORMAT} | shared_inputs(subjects, sweep.axes) | options
    return StudyPlan(inputs, overwrite, (POINTS,), _ARGUMENTS)


_OPTIONS = {
    "zip": "zipped",
    "carry": "carry",
    "both": "both",
    "starts": "starts",
    "seed": "seed",
    "transient": "transient",
    "tolerance": "tolerance",
}
_ARGUMENTS = {f"--{key}": f"`{name}=`" for key, name in _OPTIONS.items()}
