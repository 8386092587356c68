"""One case from Python: check, model, modes, run, scene; and the outcome of a run in a Python session."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields
from functools import cached_property
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

from gapbeam.interface.case_source import (
    CaseSource,
    case_and_rule,
    check_fraction,
    check_range,
    folder_from,
    name_of,
    shared_case,
)
from gapbeam.meshes.versions.launcher_variables import rank_of_launcher
from gapbeam.process.launcher import all_ranks
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import is_scene
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.scene.argument_checks import checked

if TYPE_CHECKING:
    import xarray as xr
    from mpi4py import MPI

    from gapbeam.solver.march.simulation import Simulation
    from gapbeam.solver.scene.scene import Scene
    from gapbeam.solver.scene_file.scene_description import SceneDescription
    from gapbeam.studies.case_description import CaseDescription
    from gapbeam.studies.modes.find_modes import ModesResult


class UserOutcome(Outcome):
    """An outcome from `gapbeam.run`."""

    @classmethod
    def of(cls, outcome: Outcome) -> UserOutcome:
        """Return an outcome with the same results; memory of its body goes."""
        return cls(outcome.folder, outcome.exit_status, outcome.message, outcome.summary)

    @cached_property
    def history(self) -> xr.Dataset:
        """The records, see `gapbeam.open_results`.

        Raises:
            ResultsError: The records cannot be read.
        """
        from gapbeam.postprocess.results.results import open_results

        return open_results(self.folder).history

    @property
    def figures(self) -> list[dict[str, Any]]:
        """Figures with their errors, one a row, in SI units; none where no errors were estimated."""
        return [dict(row) for row in (self.summary.get("errors") or {}).get("figures", ())]

    def _repr_html_(self) -> str:
        from gapbeam.studies.error_estimate.closing_table import closing_lines
        from gapbeam.studies.printed_results import as_html

        closing = self.summary.get("closing")
        return as_html([repr(self), *(closing_lines(closing) if closing else ())])


@checked
def run(
    case: CaseSource | Scene,
    overrides: Overrides = (),
    output: str | PathLike[str] | None = None,
    overwrite: bool = False,
    resume: bool = False,
    relative_error: float | None = None,
    of: str | None = None,
    at_most: float | None = None,
    **march: Any,
) -> UserOutcome:
    """Run a case, or march a scene, into a results folder.

    Args:
        case: Path of a case file, its text, a dict of its tables, or a case; or a scene.
        overrides: Keys to replace, such as {"support.clearance": 0.1e-3} or ["support.clearance=0.1e-3"].
        output: Results folder; by default results/<name of the case file>, or results/scene.
        overwrite: Replace the results of an earlier run.
        resume: Continue from its last checkpoint; from the start where it has none yet.
        relative_error: A run under random loads continues beyond `time.end` until the 95 % interval of a statistic is
            +- this part of it.
        of: Name of that statistic, such as "probe.tip.rms".
        at_most: Longest time that is marched, s; None: 10 times `time.end`.
        march: Options of a scene, see `gapbeam.solver.run.scene_run.SceneRun`: `step` and `end`, s; `start`, a state;
            `every`, steps from one record to the next; `scheme`; `gates`, as the table [gates] of case files;
            `observers`, functions of the step after each record, which may set loads; `period` of the forcing, s;
            `title`; `checkpoint`, wall time between checkpoints, s; `wall_time`, after which it
            stops, s; `errors=False` estimates no errors; `penalty`,
            names of contacts whose stiffness stands for rigid contact; `figures`, of one's own, see `figure`.

    Returns:
        The outcome: folder, exit status, message, summary, history, figures. A run that created energy or did not
        converge is returned with an exit status that is not zero, not raised.

    Raises:
        CaseError: The case has faults; all of them are in the message.
        MeshError: The mesh file does not fit the case.
        OutOfMemory: The limit of addresses of this process is too low to begin with.
        UserError: The folder holds results, or those of another case, or a point lies outside the mesh; or an argument
            is not for a case, or not for a scene.

    Collective.
    """
    given = {"relative_error": relative_error, "of": of, "at_most": at_most, "overrides": overrides or None}
    if not isinstance(case, str | PathLike | Mapping | Case):
        return _run_of_scene(case, output, overwrite, resume, given, march)
    if is_scene(case):
        from gapbeam.solver.scene_file.scene_reader import read_scene

        _refuse(march, 'a file, whose step and end are keys: overrides={"time.end": 0.2}')
        read = read_scene(case, overrides)
        given["overrides"] = None
        if read.reason:
            LOG.info("chosen: time.step = %.4g s", read.step)
            LOG.debug("time.step = %.4g s: %s", read.step, read.reason)
        return _run_of_scene(read.scene, folder_from(output, read.name), overwrite, resume, given, read.march())
    if march:
        _refuse(march, 'a case, whose step and end are keys: overrides={"time.end": 0.2}')
    comm = all_ranks()
    folder = folder_from(output, name_of(case))
    whole, rule = case_and_rule(case, overrides, relative_error, of, at_most, comm)
    from gapbeam.solver.run.run_case import run_case
    from gapbeam.studies.error_estimate.companions import error_way

    way = error_way(whole)
    outcome = run_case(whole, folder, comm, overwrite, resume, rule)
    if way != "none":
        from gapbeam.studies.error_estimate.run_errors import with_errors

        outcome = with_errors(whole, outcome, comm)
    return UserOutcome.of(outcome)


def _run_of_scene(
    scene: Scene, output: str | PathLike[str] | None, overwrite: bool, resume: bool, others: Mapping[str, Any],
    march: dict[str, Any],
) -> UserOutcome:  # fmt: skip
    """Run a scene, on rank 0 of several; arguments that are for cases are refused."""
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.solver.messages.wording import printable
    from gapbeam.solver.run.scene_run import SceneRun, run_scene
    from gapbeam.studies.error_estimate.scene_errors import with_scene_errors

    if not any(one.__name__ == "Scene" for one in type(scene).__mro__):
        raise UserError(f"run: found {printable(scene)}, expected a case or a scene")
    _refuse([name for name, value in others.items() if value is not None], "a scene: see `scene.with_`")
    known = [one.name for one in fields(SceneRun) if one.name != "scene"]
    _refuse([name for name in march if name not in known], f"a scene; its arguments: {', '.join(known)}")
    lacking = [name for name in ("step", "end") if name not in march]
    if lacking:
        raise UserError(f"run: a scene needs {' and '.join(f'`{name}=`' for name in lacking)}, s")
    asked = SceneRun(scene, **march)

    def work() -> UserOutcome:
        ran = run_scene(asked, folder_from(output, "scene"), overwrite, resume)
        return UserOutcome.of(with_scene_errors(asked, ran))

    if rank_of_launcher() is None:
        return work()
    from gapbeam.meshes.rank_zero import on_rank_zero
    from gapbeam.solver.run.interruption import left_to_rank_zero

    ranks = all_ranks()
    with left_to_rank_zero(ranks.rank):
        return on_rank_zero(ranks, work)


def _refuse(names: Collection[str], what: str) -> None:
    """Refuse arguments of `run`.

    Raises:
        UserError: There are such arguments.
    """
    if names:
        from gapbeam.solver.messages.errors import UserError

        raise UserError(f"run: found {', '.join(f'`{name}=`' for name in names)} for {what}")


def model(case: CaseSource, overrides: Overrides = (), comm: MPI.Comm | None = None) -> Simulation:
    """Mesh, assemble and reduce a case in memory, ready for its seat and its march.

    Args:
        case: As in `run`.
        overrides: As in `run`.
        comm: The ranks that share the work; None: all.

    Returns:
        The simulation, with `seat()` and `march()`, a generator of steps.

    Raises:
        CaseError: The case has faults, or its computed time step does not go with the rest of it.
        MeshError: The mesh file does not fit the case.
        UserError: A point lies outside the mesh, or there is not enough memory.

    Collective.
    """
    ranks = all_ranks() if comm is None else comm
    read = shared_case(case, overrides, ranks)
    from gapbeam.solver.march.simulation import Simulation

    return Simulation.of_case(read, ranks)


def scene(case: CaseSource, overrides: Overrides = ()) -> Scene:
    """Return the scene of a file with [[structure]], or of a case with a reduced, beam or rigid model.

    The scene moves as the case does; `run`, `march` and `ensemble` take it with a step and a start of their own: it has
    neither, nor gates or an analysis. What else a scene cannot carry is refused by name.

    Args:
        case: As in `run`.
        overrides: As in `run`.

    Raises:
        CaseError: The case has faults.
        UserError: The case has what a scene has no noun for.
    """
    if is_scene(case):
        from gapbeam.solver.scene_file.scene_reader import read_scene

        return read_scene(case, overrides).scene

    return shared_case(case, overrides, all_ranks()).scene()


@checked
def check(case: CaseSource, overrides: Overrides = ()) -> CaseDescription | SceneDescription:
    """Mesh, assemble and seat a case, march some steps, and predict its run: model, time, memory.

    Of a file with [[structure]]: its structures, points, frequencies, contacts and seat.

    Args:
        case: As in `run`.
        overrides: As in `run`.

    Raises:
        CaseError: The case has faults.
        MeshError: The mesh file does not fit the case.
        UserError: The run would be refused.
        NotConverged: The beam finds no seat.

    Collective.
    """
    if is_scene(case):
        from gapbeam.solver.scene_file.scene_description import describe_scene
        from gapbeam.solver.scene_file.scene_reader import read_scene

        return describe_scene(read_scene(case, overrides))
    comm = all_ranks()
    read = shared_case(case, overrides, comm)
    from gapbeam.studies.case_description import describe_case

    return describe_case(read, comm)


@checked
def modes(
    case: CaseSource,
    overrides: Overrides = (),
    count: int = 4,
    measured: Mapping[int, float] | None = None,
    accuracy: float = 0.01,
    output: str | PathLike[str] | None = None,
    overwrite: bool = False,
) -> ModesResult:
    """Find the bending modes of the seated beam, and the end springs that reproduce them or measured frequencies.

    Args:
        case: As in `run`.
        overrides: As in `run`.
        count: Bending modes, at least 2.
        measured: Measured frequencies by mode, {1: 43.2, 2: 268.0}, Hz; at least two.
        accuracy: Standard deviation of a frequency, as a fraction, for the intervals.
        output: Folder; by default results/<case>-modes.
        overwrite: Begin anew.

    Raises:
        CaseError: The case has faults.
        MeshError: The mesh file does not fit the case.
        UserError: Measured frequencies that are none, more modes than the mesh carries, or a folder that cannot be
            written or holds modes of other inputs.
        NotConverged: The beam finds no seat.

    Collective.
    """
    check_range("count", count, 2)
    check_fraction("accuracy", accuracy)
    given = dict(sorted((measured or {}).items()))
    _check_measured(given, count)
    comm = all_ranks()
    from gapbeam.studies.modes.find_modes import find_modes

    folder = folder_from(output, f"{name_of(case)}-modes")
    return find_modes(shared_case(case, overrides, comm), folder, comm, count, given, accuracy, overwrite)


def _check_measured(measured: Mapping[int, float], count: int) -> None:
    """Refuse frequencies that are none, do not ascend, or belong to no mode.

    Raises:
        UserError: There are such frequencies, or only one.
    """
    from gapbeam.solver.messages.errors import UserError

    values = list(measured.values())
    ascending = all(before < after < float("inf") for before, after in pairwise([0.0, *values]))
    fits = all(1 <= mode <= count for mode in measured)
    if measured and not (len(values) > 1 and ascending and fits):
        raise UserError(
            f"`measured=`: found {dict(measured)}; expected at least two frequencies of the modes 1 to {count}, "
            "{mode: Hz}, that ascend with the mode"
        )
