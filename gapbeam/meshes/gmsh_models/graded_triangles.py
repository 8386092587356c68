"""Triangles that fill a region with straight sides, as small as is wanted at each place, by gmsh.

The sides are divided here, into edges as long as is wanted at each place. gmsh keeps these edges: its triangulation is
constrained, so that sharp re-entrant corners and thin slots make no difference.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_mesh import Indices, PolygonOutline, Triangulation
from gapbeam.meshes.sections.section_patches import Array

SAMPLES = 60  # places from each end of a side at which its wanted length is looked up, closer and closer to the end
NEAREST = 1.0e-9  # of the length of a side: the first of them
DELAUNAY = 5  # gmsh's algorithm for lengths that differ much
MOST_EDGES = 20_000  # on the rim
FILLED = 1.0e-8  # relative


def graded_triangles(outline: PolygonOutline, wanted: Callable[[Array], Array]) -> Triangulation:
    """Return triangles of a polygon with holes.

    Args:
        outline: The polygon.
        wanted: Length of edges at places, (k, 2) to (k,), m.

    Raises:
        MeshError: gmsh is not there or stops, or the triangles do not fill the polygon.
    """
    loops = _divided(outline, wanted)
    size = outline.size

    def length(y: float, z: float) -> float:
        return float(wanted(np.array([[y * size, z * size]]))[0]) / size

    found = _triangulated([np.asarray(loop / size, dtype=np.float64) for loop in loops], length)
    found = Triangulation(found.points * size, found.triangles)
    a, b, c = np.moveaxis(found.points[found.triangles], 1, 0)
    filled = 0.5 * float(np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum())
    area = outline.moments.area
    if abs(filled - area) > FILLED * area:
        raise MeshError(
            "cross-section",
            found=f"a polygon whose triangles fill {filled:.6g} of {area:.6g} m^2",
            expected="sides that are apart from each other, beside the size of the polygon",
            hint="Leave out details far smaller than the section.",
        )
    return found


def _divided(outline: PolygonOutline, wanted: Callable[[Array], Array]) -> list[Array]:
    """Return the places along each loop between which edges are as long as wanted, [(n, 2)], m."""
    near = np.concatenate([[0.0], np.geomspace(NEAREST, 0.5, SAMPLES)])
    shares = np.concatenate([near, 1.0 - near[-2::-1]])
    start, along = outline.sides[:, 0], outline.sides[:, 1] - outline.sides[:, 0]
    places = start[:, None] + shares[:, None] * along[:, None]
    lengths = wanted(places.reshape(-1, 2)).reshape(places.shape[:2])
    density = np.linalg.norm(along, axis=1)[:, None] / lengths
    parts = 0.5 * (density[:, 1:] + density[:, :-1]) * np.diff(shares)
    sums = np.concatenate([np.zeros((len(parts), 1)), np.cumsum(parts, axis=1)], axis=1)
    counts = np.maximum(1, np.ceil(sums[:, -1] - 0.05)).astype(int)
    if (total := int(counts.sum())) > MOST_EDGES:
        raise MeshError(
            "cross-section",
            found=f"a polygon whose details ask for {total} edges around it",
            expected=f"at most {MOST_EDGES}",
            hint="Leave out details far smaller than the section.",
        )
    divided = [
        one + np.interp(np.arange(count) / count, row / row[-1], shares)[:, None] * way
        for one, way, count, row in zip(start, along, counts, sums, strict=True)
    ]
    ends = np.cumsum([len(loop) for loop in outline.loops])[:-1]
    sides = np.split(np.arange(len(divided)), ends)
    return [np.concatenate([divided[number] for number in numbers]) for numbers in sides]


def _triangulated(loops: list[Array], length: Callable[[float, float], float]) -> Triangulation:
    """Return the triangles between the points of loops, of which the first is around the others; size about 1."""
    from mpi4py import MPI

    from gapbeam.meshes.gmsh_models.gmsh_session import gmsh_errors, gmsh_session

    with gmsh_session(MPI.COMM_SELF), gmsh_errors("cross-section", "a polygon that gmsh can fill with triangles"):
        import gmsh

        before = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
        try:
            for name, value in _OPTIONS.items():
                gmsh.option.setNumber(name, value)
            _draw(loops)
            gmsh.model.mesh.setSizeCallback(lambda _dimension, _tag, y, z, _x, _length: length(y, z))
            gmsh.model.mesh.generate(2)
            tags, places, _ = gmsh.model.mesh.getNodes()
            _, _, nodes = gmsh.model.mesh.getElements(2)
        finally:
            gmsh.model.mesh.removeSizeCallback()
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    triangles: Indices = number[np.asarray(nodes[0], dtype=np.int64)].reshape(-1, 3)
    used, triangles = np.unique(triangles, return_inverse=True)
    points = np.asarray(places, dtype=float).reshape(-1, 3)[used, :2]
    triangles = triangles.reshape(-1, 3)
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    turned = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    return Triangulation(points, triangles)


_OPTIONS = {
    "Mesh.Algorithm": DELAUNAY,
    "Mesh.MeshSizeMax": 1.0e22,
    "Mesh.MeshSizeMin": 0.0,
    "Geometry.Tolerance": 1.0e-14,
}


def _draw(loops: list[Array]) -> None:
    """Draw a surface whose rim has one edge of cells for each edge of the loops."""
    import gmsh

    curves = []
    for loop in loops:
        points = [gmsh.model.geo.addPoint(float(y), float(z), 0.0) for y, z in loop]
        lines = [
            gmsh.model.geo.addLine(one, other) for one, other in zip(points, [*points[1:], points[0]], strict=True)
        ]
        for line in lines:
            gmsh.model.geo.mesh.setTransfiniteCurve(line, 2)
        curves.append(gmsh.model.geo.addCurveLoop(lines))
    gmsh.model.geo.addPlaneSurface(curves)
    gmsh.model.geo.synchronize()
