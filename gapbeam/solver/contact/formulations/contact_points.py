"""Contact points of a user's choice: resultant springs at places of the faces, and figures of whole supports.

A force on a single node gives a displacement there that grows without bound as cells shrink, so a resultant F_i is
spread over a patch by a hat function N_i around its place, and its gap is the mean of the gap over the same patch:

    g_i = sum_j P_ij g_j,    P_ij = N_i(x_j) w_j / A_i,    A_i = sum_j N_i(x_j) w_j,

with j the quadrature points of the face. That is G -> P G, g0 -> P g0 and, with friction, T -> P T; the areas A_i stand
instead of w, so that a law F(d) is the pressure F(d) / A_i.

A stiffness k of a whole support, N/m^n, needs weights of contact points whose sum is the same for every section: it is
the law F = k d^n of a beam that lies on it along its length L. With the nominal area A = L b (b the width of the beam)
a law per area has K = k / A, and the weights of the contact points that touch at once add up to A:

    sum_i w_i = A,    F = sum_i w_i K d^n = k d^n

Points of flat faces keep their places. A round or pointed section touches a plane along a line: the points of one
station, at one x, become one whose gap opens by the mean motion of a strip about this line, with hat functions h,

    g_i = g0_i + sum_j P_ij n_j . u_j,    P_ij = h_j w_j / sum_j h_j w_j (n_j . n_i),

and g0 the gap of its outermost point, so that the force does not depend on a chord that grows with the penetration. A
strip that is mirrored about its line passes no moment about the axis. A round hole is met at stations
(`circle_contact`), whose weights are those of the points around it over pi.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix, diags, identity, kron

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.supports.regions.around_face import WallsFace
from gapbeam.solver.supports.support import Face
from gapbeam.solver.system.operators import Array, Indices, Springs
from gapbeam.solver.system.semi_discrete import ContactOperator

Place = float | tuple[float, float]
"""x of a patch over the whole width, or x and y of the center of a patch, m."""


@dataclass(frozen=True, kw_only=True)
class StationOperator(ContactOperator):
    """G, w and g0 at points around sections that keep their shape: a rule along supports that is coarser than a mesh.

    Attributes:
        shares: Shares of a force on each among the quadrature points of the faces, (m, q); rows add up to 1.
    """

    shares: csr_matrix

    def spread(self, forces: Array) -> Array:
        """Return the forces at the quadrature points, (q, ...), N, for those at the points, (m, ...), N."""
        return np.asarray(self._shared_by @ forces)

    @cached_property
    def _shared_by(self) -> csr_matrix:
        """The transpose of `shares`, (q, m)."""
        return self.shares.T.tocsr()


@dataclass(frozen=True, kw_only=True)
class ResultantOperator(StationOperator):
    """G, w and g0 of resultants at places of the faces.

    Attributes:
        distributed: The operator at the quadrature points of the faces, q of them; `shares` are P.
    """

    distributed: ContactOperator

    @property
    def area(self) -> float:
        """Area of all faces, whether in a patch or not, m^2."""
        return self.distributed.area

    def springs(self, stiffness: float | Array) -> Springs:
        """Return springs along the normal of the whole faces, as if there were no patches.

        A quadrature point has the largest stiffness of the points that share it, and the least of all where none does.
        """
        if isinstance(stiffness, np.ndarray):
            least = float(np.min(stiffness))
            shared = self._shared_by.astype(bool).astype(float).multiply(stiffness - least)
            stiffness = least + np.asarray(shared.max(axis=1).todense()).reshape(-1)
        return self.distributed.springs(stiffness)

    def with_gaps_of(self, faces: Sequence[Face]) -> ResultantOperator:
        """Return the operator of the same faces with other gaps."""
        moved = super().with_gaps_of(faces)
        assert isinstance(moved, ResultantOperator)
        return replace(moved, distributed=self.distributed.with_gaps_of(faces))

    def worn(self, depths: Array) -> ResultantOperator:
        """Return the operator with larger gaps, (m,), m, of the quadrature points, too.

        A quadrature point is worn by the mean over the points that share it; one that none shares as the nearest one.
        """
        moved = super().worn(depths)
        assert isinstance(moved, ResultantOperator)
        shared = np.asarray(self.shares.T @ self.weights)
        sums = np.asarray(self.shares.T @ (self.weights * depths))
        below = np.where(shared > 0.0, sums / np.where(shared > 0.0, shared, 1.0), 0.0)
        for point in np.flatnonzero(shared == 0.0):
            mine = np.flatnonzero(self.faces == self.distributed.faces[point])
            apart = np.linalg.norm(self.positions[mine] - self.distributed.positions[point], axis=1)
            below[point] = depths[mine[np.argmin(apart)]]
        return replace(moved, distributed=self.distributed.worn(below))

    def spread(self, forces: Array) -> Array:
        """Return P^T f, the forces at the quadrature points, (q, ...), N, for resultants f, (m, ...), N."""
        return self.distributed.spread(super().spread(forces))


@dataclass(frozen=True, kw_only=True)
class ElementOperator(ResultantOperator):
    """G, w and g0 at a few points of each element, whose motion follows from that at its points of the mesh."""


def resultant_operator(contact: ContactOperator, places: Sequence[Place], size: float) -> ResultantOperator:
    """Gather contact at quadrature points into resultants, at the same places of every face.

    The position of a resultant is the mean of its patch, so that its moment is that of what it is spread over. At the
    end of a face only half a hat is left, and its mean lies size / 6 inside.

    Args:
        contact: G, w and g0 at the quadrature points.
        places: Places of the resultants.
        size: Length of a patch along x and, for places [x, y], across, m.

    Raises:
        UserError: A patch holds no quadrature point.

    Not collective: the operator is the same on all ranks.
    """
    hats = np.array([_hat(contact.positions, place, size) for place in places])
    faces = range(len(contact.face_names))
    weighted = np.concatenate([np.where(contact.faces == face, hats * contact.weights, 0.0) for face in faces])
    areas = weighted.sum(axis=1)
    _no_patch_is_empty(contact, places, areas.reshape(-1, len(places)), size)
    return mean_operator(contact, csr_matrix(weighted / areas[:, None]), areas, np.repeat(faces, len(places)))


def mean_operator(
    contact: ContactOperator, shares: csr_matrix, areas: ArrayLike, faces: Sequence[int] | Indices,
    kind: type[ResultantOperator] = ResultantOperator,
) -> ResultantOperator:  # fmt: skip
    """Return the operator at means over points, P G, P g0, P T; with areas, m^2, and the index of each face, (m,)."""
    tangents = contact.tangents
    if tangents is not None:
        tangents = csr_matrix(sliding_shares(shares, tangents.shape[0] // contact.size) @ tangents)
    return kind(
        interface=contact.interface,
        gap_matrix=csr_matrix(shares @ contact.gap_matrix),
        weights=np.asarray(areas, dtype=float),
        initial_gap=np.asarray(shares @ contact.initial_gap),
        faces=np.asarray(faces),
        support=contact.support,
        positions=np.asarray(shares @ contact.positions),
        tangents=tangents,
        frictionless=contact.frictionless,
        distributed=contact,
        shares=shares,
    )


def shares_of(rows: Sequence[tuple[Indices, Array]], count: int) -> csr_matrix:
    """Return P, (m, count), from the points of each mean and their shares."""
    points, shares = ([row[part] for row in rows] for part in (0, 1))
    ends = np.cumsum([0, *map(len, points)])
    return csr_matrix((np.concatenate(shares), np.concatenate(points), ends), (len(rows), count))


def sliding_shares(shares: csr_matrix, directions: int) -> csr_matrix:
    """Return the shares of points in the motion along the face, (m k, q k), for shares P, (m, q), in the gap.

    Along x they add up to 1. Those of a strip on a round section do not in P, whose points move around it otherwise.
    """
    along = np.repeat(1.0 / np.asarray(shares.sum(axis=1)).reshape(-1), directions)
    along[np.arange(len(along)) % directions > 0] = 1.0
    return csr_matrix(diags(along) @ kron(shares, identity(directions)))


def _hat(positions: Array, place: Place, size: float) -> Array:
    """Return the product of hats (1 - |x - x_i| / (size / 2))+ at positions (q, 3), (q,)."""
    center = np.atleast_1d(place)
    apart = np.abs(positions[:, : len(center)] - center) / (0.5 * size)
    return np.asarray(np.prod(np.maximum(1.0 - apart, 0.0), axis=1))


def _no_patch_is_empty(contact: ContactOperator, places: Sequence[Place], areas: Array, size: float) -> None:
    empty = [
        f"{place} at the {name}"
        for name, row in zip(contact.face_names, areas, strict=True)
        for place, area in zip(places, row, strict=True)
        if not area > 0.0
    ]
    if empty:
        raise UserError(
            f"[contact] points: no quadrature point lies in the patch around {', '.join(empty)}\n"
            f"  found:    patches of {size:g} m, and cells too large for them\n"
            "  expected: several quadrature points of the contact face in every patch\n"
            f"  try:      mesh.support_size = {0.5 * size:g}, or a larger contact.patch"
        )


STRIP = 0.25  # half the width of a strip over the largest distance of points from its line
FLAT = 0.05  # share of a line across that is even, from which on it is flat
EVEN = 1.0e-6  # of the length of the support: initial gaps that differ by less are one
SAME_PLACE = 1.0e-9  # of the length of the support: at one x
FEWEST = 3  # points at one x, on average, of a mesh whose points lie on lines across
TOGETHER = 16  # points of other meshes that make a station

Row = tuple[Indices, Array, float, Array]
"""Points with their shares, the initial gap, m, and the place of a contact point."""


def whole_contact(contact: ContactOperator, areas: Sequence[float | None], on_lines: bool = False) -> ContactOperator:
    """Return the operator whose points of some faces add up to nominal areas; itself where no face asks for it.

    Args:
        contact: The operator at the points of the mesh.
        areas: Nominal area of each face, m^2; None: the face keeps its points.
        on_lines: Whether the sections there are round, so that planes meet them along lines, too.

    Not collective: the operator is the same on all ranks.
    """
    if all(area is None for area in areas):
        return contact
    rows, weights, owners = list[Row](), list[float](), list[int]()
    for number, (face, area) in enumerate(zip(contact.support.faces, areas, strict=True)):
        here = contact.points_of_faces[number]
        if area is None:
            found, sizes = [_kept(contact, point) for point in here], contact.weights[here]
        elif face.circle:
            sizes = contact.weights[here] * (np.pi * area / contact.weights[here].sum())
            found = [_kept(contact, point) for point in here]
        else:
            parts = [_touching(contact, face, group, along, on_lines) for group, along in _groups(contact, face, here)]
            found = [row for part, _ in parts for row in part]
            sizes = np.concatenate([size * (area / size.sum()) for _, size in parts])
        rows += found
        weights += [float(size) for size in sizes]
        owners += [number] * len(found)
    means = mean_operator(contact, shares_of([row[:2] for row in rows], contact.size), weights, owners)
    gaps, places = np.array([gap for *_, gap, _ in rows]), np.array([place for *_, place in rows])
    return replace(means, initial_gap=gaps, positions=places)


def _kept(contact: ContactOperator, point: int) -> Row:
    return np.array([point]), np.ones(1), float(contact.initial_gap[point]), contact.positions[point]


def _groups(contact: ContactOperator, face: Face, here: Indices) -> Iterator[tuple[Indices, Array]]:
    """Yield the points that one wall of a face meets, with the unit vector (y, z) across the beam along the wall."""
    if isinstance(face, WallsFace):
        walls, normals = face.wall_of(contact.positions[here]), face.normals(contact.positions[here])
        for wall in np.unique(walls):
            y, z = normals[walls == wall][0]
            yield here[walls == wall], np.array([-z, y])
        return
    yield here, np.array([1.0, 0.0])


def _touching(
    contact: ContactOperator, face: Face, group: Indices, along: Array, on_line: bool
) -> tuple[list[Row], Array]:
    """Return the contact points of what one wall meets, with the areas that they stand for, (k,), m^2."""
    places, weights = contact.positions[group], contact.weights[group]
    rise = face.side * face.rise(places)
    gaps, length = contact.initial_gap[group] + rise, float(np.ptp(places[:, 0])) or 1.0
    stations, aligned = _stations(places[:, 0], length)
    outermost = np.full(len(group), gaps.min())
    if aligned:
        for one in stations:
            outermost[one] = gaps[one].min()
    even = gaps - outermost <= EVEN * length
    if not (face.around or on_line) and weights[even].sum() > FLAT * weights.sum():
        flat = np.flatnonzero(even)
        return [_kept(contact, group[point]) for point in flat], weights[flat]
    sideways = places[:, 1:] @ along
    line = 0.0 if face.around else float(np.average(sideways[even], weights=weights[even]))  # round sections are
    aside = sideways - line
    rows, sizes = list[Row](), list[float]()
    for one in _across(stations, aside):
        shares = _strip(aside[one], weights[one], STRIP * float(np.abs(aside).max()))
        taken, shares = one[shares != 0.0], shares[shares != 0.0]
        first = one[np.argmin(gaps[one])]
        across = places[first, 1:] + (line - sideways[first]) * along
        place = np.array([float(np.average(places[one, 0], weights=weights[one])), *across])
        opening = contact.support.opening(contact.faces[group[:1]], place[None])[0]
        toward = contact.support.opening(contact.faces[group[taken]], places[taken]) @ opening
        level = outermost[first] - face.side * float(face.rise(place[None])[0])
        rows.append((group[taken], shares / float(shares @ toward), level, place))
        sizes.append(float(weights[one].sum()))
    return rows, np.array(sizes)


def _stations(x: Array, length: float) -> tuple[list[Indices], bool]:
    """Return points in the order along the beam, those at one x together, or a few each where hardly any x is equal."""
    order = np.argsort(x, kind="stable")
    breaks = np.flatnonzero(np.diff(x[order]) > SAME_PLACE * length) + 1
    if FEWEST * (len(breaks) + 1) <= len(x):
        return np.split(order, breaks), True
    return np.array_split(order, max(1, len(x) // TOGETHER)), False


def _across(stations: Sequence[Indices], aside: Array) -> list[Indices]:
    """Return stations that reach to both sides of the line; those that do not are joined with their neighbors."""
    found, waiting = list[Indices](), np.zeros(0, dtype=np.int64)
    for one in stations:
        waiting = np.concatenate([waiting, one])
        if aside[waiting].min() <= 0.0 <= aside[waiting].max():
            found.append(waiting)
            waiting = np.zeros(0, dtype=np.int64)
    if len(waiting):
        found = [*found[:-1], np.concatenate([*found[-1:], waiting])]
    return found


def _strip(aside: Array, weights: Array, half: float) -> Array:
    """Return shares of the points of a station in a strip about the line, whose mean lies on it, (m,), with sum 1.

    The strip reaches at least to a point on each side of the line.
    """
    sides = [side for side in (aside <= 0.0, aside >= 0.0) if np.any(side)]
    nearest = max(float(np.abs(aside[side]).min()) for side in sides)
    shares = weights * np.maximum(1.0 - np.abs(aside) / max(half, 2.0 * nearest), 0.0)
    left, right = aside < 0.0, aside > 0.0
    moments = float(-shares[left] @ aside[left]), float(shares[right] @ aside[right])
    if min(moments) > 0.0:
        shares[left] *= moments[1] / max(moments)
        shares[right] *= moments[0] / max(moments)
    return np.asarray(shares / shares.sum())
