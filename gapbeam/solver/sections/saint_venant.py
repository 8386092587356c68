"""Torsion and flexure of a prismatic bar by Saint-Venant, solved by finite elements on its cross-section.

The warping functions phi of torsion and chi of flexure by a force along an axis a (b the other one) are harmonic, with

    d phi / dn = z n_y - y n_z
    d chi / dn = -n_a (nu a^2 / 2 + (1 - nu / 2) b^2) - n_b (2 + nu) a b

on the boundary, y, z, a and b measured from the centroid. Prandtl's stress function Psi is 0 on the outline and
constant around each hole. With A_k the area of hole k, torsion constant, shear coefficient and shear center are

    lap Psi = -2,    J = 2 int Psi dA + 2 sum_k A_k Psi_k
    kappa = 2 (1 + nu) I_a / (nu / 2 (I_b - I_a) - A / I_a int a (chi + a b^2) dA),      I_a = int a^2 dA
    y_s = -int z phi dA / int z^2 dA,   z_s = int y phi dA / int y^2 dA        (principal axes)

Source: Cowper (1966), J. Appl. Mech. 33, 335-340, for kappa; Trefftz (1935), Z. angew. Math. Mech. 15, 220-225, for the
shear center, which does not depend on nu.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import Any

import numpy as np

from gapbeam.meshes.gmsh_model import graded_triangles
from gapbeam.meshes.sections.section_mesh import PolygonOutline, Triangulation, edges_of, signed_area
from gapbeam.meshes.sections.section_patches import Array, Place

ALONG = 24  # wanted edges along the larger extent
GROWTH = 0.7  # of the distance from a re-entrant corner: how long edges are there
SHARP = 1.05 * pi  # rad: inner angles from which on a corner makes a singularity that counts
WALL = 0.18  # of the way through a wall: how long edges are there
CORNER = 3.0e-6  # aimed at for the share that a re-entrant corner takes away
ENOUGH = 1.0e-4  # relative error of the figures
SHARE = (
    0.5  # of the difference between two meshes that is left: the error of h^(4/3) at the sharpest corners falls by 2.5
)
MOST_TRIANGLES = 60_000
AT_ONCE = 1000  # places whose lengths are looked up together
# Dunavant (1985): exact for polynomials of degree 4
_NEAR, _FAR = 0.445948490915965, 0.091576213509771
_BARYCENTRIC = np.array([[1.0 - 2.0 * a if i == j else a for i in range(3)] for a in (_NEAR, _FAR) for j in range(3)])
_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3)


@dataclass(frozen=True)
class SaintVenantFigures:
    """Figures of beam theory from the stress of Saint-Venant's bars.

    Attributes:
        torsion_constant: J, m^4.
        shear_center: y and z from the axis of the beam, m.
        upright: 2 (1 + nu) I / kappa for a force along z: at nu = 0, and its slope by nu, m^4.
        sideways: The same for a force along y.
        error: Estimate of their largest relative error, half of the change from the last mesh but one.
    """

    torsion_constant: float
    shear_center: Place
    upright: tuple[float, float]
    sideways: tuple[float, float]
    error: float


@lru_cache(maxsize=256)
def saint_venant(outline: PolygonOutline) -> SaintVenantFigures:
    """Return torsion constant, shear center and shear coefficients of a polygon; once for each polygon.

    Raises:
        MeshError: Triangles do not fill the polygon.
    """
    mesh = _graded(outline)
    before = _solved(outline, mesh)
    while True:
        mesh = mesh.halved()
        found = _solved(outline, mesh)
        scales = np.array([found[0], *2 * [outline.size], *np.repeat(found[[3, 5]], 2)])
        error = SHARE * float(np.max(np.abs(found - before) / np.abs(scales)))
        if error < ENOUGH or 4 * len(mesh.triangles) > MOST_TRIANGLES:
            constant, y, z, *shear = (float(value) for value in found)
            return SaintVenantFigures(constant, (y, z), (shear[0], shear[1]), (shear[2], shear[3]), error)
        before = found


def _graded(outline: PolygonOutline) -> Triangulation:
    """Return triangles that shrink toward re-entrant corners as far as the singularity there asks for."""
    angles = outline.inner_angles()
    lengths = np.linalg.norm(outline.sides[:, 1] - outline.sides[:, 0], axis=1)
    base = outline.size / ALONG
    sharp = np.flatnonzero(angles > SHARP)
    corners, exponents = outline.sides[sharp, 0], pi / angles[sharp]
    local = np.minimum(base, 0.3 * np.minimum(lengths, np.roll(lengths, 1))[sharp])
    aim = np.minimum(1.0, CORNER / (1.0 - exponents) ** 2)
    smallest = np.exp(np.log(aim) / (2.0 * exponents)) * local
    walls, through = outline.walls(base)
    thin = WALL * through < base
    sources = np.concatenate([corners, walls[thin]])
    least = np.concatenate([smallest, WALL * through[thin]])

    def wanted(places: Array) -> Array:
        found = np.full(len(places), base)
        for part in range(0, len(places), AT_ONCE):
            some = slice(part, part + AT_ONCE)
            away = np.linalg.norm(places[some, None] - sources, axis=2)
            found[some] = np.min(least + GROWTH * away, axis=1, initial=base)
        return found

    return graded_triangles(outline, wanted)


def _solved(outline: PolygonOutline, mesh: Triangulation) -> Array:
    """Return J, shear center, and both terms of 2 (1 + nu) I / kappa along z and along y: (7,)."""
    from scipy.sparse import csc_matrix

    edges, numbers = edges_of(mesh.triangles)
    nodes = np.concatenate([mesh.triangles, len(mesh.points) + numbers], axis=1)
    size = len(mesh.points) + len(edges)
    corners = mesh.points[mesh.triangles] - np.array(outline.centroid)
    slopes, areas = _slopes(corners)
    values, gradients = _shapes(slopes)
    factors = areas[:, None] * _WEIGHTS
    places = np.einsum("qi,kix->kqx", _BARYCENTRIC, corners)
    y, z = places[:, :, 0], places[:, :, 1]

    def gathered(parts: Array) -> Array:
        return np.bincount(nodes.reshape(-1), weights=parts.reshape(-1), minlength=size).astype(float)

    def row(density: Array) -> Array:
        """Return int density v dA for all shapes v."""
        return gathered(np.einsum("kq,qs->ks", factors * density, values))

    def pull(along_y: Array, along_z: Array) -> Array:
        """Return int F . grad v dA for all shapes v."""
        field = factors[:, :, None] * np.stack([along_y, along_z], axis=2)
        return gathered(np.einsum("kqx,kqsx->ks", field, gradients))

    blocks = np.einsum("kq,kqsx,kqtx->kst", factors, gradients, gradients)
    placed = np.repeat(nodes, 6, axis=1).reshape(-1), np.tile(nodes, (1, 6)).reshape(-1)
    stiffness = csc_matrix((blocks.reshape(-1), placed), (size, size))
    by_y, by_z = row(y), row(z)
    loads = [
        pull(z, -y),
        pull(-2.0 * y * z, -(y**2)) - 2.0 * by_z,
        pull(-y * z, 0.5 * (y**2 - z**2)) - 2.0 * by_z,
        pull(-(z**2), -2.0 * y * z) - 2.0 * by_y,
        pull(0.5 * (z**2 - y**2), -y * z) - 2.0 * by_y,
    ]
    warped = np.zeros((size, len(loads)))  # the first node stays: constants do not count
    warped[1:] = _solution(stiffness[1:, 1:], np.stack(loads, axis=1)[1:])
    along_y, along_z, _ = outline.second_moments
    constant = _prandtl(outline, mesh, stiffness, row(np.ones_like(y)))
    center = _shear_center(outline, float(by_y @ warped[:, 0]), float(by_z @ warped[:, 0]))
    fourth = float(np.sum(factors * y**2 * z**2))
    area = outline.moments.area
    upright = _terms(area / along_z, by_z @ warped[:, 1:3], fourth, along_y - along_z)
    sideways = _terms(area / along_y, by_y @ warped[:, 3:5], fourth, along_z - along_y)
    return np.array([constant, *center, *upright, *sideways])


def _prandtl(outline: PolygonOutline, mesh: Triangulation, stiffness: Any, ones: Array) -> float:
    """Return the torsion constant by the stress function: no small difference of large integrals, as with phi.

    Args:
        outline: The polygon.
        mesh: Its triangles.
        stiffness: int grad u . grad v dA of their quadratic shapes.
        ones: int v dA of these.
    """
    from scipy.sparse import csc_matrix

    edges, numbers = edges_of(mesh.triangles)
    rim = np.flatnonzero(np.bincount(numbers.reshape(-1)) == 1)
    middles = 0.5 * (mesh.points[edges[rim, 0]] + mesh.points[edges[rim, 1]])
    apart = np.stack([PolygonOutline((loop,)).distance(middles) for loop in outline.loops])
    loops = np.argmin(apart, axis=0)
    count = len(outline.loops)
    unknown = np.full(len(ones), -1)
    for nodes in (edges[rim, 0], edges[rim, 1], len(mesh.points) + rim):
        unknown[nodes] = loops
    inside = np.flatnonzero(unknown < 0)
    unknown[inside] = count + np.arange(len(inside))
    size = count + len(inside)
    tied = csc_matrix((np.ones(len(ones)), (np.arange(len(ones)), unknown)), (len(ones), size))
    load = 2.0 * (tied.T @ ones)
    load[1:count] -= 2.0 * np.array([signed_area(loop) for loop in outline.loops[1:]])
    reduced = csc_matrix(tied.T @ stiffness @ tied)[1:, 1:]
    return float(load[1:] @ _solution(reduced, load[1:]))


def _solution(matrix: Any, loads: Array) -> Array:
    """Return the solution of a symmetric positive definite sparse system."""
    from scipy.sparse.linalg import splu

    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.asarray(factor.solve(loads))


def _terms(share: float, worked: Array, fourth: float, difference: float) -> tuple[float, float]:
    """Return the terms of 2 (1 + nu) I / kappa."""
    return float(-share * (worked[0] + fourth)), float(0.5 * difference - share * worked[1])


def _shear_center(outline: PolygonOutline, by_y: float, by_z: float) -> Place:
    """Return the point about which a twisted section warps without y or z, from int y phi dA and int z phi dA."""
    along_y, along_z, mixed = outline.second_moments
    z, y = np.linalg.solve([[along_y, -mixed], [mixed, -along_z]], [by_y, by_z])
    return float(outline.centroid[0] + y), float(outline.centroid[1] + z)


def _slopes(corners: Array) -> tuple[Array, Array]:
    """Return the gradients of the barycentric coordinates, (k, 3, 2), and the areas of triangles, (k,)."""
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    first, second = opposite[:, 0], opposite[:, 1]
    doubled = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    turned = np.stack([-opposite[:, :, 1], opposite[:, :, 0]], axis=2)
    return turned / doubled[:, None, None], 0.5 * doubled


def _shapes(slopes: Array) -> tuple[Array, Array]:
    """Return quadratic shapes at the quadrature points, (q, 6), and their gradients, (k, q, 6, 2)."""
    corner = _BARYCENTRIC * (2.0 * _BARYCENTRIC - 1.0)
    ahead = np.roll(_BARYCENTRIC, -1, axis=1)
    values = np.concatenate([corner, 4.0 * _BARYCENTRIC * ahead], axis=1)
    at_corners = np.einsum("qi,kix->kqix", 4.0 * _BARYCENTRIC - 1.0, slopes)
    ahead_slopes = np.roll(slopes, -1, axis=1)
    between = np.einsum("qi,kix->kqix", 4.0 * ahead, slopes) + np.einsum(
        "qi,kix->kqix", 4.0 * _BARYCENTRIC, ahead_slopes
    )
    return values, np.concatenate([at_corners, between], axis=2)
