"""Tables whose rows lie on all ranks, written and read in pieces, and the XML of their fields in fields.xdmf.

No rank ever holds a whole table. The XML says mesh, time, and where the values of each quantity lie.

Meshes are numbered anew for every number of ranks; places are brought into the order of the file.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from gapbeam.meshes.rank_zero import Result, on_rank_zero
from gapbeam.solver.schema.record_table import FIELDS_DATA_FILE, VECTOR_FIELDS
from gapbeam.solver.system.operators import Array, Indices

if TYPE_CHECKING:
    from mpi4py import MPI
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
            number: Number of the field.
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
        ValueError: The places differ, or some are there twice.
    """
    if places.shape != wanted.shape:
        raise ValueError(f"{places.shape[0]} places, expected {wanted.shape[0]}")
    if np.array_equal(places, wanted):
        return np.arange(len(places))
    near, found = scipy.spatial.cKDTree(places).query(wanted)
    farthest = float(np.max(near, initial=0.0))
    if farthest > SAME_PLACE * float(np.max(np.ptp(wanted, axis=0))):
        raise ValueError(f"places that lie {farthest:.3g} m apart")
    if len(np.unique(found)) < len(found):
        raise ValueError("places that are there twice")
    return np.asarray(found)


PIECE = 2**15  # rows at once
TAG = 71

Values = NDArray[Any]


@dataclass(frozen=True)
class RankRows:
    """Places of the rows of this rank in a whole table.

    Attributes:
        comm: The ranks.
        places: Number of each in the whole table, (n,).
        count: Rows of all ranks.
        reach: First number of each rank and the one after its last.
    """

    comm: MPI.Comm
    places: Indices
    count: int
    reach: tuple[tuple[int, int], ...]

    @cached_property
    def all_here(self) -> bool:
        """True where this rank has all rows, in their order."""
        return np.array_equal(self.places, np.arange(self.count))

    @property
    def in_order(self) -> bool:
        """True where the rows of the whole table follow rank by rank. Collective."""
        first = sum(self.comm.allgather(len(self.places))[: self.comm.rank])
        natural = np.array_equal(self.places, first + np.arange(len(self.places)))
        return all(self.comm.allgather(natural))


@dataclass(frozen=True)
class ParallelTable:
    """Rows of a table on this rank.

    Attributes:
        rows: Places of the rows in the whole table.
        values: Its rows, (n, ...), or several tables of such rows, (layers, n, ...).
        layered: Whether they are several.
    """

    rows: RankRows
    values: Values
    layered: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the whole."""
        axis = int(self.layered)
        return (*self.values.shape[:axis], self.rows.count, *self.values.shape[axis + 1 :])

    def part(self, layer: int, begin: int, end: int) -> tuple[Indices, Values]:
        """Return the rows of this rank among some rows of the whole, and their numbers."""
        values = self.values[layer] if self.layered else self.values
        here = np.flatnonzero((self.rows.places >= begin) & (self.rows.places < end))
        return np.asarray(self.rows.places[here] - begin), np.ascontiguousarray(values[here])


Pieces = Callable[[str], Iterator[Values]]


def rank_by_rank(comm: MPI.Comm, count: int) -> RankRows:
    """Return the rows of tables that have those of one rank after those of the other. Collective."""
    ends = np.cumsum(comm.allgather(count))
    reach = tuple((int(end) - size, int(end)) for end, size in zip(ends, comm.allgather(count), strict=True))
    return RankRows(comm, np.arange(*reach[comm.rank]), int(ends[-1]), reach)


def on_rank_zero_with(comm: MPI.Comm, tables: Mapping[str, ParallelTable], work: Callable[[Pieces], Result]) -> Result:
    """Do work on rank 0 that takes tables of all ranks, piece by piece, in the order of their rows.

    Args:
        comm: The ranks.
        tables: Tables by name, the same names on all ranks.
        work: Called on rank 0 only, with a function that yields the pieces of a table; it must not communicate.

    Returns:
        Result of `work`, on all ranks.

    Raises:
        BaseException: Any error that `work` raises, on all ranks.

    Collective.
    """

    def pieces(name: str) -> Iterator[Values]:
        table = tables[name]
        layers = len(table.values) if table.layered else 1
        for layer in range(layers):
            for begin in range(0, table.rows.count, PIECE):
                end = min(begin + PIECE, table.rows.count)
                if table.rows.all_here:
                    yield (table.values[layer] if table.layered else table.values)[begin:end]
                    continue
                whole = np.empty((end - begin, *table.shape[1 + table.layered :]), dtype=table.values.dtype)
                for rank, (first, last) in enumerate(table.rows.reach):
                    if first >= end or last <= begin:
                        continue
                    if rank == comm.rank:
                        which, values = table.part(layer, begin, end)
                    else:
                        comm.send((name, layer, begin, end), rank, TAG)
                        which, values = comm.recv(source=rank, tag=TAG)
                    whole[which] = values
                yield whole

    def asking() -> Result:
        try:
            return work(pieces)
        finally:
            for rank in range(1, comm.size):
                comm.send(None, rank, TAG)

    if comm.rank != 0:
        while (asked := comm.recv(source=0, tag=TAG)) is not None:
            name, *place = asked
            comm.send(tables[name].part(*place), 0, TAG)
    return on_rank_zero(comm, asking)


def broadcast(comm: MPI.Comm, pieces: Callable[[], Iterator[Values]]) -> Iterator[Values]:
    """Yield values and raise errors of rank 0 on all ranks. Collective."""
    source: list[Iterator[Values]] = []

    def following() -> Values | None:
        if not source:
            source.append(pieces())
        return next(source[0], None)

    while (piece := on_rank_zero(comm, following)) is not None:
        yield piece


def found_rows(comm: MPI.Comm, places: Array, pieces: Callable[[], Iterator[Values]]) -> RankRows:
    """Return the places of this rank's rows in a table of places that rank 0 reads.

    Args:
        comm: The ranks.
        places: Places of this rank, up to round-off, (n, d), m.
        pieces: Yields the rows of the table on rank 0.

    Raises:
        ValueError: The places differ, or some are there twice.

    Collective.
    """
    ends = comm.allgather((np.min(places, axis=0, initial=np.inf), np.max(places, axis=0, initial=-np.inf)))
    low, high = np.min([one for one, _ in ends], axis=0), np.max([other for _, other in ends], axis=0)
    tolerance = SAME_PLACE * float(np.max(high - low))
    tree, count = scipy.spatial.cKDTree(places), 0
    found, times = np.zeros(len(places), dtype=np.int64), np.zeros(len(places), dtype=np.int64)
    for piece in broadcast(comm, pieces):
        near, which = tree.query(piece, distance_upper_bound=2.0 * tolerance)
        here = np.flatnonzero(near <= tolerance)
        found[which[here]] = count + here
        np.add.at(times, which[here], 1)
        count += len(piece)
    wanted = comm.allreduce(len(places))
    if count != wanted:
        raise ValueError(f"{count} places, expected {wanted}")
    if comm.allreduce(int(np.count_nonzero(times != 1))):
        raise ValueError("other places, or places that are there twice")
    reach = (int(found.min()), int(found.max()) + 1) if len(found) else (0, 0)
    return RankRows(comm, found, count, tuple(comm.allgather(reach)))


def taken(
    rows: RankRows, shape: tuple[int, ...], pieces: Callable[[], Iterator[Values]], layered: bool = False
) -> Array:
    """Return the rows of this rank of a table that rank 0 reads.

    Args:
        rows: Rows of this rank in the table.
        shape: Shape of the whole, (count, ...) or (layers, count, ...).
        pieces: Yields the rows of the table, layer by layer, on rank 0; none reach from one layer to the next.
        layered: Whether there are layers.

    Raises:
        ValueError: There are other values than finite numbers.

    Collective.
    """
    layers, rest = (shape[0], shape[2:]) if layered else (1, shape[1:])
    result = np.empty((layers, len(rows.places), *rest))
    begin, layer = 0, 0
    for piece in broadcast(rows.comm, pieces):
        here = np.flatnonzero((rows.places >= begin) & (rows.places < begin + len(piece)))
        result[layer, here] = piece[rows.places[here] - begin]
        begin += len(piece)
        if begin == rows.count:
            begin, layer = 0, layer + 1
    if not all(rows.comm.allgather(bool(np.all(np.isfinite(result))))):
        raise ValueError("other things than finite numbers")
    return result if layered else result[0]
