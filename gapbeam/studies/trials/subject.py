"""The subject of a study: a case or a file of structures with given values, which is started, marched and judged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol, Self

import xarray as xr

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.case_reader import is_scene, read_case
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.scene_file.scene_reader import scene_file
from gapbeam.solver.system.operators import Array
from gapbeam.studies.trials.axes import Axis
from gapbeam.studies.trials.response import TrialResponse
from gapbeam.studies.trials.scene_subject import CaseSubject, SceneSubject
from gapbeam.studies.trials.starts import Start


class Subject(Protocol):
    """A case or a file of structures with given values of its keys; it is set up when it is first started."""

    @property
    def tables(self) -> dict[str, Any]:
        """All that decides its responses, by dotted keys."""

    @property
    def contents(self) -> dict[str, Any]:
        """Checksums of the files that its tables name."""

    @property
    def state_keys(self) -> dict[str, Any]:
        """Tables that a state depends on, by dotted keys: the end of a response fits subjects that share them."""

    @property
    def carried_keys(self) -> str:
        """Keys along which a state can be carried, in words."""

    @property
    def figures(self) -> Sequence[Figure]:
        """Figures of one's own."""

    @property
    def is_random(self) -> bool:
        """True where loads are random, so that a response is known by its statistics."""

    @property
    def moves_by_itself(self) -> bool:
        """True where forces that follow the motion may keep it up, so that it has statistics without forcing."""

    @property
    def frequency(self) -> float | None:
        """Forcing frequency, Hz; None: there is none, or there are several."""

    @property
    def window(self) -> float:
        """Window of smoothed accelerations, s."""

    def unit_of(self, key: str) -> str:
        """Return the SI unit of a key, as a study names it; "": none, or none that is known."""

    def refuse(self) -> None:
        """Refuse an analysis that is no march.

        Raises:
            UserError: The subject is no march.
        """

    def memory_with(self, others: Sequence[Self]) -> float | None:
        """Return the approximate memory of a worker for this and others of its kind, bytes; None: not known."""

    def start(self, number: int, seed: int) -> Start:
        """Return a start: 0 is the one of its file, others are random kicks.

        Raises:
            RunError: There is no such start.
        """

    def carried(self, end: Any, before: Self) -> Start:
        """Return the end of a response of another subject as a start.

        Raises:
            UserError: The end does not fit this subject.
        """

    def respond(self, begin: Start, rings: bool) -> TrialResponse:
        """March from a start, record, and judge; errors of the march are results.

        Args:
            begin: The start.
            rings: Whether free vibration from the start is part of the response.
        """

    def stays_linear(self, history: xr.Dataset, after: float) -> bool:
        """Return whether it was a linear system from a time on, s: no contact opened or closed, on linear springs."""

    def packed(self, end: Any) -> dict[str, Array]:
        """Return the end of a response as arrays."""

    def unpacked(self, arrays: Any) -> Any | None:
        """Return the end of a response from its arrays; None where this process has another basis than that one."""


def shared_inputs(subjects: Sequence[Subject], axes: Sequence[Axis] = ()) -> dict[str, Any]:
    """Return all inputs of the responses of several subjects: tables that all share, files, and values of the axes.

    Args:
        subjects: Subjects at the points of a study, one or more.
        axes: Axes of the study.
    """
    first, *others = (one.tables for one in subjects)
    swept = {axis.key for axis in axes}
    shared = {
        key: value
        for key, value in first.items()
        if key not in swept and all(table.get(key) == value for table in others)
    }
    return shared | subjects[0].contents | {f"values of {axis.key}": list(axis.values) for axis in axes}


def read_subject(path: Path, overrides: Overrides) -> Subject:
    """Read a case or a file of structures.

    Args:
        path: The file.
        overrides: Keys that are replaced.

    Raises:
        CaseError: The file has faults.
    """
    if is_scene(path):
        return SceneSubject(scene_file(path, overrides))
    return CaseSubject(read_case(path, overrides))
