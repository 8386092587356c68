"""A study of uncertain values from its file: the scene of a case, its starts, and the folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from pathlib import Path

from gapbeam.solver.case.reading.case_reader import read_tables
from gapbeam.solver.case.reading.overrides import pairs
from gapbeam.solver.errors import UserError
from gapbeam.solver.faults import CaseError, Fault
from gapbeam.studies.atlas.run_atlas import PeriodicScene, rest_of, starts_of
from gapbeam.studies.identification.identification_file import settings_of
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.uncertain.uncertain_file import Rare, UncertainStudy, contradictions
from gapbeam.studies.uncertain.uncertain_result import Uncertain
from gapbeam.studies.uncertain.uncertain_scene import uncertain


def read_uncertain(path: Path) -> UncertainStudy:
    """Read the file of a study.

    Raises:
        CaseError: It cannot be read, or there are faults: all of them.
    """
    study = read_tables(path, UncertainStudy, contradictions)
    if not study.variable:
        fault = Fault((), "no [[variable]]", "at least one, with path and distribution", where=f"{path}: variable")
        raise CaseError(str(path), [fault])
    return study


def settings_of_study(path: Path, study: UncertainStudy, overrides: Sequence[str]) -> dict[str, object]:
    """Return the settings over those of the case: [set], and texts KEY=VALUE over it.

    Raises:
        CaseError: A text is no KEY=VALUE.
    """
    typed = list(pairs(overrides))
    faults = [entry for entry in typed if isinstance(entry, Fault)]
    if faults:
        raise CaseError(str(path), faults)
    return settings_of(study.set) | dict(entry for entry in typed if not isinstance(entry, Fault))


def run_uncertain(
    study: UncertainStudy, one: PeriodicScene, folder: Path, progress: Callable[[int], None] | None = None
) -> Uncertain:
    """March the members of a study, and write tables and a picture; a call with the same folder continues there.

    Args:
        study: As read.
        one: The scene of its case.
        folder: Where files go.
        progress: Called with the number of members that are done.

    Raises:
        UserError: The scene has no such value or figure, or does not take a value that was drawn.
        NotWritten: A file could not be written.
    """
    T, several = one.period, study.starts > 1
    starts = starts_of(one, study.settle, study.starts, study.reach, study.seed) if several else rest_of(one)
    rare, causes = study.rare or Rare(), study.sensitivity
    limits = {limit.figure: limit.value for limit in study.limit}
    given = {variable.path: variable.frozen for variable in study.variable}
    if not one.scene.point_names and any(name.startswith(("peak/", "rms/")) for name in limits):
        raise UserError("uncertain: the case has no probe, and so no displacement; add a [[probe]]")
    with study_folder(folder):
        return uncertain(
            one.scene, given, correlation={pair.paths: pair.rank for pair in study.correlation}, limits=limits,
            members=study.members, sampling=study.sampling, replicates=study.replicates, seed=study.seed,
            rare=study.rare is not None, rare_members=rare.members, rare_replicates=rare.replicates,
            sensitivity=0 if causes is None else causes.points, period=T, starts=starts,
            steps=ceil(T / one.step * (1.0 - 1e-9)), settle=study.settle, rounds=study.rounds, orders=study.orders,
            measure=study.measure, output=folder, progress=progress,
        )  # fmt: skip
