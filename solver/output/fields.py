"""fields.xdmf and fields.h5: displacement, velocity and contact pressure on the linear mesh.

One temporal collection that ParaView and meshio read. The XML is rewritten after every field, by rename, so a
killed run leaves a readable series.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from dolfinx import fem

from solver.face_points import FacePoints, at_nodes, face_points, gather_points
from solver.model import Model
from solver.operators import Array
from solver.output.records import FIELDS, FIELDS_DATA_FILE, FIELDS_FILE
from solver.system import VALUE, State

XDMF_CELLS = {
    "triangle": "Triangle",
    "quadrilateral": "Quadrilateral",
    "tetrahedron": "Tetrahedron",
    "hexahedron": "Hexahedron",
}
# DOLFINx counts the corners of quadrilaterals and hexahedra row by row, XDMF around.
AROUND = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}

HEAD = (
    '<?xml version="1.0" encoding="utf-8"?>\n'
    '<Xdmf Version="3.0"><Domain><Grid Name="gapbeam" GridType="Collection" CollectionType="Temporal">'
)
TAIL = "</Grid></Domain></Xdmf>\n"


class FieldWriter:
    """Writes fields at their own cadence; rank 0 holds the files.

    Collective to make and to use.
    """

    def __init__(self, folder: Path, model: Model) -> None:
        mesh = model.space.mesh
        self._comm = mesh.comm
        self._space = fem.functionspace(mesh, ("Lagrange", 1, (mesh.geometry.dim,)))
        self._fine, self._coarse = fem.Function(model.space), fem.Function(self._space)
        self._folder = folder
        self._contact_rows(model)
        index_map = self._space.dofmap.index_map
        owned_cells = mesh.topology.index_map(mesh.topology.dim).size_local
        cell = mesh.topology.cell_name()
        local_cells = self._space.dofmap.list[:owned_cells]
        corners = index_map.local_to_global(np.ascontiguousarray(local_cells).reshape(-1).astype(np.int32)).reshape(
            local_cells.shape
        )
        cells = self._gather(corners[:, AROUND.get(cell, list(range(corners.shape[1])))])
        points = self._gather(self._space.tabulate_dof_coordinates()[: index_map.size_local])
        self._grids: list[str] = []  # XML of each field written
        self._shapes = {"points": points.shape, "cells": cells.shape}
        self._topology = XDMF_CELLS[cell]
        if self._comm.rank == 0:
            self._file = h5py.File(folder / FIELDS_DATA_FILE, "w")
            self._file["points"], self._file["cells"] = points, cells

    def write(self, state: State, model: Model) -> None:
        """Add the fields of a state. Collective."""
        values = {
            "displacement": self._nodal(model.expand(state.u[VALUE])),
            "velocity": self._nodal(model.expand(state.v[VALUE])),
        }
        if self._comm.rank != 0:
            return
        contact = model.system.contact
        forces = self._hat_forces @ contact.spread(contact.weights * state.pressure)
        values["contact_pressure"] = np.zeros(self._shapes["points"][0])
        values["contact_pressure"][self._contact_nodes] = forces / self._hat_areas
        for name, value in values.items():
            self._file[f"{name}/{len(self._grids)}"] = value
        self._file.flush()
        self._grids.append(self._grid(len(self._grids), state.time))
        self._write_xml()

    def close(self) -> None:
        """Close the files."""
        if self._comm.rank == 0:
            self._file.close()

    def _contact_rows(self, model: Model) -> None:
        """Tabulate hat functions at the contact points: nodal pressure = int N p / int N, never negative."""
        parts = [self._points_on(name, model) for name in model.system.contact.face_names]
        nodes = np.concatenate([part.nodes for part in parts])
        values = np.concatenate([part.values for part in parts])
        weights = np.concatenate([part.weights for part in parts])
        values = np.where(np.abs(values) > 1e-12, values, 0.0)
        self._contact_nodes = np.unique(nodes[values != 0.0])
        rows = np.zeros((len(self._contact_nodes), len(weights)))
        point, local = np.nonzero(values)
        place = np.searchsorted(self._contact_nodes, nodes[point, local])
        np.add.at(rows, (place, point), values[point, local])
        self._hat_forces, self._hat_areas = rows, rows @ weights

    def _points_on(self, face: str, model: Model) -> FacePoints:
        """Return the contact points of a face with the hat functions of the linear mesh. Collective."""
        width = model.case.beam.width if model.case.mesh.dimension == 2 else 1.0
        facets, rule = model.tagged.facets_of(face), model.point_rule
        coarse = gather_points(self._comm, face_points(self._space, facets, rule, width))
        if not rule.nodal:
            return coarse
        rows, weights = at_nodes(gather_points(self._comm, face_points(model.space, facets, rule, width)))
        return replace(coarse.taken(rows), weights=weights)

    def _nodal(self, values: Array) -> Any:
        self._fine.x.array[: len(values)] = values
        self._fine.x.scatter_forward()
        self._coarse.interpolate(self._fine)
        block = self._space.dofmap.index_map_bs
        owned = self._space.dofmap.index_map.size_local
        local = self._coarse.x.array[: owned * block].reshape(-1, block)
        return self._gather(np.pad(local, ((0, 0), (0, 3 - block))))

    def _gather(self, local: Any) -> Any:
        """Return the rows of all ranks in rank order, which is the global numbering, on rank 0."""
        parts = self._comm.gather(np.ascontiguousarray(local))
        return np.concatenate(parts) if parts is not None else local

    def _grid(self, number: int, time: float) -> str:
        """Return the XML of one field."""
        grid = ET.Element("Grid", Name=f"step {number}", GridType="Uniform")
        ET.SubElement(grid, "Time", Value=repr(float(time)))
        cells, points = self._shapes["cells"], self._shapes["points"]
        topology = ET.SubElement(grid, "Topology", TopologyType=self._topology, NumberOfElements=str(cells[0]))
        _item(topology, "cells", cells, "Int")
        _item(ET.SubElement(grid, "Geometry", GeometryType="XYZ"), "points", points, "Float")
        for name in FIELDS:
            scalar = name == "contact_pressure"
            attribute = ET.SubElement(
                grid,
                "Attribute",
                Name=name,
                AttributeType="Scalar" if scalar else "Vector",
                Center="Node",
            )
            _item(attribute, f"{name}/{number}", (points[0],) if scalar else points, "Float")
        return ET.tostring(grid, encoding="unicode")

    def _write_xml(self) -> None:
        target = self._folder / FIELDS_FILE
        beside = target.with_suffix(".part")
        beside.write_text(HEAD + "".join(self._grids) + TAIL, encoding="utf-8")
        Path.replace(beside, target)


def _item(parent: ET.Element, place: str, shape: tuple[int, ...], kind: str) -> None:
    item = ET.SubElement(
        parent, "DataItem", Dimensions=" ".join(map(str, shape)), NumberType=kind, Precision="8", Format="HDF"
    )
    item.text = f"{FIELDS_DATA_FILE}:/{place}"
