"""Fields and curves of a run: fields.xdmf and fields.h5, curve.json and curve.csv.

One temporal collection that ParaView and meshio read. While a run goes on, one or a few fields at a time are a file of
their own in the folder `fields`, put in place when it is whole, and then named by the XML, which grows in place:
whatever happens to the run, the series can be read. At the end all fields are gathered in fields.h5.

Mode shapes are fields, too: one instant a mode, its time the frequency in Hz.

A curve of periodic responses is a table in the results folder.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.meshes.mesh_readings import vector_space
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.assembly.face_quadrature import FacePoints, at_nodes, face_points, gather_points
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.output import parallel_tables
from gapbeam.solver.run.output.atomic_files import new_hdf5, part_of, put_in_place, to_disk, written
from gapbeam.solver.run.output.hdf5_files import AT_ONCE, FieldPieces, GrowingSeries, refuse_other_data
from gapbeam.solver.run.output.nodal_stresses import CornerValues, StressFields
from gapbeam.solver.run.output.parallel_tables import FieldGrid, ParallelTable, Pieces, RankRows, around, dataset
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.schema.record_table import (
    CURVE_FILE,
    CURVE_TABLE_FILE,
    FIELD_FOLDER,
    FIELDS,
    FIELDS_DATA_FILE,
    FIELDS_FILE,
    STRESS_FIELDS,
    VECTOR_FIELDS,
)

if TYPE_CHECKING:
    from gapbeam.solver.periodic.continuation import CurvePoint, ResponseCurve
    from gapbeam.solver.periodic.periodic_response import SteadyModel
    from gapbeam.solver.periodic.response_branches import Branches
    from gapbeam.solver.seat.contact_modes import HeldModes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import Snapshots

MOST_BYTES = 2**25  # of a file with several fields


class FieldWriter:
    """Writes fields at their own cadence; rank 0 holds the files.

    Args:
        folder: Results folder.
        model: The model.
        times: Times of the fields to continue after, s; None: new files. Existing files change with the first field.

    Raises:
        UserError: The fields to go on after are not there.
        NotWritten: The files cannot be written.

    Collective to make and to write with.
    """

    def __init__(self, folder: Path, case: Case, model: Model, times: Sequence[float] | None = None) -> None:
        mesh = model.space.mesh
        self._comm = mesh.comm
        self._space = vector_space(mesh, 1)
        self._corners = CornerValues.of_model(model, self._space)
        self._folder = folder
        self._contact_rows(model)
        index_map = self._space.dofmap.index_map
        owned_cells = mesh.topology.index_map(mesh.topology.dim).size_local
        cell = mesh.topology.cell_name()
        local_cells = self._space.dofmap.list[:owned_cells]
        corners = index_map.local_to_global(np.ascontiguousarray(local_cells).reshape(-1).astype(np.int32)).reshape(
            local_cells.shape
        )
        points = self._space.tabulate_dof_coordinates()[: index_map.size_local]
        self._rows = parallel_tables.rank_by_rank(self._comm, len(points))  # of the corners of this rank in the files
        self._first = index_map.local_range[0]
        mesh_tables = {
            "points": ParallelTable(self._rows, points),
            "cells": ParallelTable(
                parallel_tables.rank_by_rank(self._comm, owned_cells),
                around(cell, corners),
            ),
        }
        self._shapes = {name: table.shape for name, table in mesh_tables.items()}
        self._stress = StressFields.of_case(case, model, self._space)
        names = (*FIELDS, *(STRESS_FIELDS if self._stress else ()))
        self._grid_text = FieldGrid(cell, self._shapes["points"], self._shapes["cells"], names)
        self.times: list[float] = list(times or ())  # of each field written
        self._gathered = 0  # how many of them are in fields.h5
        self._safe = len(self.times)  # how many of them are on the disk
        self._going_on = times is not None  # and nothing has been written yet
        self._series = GrowingSeries(folder / FIELDS_FILE)
        self._grids: list[str]  # XML of each field written
        self._pieces = FieldPieces(folder, self._grid_text)  # on rank 0
        of_one = sum(np.prod(self._grid_text.shape(name)) * 8 for name in names)  # bytes
        self._several = AT_ONCE * of_one <= MOST_BYTES  # whether a file may have several fields
        if times is None:
            parallel_tables.on_rank_zero_with(self._comm, mesh_tables, partial(self._begin, mesh_tables))
        else:
            on_rank_zero(self._comm, self._go_on)
            self._rows = self._found_rows(points)

    def write(self, snapshots: Snapshots, model: Model) -> None:
        """Add the fields of snapshots.

        Raises:
            NotWritten: The fields could not be written; those on disk are unchanged.

        Collective.
        """
        first, count = 0, len(snapshots.times)
        while first < count:
            taken = min(AT_ONCE, count - first) if self._several else 1
            some = Snapshots._make(column[first : first + taken] for column in snapshots)
            values = self._values(some, model)
            tables = {
                dataset(name, at): ParallelTable(self._rows, values[name][at])
                for name in self._grid_text.names
                for at in range(taken)
            }
            times = [float(time) for time in some.times]
            parallel_tables.on_rank_zero_with(self._comm, tables, partial(self._write, times))
            first += taken

    def _values(self, snapshots: Snapshots, model: Model) -> dict[str, Array]:
        """Return the values at the corners that this rank owns, by quantity, (times, n) or (times, n, 3)."""
        contact = model.system.contact
        pressures = np.zeros((len(snapshots.times), len(self._rows.places)))
        here = (self._contact_nodes >= self._first) & (self._contact_nodes < self._first + pressures.shape[1])
        forces = contact.spread(contact.weights[:, None] * snapshots.pressure.T)
        nodal = ((self._hat_forces @ forces).T / self._hat_areas)[:, here]
        pressures[:, self._contact_nodes[here] - self._first] = nodal
        vectors = np.split(self._corners.vectors(np.concatenate(snapshots[1:3])), len(VECTOR_FIELDS))
        values = dict(zip(VECTOR_FIELDS, vectors, strict=True))
        values["contact_pressure"] = pressures
        if self._stress is not None:
            stresses = [self._stress.at_corners(model.expand(u)) for u in snapshots.u]
            values |= {name: np.stack([of[name] for of in stresses]) for name in STRESS_FIELDS}
        return values

    def _write(self, times: Sequence[float], pieces: Pieces) -> None:
        first = len(self.times)
        with written(self._pieces.path(first)):
            self._cut()
            self._pieces.write(first, len(times), pieces)
            self.times += times
            self._grids += [self._grid(number) for number in range(first, len(self.times))]
            if first == 0:
                self._series.write(self._grids)
            else:
                self._series.add(self._grids, len(times))

    def commit(self) -> None:
        """Wait until every field so far is on the disk; rank 0 only.

        Raises:
            NotWritten: A field could not be written.
        """
        with written(self._folder / FIELD_FOLDER):
            self._pieces.to_disk(max(self._safe, self._gathered))
            if self._safe < len(self.times):
                to_disk(self._folder / FIELDS_FILE)
        self._safe = len(self.times)

    def close(self) -> None:
        """Gather all fields in fields.h5.

        Raises:
            NotWritten: The fields could not be gathered, and stay where they are; on rank 0 alone.
        """
        if self._comm.rank != 0 or self._gathered == len(self.times):
            return
        target = self._folder / FIELDS_DATA_FILE
        part = part_of(target)
        with written(target):
            self._cut()
            with new_hdf5(part) as whole:
                self._gather_in(whole)
            put_in_place(part, target)
            self._gathered = len(self.times)
            self._grids = [self._grid(number) for number in range(len(self.times))]
            self._series.finish(self._grids)
        self._pieces.remove()

    def _begin(self, tables: Mapping[str, ParallelTable], pieces: Pieces) -> None:
        """Make fields.h5 with the mesh alone."""
        target = self._folder / FIELDS_DATA_FILE
        part = part_of(target)
        with written(target):
            with new_hdf5(part) as file:
                _fill(file, tables, pieces)
            put_in_place(part, target)
        self._grids = []

    def _go_on(self) -> None:
        """Find the fields before."""
        source, count = self._folder / FIELDS_DATA_FILE, len(self.times)
        try:
            with h5py.File(source, "r") as file:
                refuse_other_data(file, self._shapes)
                groups = [file.get(name, ()) for name in self._grid_text.names]
                while self._gathered < count and all(str(self._gathered) in group for group in groups):
                    self._gathered += 1
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            raise UserError(f"{source} cannot be read ({error}); start again with `overwrite=True`") from error
        self._pieces.find(self._gathered, count)
        self._grids = [self._grid(number) for number in range(count)]

    def _found_rows(self, points: Array) -> RankRows:
        """Return the places of this rank's nodes in earlier fields, whose order comes from the number of ranks."""
        source = self._folder / FIELDS_DATA_FILE

        def pieces() -> Iterator[Array]:
            with h5py.File(source, "r") as file:
                for begin in range(0, len(file["points"]), parallel_tables.PIECE):
                    yield file["points"][begin : begin + parallel_tables.PIECE]

        try:
            return parallel_tables.found_rows(self._comm, points, pieces)
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            raise UserError(f"{source} cannot be read ({error}); start again with `overwrite=True`") from error

    def _cut(self) -> None:
        """Remove fields of a march that had come further than the start of this one."""
        if not self._going_on:
            return
        self._going_on = False
        self._series.write(self._grids)
        self._pieces.cut(len(self.times))

    def _gather_in(self, whole: h5py.File) -> None:
        """Copy mesh and fields to one file."""
        with h5py.File(self._folder / FIELDS_DATA_FILE, "r") as before:
            for name in ("points", "cells"):
                before.copy(name, whole)
            for name in self._grid_text.names:
                group = whole.create_group(name)
                for number in range(self._gathered):
                    before.copy(f"{name}/{number}", group, str(number))
        self._pieces.copy_into(whole, len(self.times))

    def _contact_rows(self, model: Model) -> None:
        """Tabulate hat functions at the contact points: nodal pressure = int N p / int N, never negative."""
        parts = [self._points_on(name, model) for name in model.system.contact.face_names]
        nodes = np.concatenate([part.nodes for part in parts])
        values = np.concatenate([part.values for part in parts])
        weights = np.concatenate([part.weights for part in parts])
        values = np.where(np.abs(values) > 1e-12, values, 0.0)
        self._contact_nodes = np.unique(nodes[values != 0.0])
        point, local = np.nonzero(values)
        place = np.searchsorted(self._contact_nodes, nodes[point, local])
        shape = (len(self._contact_nodes), len(weights))
        self._hat_forces = csr_matrix((values[point, local], (place, point)), shape)
        self._hat_areas = self._hat_forces @ weights

    def _points_on(self, face: str, model: Model) -> FacePoints:
        """Return the contact points of a face with the hat functions of the linear mesh. Collective."""
        facets, rule, met = model.tagged.facets_of(face), model.point_rule, model.support.named(face)
        width = model.body.meshed.width
        coarse = gather_points(self._comm, face_points(self._space, facets, rule, width, met))
        if not rule.nodal:
            return coarse
        rows, weights = at_nodes(gather_points(self._comm, face_points(model.space, facets, rule, width, met)))
        return replace(coarse.taken(rows), weights=weights)

    def _grid(self, number: int) -> str:
        """Return the XML of one field."""
        file, place = (FIELDS_DATA_FILE, number) if number < self._gathered else self._pieces.place(number)
        return self._grid_text.text(number, self.times[number], file, place)


def _fill(file: h5py.File, tables: Mapping[str, ParallelTable], pieces: Pieces) -> None:
    """Write tables, piece by piece."""
    for name, table in tables.items():
        data, begin = file.create_dataset(name, table.shape, table.values.dtype), 0
        for piece in pieces(name):
            data[begin : begin + len(piece)] = piece
            begin += len(piece)


LARGEST = 0.05  # displacement of a node, of the length of the beam


def write_mode_fields(folder: Path, case: Case, model: Model, modes: HeldModes) -> None:
    """Write the shapes of all modes to fields.xdmf and fields.h5; the largest motion is 5 % of the length of the beam.

    Args:
        folder: Folder for the files.
        case: The case.
        model: Its model.
        modes: Its modes in one state of contact.

    Collective.
    """
    comm, contact = model.space.mesh.comm, model.system.contact
    writer = FieldWriter(folder, case, model)
    try:
        for frequency, shape in zip(modes.frequencies, modes.shapes.T, strict=True):
            bodies = shape[model.body.operators.size :]  # of supports, beside which the beam may be at rest
            moved = np.abs(np.concatenate([model.expand(shape), bodies]))
            largest = max(comm.allgather(float(np.max(moved, initial=0.0))))
            scaled = shape * (LARGEST * model.length / largest)
            still, none = np.zeros((1, len(scaled))), np.zeros((1, contact.size))
            writer.write(Snapshots(np.array([frequency]), scaled[None], still, none), model)
    finally:
        writer.close()


def curve_rows(curves: Sequence[ResponseCurve], model_at: Callable[[float], SteadyModel]) -> list[dict[str, Any]]:
    """Return one row for every point: parameter, branch, stability, and figures of probes and faces.

    Args:
        curves: The branches.
        model_at: The model for a value of the parameter.
    """
    return [
        _row(point, number, model_at(point.value))
        for number, curve in enumerate(curves, start=1)
        for point in curve.points
    ]


def _row(point: CurvePoint, branch: int, steady: SteadyModel) -> dict[str, Any]:
    period_map = steady.modal_map()
    assert period_map is not None
    places, forces = period_map.history(point.x)
    model, stability = steady.model, point.stability
    leading = stability.multipliers[0]
    row: dict[str, Any] = {
        "value": point.value,
        "branch": branch,
        "stable": stability.stable,
        "kind": stability.kind,
        "event": point.event,
        "largest_multiplier": stability.largest,
        "multiplier_real": float(leading.real),
        "multiplier_imaginary": float(abs(leading.imag)),
        "residual": point.residual,
        "iterations": point.iterations,
    }
    for name, probe in model.probes.items():
        along = [float(probe.evaluate(place, model.system.operators)[-1]) for place in places]
        row[f"{name}.peak_to_peak"] = float(np.ptp(along))
        row[f"{name}.peak"] = float(np.max(np.abs(along)))
    for face, name in enumerate(model.system.contact.face_names):
        row[f"{name}.peak_force"] = float(np.max(forces[:, face]))
    return row


def write_curve(folder: Path, key: str, unit: str, periods: int, found: Branches, rows: list[dict[str, Any]]) -> None:
    """Write the table.

    Args:
        folder: Results folder.
        key: The parameter.
        unit: Its unit.
        periods: Forcing periods in a period of the response.
        found: The branches.
        rows: Rows of `curve_rows`.
    """
    contents = {"key": key, "unit": unit, "periods": periods, **coverage(found), "points": rows}
    write_beside(folder / CURVE_FILE, json.dumps(contents, indent=1) + "\n")
    with (folder / CURVE_TABLE_FILE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def coverage(found: Branches) -> dict[str, Any]:
    """Return the reason for which the first branch ends, and intervals without a branch, or a stable response."""
    return {
        "endings": list(found.curves[0].endings),
        "branches": len(found.curves),
        "missing": [{"low": low, "high": high, "reason": why} for low, high, why in found.missing],
        "unstable": [{"low": low, "high": high} for low, high in found.unstable],
    }


def unit_of(key: str, steady: SteadyModel) -> str:
    """Return the unit of the key that varies along a curve."""
    case, field = steady.case, key.rsplit(".", 1)[1]
    if key.startswith("load."):
        return next(load for load in case.load if load.name == key.split(".")[1]).curve_units[field]
    contact = {"stiffness": case.contact.stiffness_unit, "damping": case.contact.damping_unit}
    return {"clearance": "m", **contact}[field]
