"""A user's mesh that falls apart, fills places twice or presses with the wrong faces is refused, with the place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.tagged_mesh import mean_section
from gapbeam.meshes.user_mesh import user_mesh
from gapbeam.meshes.user_mesh.user_mesh import read_mesh

pytestmark = pytest.mark.versions

LENGTH, THICKNESS, WIDTH, SUPPORT = 0.3, 0.012, 0.02, 0.06
COLUMNS, LAYERS, HELD = 15, 4, 3
Point = tuple[float, float]


@dataclass
class Layout:
    """Quadrilaterals in the bending plane: cells by columns of the beam, and the edges of base and gland."""

    points: list[Point] = field(default_factory=list)
    cells: list[list[int]] = field(default_factory=list)
    base: list[list[int]] = field(default_factory=list)
    gland: list[list[int]] = field(default_factory=list)

    def node(self, x: float, h: float) -> int:
        """Add a node; returns its number."""
        self.points.append((float(x), float(h)))
        return len(self.points)

    def block(self, columns: range, move: Point = (0.0, 0.0)) -> dict[tuple[int, int], int]:
        """Add the cells of some columns with nodes of their own; returns the nodes by column and layer."""
        numbers = {
            (i, j): self.node(*np.add(_place(i, j), move))
            for i in range(columns.start, columns.stop + 1)
            for j in range(LAYERS + 1)
        }
        for i in columns:
            for j in range(LAYERS):
                self.cells.append([numbers[i, j], numbers[i + 1, j], numbers[i + 1, j + 1], numbers[i, j + 1]])
        return numbers

    def join(self, kept: int, left_out: int) -> None:
        """Let cells have one node instead of another."""
        self.cells = [[kept if node == left_out else node for node in cell] for cell in self.cells]

    def saved(self, path: Path, dimension: int, rows: int = 2) -> Path:
        """Write the plane, or the solid with some rows of cells across its width."""
        points = [(*point, 0.0) for point in self.points]
        body, base, gland = self.cells, self.base, self.gland
        if dimension == 3:
            count, across = len(self.points), np.linspace(-WIDTH / 2, WIDTH / 2, rows + 1)
            points = [(x, float(y), h) for y in across for x, h in self.points]
            body, base, gland = (
                [
                    [n + k * count for n in cell] + [n + (k + 1) * count for n in reversed_for(cell)]
                    for k in range(rows)
                    for cell in cells
                ]
                for cells in (self.cells, self.base, self.gland)
            )
        kinds = (3, 1) if dimension == 2 else (5, 3)
        groups = [(body, 3, kinds[0]), (base, 1, kinds[1]), (gland, 2, kinds[1])]
        names = [f'{dimension - 1} 1 "base"', f'{dimension - 1} 2 "gland"', f'{dimension} 3 "body"']
        used = sorted({node for cells, *_ in groups for cell in cells for node in cell})
        elements = [f"{kind} 2 {tag} {tag} {' '.join(map(str, cell))}" for cells, tag, kind in groups for cell in cells]
        lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "3", *names, "$EndPhysicalNames"]
        lines += ["$Nodes", str(len(used)), *(f"{n} {' '.join(map(repr, points[n - 1]))}" for n in used), "$EndNodes"]
        lines += ["$Elements", str(len(elements)), *(f"{n} {words}" for n, words in enumerate(elements, 1))]
        path.write_text("\n".join([*lines, "$EndElements"]) + "\n")
        return path


def reversed_for(cell: list[int]) -> list[int]:
    """The far side of an edge closes a quadrilateral, that of a quadrilateral a hexahedron."""
    return cell[::-1] if len(cell) == 2 else cell


def _place(i: int, j: int) -> Point:
    return i * LENGTH / COLUMNS, (j / LAYERS - 0.5) * THICKNESS


def sound() -> tuple[Layout, dict[tuple[int, int], int]]:
    """A beam that is one body, and its nodes by column and layer."""
    layout = Layout()
    nodes = layout.block(range(COLUMNS))
    layout.base = [[nodes[i, 0], nodes[i + 1, 0]] for i in range(HELD)]
    layout.gland = [[nodes[i, LAYERS], nodes[i + 1, LAYERS]] for i in range(HELD)]
    return layout, nodes


def cut(layout: Layout, nodes: dict[tuple[int, int], int], column: int, joined: int) -> None:
    """Give the cells right of a line nodes of their own on it, but the lowest ones."""
    for j in range(joined, LAYERS + 1):
        new = layout.node(*_place(column, j))
        right = [
            cell for cell in layout.cells if np.mean([layout.points[n - 1][0] for n in cell]) > _place(column, 0)[0]
        ]
        for cell in right:
            cell[:] = [new if node == nodes[column, j] else node for node in cell]


def hinge(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    cut(layout, nodes, 10, 1)


def crack(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    cut(layout, nodes, 6, 3)


def twice(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    """A part in its own place again, joined at one node."""
    copy = layout.block(range(6, 9))
    layout.join(nodes[6, 2], copy[6, 2])


def overlapping(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    """A part that lies across others, joined at one node."""
    step = LENGTH / COLUMNS
    copy = layout.block(range(6, 7), (0.3 * step, 0.0))
    layout.points[copy[7, 2] - 1] = _place(8, 2)
    layout.join(nodes[8, 2], copy[7, 2])


def hanging(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    """One cell in the middle of the beam cut in four."""
    corners = [nodes[8, 1], nodes[9, 1], nodes[9, 2], nodes[8, 2]]
    layout.cells.remove(corners)
    low, high = np.array(_place(8, 1)), np.array(_place(9, 2))
    center, half = 0.5 * (low + high), 0.5 * (high - low)
    middle = [layout.node(*(center + half * side)) for side in ((0, -1), (1, 0), (0, 1), (-1, 0), (0, 0))]
    for k in range(4):
        layout.cells.append([corners[k], middle[k], middle[4], middle[(k + 3) % 4]])


def pinch(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    """Two halves that meet corner to corner, and touch nowhere else."""
    for column, layers in ((7, (2, 3)), (8, (0, 1))):
        for j in layers:
            layout.cells.remove(
                [nodes[column, j], nodes[column + 1, j], nodes[column + 1, j + 1], nodes[column, j + 1]]
            )


def end_face(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    layout.base += [[nodes[0, j], nodes[0, j + 1]] for j in range(2)]


def top_face(layout: Layout, nodes: dict[tuple[int, int], int]) -> None:
    """The base holds a facet of the top, beyond the gland."""
    layout.gland.pop(1)
    layout.base.append([nodes[1, LAYERS], nodes[2, LAYERS]])


FAULTS = {
    hinge: ("8 facets that touch others and do not share their nodes", "one node at each place", "Coherence Mesh"),
    crack: ("4 facets that touch others and do not share their nodes", "one node at each place", "A crack"),
    twice: ("cells inside of other cells, near", "fills every place once", "BooleanFragments"),
    overlapping: ("cells inside of other cells, near", "fills every place once", "BooleanFragments"),
    hanging: ("touch larger or smaller ones (hanging nodes)", "share whole facets", "same divisions"),
    pinch: ("2 pieces that hang together at single nodes or edges", "connected through facets", "a hinge without"),
    end_face: ("2 of 5 facets that do not look down", "points along -", "a face across the beam"),
    top_face: ("1 of 4 facets that do not look down", "points along -", "at the side or of a bore"),
}


def beam(dimension: int) -> BeamGeometry:
    return BeamGeometry(dimension, LENGTH, THICKNESS, WIDTH, SUPPORT)


@pytest.mark.parametrize("dimension", [2, 3])
def test_sound_layout(tmp_path: Path, dimension: int) -> None:
    """The layout that the faults are put into is accepted, with its section."""
    tagged = read_mesh(MPI.COMM_WORLD, sound()[0].saved(tmp_path / "a.msh", dimension), beam(dimension))
    section = mean_section(tagged, WIDTH if dimension == 2 else 1.0)
    assert section.volume == pytest.approx(LENGTH * WIDTH * THICKNESS, rel=1e-12)
    assert section.second_moment == pytest.approx(WIDTH * THICKNESS**3 / 12.0, rel=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: str(fault.__name__))
def test_fault_is_named_with_a_remedy(tmp_path: Path, fault: Callable[..., None], dimension: int) -> None:
    layout, nodes = sound()
    fault(layout, nodes)
    path = layout.saved(tmp_path / "a.msh", dimension, rows=1)
    with pytest.raises(MeshError) as caught:
        read_mesh(MPI.COMM_WORLD, path, beam(dimension))
    found, expected, hint = FAULTS[fault]
    assert found in caught.value.found
    assert " m" in caught.value.found  # a place
    assert expected in caught.value.expected
    assert hint in caught.value.hint


def test_volume_larger_than_the_box(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The volume alone shows as well that a part is there twice."""
    layout, nodes = sound()
    twice(layout, nodes)
    path = layout.saved(tmp_path / "a.msh", 3)
    monkeypatch.setattr("gapbeam.meshes.user_mesh.mesh_check.check_surface", lambda *_: None)
    with pytest.raises(MeshError, match=r"cells of 8\.64e-05 m\^3 in a box of 7\.2e-05 m\^3"):
        user_mesh.read_mesh(MPI.COMM_WORLD, path, beam(3))


@pytest.mark.parametrize("order", [1, 2])
def test_tube(tmp_path: Path, order: int) -> None:
    """A round tube, its contact faces curved, has the area and the second moment of a ring."""
    outer, inner, length, support = 0.025, 0.02, 0.1, 0.05
    path = round_tube(tmp_path / "tube.msh", outer, inner, length, support, order)
    geometry = BeamGeometry(3, length, 2 * outer, 2 * outer, support)
    section = mean_section(read_mesh(MPI.COMM_WORLD, path, geometry), 1.0)
    tolerance = 0.05 if order == 1 else 2e-3
    assert section.area == pytest.approx(np.pi * (outer**2 - inner**2), rel=tolerance)
    assert section.second_moment == pytest.approx(np.pi / 4.0 * (outer**4 - inner**4), rel=tolerance)


def round_tube(path: Path, outer: float, inner: float, length: float, support: float, order: int) -> Path:
    """Save a tube whose base is the lower half of its outer face in the support, its gland the upper half."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.02)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 16)
        occ = gmsh.model.occ
        for x, dx in ((0.0, support), (support, length - support)):
            [ring], _ = occ.cut(
                [(3, occ.addCylinder(x, 0, 0, dx, 0, 0, outer))], [(3, occ.addCylinder(x, 0, 0, dx, 0, 0, inner))]
            )
            lower, upper = (occ.addBox(x, -outer, z, dx, 2 * outer, outer) for z in (-outer, 0.0))
            occ.intersect([ring], [(3, lower)], removeObject=False)
            occ.intersect([ring], [(3, upper)])
        occ.fragment(occ.getEntities(3), [])
        occ.synchronize()
        groups: dict[str, list[int]] = {"base": [], "gland": []}
        for _, tag in gmsh.model.getEntities(2):
            *_, low, end, _, high = gmsh.model.getBoundingBox(2, tag)
            reach = max(abs(low), abs(high))
            if gmsh.model.getType(2, tag) == "Cylinder" and end < support + 1e-6 and reach > outer - 1e-4:
                groups["base" if low < -1e-4 else "gland"].append(tag)
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
        for name, tags in groups.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path
