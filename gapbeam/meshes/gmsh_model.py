"""gmsh started silently on rank 0, and ended whatever happens in between; triangles and tetrahedra that it draws.

The sides of a region are divided here, into edges as long as is wanted at each place. gmsh keeps these edges: its
triangulation is constrained, so that sharp re-entrant corners and thin slots make no difference.
"""

from __future__ import annotations

import contextlib
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_size import CellLength, structured_partition
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.sections.section_mesh import Indices, PolygonOutline, Triangulation, doubled_areas, refuse_gaps
from gapbeam.meshes.sections.section_patches import Array

if TYPE_CHECKING:
    from mpi4py import MPI

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.Algorithm": 6,  # frontal Delaunay
    "Mesh.Algorithm3D": 1,  # Delaunay
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.RandomSeed": 1,
}
"""gmsh's options while gapbeam uses it: silent, sizes from the size callback only, reproducible."""

LIBRARIES = (
    "libglu1-mesa libgl1 libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 "
    "libfontconfig1 libxinerama1 libx11-6 libgomp1"
)
"""Debian's packages of the libraries that PyPI's gmsh is linked to."""

_MODEL = "gapbeam"


@dataclass(frozen=True)
class _Callers:
    """Settings of the caller's own gmsh session."""

    model: str
    options: dict[str, float]


@contextlib.contextmanager
def gmsh_session(comm: MPI.Comm) -> Iterator[None]:
    """An empty gmsh model on rank 0 for the duration of the block.

    If gmsh is already initialized, the caller's model and options come back afterwards.

    Raises:
        MeshError: A library of the system that gmsh needs is missing.

    Collective.
    """
    callers = on_rank_zero(comm, _start)
    try:
        yield
    finally:
        if comm.rank == 0:
            _end(callers)


@contextlib.contextmanager
def gmsh_errors(where: str, expected: str) -> Iterator[None]:
    """Turn gmsh's plain exceptions into MeshError; they carry gmsh's last message and nothing else."""
    try:
        yield
    except Exception as error:
        if type(error) is not Exception:
            raise
        message = str(error) or "no message"
        raise MeshError(where, found=f"that gmsh stopped with: {message}", expected=expected) from error


def _start() -> _Callers | None:
    try:
        import gmsh
    except OSError as error:  # it draws windows, too, which are never opened here
        raise MeshError(
            "gmsh",
            found=str(error),
            expected="the libraries that gmsh is linked to",
            hint=f"Debian: apt-get install {LIBRARIES}; quadrilaterals and hexahedra need no gmsh.",
        ) from error
    callers = None
    if gmsh.isInitialized():
        options = {name: gmsh.option.getNumber(name) for name in OPTIONS}
        callers = _Callers(gmsh.model.getCurrent(), options)
    else:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    for name, value in OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.add(_MODEL)
    return callers


def _end(callers: _Callers | None) -> None:
    import gmsh

    if callers is None:
        gmsh.finalize()
        return
    gmsh.model.setCurrent(_MODEL)
    gmsh.model.remove()
    gmsh.model.setCurrent(callers.model)
    for name, value in callers.options.items():
        gmsh.option.setNumber(name, value)


SAMPLES = 60  # places from each end of a side at which its wanted length is looked up, closer and closer to the end
NEAREST = 1.0e-9  # of the length of a side: the first of them
DELAUNAY = 5  # gmsh's algorithm for lengths that differ much
MOST_EDGES = 20_000  # on the rim


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
    refuse_gaps(found.points, found.triangles, outline.moments.area)
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
    turned = doubled_areas(points, triangles) < 0.0
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


def draw_unstructured(geometry: BeamGeometry, cell_length: CellLength, unit: float) -> None:
    """Draw the beam as blocks between the ends of supports and steps, with the given points as vertices.

    Args:
        geometry: The beam, in m.
        cell_length: Wanted length of edges, in m.
        unit: Length of one unit of the gmsh model, m.
    """
    import gmsh

    kernel = gmsh.model.occ
    ends = [0.0, *(edge / unit for edge in geometry.edges), geometry.length / unit]
    blocks = []
    for start, stop in pairwise(ends):
        low, sides = _block(geometry, 0.5 * (start + stop), unit)
        if geometry.dimension == 2:
            blocks.append((2, kernel.addRectangle(start, low[1], 0.0, stop - start, sides[1])))
        else:
            blocks.append((3, kernel.addBox(start, low[1], low[2], stop - start, sides[1], sides[2])))
    points = [
        (0, kernel.addPoint(*(value / unit for value in point), *([0.0] if len(point) == 2 else [])))
        for point in dict.fromkeys(geometry.points)
    ]
    if len(blocks) + len(points) > 1:
        kernel.fragment(blocks, points)
    kernel.synchronize()
    gmsh.model.mesh.setSizeCallback(_size_callback(geometry, cell_length, unit))


def _block(geometry: BeamGeometry, x: float, unit: float) -> tuple[list[float], list[float]]:
    """The smallest coordinates and the sides of the beam at a place, in the units of the model; along x zeros."""
    here = geometry.at(x * unit)
    size = [here.thickness] if geometry.dimension == 2 else [here.width, here.thickness]
    lows = [-side / 2 for side in size]
    return [0.0, *(low / unit for low in lows)], [0.0, *((-low - low) / unit for low in lows)]


def _size_callback(
    geometry: BeamGeometry, cell_length: CellLength, unit: float
) -> Callable[[int, int, float, float, float, float], float]:
    """The wanted length in the units of the model, tabulated: gmsh asks for it very often."""
    breaks = geometry.breakpoints(0)
    x = structured_partition(breaks, cell_length)
    fine = np.unique(np.concatenate([np.linspace(a, b, 9) for a, b in pairwise(x)]))
    positions = [float(position) for position in fine / unit]
    lengths = [float(length) for length in cell_length.ending_at(breaks)(fine) / unit]
    last = len(positions) - 2

    def wanted(_dim: int, _tag: int, x: float, _y: float, _z: float, _length: float) -> float:
        left = min(max(bisect_right(positions, x) - 1, 0), last)
        share = (x - positions[left]) / (positions[left + 1] - positions[left])
        return float(lengths[left] + share * (lengths[left + 1] - lengths[left]))

    return wanted
