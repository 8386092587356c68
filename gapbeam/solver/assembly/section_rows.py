"""The mean motions of cross-sections of a mesh, as rows of its DOFs, and the forces that work on these motions.

A point on the axis stands for its whole cross-section: it moves as the section carries it on average, and a force there
is distributed over the section. A force at a single node of a solid would sink in without bound as cells get finer.

The forces of loads on a finite element space per unit factor, by where they act.

* A force at a point: f = N(x_p)^T e; on the axis it is distributed over the section (`assembly.section_rows`).
* Forces along the axis: the sum of such forces.
* A uniform acceleration of all mass, such as gravity: f = M e, with the consistent mass matrix.
* An acceleration of the support: the equations are solved in its frame, where f = -M e.
* A motion of the walls of one support: no force but that of contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, assert_never

import numpy as np

from gapbeam.meshes.mesh_readings import displacement_shapes
from gapbeam.meshes.serial_mesh import SerialMesh
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, coordinate_element, geometry_order
from gapbeam.solver.assembly.assembled_system import attached_motions
from gapbeam.solver.assembly.section_cut import SectionCut, SectionCutter
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.attachments import DISPLACEMENTS, MeanMotion
from gapbeam.solver.loads.load_choice import Load, axis_point, load_direction
from gapbeam.solver.loads.places import (
    BodyForce,
    LineForce,
    LoadPart,
    PointForce,
    SupportAcceleration,
    SupportWalls,
    patterned,
)
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.system.operators import Array, Indices, Operators, row_product

ON_NODE = 1e-9  # of the length of the mesh
IN_CELL = 1e-4  # of the reference cell: coordinates in files have six digits or more
BULGE = 0.05  # of the smallest side of the mesh: how far curved cells may reach beyond their nodes
SIMPLICES = {2: (3, 6), 3: (4, 10)}  # nodes of triangles and tetrahedra of order 1 and 2


@dataclass(frozen=True)
class PointRow:
    """Basis functions at one point, on the nodes that this rank owns.

    Attributes:
        nodes: Owned nodes (blocks), (k,).
        values: Their basis functions at the point, (k,).
        components: Number of components per node.
    """

    nodes: Indices
    values: Array
    components: int

    def evaluate(self, x: Array, operators: Operators) -> Array:
        """Return the vector field at the point, (components,), or row by row of x, (times, components). Collective."""
        return operators.sum(self.values @ x.reshape(*x.shape[:-1], -1, self.components)[..., self.nodes, :])

    def force(self, direction: Array, size: int) -> Array:
        """Return the nodal forces of a unit force along a direction, (n,), local."""
        pattern = np.zeros((size // self.components, self.components))
        pattern[self.nodes] = np.outer(self.values, direction)
        return pattern.reshape(-1)


class PointFinder:
    """Finds points in a mesh; made once for many of them."""

    def __init__(self, space: Any) -> None:
        """Build the tree of bounding boxes. Collective.

        Args:
            space: Blocked Lagrange space.
        """
        mesh, index_map = space.mesh, space.dofmap.index_map
        self.space = space
        self.places = space.tabulate_dof_coordinates()[: index_map.size_local]
        self.span = max(mesh.comm.allgather(float(np.max(np.abs(self.places), initial=0.0))))
        self.curved = geometry_order(mesh) > 1
        sides = np.ptp(mesh.geometry.x[:, : mesh.geometry.dim], axis=0) if len(mesh.geometry.x) else np.zeros(1)
        self.padding = BULGE * float(np.min(sides)) if self.curved else IN_CELL * self.span
        self.tree: Any = None
        if not isinstance(mesh, SerialMesh):
            from dolfinx import geometry

            self.tree = geometry.bb_tree(mesh, mesh.topology.dim, padding=self.padding)

    def row(self, point: Array, name: str, beyond: float = IN_CELL) -> PointRow:
        """Find the basis functions at a point: a node where one lies there, else by interpolation in its cell.

        Args:
            point: (3,), m.
            name: Name of the point in errors.
            beyond: Allowed distance of a point from a curved cell, over the size of the cell: coarse cells do not
                follow an arc exactly.

        Raises:
            UserError: The point lies outside the mesh; on all ranks.

        Collective.
        """
        comm, index_map, block = self.space.mesh.comm, self.space.dofmap.index_map, self.space.dofmap.index_map_bs
        distance = np.linalg.norm(self.places - point, axis=1)
        nearest = int(np.argmin(distance)) if len(distance) else -1
        best = float(distance[nearest]) if len(distance) else np.inf
        candidates = comm.allgather(best)
        if min(candidates) <= ON_NODE * self.span:
            here = comm.rank == int(np.argmin(candidates))
            return PointRow(np.array([nearest] if here else [], dtype=np.int64), np.array([1.0] if here else []), block)
        found = comm.allgather(self._in_cell(point, beyond))
        holders = [entry for entry in found if entry is not None]
        if not holders:
            place = ", ".join(f"{x:.6g}" for x in point[: self.space.mesh.geometry.dim])
            raise UserError(
                f"{name}: the point ({place}) m is not in the mesh; the nearest node is {min(candidates):.3g} m away. "
                "Move the point into the body, or check that the mesh is in meters with x = 0 at the supported end"
            )
        _, nodes, values = min(holders, key=itemgetter(0))
        first, last = index_map.local_range
        mine = (nodes >= first) & (nodes < last)
        return PointRow(nodes[mine] - first, values[mine], block)

    def cells_at(self, point: Array, beyond: float = IN_CELL) -> Iterator[tuple[float, int, Array]]:
        """Yield the distance of a point from owned cells that hold it, each cell, and the place in it, (1, dimension).

        Args:
            point: (3,), m.
            beyond: As in `row`.
        """
        for cell in map(int, self._cells_near(point)):
            away, reference = self._reference(cell, point)
            if away <= beyond:
                yield away, cell, reference

    def _cells_near(self, point: Array) -> Indices:
        """Return owned cells that may hold a point."""
        mesh = self.space.mesh
        if isinstance(mesh, SerialMesh):
            return mesh.cells_near(point, self.padding + ON_NODE * self.span)
        from dolfinx import geometry

        cells = geometry.compute_collisions_points(self.tree, point.reshape(1, 3)).links(0)
        return np.asarray(cells[cells < mesh.topology.index_map(mesh.topology.dim).size_local], dtype=np.int64)

    def _in_cell(self, point: Array, beyond: float) -> tuple[float, Indices, Array] | None:
        """Return the distance of a point from the nearest owned cell, global nodes, and the basis functions there."""
        nearest: tuple[float, int, Array] | None = None
        for found in self.cells_at(point, beyond):
            if nearest is None or found[0] < nearest[0]:
                nearest = found
            if found[0] <= IN_CELL:
                break
        if nearest is None:
            return None
        away, cell, reference = nearest
        values = displacement_shapes(self.space).tabulate(reference)[0][0]
        nodes = self.space.dofmap.index_map.local_to_global(self.space.dofmap.cell_dofs(cell).astype(np.int32))
        return away, nodes.astype(np.int64), values

    def _reference(self, cell: int, point: Array) -> tuple[float, Array]:
        """Return the distance of a point from the reference cell, and its place there, (1, dimension)."""
        mesh, dimension = self.space.mesh, self.space.mesh.geometry.dim
        corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, :dimension]
        place = point[:dimension] if isinstance(mesh, SerialMesh) else point[:dimension].reshape(1, -1)
        try:
            found = np.asarray(coordinate_element(mesh).pull_back(place, corners))
        except RuntimeError:  # Newton's method ends far outside of the cell
            return np.inf, np.empty((1, dimension))
        outside = [float(np.max(-found)), float(np.max(found - 1.0))]
        if len(corners) in SIMPLICES[dimension]:
            outside.append(float(np.sum(found) - 1.0))
        away = max(0.0, *outside)
        return (0.0 if away <= IN_CELL and not self.curved else away), found


CENTERED = 1.0e-9  # of the radius of gyration: a centroid this near to the axis lies on it


@dataclass(frozen=True)
class MotionRow:
    """Row of the motion of a point: factors of the displacements of its nodes, on the nodes that this rank owns.

    Attributes:
        nodes: Owned nodes (blocks), (k,).
        factors: Factors of their displacements, (components, k, components).
    """

    nodes: Indices
    factors: Array

    def evaluate(self, x: Array, operators: Operators) -> Array:
        """Return the displacement, (components,), or row by row of x, (times, components). Collective."""
        components = len(self.factors)
        moved = x.reshape(-1, x.shape[-1] // components, components)[:, self.nodes, :]
        rows = row_product(moved.reshape(len(moved), -1), self.factors.reshape(components, -1).T)
        return operators.sum(rows.reshape(*x.shape[:-1], components))

    def force(self, direction: Array, size: int) -> Array:
        """Return the nodal forces of a unit force along a direction, (n,), local."""
        pattern = np.zeros((size // len(self.factors), len(self.factors)))
        pattern[self.nodes] = np.tensordot(direction, self.factors, axes=1)
        return pattern.reshape(-1)


class SectionRows:
    """The rows of mean motions on a mesh; each section is cut once."""

    def __init__(self, space: Any) -> None:
        """Prepare the mesh. Collective.

        Args:
            space: Blocked Lagrange space.
        """
        self.space = space
        self.cutter = SectionCutter(space)
        self.cuts = dict[float, SectionCut]()

    def of_motions(self, motions: Sequence[MeanMotion], size: int) -> Iterator[Array]:
        """Yield the row of each mean motion: the motion is the scalar product of row and displacements, over all ranks.

        Args:
            motions: The motions.
            size: Number of DOFs that this rank owns.

        Yields:
            (size,).

        Raises:
            UserError: The mesh has no section at a place; on all ranks.

        Collective.
        """
        for motion in motions:
            nodes, factors = self._owned(motion, "a joint, a mass, a fluid or a restraint")
            found = np.zeros((size // factors.shape[1], factors.shape[1]))
            found[nodes] = factors
            yield found.reshape(-1)

    def of_axis(self, x: float, name: str) -> MotionRow:
        """Return the row of the point on the axis at x, m, as its section carries it on average.

        Args:
            x: The place, m.
            name: Name of the point in errors.

        Raises:
            UserError: The mesh has no section there; on all ranks.

        Collective.
        """
        moments = self._cut(x, name).moments
        center = moments[0, 1:] / moments[0, 0]
        beside, above = (0.0, float(center[0])) if len(center) == 1 else (float(center[0]), float(center[1]))
        centered = np.hypot(beside, above) <= CENTERED * np.sqrt(np.trace(moments[1:, 1:]) / moments[0, 0])
        offset = (0.0, 0.0, 0.0) if centered else (0.0, -beside, -above)
        names = DISPLACEMENTS if len(moments) == 3 else ("axial", "vertical")
        rows = [self._owned(MeanMotion(x, one, offset), name) for one in names]
        return MotionRow(rows[0][0], np.stack([factors for _, factors in rows]))

    def of_turn(self, x: float, name: str) -> MotionRow:
        """Return the row of the rotation of the section at x in the bending plane, as its last component, rad.

        Args and errors as in `of_axis`. Collective.
        """
        nodes, factors = self._owned(MeanMotion(x, "rotation"), name)
        return MotionRow(nodes, np.stack([*np.zeros((factors.shape[1] - 1, *factors.shape)), factors]))

    def _cut(self, x: float, name: str) -> SectionCut:
        if x not in self.cuts:
            self.cuts[x] = self.cutter.cut(x, name)
        return self.cuts[x]

    def _owned(self, motion: MeanMotion, name: str) -> tuple[Indices, Array]:
        """Return the nodes of this rank, (k,), and the factors of their displacements, (k, dimension)."""
        cut = self._cut(motion.x, name)
        first, last = self.space.dofmap.index_map.local_range
        mine = (cut.nodes >= first) & (cut.nodes < last)
        return cut.nodes[mine] - first, cut.integrals[mine] @ motion.factors(cut.moments).T


def row_at(sections: SectionRows, point: float | tuple[float, ...], name: str) -> PointRow | MotionRow:
    """Return the row of a point of the body, or of the cross-section for a point on the axis.

    Args:
        sections: Sections of the mesh.
        point: x on the axis, or all coordinates, m.
        name: Name of the point in errors.

    Raises:
        UserError: The point, or the section, lies outside the mesh; on all ranks.

    Collective.
    """
    place = axis_point(point)
    if np.any(place[1:]):
        return PointFinder(sections.space).row(place, name)
    return sections.of_axis(float(place[0]), name)


def load_patterns(case: Case, sections: SectionRows, operators: Operators) -> tuple[Array, ...]:
    """Return the forces of each load per unit factor on a vector space, (n,), N, and those of `attached_motions`.

    Args:
        case: The case.
        sections: Sections on its vector space.
        operators: Operators on the same space.

    Raises:
        UserError: A point or a section lies outside the mesh.

    Collective.
    """
    rows: dict[float | tuple[float, ...], PointRow | MotionRow] = {}  # many parts of a load act at the same places

    def row(point: float | tuple[float, ...], name: str) -> PointRow | MotionRow:
        if point not in rows:
            rows[point] = row_at(sections, point, f"[[load]] {name}")
        return rows[point]

    return (
        *(
            _pattern(load, part, sections.space.mesh.geometry.dim, operators, row)
            for load, part in patterned(case.load)
        ),
        *sections.of_motions([one.motion for one in attached_motions(case)], operators.size),
    )


def _pattern(
    load: Load,
    part: LoadPart,
    dimension: int,
    operators: Operators,
    row: Callable[[float | tuple[float, ...], str], PointRow | MotionRow],
) -> Array:
    """Return the forces of a part of a load; `load_direction` has the sign of the inertia in a moving frame."""
    direction = load_direction(load, dimension)
    match part.place:
        case PointForce(point):
            return row(point, load.name).force(direction, operators.size)
        case LineForce(places, weights):
            total = np.zeros(operators.size)
            for place, weight in zip(places, weights, strict=True):
                total += row(place, load.name).force(weight * direction, operators.size)
            return total
        case BodyForce() | SupportAcceleration():
            return operators.apply_mass(np.tile(direction, operators.size // dimension))
        case SupportWalls():
            return np.zeros(operators.size)
        case unknown:
            assert_never(unknown)
