"""Regions: the set of the section plane that a contact point may not leave.

A region is one or more faces. A face gives the penetration x(r) and a discrete gradient g(r0, r1) with

    g . (r1 - r0) = x1 - x0,

which is all that a contact force -T(x0, x1) g needs to conserve energy (Gonzalez 1996, J. Nonlinear Sci. 6, 449).

`face(k, r0x, r0y, r1x, r1y, values)` returns x0, x1, g . (r1 - r0), g (2), the normal grad x(r1) (2), and dg/dr1 (4, by
rows). Where a user gives a distance only, both follow from differences of that distance.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf
from typing import Any

import numba
import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, named_values
from gapbeam.solver.scene.force_law import inlined
from gapbeam.solver.scene.own_functions import check_distance, is_own
from gapbeam.solver.scene.printed_values import called
from gapbeam.solver.system.operators import Array

EVERY_WAY = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


@dataclass(frozen=True, eq=False)
class RegionKind:
    """A compiled kind of region with its traits.

    Attributes:
        name: Name in messages.
        faces: Number of faces.
        names: Names of its values; one called "clearance" is the distance of the faces.
        face: See the module.
        period: Period of the values that move outward: every so many, from `outward` on; 0 where no value does.
        outward: The first of them.
        distance: The distance that a user wrote; None: a kind of this package.
    """

    name: str
    faces: int
    names: tuple[str, ...]
    face: Callable[..., Any]
    period: int = 0
    outward: int = 0
    distance: Any = None


@dataclass(frozen=True, eq=False)
class ConvexRegion:
    """A region with its values.

    Attributes:
        kind: The compiled functions.
        values: Numbers of this region, or arrays over the members of an ensemble.
        normals: Rows that span the ways which stay closed, {d: normals @ d <= 0 is open}: what a seat asks whether a
            rigid motion can escape.
        motions: 1, 2 in a section plane, or 3 in space, where walls are flat.
    """

    __repr__ = called

    kind: RegionKind
    values: tuple[Any, ...]
    normals: Array
    motions: int = 2

    def penetration(self, places: Array) -> tuple[Array, Array]:
        """Return penetrations, negative inside, and outward normals at places (n, motions): (n,), m, and (n, motions).

        Of several faces the one that is nearest, or deepest, counts. The values are those of one member.
        """
        if self.motions == 3:
            return places @ self.normals[0] - self.values[3], np.broadcast_to(self.normals, places.shape)
        depth, normals = np.empty(len(places)), np.zeros((len(places), 2))
        flat = np.zeros((len(places), 2))
        flat[:, : self.motions] = places
        _deepest(self.kind)(flat, tuple(float(one) for one in self.values), depth, normals)
        return depth, normals[:, : self.motions]

    @property
    def is_half_plane(self) -> bool:
        """True where it has one flat face."""
        return self.kind in (_SPACE, _PLANES.get(1))

    @property
    def normal(self) -> Array:
        """Outward normal of a half plane, (motions,)."""
        return np.asarray(self.normals[0, : self.motions])

    @property
    def reach(self) -> float:
        """Way by which its faces may close: the radius of a disc; infinite of others."""
        return float(np.min(self.values[0])) if self.kind is _DISC else inf

    @property
    def share(self) -> float:
        """Way of each face outward by a unit of clearance."""
        return 0.5 if self.kind is _SLOT else 1.0

    def check_own(self, at: Array, where: str) -> None:
        """Refuse a distance of a user that is none, seen from a place, (motions,), m; see `check_distance`."""
        if is_own(self.kind.distance):
            name = f"{where}: region {self.kind.name}"
            check_distance(self.kind.distance, self.values, bool(len(self.normals)), at, name)

    def grown(self, by: Any) -> ConvexRegion:
        """Return the region with its faces moved outward, m: by a number, or by one for each member of an ensemble.

        Raises:
            UserError: Nothing says which values of this kind move outward.
        """
        kind = self.kind
        if not kind.period:
            raise UserError(f"region {kind.name} cannot be grown: make one with other values")
        moved = (i % kind.period == kind.outward for i in range(len(self.values)))
        return replace(
            self, values=tuple(v + by if outward else v for v, outward in zip(self.values, moved, strict=True))
        )

    @property
    def flat_faces(self) -> tuple[tuple[ConvexRegion, float], ...]:
        """The half planes that bound it, each with its way outward by a unit of clearance; none where it is curved."""
        if self.kind is _SLOT:
            half, center = 0.5 * self.values[0], self.values[1]
            return (HalfPlane(half + center), 0.5), (HalfPlane(half - center, -1.0), 0.5)
        kind, n = self.kind, self.kind.outward
        places = range(0, len(self.values), kind.period) if n > 1 else ()
        return tuple((HalfPlane(self.values[i + n], self.values[i : i + self.motions]), 1.0) for i in places)

    def replaced(self, name: str, value: Any) -> ConvexRegion:
        """Return the region with another value of a name.

        Raises:
            UserError: The kind has no such name.
        """
        if name not in self.kind.names:
            raise UserError(f"region {self.kind.name} has no {name!r}; its values: {', '.join(self.kind.names)}")
        place, new = self.kind.names.index(name), _numbers(value, f"region {self.kind.name}: {name}")
        return replace(self, values=(*self.values[:place], new, *self.values[place + 1 :]))


@lru_cache
def _deepest(kind: RegionKind) -> Any:
    """Return compiled deepest(places, values, depth, normals) of a kind of region."""
    face, faces = kind.face, kind.faces

    @numba.njit(error_model="numpy")  # type: ignore[untyped-decorator]
    def deepest(places, values, depth, normals):  # type: ignore[no-untyped-def]
        for i in range(len(places)):
            x, y = places[i]
            for k in range(faces):
                _, reach, _, _, _, nx, ny, _, _, _, _ = face(k, x, y, x, y, values)
                if k == 0 or reach > depth[i]:
                    depth[i], normals[i, 0], normals[i, 1] = reach, nx, ny

    return deepest


@inlined
def _plane(k, r0x, r0y, r1x, r1y, values):  # type: ignore[no-untyped-def]
    nx, ny, c = values[3 * k], values[3 * k + 1], values[3 * k + 2]
    step = nx * (r1x - r0x) + ny * (r1y - r0y)
    return nx * r0x + ny * r0y - c, nx * r1x + ny * r1y - c, step, nx, ny, nx, ny, 0.0, 0.0, 0.0, 0.0


@inlined
def _slot(k, r0x, r0y, r1x, r1y, values):  # type: ignore[no-untyped-def]  # noqa: ARG001
    side, half = (1.0 if k == 0 else -1.0), 0.5 * values[0]
    x0, x1 = side * (r0x - values[1]) - half, side * (r1x - values[1]) - half
    return x0, x1, side * (r1x - r0x), side, 0.0, side, 0.0, 0.0, 0.0, 0.0, 0.0


@inlined
def _disc(k, r0x, r0y, r1x, r1y, values):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """The radial discrete gradient (r0 + r1) / (|r0| + |r1|) keeps the angular momentum about the center as well."""
    rho0, rho1 = np.sqrt(r0x * r0x + r0y * r0y), np.sqrt(r1x * r1x + r1y * r1y)
    both = rho0 + rho1 + 1e-300
    gx, gy, inverse = (r0x + r1x) / both, (r0y + r1y) / both, 1.0 / (rho1 + 1e-300)
    nx, ny = r1x * inverse, r1y * inverse
    step = gx * (r1x - r0x) + gy * (r1y - r0y)
    return (
        rho0 - values[0], rho1 - values[0], step, gx, gy, nx, ny,
        (1.0 - gx * nx) / both, -gx * ny / both, -gy * nx / both, (1.0 - gy * ny) / both,
    )  # fmt: skip


_DISC = RegionKind("Disc", 1, ("clearance",), _disc, 1)
_SLOT = RegionKind("Slot", 2, ("clearance", "center"), _slot)
_SPACE = RegionKind("HalfSpace", 1, ("normal_x", "normal_y", "normal_z", "clearance"), _plane, 4, 3)
_PLANES: dict[int, RegionKind] = {}


def _half_planes(normals: Array, offsets: Array, motions: int) -> ConvexRegion:
    count = len(offsets)
    if count not in _PLANES:
        names = [f"{name}{k or ''}" for k in range(count) for name in ("normal_x", "normal_y", "clearance")]
        _PLANES[count] = RegionKind("HalfPlane" if count == 1 else "Polygon", count, tuple(names), _plane, 3, 2)
    three = np.zeros((count, 3))
    three[:, : normals.shape[1]], three[:, 2] = normals, offsets
    return ConvexRegion(_PLANES[count], tuple(float(v) for v in three.ravel()), three[:, :2], motions)


@checked
def HalfPlane(clearance: float, normal: ArrayLike = 1.0) -> ConvexRegion:  # noqa: N802 - it makes an object
    """Return the points with normal . r <= clearance: a stop, a base, the face of another body.

    Args:
        clearance: Distance of the wall from the origin of the contact's motions, m; negative: it is pressed.
        normal: Outward: 1 or -1 for a contact of one motion, a vector of two (scaled to length 1) in a section plane,
            or of three in space.

    Raises:
        UserError: The normal is 0 or has more than three parts.
    """
    n = np.atleast_1d(finite(normal, "HalfPlane: normal"))
    size = float(np.linalg.norm(n))
    if n.shape not in ((1,), (2,), (3,)) or not size > 0.0:
        raise UserError(
            f"HalfPlane: found normal {normal!r}, expected 1 or -1, or a vector of two or three numbers that is not 0"
        )
    row, stop = np.asarray((n / size)[None], dtype=float), finite([clearance], "HalfPlane: clearance")
    if len(n) == 3:
        return ConvexRegion(_SPACE, (*map(float, row[0]), float(stop[0])), row, 3)
    return _half_planes(row, stop, len(n))


@checked
def Slot(clearance: Any, center: float = 0.0) -> ConvexRegion:  # noqa: N802
    """Return abs(r - center) <= clearance / 2 for one motion: a stop on either side.

    Args:
        clearance: Total play of the slot, m; negative for an interference fit.
        center: Center of the slot, m.
    """
    return ConvexRegion(_SLOT, (_numbers(clearance, "Slot: clearance"), float(center)), EVERY_WAY[:2], 1)


def Disc(clearance: Any) -> ConvexRegion:  # noqa: N802
    """Return norm(r) <= clearance: a round hole around a round body.

    Args:
        clearance: Radial play, m: radius of the hole minus radius of the body.
    """
    return ConvexRegion(_DISC, (_numbers(clearance, "Disc: clearance"),), EVERY_WAY)


def Polygon(corners: ArrayLike) -> ConvexRegion:  # noqa: N802
    """Return a convex polygon; in a corner both edges press.

    Args:
        corners: (n, 2), m, counter-clockwise.

    Raises:
        UserError: Fewer than three corners, clockwise, or not convex.
    """
    p = finite(corners, "Polygon: corners")
    if p.ndim != 2 or p.shape[1:] != (2,) or len(p) < 3:
        raise UserError(f"Polygon: found corners of shape {p.shape}, expected (n, 2) with n from 3 on")
    edge = np.roll(p, -1, 0) - p
    after = np.roll(edge, -1, 0)
    turn = edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0]
    around = np.arctan2(turn, (edge * after).sum(1)).sum()  # 2 pi for each time that the edges go around
    if not np.all(turn > 0.0) or around > 3.0 * np.pi:
        raise UserError(
            "Polygon: the corners do not turn left everywhere and once around: give a convex one counter-clockwise"
        )
    n = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.hypot(*edge.T)[:, None]
    return _half_planes(n, (n * p).sum(1), 2)


def Polar(radii: ArrayLike) -> ConvexRegion:  # noqa: N802
    """Return a measured or worn hole: radii at equal angles from the first axis on, a smooth curve between them.

    The curve is a periodic cubic spline: with corners, normals would jump from step to step. Radii that scatter from
    angle to angle make dents as narrow as their spacing: take means over neighbors first.

    Args:
        radii: Radial play at each angle, (n,), m.

    Raises:
        UserError: Fewer than three radii, or one that is not above 0, or a curve between them that is not.
    """
    given = finite(radii, "Polar: radii")
    if given.ndim != 1 or len(given) < 3 or not np.all(given > 0.0):
        raise UserError("Polar: expected at least three radii, all above 0")
    count, size = len(given), float(given.mean())
    ends = np.append(given, given[0]) / size
    curve = scipy.interpolate.CubicSpline(np.arange(count + 1), ends, bc_type="periodic")
    if not np.all(curve(np.linspace(0.0, count, 16 * count)) > 0.0):
        raise UserError(
            "Polar: found radii between which a smooth curve reaches the middle, expected more angles there"
        )
    table, turns = np.ascontiguousarray(curve.c.T), count / (2.0 * np.pi)

    def polar(x, y):  # type: ignore[no-untyped-def]
        at = (np.arctan2(y, x) * turns) % count
        k = min(int(at), count - 1)
        a, b, c, d = table[k]
        u = at - k
        radius, slope = d + u * (c + u * (b + u * a)), turns * (c + u * (2.0 * b + 3.0 * u * a))
        return (np.sqrt(x * x + y * y) - size * radius) / np.sqrt(1.0 + (slope / radius) ** 2)

    made: ConvexRegion = region(polar)()
    return made


@checked
def region(distance: Callable[..., Any], name: str | None = None, bounded: bool = True) -> Callable[..., ConvexRegion]:
    """Make a region from its distance; also a decorator.

    Normals are central differences of the distance. The discrete gradient is the mean of the normals at both ends of a
    step, corrected along the chord (Gonzalez 1996, eq. 3.7).

    Args:
        distance: distance(x, y, *values): negative inside, the distance to the wall outside; numbers only, compiled.
        name: Name in messages; default the function's.
        bounded: Whether the region ends in every direction.

    Returns:
        A function of the values by name.
    """
    f = inlined(distance)
    names = tuple(list(inspect.signature(distance).parameters)[2:])

    @inlined
    def normal(x, y, values):  # type: ignore[no-untyped-def]
        e = 1e-6 * (abs(x) + abs(y)) + 1e-30
        across = f(x, y + e, *values) - f(x, y - e, *values)
        return (f(x + e, y, *values) - f(x - e, y, *values)) / (2.0 * e), across / (2.0 * e)

    @inlined
    def chord(r0x, r0y, x0, n0x, n0y, r1x, r1y, values):  # type: ignore[no-untyped-def]
        x1 = f(r1x, r1y, *values)
        n1x, n1y = normal(r1x, r1y, values)
        gx, gy, dx, dy = 0.5 * (n0x + n1x), 0.5 * (n0y + n1y), r1x - r0x, r1y - r0y
        size = dx * dx + dy * dy
        if size > 1e-14 * (r0x * r0x + r0y * r0y + r1x * r1x + r1y * r1y):
            a = (x1 - x0 - gx * dx - gy * dy) / size
            gx, gy = gx + a * dx, gy + a * dy
        return x1, gx, gy, n1x, n1y

    @inlined
    def face(k, r0x, r0y, r1x, r1y, values):  # type: ignore[no-untyped-def]  # noqa: ARG001
        x0 = f(r0x, r0y, *values)
        n0x, n0y = normal(r0x, r0y, values)
        x1, gx, gy, nx, ny = chord(r0x, r0y, x0, n0x, n0y, r1x, r1y, values)
        e = 1e-5 * (abs(r1x - r0x) + abs(r1y - r0y)) + 1e-9 * (abs(r1x) + abs(r1y)) + 1e-30
        _, ax, ay, _, _ = chord(r0x, r0y, x0, n0x, n0y, r1x + e, r1y, values)
        _, bx, by, _, _ = chord(r0x, r0y, x0, n0x, n0y, r1x, r1y + e, values)
        step = gx * (r1x - r0x) + gy * (r1y - r0y)
        return x0, x1, step, gx, gy, nx, ny, (ax - gx) / e, (bx - gx) / e, (ay - gy) / e, (by - gy) / e

    kind = RegionKind(name or distance.__name__, 1, names, face, distance=f)
    normals = EVERY_WAY if bounded else np.zeros((0, 2))

    def make(*given: Any, **named: Any) -> ConvexRegion:
        values = named_values(f"region {kind.name}", given, named, names)
        if set(values) != set(names):
            raise UserError(f"region {kind.name}: found values {sorted(values)}, expected {list(names)}")
        return ConvexRegion(kind, tuple(_numbers(values[one], f"{kind.name}: {one}") for one in names), normals)

    make.__name__, make.__doc__ = kind.name, f"Return region {kind.name} with {', '.join(names) or 'no values'}."
    return make


def _numbers(value: Any, where: str) -> Any:
    """Return a float, or an array over the members of an ensemble.

    Raises:
        UserError: The value is neither a number nor such an array.
    """
    found = finite(value, where)
    if found.ndim > 1 or not found.size:
        raise UserError(f"{where}: found shape {found.shape}, expected a number, or one for each member")
    return float(found) if found.ndim == 0 else found
