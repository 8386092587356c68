"""The XML of one field in fields.xdmf: mesh, time, and where the values of each quantity lie.

Meshes are numbered anew for every number of ranks; places are brought into the order of the file.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gapbeam.solver.record_table import FIELDS_DATA_FILE, VECTOR_FIELDS
from gapbeam.solver.system.operators import Array, Indices

XDMF_CELLS = {
    "triangle": "Triangle",
    "quadrilateral": "Quadrilateral",
    "tetrahedron": "Tetrahedron",
    "hexahedron": "Hexahedron",
}
MESHIO_CELLS = {"triangle": "triangle", "quadrilateral": "quad", "tetrahedron": "tetra", "hexahedron": "hexahedron"}
# DOLFINx counts the corners of quadrilaterals and hexahedra row by row, XDMF around.
AROUND = {"quadrilateral": [0, 1, 3, 2], "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6]}


def dataset(name: str, place: int | str) -> str:
    """Return the name of the values of a quantity in a data file, by their number in it."""
    return f"{name}/{place}"


def around(cell: str, corners: Array) -> Array:
    """Return the corners of cells of DOLFINx, (cells, c), in the order of XDMF."""
    return corners[:, AROUND.get(cell, list(range(corners.shape[1])))]


@dataclass(frozen=True)
class FieldGrid:
    """Common parts of the XML of all fields of a mesh.

    Attributes:
        cell: Name of the cells in DOLFINx.
        points: Shape of the table of points, (n, 3).
        cells: Shape of the table of cells, (cells, c).
        names: The quantities.
    """

    cell: str
    points: tuple[int, ...]
    cells: tuple[int, ...]
    names: Sequence[str]

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of the values of a quantity."""
        return self.points if name in VECTOR_FIELDS else self.points[:1]

    def text(self, number: int, time: float, file: str, place: int) -> str:
        """Return the XML of one field.

        Args:
            number: Of the field.
            time: s.
            file: Its data file, relative to the results folder.
            place: Its number in that file.
        """
        return self._template.format(number=number, time=repr(time), file=file, place=place)

    @cached_property
    def _template(self) -> str:
        """The XML with braces for number, time, file and place."""
        grid = ET.Element("Grid", Name="step {number}", GridType="Uniform")
        ET.SubElement(grid, "Time", Value="{time}")
        topology = ET.SubElement(
            grid, "Topology", TopologyType=XDMF_CELLS[self.cell], NumberOfElements=str(self.cells[0])
        )
        geometry = ET.SubElement(grid, "Geometry", GeometryType="XYZ")
        _item(topology, f"{FIELDS_DATA_FILE}:/cells", self.cells, "Int")
        _item(geometry, f"{FIELDS_DATA_FILE}:/points", self.points, "Float")
        for name in self.names:
            kind = "Vector" if name in VECTOR_FIELDS else "Scalar"
            attribute = ET.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
            _item(attribute, dataset("{file}:/" + name, "{place}"), self.shape(name), "Float")
        return ET.tostring(grid, encoding="unicode")


def _item(parent: ET.Element, place: str, shape: tuple[int, ...], kind: str) -> None:
    item = ET.SubElement(
        parent, "DataItem", Dimensions=" ".join(map(str, shape)), NumberType=kind, Precision="8", Format="HDF"
    )
    item.text = place


SAME_PLACE = 1.0e-9  # of the extent of all places


def matching(places: Array, wanted: Array) -> Indices:
    """Return the numbers of the wanted places, (n,), so that `places[matching(places, wanted)]` is `wanted`.

    Args:
        places: (n, d), m.
        wanted: The same places in another order, up to round-off, (n, d), m.

    Raises:
        ValueError: They are not the same places, or some are there twice.
    """
    if places.shape != wanted.shape:
        raise ValueError(f"{places.shape[0]} places, expected {wanted.shape[0]}")
    if np.array_equal(places, wanted):
        return np.arange(len(places))
    near, found = cKDTree(places).query(wanted)
    farthest = float(np.max(near, initial=0.0))
    if farthest > SAME_PLACE * float(np.max(np.ptp(wanted, axis=0))):
        raise ValueError(f"places that lie {farthest:.3g} m apart")
    if len(np.unique(found)) < len(found):
        raise ValueError("places that are there twice")
    return np.asarray(found)
