"""Model that a run resumes with: the one that was marched, to the last bit where that is more than its mesh.

The fingerprint of a case holds every key but those that do not change the results.

Stored matrices are compared with those of a model set up anew, in another basis of the same motions: the products

    b_i (K + s M)^-1 b_j,    b_i (K + s M)^-1 M (K + s M)^-1 b_j    and the same with the restraint instead of M

do not depend on the basis, where the b are loads, gaps, contact forces and probes, and s is the square of a frequency.
Of motions that joints hold, which the basis does not have, b is the inertia along the shapes that give their forces.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter
from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.assembly.assembled_system import attached_rows
from gapbeam.solver.case.case import Case, with_checksums
from gapbeam.solver.loads.places import patterned
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.model import Model, model_of
from gapbeam.solver.models.reduction.projection import DenseRow
from gapbeam.solver.run.checkpoint.checkpoint_files import (
    BrokenCheckpoint,
    Contents,
    model_file,
    read_checkpoint,
    write_model,
)
from gapbeam.solver.run.checkpoint.kept_model import EXPANSION, Matrices, has_basis, matrices_of, sum_of, taken_up
from gapbeam.solver.run.checkpoint.state_checks import NODES, POINTS, DofLayout, layout_of
from gapbeam.solver.run.output.parallel_tables import on_rank_zero_with, taken
from gapbeam.solver.schema.record_table import SUMMARY_FILE
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

if TYPE_CHECKING:
    from mpi4py import MPI

ROUND_OFF = 1.0e-12  # of lengths and areas that ranks add up in another order


def measures_of(model: Model) -> list[float]:
    """Return the measures behind the law's stiffness: area of the faces, m^2, and length of their facets, m."""
    return [model.body.contact.support.area, model.body.meshed.facet_length]


def keep_model(folder: Path, layout: DofLayout) -> None:
    """Write the matrices of a model of few DOFs to a results folder, unless they are there; for others nothing.

    Raises:
        NotWritten: The matrices could not be written.

    Collective.
    """
    body, comm = layout.model.body, layout.comm
    if not layout.basis or on_rank_zero(comm, lambda: _kept_sum(folder) == layout.basis):
        return
    tables = {NODES: layout.node_table}
    if has_basis(body):
        assert isinstance(body.expansion, np.ndarray)
        tables[EXPANSION] = layout.table(body.expansion.T)
    arrays = matrices_of(body) | {POINTS: layout.places} | tables
    on_rank_zero_with(comm, tables, lambda pieces: write_model(folder, {"basis": layout.basis}, arrays, pieces))


def model_as_it_was(folder: Path, case: Case, model: Model, header: Mapping[str, Any], comm: MPI.Comm) -> Model:
    """Return the model that a checkpoint continues with.

    Args:
        folder: Results folder.
        case: The case, as it was read.
        model: Its model, found anew.
        header: Header of the checkpoint.
        comm: The ranks.

    Raises:
        BrokenCheckpoint: Its matrices are others, and those that were marched cannot be read.

    Collective.
    """
    body, found, before = model.body, measures_of(model), header["measures"]
    near = all(isclose(one, other, rel_tol=ROUND_OFF) for one, other in zip(found, before, strict=True))
    if near and found != before:
        meshed = replace(body.meshed, facet_length=before[1])
        support = replace(body.contact.support, area=before[0])
        model = model_of(case, replace(body, contact=replace(body.contact, support=support), meshed=meshed))
    layout = layout_of(model, comm)
    if header["basis"] == layout.basis or not layout.basis:
        return model
    try:
        return _kept_model(folder, case, model, header, layout)
    except BrokenCheckpoint as broken:
        raise BrokenCheckpoint(
            f"{model_file(folder)}, which it goes on with on other ranks or another machine, cannot be read: {broken}; "
            f"try as many ranks as before, {header.get('ranks')}"
        ) from broken


def _kept_model(folder: Path, case: Case, model: Model, header: Mapping[str, Any], layout: DofLayout) -> Model:
    comm = layout.comm
    local: list[Contents] = []

    def read() -> tuple[Matrices, tuple[int, ...]]:
        contents = read_checkpoint(model_file(folder))
        local.append(contents)
        points = layout.points_in(contents)
        if not np.array_equal(points, np.arange(len(points))):
            raise ValueError("contact points in another order")
        small = {name: contents.array(name) for name in contents.shapes.keys() - {NODES, POINTS, EXPANSION}}
        if sum_of(small) != header["basis"]:
            raise ValueError("matrices of another model")
        taken_up(model.body, small, None)
        shape = contents.shapes.get(EXPANSION, ())
        if has_basis(model.body) and shape != (len(small["mass"]), layout.rows.count, layout.components):
            raise ValueError(f"{EXPANSION} of the shape {shape}")
        return small, shape

    try:
        small, shape = on_rank_zero(comm, read)
        rows = layout.found_in(local[0] if local else None)
        columns = None
        if has_basis(model.body):
            whole = taken(rows, shape, lambda: local[0].pieces(EXPANSION, layered=True), layered=True)
            columns = np.ascontiguousarray(whole.reshape(len(whole), -1).T)
        return model_of(case, taken_up(model.body, small, columns))
    except (KeyError, ValueError, IndexError, TypeError) as error:  # the same on all ranks
        raise BrokenCheckpoint(f"its arrays do not fit the model: {error}") from error


def _kept_sum(folder: Path) -> str:
    try:
        contents = read_checkpoint(model_file(folder))
    except BrokenCheckpoint:
        return ""
    return str(contents.header.get("basis"))


FREE = {
    "title",
    "mesh.file",
    "output.checkpoint_interval",
    "output.keep_checkpoint",
    "output.keep_states",
    "output.wall_time",
    "time.end",
    "gates.accept_lack_of_memory",
}
MESH_FILE = "contents of mesh.file"
NOTHING = "nothing"


def keys_of(case: Case) -> dict[str, Any]:
    """Return the values of a case by their dotted keys, with checksums for the paths of its files; for JSON."""
    case = with_checksums(case)
    keys = dict(_flat("", TypeAdapter(Case).dump_python(case, mode="json")))
    for load in case.load:
        keys.pop(f"load.{load.name}.file", None)
    if case.mesh.file is not None:
        keys[MESH_FILE] = "sha256 " + checksum_of(Path(case.mesh.file))
    return keys


def checksum_of(path: Path) -> str:
    """Return the SHA-256 of a file, which is not held in memory as a whole."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def differences(keys: dict[str, Any], expected: dict[str, Any], free: set[str] | frozenset[str]) -> list[str]:
    """Return a line for every key in which two cases differ: found, expected."""
    names = sorted((keys.keys() | expected.keys()) - free)
    return [
        f"{name}: found {keys.get(name, NOTHING)!r}, expected {expected.get(name, NOTHING)!r}"
        for name in names
        if keys.get(name, NOTHING) != expected.get(name, NOTHING)
    ]


def _flat(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from _flat(f"{key}.{name}" if key else name, entry)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for number, entry in enumerate(value):
            yield from _flat(f"{key}.{entry.get('name', number)}", entry)
    else:
        yield key, value


LARGEST_SUMMARY = 64 * 2**20  # bytes


def earlier_summary(folder: Path) -> dict[str, Any]:
    """Return the summary of a run; of one that cannot be read, nothing."""
    path = folder / SUMMARY_FILE
    try:
        if path.stat().st_size > LARGEST_SUMMARY:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("message"), str) else {}


FLOATING = 1.0e-8  # of the largest square of a frequency: rigid motions on the weak restraint are below it
HELD = 1.0e-9  # of the largest response: that of a place that a joint holds, which the basis cannot move, is round-off
NEGLIGIBLE = 1.0e-6  # of the whole energy: what the restraint may have without being looked at
ALIKE = 1.0e-3  # relative: bases that are found on other ranks span the same motions to some 1e-6


def refuse_other_matrices(kept: Body, found: Body, comm: MPI.Comm) -> None:
    """Refuse a body whose matrices respond otherwise than those found anew; one that is marched on its mesh passes.

    Raises:
        BrokenCheckpoint: The matrices respond otherwise.

    Collective.
    """
    if kept.operators is found.operators or not isinstance(found.operators, DenseOperators):
        return
    try:
        faults = _faults(kept, found, comm)
    except (LinAlgError, ValueError, TypeError) as error:
        faults = [str(error)]
    faults = comm.bcast(faults)
    if faults:
        raise BrokenCheckpoint("the matrices that were kept are not those of this model: " + "; ".join(faults))


def _faults(kept: Body, found: Body, comm: MPI.Comm) -> list[str]:
    same = (kept.contact.weights, found.contact.weights), (kept.contact.initial_gap, found.contact.initial_gap)
    places = (kept.contact.positions, found.contact.positions), (kept.contact.faces, found.contact.faces)
    faults = [
        "contact points of other places, areas or gaps"
        for one, other in (*same, *places)
        if not np.allclose(one, other, rtol=ALIKE, atol=ALIKE * float(np.max(np.abs(other), initial=0.0)))
    ]
    faults += [
        "joints hold them otherwise"
        for one, other in zip(_along_holds(kept), _along_holds(found), strict=True)
        if not np.allclose(one, other, rtol=ALIKE, atol=ALIKE * float(np.max(np.abs(other), initial=0.0)))
    ]
    shift = _shift(found)
    responses, others = (_responses(body, shift) for body in (kept, found))
    energies = np.abs(np.diagonal(others[0]))
    for one, other in zip(responses, others, strict=True):
        size = np.sqrt(np.maximum(np.abs(np.diagonal(other)), NEGLIGIBLE * energies if other is others[-1] else 0.0))
        size = np.maximum(size, HELD * np.max(size, initial=0.0))
        if one.shape != other.shape or not np.all(np.abs(one - other) <= ALIKE * np.outer(size, size)):
            faults.append("they respond otherwise to loads and contact")
    moved, expected = (_motion(body, shift) for body in (kept, found))
    off, whole = (comm.allreduce(float(np.sum(x**2))) for x in (moved - expected, expected))
    if not off <= ALIKE**2 * whole:
        faults.append("the mesh moves otherwise with them")
    return list(dict.fromkeys(faults))


def _shift(body: Body) -> float:
    """Return the square of the lowest elastic frequency, 1/s^2: the highest of a basis are those of its round-off."""
    operators = body.operators
    assert isinstance(operators, DenseOperators)
    squares = eigh(operators.stiffness, operators.mass, eigvals_only=True)
    return float(np.min(squares[squares > FLOATING * squares.max()]))


def _along_holds(body: Body) -> list[Array]:
    """Return the effects of loads and contact along the shapes of held motions, whatever the basis is."""
    held = body.holding
    return [] if held is None else [held.patterns, held.pressure, held.friction]


def _rows(body: Body) -> Array:
    """Return the rows by which a model is loaded and observed, (rows, n)."""
    contact, size = body.contact, len(body.patterns[0]) if body.patterns else body.contact.interface.size
    traced = np.zeros((contact.interface.size, size))
    traced[contact.interface.slots, contact.interface.owned] = 1.0
    seen = [*body.patterns[: len(patterned(body.case.load))]]
    seen += [row for one, row in attached_rows(body.case, body.patterns) if not one.held]
    seen += [] if body.holding is None else [*body.holding.mass]
    rows = [*seen, *(contact.gap_matrix @ traced), *(contact.resultants.T @ traced)]
    for probe in body.probes.values():
        assert isinstance(probe, DenseRow)
        rows += [*probe.matrix]
    return np.array(rows)


def _static(body: Body, shift: float) -> Array:
    operators, rows = body.operators, _rows(body)
    assert isinstance(operators, DenseOperators)
    return np.asarray(cho_solve(cho_factor(operators.stiffness + shift * operators.mass), rows.T))


def _responses(body: Body, shift: float) -> tuple[Array, Array, Array]:
    """Return twice the energies of all, of the motion and of the restraint, that pairs of rows have together."""
    operators, moved = body.operators, _static(body, shift)
    assert isinstance(operators, DenseOperators)
    return _rows(body) @ moved, moved.T @ operators.mass @ moved, moved.T @ operators.restraint @ moved


def _motion(body: Body, shift: float) -> Array:
    """Return the motion of the nodes of this rank under each row, scaled by the mass that moves with them."""
    operators, moved = body.operators, _static(body, shift)
    assert isinstance(operators, DenseOperators)
    size = np.sqrt(np.abs(np.sum(moved * (operators.mass @ moved), axis=0)))
    scaled = moved / np.maximum(size, max(HELD * float(np.max(size, initial=0.0)), np.finfo(float).tiny))
    return scaled if body.expansion is None else np.asarray(body.expansion @ scaled)
