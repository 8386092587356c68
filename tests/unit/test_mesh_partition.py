"""Layers along the beam: they hit given points and grow smoothly; their number follows from the sizes."""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_size import (
    GROWTH,
    LARGEST_RATIO,
    BeamSizing,
    CellLength,
    even_partition,
    structured_partition,
)

LENGTH, THICKNESS, WIDTH, SUPPORT = 0.51, 0.012, 0.02, 0.05


def beam(*points: float, dimension: int = 2) -> BeamGeometry:
    """The beam of the paper with points on its axis."""
    on_axis = tuple((x,) + (0.0,) * (dimension - 1) for x in points)
    return BeamGeometry(dimension, LENGTH, THICKNESS, WIDTH, SUPPORT, on_axis)


def layers(*points: float, sizing: BeamSizing | None = None) -> np.ndarray:
    geometry = beam(*points)
    return structured_partition(geometry.breakpoints(0), (sizing or BeamSizing()).cell_length(geometry))


def largest_ratio(x: np.ndarray) -> float:
    lengths = np.diff(x)
    return float(np.max(np.maximum(lengths[1:] / lengths[:-1], lengths[:-1] / lengths[1:])))


def test_default_layers() -> None:
    """15 in the support and 43 behind it: 58 * 4 * 4 hexahedra of degree 2 have 28431 degrees of freedom."""
    x = layers()
    assert x[0] == 0.0
    assert x[-1] == LENGTH
    assert SUPPORT in x
    assert np.count_nonzero(x < SUPPORT) == 15
    assert len(x) - 1 == 58
    assert np.diff(x).max() <= THICKNESS


def test_edge_is_finest_and_growth_is_monotone() -> None:
    """Layers grow from the edge of the base outward, and from both ends of the support to its middle."""
    x = layers()
    lengths = np.diff(x)
    edge = int(np.searchsorted(x, SUPPORT))
    behind = lengths[edge:]
    assert np.all(np.diff(behind) >= -1e-12)
    assert behind[0] < THICKNESS / 5 < THICKNESS / 2 < behind[-1]
    half = edge // 2
    assert np.all(np.diff(lengths[:half]) >= -1e-12)
    assert np.all(np.diff(lengths[edge - half : edge]) <= 1e-12)
    # refined alike at x = 0 and at the edge
    assert lengths[:edge] == pytest.approx(lengths[:edge][::-1], rel=1e-3)
    assert largest_ratio(x) == pytest.approx(GROWTH, rel=0.02)


def test_random_points_are_hit_without_jumps() -> None:
    """Whatever the points, also ones very close to each other or to the support."""
    rng = np.random.default_rng(7)
    for _ in range(60):
        points = rng.uniform(0, LENGTH, rng.integers(1, 6))
        points[0] = SUPPORT + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-5, -2)
        x = layers(*points)
        assert np.all(np.diff(x) > 0)
        assert set(points) <= set(x)
        assert largest_ratio(x) <= LARGEST_RATIO + 1e-9


def test_number_of_layers_follows_the_sizes() -> None:
    """Half the sizes: about twice the layers; every small step in size changes their number by little."""
    scales = np.geomspace(1, 1 / 8, 60)
    counts = [
        len(layers(sizing=BeamSizing(size=0.012 * s, support_size=0.004 * s, edge_size=0.002 * s))) - 1 for s in scales
    ]
    assert np.all(np.diff(counts) >= 0)
    assert np.max(np.diff(counts) / np.array(counts[:-1])) < 0.06
    # the layers in which the lengths grow come on top, so a little less than 8 times
    assert 5 < counts[-1] / counts[0] < 8


def test_even_layers_unless_a_point_is_in_the_way() -> None:
    assert even_partition([-1.0, 0.0, 0.5, 1.0], 4) == pytest.approx([-1, -0.5, 0, 0.5, 1], abs=0)
    shifted = even_partition([-1.0, 0.1, 1.0], 4)
    assert 0.1 in shifted
    assert len(shifted) in (5, 6)
    assert 0.0 in even_partition([-1.0, 0.0, 1.0], 3)


def test_cell_length_is_limited_by_regions_and_sources() -> None:
    wanted = CellLength(regions=((1.0, 0.5), (2.0, 0.2)), sources=((0.0, 0.1),))
    assert wanted([0.0, 2.0]) == pytest.approx([0.1, 0.2])
    assert wanted(0.5) == pytest.approx(0.1 + 0.5 * np.log(GROWTH))
    assert wanted.smallest == 0.1


def test_far_size_limits_the_other_defaults() -> None:
    """A size below a third of the thickness is not exceeded in the support."""
    wanted = BeamSizing(size=0.001).cell_length(beam())
    assert wanted(np.linspace(0, LENGTH, 100)).max() == 0.001
    assert wanted(SUPPORT) == 0.0005


def test_triangles_are_limited_by_the_section() -> None:
    free = BeamSizing(cell="triangle").cell_length(beam())
    assert free(LENGTH) == THICKNESS / 2
    asked = BeamSizing(cell="triangle", cells_through_thickness=6).cell_length(beam())
    assert asked(LENGTH) == THICKNESS / 6
    across = BeamSizing(cell="tetrahedron", cells_across_width=20).cell_length(beam(dimension=3))
    assert across(LENGTH) == WIDTH / 20


@pytest.mark.parametrize("size", [1e-9, 1e-6])
def test_absurd_size_ends_soon(size: float) -> None:
    with pytest.raises(MeshError, match="layers"):
        layers(sizing=BeamSizing(size=size))


@pytest.mark.parametrize(("length", "slenderness"), [(2.0, 20_100.0), (1e-4, 3e4), (50.0, 1e6)])
@pytest.mark.parametrize("support", [1e-3, 1.0])
def test_the_advice_for_slender_beams_is_enough(length: float, slenderness: float, support: float) -> None:
    """The number of layers stands beside the limit and is above it; cells of the size that is named are accepted."""
    geometry = BeamGeometry(2, length, length / slenderness, 1e-2 * length, support * length, ())
    with pytest.raises(MeshError) as refused:
        structured_partition(geometry.breakpoints(0), BeamSizing().cell_length(geometry))
    found = re.search(
        r"makes about (\S+) layers; expected at most (\d+)\..* size = (\S+) in \[mesh\]", str(refused.value)
    )
    assert found is not None
    assert float(found[1]) > int(found[2])
    sizing = BeamSizing(size=float(found[3]), support_size=float(found[3]) if support == 1.0 else None)
    assert len(structured_partition(geometry.breakpoints(0), sizing.cell_length(geometry))) <= int(found[2])


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_sizes_are_positive(value: float) -> None:
    with pytest.raises(MeshError, match="support_size"):
        BeamSizing(support_size=value).cell_length(beam())
    with pytest.raises(MeshError, match="thickness"):
        BeamGeometry(2, 1.0, value, 0.1, 0.1)


def test_cell_belongs_to_the_dimension() -> None:
    with pytest.raises(MeshError, match=r"found hexahedron .* expected quadrilateral or triangle"):
        BeamSizing(cell="hexahedron").cell_of(2)
    assert BeamSizing().cell_of(2) == "quadrilateral"
    assert BeamSizing().cell_of(3) == "hexahedron"


@pytest.mark.parametrize("point", [(-0.001, 0.0), (0.52, 0.0), (0.1, 0.0061), (float("nan"), 0.0)])
def test_points_outside_are_refused(point: tuple[float, ...]) -> None:
    with pytest.raises(MeshError, match="outside of the beam"):
        BeamGeometry(2, LENGTH, THICKNESS, WIDTH, SUPPORT, (point,))


def test_point_has_the_coordinates_of_the_dimension() -> None:
    with pytest.raises(MeshError, match="found 3 coordinates; expected 2"):
        BeamGeometry(2, LENGTH, THICKNESS, WIDTH, SUPPORT, ((0.1, 0.0, 0.0),))


def test_points_within_rounding_are_the_same() -> None:
    points = ((0.1 + 0.2, 0.0), (0.3, 1e-17), (SUPPORT + 1e-16, THICKNESS / 2 + 1e-17))
    geometry = BeamGeometry(2, LENGTH, THICKNESS, WIDTH, SUPPORT, points)
    assert len(geometry.breakpoints(0)) == 4
    assert geometry.points[2] == (SUPPORT, THICKNESS / 2)


def test_almost_equal_points_are_refused() -> None:
    with pytest.raises(MeshError, match=r"x = 0\.05 m and x = 0\.0500001 m"):
        beam(SUPPORT + 1e-7).breakpoints(0)


def test_support_is_not_longer_than_the_beam() -> None:
    with pytest.raises(MeshError, match="support length"):
        BeamGeometry(2, 0.1, 0.01, 0.01, 0.2)
    assert BeamGeometry(2, 0.3, 0.01, 0.01, 0.1 + 0.2).support_length == 0.3


def test_error_keeps_its_fields_through_pickle() -> None:
    error = pickle.loads(pickle.dumps(MeshError("here", found="a", expected="b", hint="Try c.")))
    assert (error.where, error.found, error.expected, error.hint) == ("here", "a", "b", "Try c.")
    assert str(error) == "here: found a; expected b. Try c."
