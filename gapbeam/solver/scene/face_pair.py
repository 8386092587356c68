"""Contacts between faces of two solids whose meshes do not match: paired once, for small sliding.

Each corner i of the first face gets one contact. Its place is the gap, weighted by the linear shape function N_i over
the part of the face that lies before the second one, and its force acts on all nodes there:

    g_i = int N_i n . (x_2 - x_1 + u_2 - u_1) dA / A_i,     A_i = int N_i dA,     F_i = stiffness A_i <-g_i>.

The integrals are taken over the intersections of facets, seen along the normal n of the facet of the first face. Flat
faces of straight cells then carry a constant pressure exactly (patch test); faces that are curved do so up to the
deviation of their facets. Friction weights the slip likewise, in space in two directions across the mean normal of the
facets at a corner. Source: Puso and Laursen (2004), Comput. Methods Appl. Mech. Engrg. 193, 601.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.convex_region import HalfPlane
from gapbeam.solver.scene.force_law import ForceLaw
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.scene.solid_cells import FACETS, Indices, rule_of, shapes_at
from gapbeam.solver.scene.structure import Structure, dense
from gapbeam.solver.scene.structure_geometry import directions_across
from gapbeam.solver.system.operators import Array

POINTS = 3  # of the rule in each direction of a part of the intersection
SMALL = 1e-9  # of a facet: intersections, and areas of corners, that are none
OVERLAP = 0.05  # of the size of a facet: how deep faces may lie in each other at the start
PASSES, CLOSE = 20, 1e-13


class _Face(NamedTuple):
    """A face: its structure, places of all nodes, facets, their kind, and the normals of the facets."""

    structure: Structure
    places: Array
    facets: Indices
    kind: str
    normals: Array

    @property
    def corners(self) -> int:
        """Corners of a facet."""
        return len(FACETS[self.kind].corners)


class _Seen(NamedTuple):
    """Points of a facet that lie before the other face, and their weights, in the plane across a normal."""

    points: Array
    weights: Array


@checked
def face_contacts(
    first: tuple[Structure, str],
    second: tuple[Structure, str],
    stiffness: float | ForceLaw,
    *,
    damping: float = 0.0,
    clearance: float | None = None,
    friction: float = 0.0,
    sliding: float = 0.0,
    name: str = "face",
) -> list[Contact]:
    """Return the contacts between faces of two solids, whose meshes need not match; those of a scene.

    They act at the corners of the first face: take the finer one. Faces are paired as they lie at the start, so sliding
    stays small beside a facet.

    Args:
        first: Structure of `from_mesh`, and the name of a set of nodes: the facets of its surface that they span.
        second: The other, likewise.
        stiffness: Penalty stiffness, Pa/m: about ten times Young's modulus over the size of a cell; or a law per area,
            as `Cubic` with a stiffness in Pa/m.
        damping: Pa s/m.
        clearance: Distance of the faces, m, where it is known better than facets of curved faces have it; negative: an
            interference. Default: as the meshes lie.
        friction: Coefficient.
        sliding: As of a `Contact`, m/s.
        name: "face" makes contacts "face-0", "face-1", ...

    Raises:
        UserError: A structure has no such face, the faces do not lie before each other, or they lie in each other.
    """
    where = f"contacts {name}"
    one, two = _face(first, where), _face(second, where)
    if FACETS[one.kind].dimension != FACETS[two.kind].dimension:
        raise UserError(f"{where}: found a solid in the plane and one in space, expected two of a kind")
    lossy = positive(damping, f"{where}: damping", zero=True)
    if not isinstance(stiffness, ForceLaw):
        law = KelvinVoigt(stiffness=float(positive(stiffness, f"{where}: stiffness")), damping=float(lossy))
    elif stiffness.kind.per_area is None or damping:
        expected = "a stiffness, or a law with `per_area` and no damping beside it"
        raise UserError(f"{where}: found law {stiffness.kind.name}, expected {expected}")
    else:
        law = stiffness

    slips = FACETS[one.kind].dimension if positive(friction, f"{where}: friction", zero=True) > 0.0 else 0
    along = _directions(one) if slips == 2 else {}
    own: list[Array] = [np.zeros((3, 0))]
    other: list[Array] = [np.zeros((3, 0))]
    area, gap = np.zeros(len(one.places)), np.zeros(len(one.places))
    for facet, normal in zip(one.facets, one.normals, strict=True):
        across = _across(normal, FACETS[one.kind].dimension)
        flat = one.places[facet] @ across.T
        for k in _before(flat, normal, across, two):
            facing = two.facets[k]
            seen = _intersection(flat[: one.corners], two.places[facing[: two.corners]] @ across.T)
            if seen is None:
                continue
            at = _reference(one, facet, across, seen.points)
            mine, slopes = shapes_at(one.kind, at)
            theirs, _ = shapes_at(two.kind, _reference(two, facing, across, seen.points))
            upright = _normals(np.einsum("gdn,nx->gdx", slopes, one.places[facet]))
            share = (seen.weights / (upright @ normal))[:, None] * shapes_at(_linear(one.kind), at)[0]
            corners = facet[: one.corners]
            np.add.at(area, corners, share.sum(axis=0))
            between = ((theirs @ two.places[facing] - mine @ one.places[facet]) * upright).sum(axis=1)
            np.add.at(gap, corners, share.T @ between)
            ways = np.empty((one.corners, 1 + slips, *upright.shape))
            ways[:, 0] = upright
            if slips:
                ways[:, 1:] = np.cross([0, 0, 1], upright) if slips == 1 else [along[i][:, None] for i in corners]
            for nodes, values, found in ((facet, mine, own), (facing, theirs, other)):
                table = np.einsum("gi,gj,imgd->imjd", share, values, ways)
                columns = np.broadcast_to(3 * nodes[:, None] + np.arange(3), table.shape)
                motions = (1 + slips) * corners[:, None] + np.arange(1 + slips)
                rows = np.broadcast_to(motions[..., None, None], table.shape)
                found.append(np.array([rows.ravel(), columns.ravel(), table.ravel()]))
    merged = _merged(one)
    area, gap = merged @ area, merged @ gap
    nodes = np.flatnonzero(area > SMALL * area.max(initial=0.0))
    if not len(nodes):
        raise UserError(
            f"{where}: found faces {first[1]} and {second[1]} that do not lie before each other, expected normals that "
            "face each other; see `place` of a structure"
        )
    gaps = gap[nodes] / area[nodes]
    if clearance is not None:
        gaps = np.full(len(nodes), float(finite(clearance, f"{where}: clearance")))
    size = float(np.linalg.norm(np.ptp(one.places[one.facets], axis=1), axis=1).mean())
    if clearance is None and gaps.min() < -OVERLAP * size:
        raise UserError(
            f"{where}: found faces that lie in each other by {-gaps.min():.4g} m, expected a distance; give "
            "`clearance`, 0 where they touch, below 0 for an interference"
        )
    first_rows, second_rows = (
        _rows(found, face, nodes, 1 + slips, merged) / area[nodes, None, None]
        for found, face in ((own, one), (other, two))
    )
    normal_way = (1.0, 0.0, 0.0)[: 1 + slips]
    return [
        Contact(
            (one.structure.point(first_rows[i], first[1]), two.structure.point(second_rows[i], second[1])),
            HalfPlane(float(gaps[i]), normal_way),
            law.on_area(float(area[node])),
            friction, sliding, name=f"{name}-{i}",
        )
        for i, node in enumerate(nodes)
    ]  # fmt: skip


def _face(given: tuple[Structure, str], where: str) -> _Face:
    if not (isinstance(given, tuple) and len(given) == 2 and isinstance(given[0], Structure)):
        raise UserError(f'{where}: found {given!r}, expected (structure, "SET")')
    structure, name = given
    shape = structure.geometry
    faces = {} if shape is None else dict(shape.faces)
    if shape is None or str(name).upper() not in faces:
        known = ", ".join(faces) or "none; structures of from_mesh have faces"
        raise UserError(f"{where}: found the face {name!r} of {structure.name or '?'}, expected one of {known}")
    facets = faces[str(name).upper()]
    kind = FACETS[shape.facet]
    _, slopes = shapes_at(shape.facet, np.full((1, kind.dimension), 1.0 / 3.0 if kind.simplex else 0.5))
    normals = _normals(np.einsum("dn,fnx->fdx", slopes[0], shape.places[facets]))
    return _Face(structure, shape.places, facets, shape.facet, normals)


def _directions(face: _Face) -> dict[int, Array]:
    """Return two directions across the mean normal of the facets at each corner, (2, 3)."""
    mean = np.zeros_like(face.places)
    for facet, normal in zip(face.facets, face.normals, strict=True):
        mean[facet[: face.corners]] += normal
    return {int(i): directions_across(mean[i] / np.linalg.norm(mean[i])) for i in np.flatnonzero(mean.any(axis=1))}


def _normals(along: Array) -> Array:
    """Return outward normals from the slopes of places in a facet, (count, dimension, 3)."""
    if along.shape[1] == 1:  # the solid is on the left
        first, second = along[:, 0], np.broadcast_to([0.0, 0.0, 1.0], along[:, 0].shape)
    else:
        first, second = along[:, 0], along[:, 1]
    found = np.cross(first, second)
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _linear(kind: str) -> str:
    """Return the kind of facets of order 1 with the same corners."""
    return {"line3": "line", "triangle6": "triangle", "quad8": "quad", "quad9": "quad"}.get(kind, kind)


def _across(normal: Array, dimension: int) -> Array:
    """Return unit vectors across a normal, (dimension, 3)."""
    if dimension == 1:
        return np.array([[-normal[1], normal[0], 0.0]])
    return directions_across(normal)


def _before(flat: Array, normal: Array, across: Array, other: _Face) -> Indices:
    """Return the facets of the other face whose boxes meet a facet's, seen along its normal."""
    seen = other.places[other.facets] @ across.T
    meets = np.all((seen.min(axis=1) < flat.max(axis=0)) & (seen.max(axis=1) > flat.min(axis=0)), axis=1)
    return np.flatnonzero(meets & (other.normals @ normal < 0.0))


def _intersection(a: Array, b: Array) -> _Seen | None:
    """Return points and weights of a rule on the intersection of two convex facets; None: there is none."""
    if a.shape[1] == 1:
        low, high = max(a.min(), b.min()), min(a.max(), b.max())
        if high - low <= SMALL * np.ptp(a):
            return None
        x, w = rule_of(POINTS, 1, False)
        return _Seen(low + (high - low) * x, (high - low) * w)
    polygon = _clipped(_turned(a), _turned(b))
    if len(polygon) < 3:
        return None
    x, w = rule_of(POINTS, 2, True)
    points, weights = [], []
    for p, q in pairwise(polygon[1:]):
        sides = np.array([p - polygon[0], q - polygon[0]])
        points.append(polygon[0] + x @ sides)
        weights.append(w * abs(float(np.linalg.det(sides))))
    total = np.concatenate(weights)
    return _Seen(np.vstack(points), total) if total.sum() > SMALL * abs(_area(a)) else None


def _area(corners: Array) -> float:
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _turned(corners: Array) -> Array:
    """Return corners in counter-clockwise order."""
    return corners if _area(corners) > 0.0 else corners[::-1]


def _clipped(polygon: Array, by: Array) -> Array:
    """Return the part of a polygon in a convex one, by Sutherland and Hodgman."""
    for start, end in zip(by, np.roll(by, -1, axis=0), strict=True):
        if not len(polygon):
            break
        inward = np.array([start[1] - end[1], end[0] - start[0]])
        side = (polygon - start) @ inward
        kept = []
        for p, q, s, t in zip(polygon, np.roll(polygon, -1, axis=0), side, np.roll(side, -1), strict=True):
            if s >= 0.0:
                kept.append(p)
            if s * t < 0.0:
                kept.append(p + s / (s - t) * (q - p))
        polygon = np.array(kept)
    return polygon


def _reference(face: _Face, facet: Indices, across: Array, points: Array) -> Array:
    """Return the places in the reference facet of points seen along a normal, by Newton's method."""
    kind = FACETS[face.kind]
    flat = face.places[facet] @ across.T
    x = np.full((len(points), kind.dimension), 1.0 / 3.0 if kind.simplex else 0.5)
    for _ in range(PASSES):
        values, slopes = shapes_at(face.kind, x)
        change = np.linalg.solve(np.einsum("pdn,nx->pxd", slopes, flat), (points - values @ flat)[..., None])[..., 0]
        x += change
        if np.abs(change).max() < CLOSE:
            break
    return x


def _merged(face: _Face) -> Any:
    """Return the sum over nodes that gives those of the file, (nodes, nodes): hats of coarse cells are sums of fine."""
    assert face.structure.geometry is not None
    corners_of = face.structure.geometry.corners_of
    return sp.identity(len(face.places), format="csr") if corners_of is None else corners_of.T


def _rows(found: Sequence[Array], face: _Face, nodes: Indices, motions: int, merged: Any) -> Array:
    """Return the motions of the corners as rows of the structure's DOFs, (nodes, motions, DOFs)."""
    row, column, value = np.concatenate(found, axis=1)
    wanted = (motions * nodes[:, None] + np.arange(motions)).ravel()
    parts = sp.kron(merged, sp.identity(motions), format="csr")[wanted]
    table = parts @ sp.csr_matrix(
        (value, (row.astype(int), column.astype(int))), (parts.shape[1], 3 * len(face.places))
    )
    assert face.structure.geometry is not None
    moved = dense(table @ face.structure.geometry.rows)
    return moved.reshape(len(nodes), motions, -1)
