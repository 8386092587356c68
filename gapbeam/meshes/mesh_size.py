"""Mesh size of a beam: keys, defaults, cell lengths along it, layers, and the size of a mesh before it is made.

Cells are small where contact carries and larger away from it. Layers hit given points, and their lengths grow smoothly.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sections.section_patches import CELLS_THROUGH, SectionPatches
from gapbeam.solver.messages.wording import apart

GROWTH = 1.25
"""Ratio of the lengths of two neighboring cells while they grow."""

SLOPE = math.log(GROWTH)


@dataclass(frozen=True)
class CellLength:
    """Wanted cell length h(x), continuous and with a slope of at most log(GROWTH).

    h(x) is the smallest of the region's length and of size + log(GROWTH) |x - position| over all sources.

    Attributes:
        regions: (end, length) of consecutive regions from x = 0 on.
        sources: (position, size): at the position the length is at most this size.
    """

    regions: tuple[tuple[float, float], ...]
    sources: tuple[tuple[float, float], ...] = ()

    def __call__(self, x: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """The length wanted at each x, shape of x."""
        positions = np.asarray(x, dtype=np.float64)
        ends, lengths = np.array(self.regions).T
        region = np.minimum(np.searchsorted(ends, positions), len(ends) - 1)
        wanted = lengths[region]
        if positions.ndim == 0 and self.sources:
            places, sizes = np.array(self.sources).T
            return np.asarray(np.minimum(wanted, np.min(sizes + SLOPE * np.abs(positions - places))))
        for position, size in self.sources:
            wanted = np.minimum(wanted, size + SLOPE * np.abs(positions - position))
        return np.asarray(wanted, dtype=np.float64)

    def between(self, low: float, high: float) -> CellLength:
        """The same from one place to another, without the regions and sources that say nothing there."""
        ends = [end for end, _ in self.regions]
        first, last = (min(bisect_left(ends, x), len(ends) - 1) for x in (low, high))
        regions = self.regions[first : last + 1]
        longest = max(length for _, length in regions)
        near = [
            (position, size)
            for position, size in self.sources
            if size + SLOPE * max(low - position, position - high, 0.0) < longest
        ]
        return CellLength(regions, tuple(near))

    @property
    def smallest(self) -> float:
        """The smallest length that is wanted anywhere."""
        return min(size for _, size in (*self.regions, *self.sources))

    def ending_at(self, breakpoints: npt.ArrayLike) -> CellLength:
        """The same, no longer at a breakpoint than the distance to the next one."""
        x = [float(end) for end in np.asarray(breakpoints, dtype=np.float64)]
        return self.with_sources([(end, b - a) for a, b in pairwise(x) for end in (a, b)])

    def with_sources(self, sources: list[tuple[float, float]]) -> CellLength:
        """The same with further sources."""
        return CellLength(self.regions, (*self.sources, *sources))


Positions = npt.NDArray[np.floating]

LARGEST_RATIO = 1.4
"""Largest ratio of neighboring layers that `structured_partition` accepts where two segments meet."""

MOST_LAYERS = 20_000
"""More layers than this in one direction are a mistake in a size."""

_SLACK = 0.1
_ROUNDS = 40
_SAMPLES = 16


def structured_partition(breakpoints: npt.ArrayLike, cell_length: CellLength) -> Positions:
    """Divide an interval into layers.

    Each segment between two breakpoints gets the number of layers N = integral of dx/h(x), rounded up (but a
    tenth of a layer is rounded down), with equal parts of that integral in each. A segment shorter than h
    makes its neighborhood finer, and where the lengths on both sides of a breakpoint differ by more than
    LARGEST_RATIO the longer side is refined.

    Args:
        breakpoints: Positions that become layer boundaries, at least two, increasing, in m.
        cell_length: Wanted length h(x), in m.

    Returns:
        Layer boundaries in m, increasing, all breakpoints exactly among them.

    Raises:
        MeshError: more than MOST_LAYERS layers.
    """
    breaks = np.asarray(breakpoints, dtype=np.float64)
    return _partition(tuple(float(x) for x in breaks), cell_length).copy()


@lru_cache(maxsize=64)
def _partition(breakpoints: tuple[float, ...], cell_length: CellLength) -> Positions:
    """Divide an interval as `structured_partition` does: the size of a model is asked for several times."""
    breaks = np.array(breakpoints)
    roughly = np.mean(1 / cell_length(np.linspace(breaks[0], breaks[-1], 1001))) * (breaks[-1] - breaks[0])
    if roughly > MOST_LAYERS:
        raise _too_many(cell_length.smallest, breaks, f"about {apart(roughly, MOST_LAYERS, least=5)[0]}")
    wanted = cell_length.ending_at(breaks)
    layers = breaks
    for _ in range(_ROUNDS):
        segments = [_segment(float(a), float(b), wanted) for a, b in pairwise(breaks)]
        layers = np.concatenate([breaks[:1], *(segment[1:] for segment in segments)])
        jumps = _jumps(segments)
        if not jumps:
            break
        wanted = wanted.with_sources(jumps)
    return layers


def even_partition(breakpoints: npt.ArrayLike, count: int) -> Positions:
    """Divide an interval into equal layers, or nearly so when breakpoints are in the way.

    Args:
        breakpoints: Positions that become layer boundaries, at least two, increasing, in m.
        count: Wanted number of layers.

    Returns:
        `count` equal layers when every breakpoint is on one of their boundaries, otherwise the layers of
        `structured_partition` for the same length.
    """
    breaks = np.asarray(breakpoints, dtype=np.float64)
    low, high = breaks[0], breaks[-1]
    even = np.linspace(low, high, count + 1)
    distance = np.abs(even[:, None] - breaks[None, :]).min(axis=0)
    if np.all(distance <= 1e-12 * (high - low)):
        return even
    return structured_partition(breaks, CellLength(((float(high), float(high - low) / count),)))


def _segment(low: float, high: float, wanted: CellLength) -> Positions:
    """Layer boundaries from low to high."""
    wanted = wanted.between(low, high)
    position = low
    samples = [low]
    while position < high:
        position = min(high, position + float(wanted(position)) / _SAMPLES)
        samples.append(position)
        if len(samples) > _SAMPLES * MOST_LAYERS:
            raise _too_many(wanted.smallest, samples, "more")
    x = np.array(samples)
    density = 1 / wanted(x)
    layers = np.concatenate([[0.0], np.cumsum(np.diff(x) * (density[1:] + density[:-1]) / 2)])
    count = max(1, int(np.ceil(layers[-1] - _SLACK)))
    boundaries = np.interp(np.linspace(0, layers[-1], count + 1), layers, x)
    boundaries[[0, -1]] = low, high
    return np.asarray(boundaries, dtype=np.float64)


def _jumps(segments: list[Positions]) -> list[tuple[float, float]]:
    """Breakpoints whose two sides differ too much, with the smaller length."""
    jumps = []
    for left, right in pairwise(segments):
        lengths = (left[-1] - left[-2], right[1] - right[0])
        if max(lengths) > LARGEST_RATIO * min(lengths):
            jumps.append((float(right[0]), float(min(lengths))))
    return jumps


def _too_many(smallest: float, interval: npt.ArrayLike, layers: str) -> MeshError:
    ends = np.asarray(interval)
    length = float(ends[-1] - ends[0])
    return MeshError(
        "mesh sizes",
        found=f"cells of {smallest:.3g} m and longer on {length:.3g} m, which makes {layers} layers",
        expected=f"at most {MOST_LAYERS}",
        hint=f"Sizes are in m; try longer cells, size = {10.0 * length / MOST_LAYERS:.1g} in [mesh], with long "
        'supports support_size, too; of slender beams with model.type = "beam".',
    )


Cell = Literal["triangle", "quadrilateral", "tetrahedron", "hexahedron"]

CELLS: dict[int, tuple[Cell, Cell]] = {2: ("quadrilateral", "triangle"), 3: ("hexahedron", "tetrahedron")}
"""The cell types of each dimension, the default first."""

UNSTRUCTURED_THROUGH = 2
"""Triangles and tetrahedra are never longer than the thickness divided by this, unless asked for."""


@dataclass(frozen=True)
class BeamSizing:
    """Cell type and cell sizes, in m; None stands for the default.

    Attributes:
        cell: quadrilateral (default) or triangle in 2D, hexahedron (default) or tetrahedron in 3D.
        size: cell length along x far from the support; default the thickness there, and a third of the smaller one
            where the cross-section changes.
        support_size: the same within the support; default a third of the thickness, at most `size`.
        edge_size: the same where supports begin and end; default half of the smaller of the two
            above, never larger than these.
        cells_through_thickness: default 4 layers of quadrilaterals or hexahedra. Triangles and tetrahedra
            follow the length along x, but are no longer than the thickness divided by this number, default 2.
        cells_across_width: the same across the width; no limit by default for tetrahedra.
    """

    cell: Cell | None = None
    size: float | None = None
    support_size: float | None = None
    edge_size: float | None = None
    cells_through_thickness: int | None = None
    cells_across_width: int | None = None

    def cell_of(self, dimension: int) -> Cell:
        """The cell type, the default of the dimension when none was chosen."""
        cell = CELLS[dimension][0] if self.cell is None else self.cell
        if cell not in CELLS[dimension]:
            raise MeshError(
                "mesh.cell",
                found=f"{cell} in a mesh of dimension {dimension}",
                expected=" or ".join(CELLS[dimension]),
            )
        return cell

    def cell_length(self, geometry: BeamGeometry) -> CellLength:
        """Wanted cell length along the beam.

        Raises:
            MeshError: a size is not a positive number.
        """
        regions, at_edges = list[tuple[float, float]](), dict[float, float]()
        for start, end, supported in geometry.parts:
            size, support_size, edge_size = self._lengths(geometry, geometry.at(0.5 * (start + end)).thickness)
            regions.append((end, support_size if supported else size))
            for place in {start, end} & {x for span in geometry.spans for x in (span.start, span.end)}:
                at_edges[place] = min(edge_size, at_edges.get(place, edge_size))
            if self.size is None:
                for place in {start, end} & {*(step.start for step in geometry.steps[1:])}:
                    at_edges[place] = min(support_size, at_edges.get(place, support_size))
        return CellLength(tuple(regions), tuple(sorted(at_edges.items())))

    def _lengths(self, geometry: BeamGeometry, thickness: float) -> tuple[float, float, float]:
        """Cell lengths far from supports, within them and where they begin and end, for a thickness of the beam."""
        size = self._length("size", self.size, thickness)
        support_size = self._length("support_size", self.support_size, min(thickness / 3, size))
        edge_size = self._length("edge_size", self.edge_size, min(support_size, size) / 2)
        longest = self._longest(geometry, thickness)
        size, support_size = min(size, longest), min(support_size, longest)
        return size, support_size, min(edge_size, support_size, size)

    def layers_along(self, geometry: BeamGeometry) -> Positions:
        """Boundaries of structured layers along the beam, in m; errors as in `cell_length`."""
        return structured_partition(geometry.breakpoints(0), self.cell_length(geometry))

    def layers(self, geometry: BeamGeometry) -> tuple[int, ...]:
        """Number of structured cells in the directions after x: (thickness) or (width, thickness)."""
        through = self._count("cells_through_thickness", self.cells_through_thickness)
        if geometry.dimension == 2:
            return (through,)
        return (self._count("cells_across_width", self.cells_across_width), through)

    def _longest(self, geometry: BeamGeometry, thickness: float) -> float:
        """The limit that the section sets to the length of triangles and tetrahedra."""
        if self.cell_of(geometry.dimension) not in ("triangle", "tetrahedron"):
            return math.inf
        through = self.cells_through_thickness or UNSTRUCTURED_THROUGH
        longest = thickness / through
        if geometry.dimension == 3 and self.cells_across_width is not None:
            longest = min(longest, geometry.width / self.cells_across_width)
        return longest

    @staticmethod
    def _length(name: str, value: float | None, default: float) -> float:
        if value is None:
            return default
        if not (math.isfinite(value) and value > 0):
            raise MeshError(f"mesh.{name}", found=f"{value}", expected="a positive length in m")
        return value

    @staticmethod
    def _count(name: str, value: int | None) -> int:
        if value is None:
            return CELLS_THROUGH
        if value < 1:
            raise MeshError(f"mesh.{name}", found=f"{value}", expected="1 or more")
        return value


def beam_layers(geometry: BeamGeometry, sizing: BeamSizing) -> list[Positions]:
    """Return layer boundaries along each axis, m.

    They are graded along x and even across the beam; every given point is a corner of cells. Across a slice with steps
    the layers are as thin as the thinnest part there asks for.
    """
    along, counts = sizing.layers_along(geometry), sizing.layers(geometry)
    if geometry.steps:
        (count,) = counts
        parts = [
            (high, [step.thickness for step in geometry.steps if step.thickness > abs(low + high)])
            for low, high in pairwise(levels(geometry))
        ]
        lengths = CellLength(tuple((high, min(there) / count) for high, there in parts))
        return [along, structured_partition(geometry.breakpoints(1), lengths)]
    across = [even_partition(geometry.breakpoints(axis), count) for axis, count in enumerate(counts, start=1)]
    return [along, *across]


def levels(geometry: BeamGeometry) -> tuple[float, ...]:
    """Return the heights between which the bands of layers of a slice lie, m: one band without steps."""
    found = {side * step.thickness for step in geometry.steps for side in (-0.5, 0.5)}
    inner = sorted(found - {geometry.lower[-1], geometry.upper[-1]})
    return (geometry.lower[-1], *inner, geometry.upper[-1])


def filled_parts(geometry: BeamGeometry, x: Positions) -> list[tuple[bool, ...]]:
    """Return flags of the bands of a slice, or patches of a section, that the beam fills at places; () for all."""
    found = list[tuple[bool, ...]]()
    for place in x:
        here = geometry.at(float(place))
        if not geometry.steps:
            found.append(())
        elif here.section is not None:
            found.append(here.filled)
        else:
            found.append(tuple(abs(low + high) <= here.thickness for low, high in pairwise(levels(geometry))))
    return found


STRUCTURED = ("quadrilateral", "hexahedron")


def expected_cells(geometry: BeamGeometry, sizing: BeamSizing) -> float:
    """Return the number of cells of a beam: exact for layers, about that for triangles and tetrahedra.

    Raises:
        MeshError: The sizes make no sense.
    """
    if geometry.section is not None:
        along = sizing.layers_along(geometry)
        if geometry.steps:
            return sum(_section(geometry, x).cells for x in 0.5 * (along[1:] + along[:-1]))
        return float(geometry.section.cells * (len(along) - 1))
    if sizing.cell_of(geometry.dimension) not in STRUCTURED:
        return cells_that_fill(geometry, sizing.cell_length(geometry))
    count = 1.0
    for axis in beam_layers(geometry, sizing):
        count *= len(axis) - 1
    return count


def expected_nodes(geometry: BeamGeometry, sizing: BeamSizing, degree: int) -> float:
    """Return the number of nodes of degree p: exact for layers, p^2 / 2 a triangle, p^3 / 6 a tetrahedron.

    Raises:
        MeshError: The sizes make no sense.
    """
    if geometry.section is not None:
        along = sizing.layers_along(geometry)
        if geometry.steps:  # but for the nodes where sections meet
            each = [_section(geometry, x).nodes(degree) for x in 0.5 * (along[1:] + along[:-1])]
            return float(each[0] + degree * sum(each))
        return float(geometry.section.nodes(degree) * (degree * (len(along) - 1) + 1))
    if sizing.cell_of(geometry.dimension) not in STRUCTURED:
        share = degree**2 / 2.0 if geometry.dimension == 2 else degree**3 / 6.0
        return share * expected_cells(geometry, sizing)
    count = 1.0
    for axis in beam_layers(geometry, sizing):
        count *= degree * (len(axis) - 1) + 1
    return count


def _section(geometry: BeamGeometry, x: float) -> SectionPatches:
    """Return the patches of the cross-section at a place of a beam with steps."""
    section = geometry.at(x).section
    assert section is not None
    return section


def cells_that_fill(geometry: BeamGeometry, cell_length: CellLength) -> float:
    """Number of equilateral cells that fill the beam, from the lengths wanted along it."""
    x = structured_partition(geometry.breakpoints(0), cell_length)
    lengths = np.diff(x)
    section = geometry.volume / geometry.length
    share = np.sqrt(3) / 4 if geometry.dimension == 2 else 1 / (6 * np.sqrt(2))
    return float(np.sum(section * lengths / (share * lengths**geometry.dimension)))
