"""Resume of a run in a results folder, or a start from the state that another run left there."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.checkpoint_files import (
    BrokenCheckpoint,
    Contents,
    found,
    model_file,
    read_checkpoint,
    time_of,
)
from gapbeam.solver.run.checkpoint.checkpoints import Left, checked_header, last_checkpoint, refuse_another_case
from gapbeam.solver.run.checkpoint.same_model import FREE, differences, earlier_summary, keys_of
from gapbeam.solver.run.checkpoint.state_checks import DofLayout, layout_of, restored
from gapbeam.solver.run.output.history_file import refuse_cut
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged

if TYPE_CHECKING:
    from mpi4py import MPI


def refuse_to_resume(case: Case) -> None:
    """Refuse a case whose runs have no checkpoints.

    Raises:
        UserError: The case looks for a periodic response.
    """
    if isinstance(case.analysis, Periodic):
        raise UserError(
            '`resume=True` with analysis.type = "periodic": a search has no checkpoints; expected a transient; '
            "start again with `overwrite=True`, or with a shorter march before the search (time.end)"
        )


def find_left(folder: Path, case: Case, model: Model, comm: MPI.Comm) -> Left | dict[str, Any] | None:
    """Return the state in which the run in a results folder stopped.

    Args:
        folder: Results folder, held by this run.
        case: The case that shall go on, as it was read.
        model: Its model, found anew.
        comm: Its ranks.

    Returns:
        State to resume from; the summary of a run that is done; or None where a run has not come to its first
        checkpoint, or there is none, and the run starts.

    Raises:
        UserError: The case differs from the one that was run, no checkpoint can be read, or results of a run that is
            done were cut.

    Collective.
    """
    summary: dict[str, Any] = on_rank_zero(comm, lambda: earlier_summary(folder))
    keys = on_rank_zero(comm, lambda: keys_of(model.case))
    if summary.get("status") == "completed":
        refuse_another_case(folder, keys, comm, frozenset(FREE - {"time.end"}))
        on_rank_zero(comm, lambda: refuse_cut(folder))
        return summary
    left = last_checkpoint(folder, case, model, comm, keys)
    if left is None:
        refuse_another_case(folder, keys, comm, frozenset(FREE))
        LOG.info("%s has no checkpoint: the run starts", folder)
    return left


MAY_DIFFER = ("title", "load", "probe", "damping", "time", "analysis", "solver", "gates", "output")
SAME_PLACE = "mesh.file"  # its contents count
ROUND_OFF = 1.0e-9  # of the largest entry of mass and stiffness
DEEPER = 1.0e-7  # of the thickness: round-off of points that touch


def left_state(case: Case, model: Model, folder: Path, comm: MPI.Comm) -> State | None:
    """Return the state at t = 0 that a case takes from another results folder; None: it takes none.

    u, v, contact pressure, friction and plastic sets are those of the last checkpoint, or of that at
    `analysis.state_time`. The acceleration follows from the balance under the loads of the case, which begin anew at
    t = 0.

    Args:
        case: The case.
        model: Its model.
        folder: Folder of the results of the case.
        comm: Its ranks.

    Raises:
        UserError: There is no such folder, no checkpoint in it, none of that time or none that can be read, the
            checkpoint is of another model, or faces that move are elsewhere.

    Collective.
    """
    analysis = case.analysis
    if not isinstance(analysis, Transient) or analysis.state is None:
        return None
    source = Path(analysis.state)
    path = on_rank_zero(comm, lambda: _chosen(source, folder, analysis.state_time))
    local: list[Contents] = []
    layout = layout_of(model, comm)
    try:
        header: dict[str, Any] = on_rank_zero(comm, partial(checked_header, path, local))
        contents = local[0] if local else None
        on_rank_zero(comm, lambda: _refuse_another_model(path, keys_of(case), header, layout))
        paused, _ = restored(contents, header, layout)
    except BrokenCheckpoint as broken:
        raise _fault(path, f"cannot be used: {broken}") from broken
    LOG.info("starts from the state of %s at t = %.6g s", path, paused.state.time)
    return _at_zero(paused.state, model, path)


def _chosen(source: Path, folder: Path, time: float | None) -> Path:
    """Return the checkpoint of a results folder at a time, None: the last one; on rank 0."""
    try:
        there, same = source.is_dir(), source.resolve() == folder.resolve()
        paths = found(source) if there else []
    except (OSError, ValueError, RuntimeError) as error:
        raise _fault(source, f"cannot be read ({error})") from error
    if not there:
        raise _fault(source, "is no folder", "the path of a results folder, relative to the case file")
    if same:
        raise _fault(source, "is where the results of this run go", "another folder", "another `output=`")
    if not paths:
        status, kept = earlier_summary(source).get("exit_status"), "the results of a run that keeps one"
        if status and isinstance(status, int):
            raise _fault(source, f"holds no checkpoint: its run ended with status {status}", kept, "a run that passes")
        raise _fault(
            source,
            "holds no checkpoint, so no state of all DOFs with their velocities",
            kept,
            "running it again with output.keep_checkpoint = true",
        )
    return paths[0] if time is None else _at(source, paths, time)


def _at(source: Path, paths: list[Path], time: float) -> Path:
    """Return the checkpoint that is at a time, to half a step."""
    there = list[float]()
    for path in reversed(paths):
        try:
            moment, steps = time_of(path)
        except BrokenCheckpoint as broken:
            raise _fault(path, f"cannot be used: {broken}") from broken
        there.append(moment)
        if abs(moment - time) * max(steps, 1) <= 0.5 * moment:
            return path
    moments = ", ".join(f"{moment:.6g}" for moment in there)
    raise UserError(
        f"[analysis] state_time = {time:g}: {source} has no state of that time; expected one of {moments} s; try one "
        f"of these, or run that case again with output.keep_states = [{time:g}]"
    )


def _fault(
    place: Path,
    words: str,
    expected: str = "a checkpoint of the same model",
    advice: str = "running that case again with output.keep_checkpoint = true",
) -> UserError:
    return UserError(f"[analysis] state: {place} {words}; expected {expected}; try {advice}")


def _refuse_another_model(path: Path, keys: dict[str, Any], header: dict[str, Any], layout: DofLayout) -> None:
    """Refuse a checkpoint of another beam, support or mesh, or of other matrices; on rank 0."""
    before = header["case"]
    faults = differences(keys, before, frozenset(key for key in keys.keys() | before.keys() if not _counts(key)))
    if faults:
        raise UserError(
            f"[analysis] state: {path} is of another model:\n  " + "\n  ".join(faults) + "\nexpected the same beam, "
            "supports, contact, mesh and model; try the tables of that run, or a run of this model"
        )
    if header["basis"] == layout.basis:
        return
    operators = layout.model.system.operators
    assert isinstance(operators, DenseOperators)
    kept = read_checkpoint(model_file(path.parent.parent))
    for name, matrix in (("mass", operators.mass), ("stiffness", operators.stiffness)):
        try:
            other = kept.array(name)
        except KeyError as error:
            raise BrokenCheckpoint(f"its {name} is missing") from error
        if other.shape != matrix.shape:
            raise _fault(path, f"has {len(other)} DOFs", f"{len(matrix)}, those of this model", _ADVICE)
        if not np.max(np.abs(other - matrix)) <= ROUND_OFF * np.max(np.abs(matrix)):
            raise _fault(path, f"has another {name} matrix", "that of this model", _ADVICE)


_ADVICE = (
    'type = "beam" or "full" in [model] of both runs: a reduced basis depends on loads, probes and machine, and motion '
    "out of the bending plane needs DOFs that a case without it has not"
)


def _counts(key: str) -> bool:
    return key.split(".")[0] not in MAY_DIFFER and key != SAME_PLACE


def _at_zero(state: State, model: Model, path: Path) -> State:
    """Return a state at t = 0, its images formed anew. Collective."""
    contact, operators = model.system.contact, model.system.operators
    u, v = imaged(operators, state.u[VALUE].copy()), imaged(operators, state.v[VALUE].copy())
    depth: Array = contact.depth(contact.interface.trace(u[VALUE], operators), 0.0)
    excess = depth - np.maximum(state.depth, 0.0)
    if np.max(excess, initial=0.0) > DEEPER * model.profile.thinnest:
        worst = int(np.argmax(excess))
        raise _fault(
            path,
            f"reaches {excess[worst]:.3g} m deeper into {contact.face_names[contact.faces[worst]]} than it did there",
            "faces that are at t = 0 where they were at that time",
            "a motion of the support that begins there",
        )
    return State(
        0.0,
        u,
        v,
        depth,
        state.pressure,
        touch_speed=state.touch_speed,
        lagged=state.lagged,
        traction=state.traction,
        plastic_set=state.plastic_set,
        slip=state.slip,
        slides=state.slides,
    )
