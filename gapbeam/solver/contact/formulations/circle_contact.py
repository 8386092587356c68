"""Contact of round sections in round holes without points around them: one contact at each station along the hole.

With r the place of the axis of the section across the beam, measured from the middle of the hole, c the clearance and
x = |r| - c the penetration, a step from r0 to r1 has the force

    F = -N z / s,    z = r0 + r1,    s = |r0| + |r1|,    N = w P(x0, x1),

P being the law of any other contact point. Since (r0 + r1) . (r1 - r0) = (|r1| - |r0|) s, the force does the work -N
(x1 - x0): it keeps the energy that P keeps, and z x F = 0 keeps the angular momentum of the axis about the middle. For
the directions o = -z / s of a step, the gap is linear, g1 = g0 + o . (r1 - r0), and the step is solved like contact at
points that do not turn; o is found by iteration (`march.python.march`). Holes that move or open have the r and c
of the time; over a step, walls then open the gap by c1 - c0 - o . (m1 - m0) with m the middle of the hole.

The area of a station is the projected one, diameter times length. Points around the section come near a circle as
their number grows; here it is one. What is left out is that a wall that gives way touches on a wider part of the
circumference as it is pressed: N is linear in x where P is.

Source: LaBudde and Greenspan (1976), Numerische Mathematik 25, 323-346, for the discrete force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import pi

import numpy as np
from scipy.sparse import csr_matrix, vstack

from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.supports.regions.around_face import AroundFace
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.circles import DOWN, Circles, unit_vectors
from gapbeam.solver.system.operators import Array, Indices, Reactions, Springs, Walls
from gapbeam.solver.system.semi_discrete import ContactOperator, spring_matrix

SAME_PLACE = 1.0e-9  # of the length over which points stand: at one x
RIGID = 1.0e-8  # of the largest entry: what points of one section may move apart by round-off


def stations_of(points: ContactOperator, chosen: Indices) -> list[Indices]:
    """Return the points at one x of one face each."""
    found, length = list[Indices](), max(float(np.ptp(points.positions[:, 0])), np.finfo(float).tiny)
    for face in np.unique(points.faces[chosen]):
        here = chosen[points.faces[chosen] == face]
        here = here[np.argsort(points.positions[here, 0], kind="stable")]
        breaks = np.flatnonzero(np.diff(points.positions[here, 0]) > SAME_PLACE * length) + 1
        found += np.split(here, breaks)
    return found


def section_motions(points: ContactOperator, members: Indices, deforms: bool = False) -> tuple[Array, Array]:
    """Return the rows of a section: of its axis, (2, size), and of its surface, (4, size), if there are tangents.

    Args:
        points: The operator at points around sections.
        members: The points of the section.
        deforms: Whether points may move apart: the rows are then those of the best fit by least squares.
    """
    limit = np.inf if deforms else RIGID
    across, gaps = points.across[members], points.gap_matrix[members].toarray()
    plane = _fitted(across, gaps, points, members, limit)
    if points.tangents is None:
        return plane, np.zeros((0, plane.shape[1]))
    along, around = (points.tangents[2 * members + axis].toarray() for axis in (0, 1))
    basis, sideways, arms = surface_basis(points, members)
    axial = _fitted(basis, along, points, members, limit)
    turn = _fitted(arms, around - sideways @ plane, points, members, limit, float(np.abs(around).max()))
    return plane, np.concatenate([axial, turn])


def surface_basis(points: ContactOperator, members: Indices) -> tuple[Array, Array, Array]:
    """Return the motions of points of a section along faces, by those of the section.

    Along x with the axis and its changes along y and z, (m, 3); around the section with the axis along y and z,
    (m, 2), and with a rotation about x, (m, 1).
    """
    across, spots = points.across[members], points.positions[members, 1:]
    sideways = np.stack([-across[:, 1], across[:, 0]], axis=1)
    arms = sideways[:, 1] * spots[:, 0] - sideways[:, 0] * spots[:, 1]
    return np.column_stack([np.ones(len(members)), spots]), sideways, arms[:, None]


def _fitted(
    basis: Array, rows: Array, points: ContactOperator, members: Indices, limit: float, largest: float = 0.0
) -> Array:
    """Return the rows, (b, size), of which all rows, (m, size), are combinations with `basis`, (m, b)."""
    found = np.linalg.lstsq(basis, rows)[0]
    if np.abs(basis @ found - rows).max() > limit * max(float(np.abs(rows).max()), largest):
        name, x = points.face_names[points.faces[members[0]]], points.positions[members[0], 0]
        raise UserError(
            f"{name} at x = {x:.4g} m is met as a circle, and the section there does not keep its shape\n"
            "  expected: a model whose sections keep it\n"
            '  try:      contact = "points" in the region of the support'
        )
    return np.asarray(found)


@dataclass(frozen=True, kw_only=True)
class CircleOperator(ContactOperator):
    """G, w and g0 with stations in round holes; G takes the directions `opening`.

    Attributes:
        around: The operator at points around the sections.
        kept: The points of it that are contact points here, too: those at other supports, (m - k,).
        circles: The stations.
        opening: y and z of the directions of all contact points that G holds for, (m, 2).
        sections: Whether springs at the points around a station act on the two motions of its section: the points are
            those of `around`, and sections keep their shape.
    """

    around: ContactOperator
    kept: Indices
    circles: Circles = field()  # required: the default would be what other operators have
    opening: Array
    sections: bool = False

    @property
    def surfaces(self) -> Array:
        """Areas of points, and those all around the sections of stations, (m,), m^2."""
        found = self.weights.copy()
        found[self.circles.points] *= pi
        return found

    @property
    def area(self) -> float:
        """Area of all faces, m^2."""
        return self.around.area

    @cached_property
    def across(self) -> Array:
        """Unit vectors along `opening`, (m, 2)."""
        return unit_vectors(self.opening, np.zeros(2))

    @cached_property
    def others(self) -> Indices:
        """The contact points that are no stations, in the order of `kept`, (m - k,)."""
        return np.setdiff1d(np.arange(self.size), self.circles.points)

    def turned(self, opening: Array | None) -> CircleOperator:
        """Return the operator with other directions of the stations, (k, 2), of a length of up to 1; None: the same."""
        if opening is None:
            return self
        circles, count, size = self.circles, self.size, self.interface.size
        stations = np.arange(len(circles.points))
        rows = csr_matrix(
            (
                opening.reshape(-1),
                (np.repeat(circles.points, 2), np.stack([2 * stations, 2 * stations + 1], axis=1).reshape(-1)),
            ),
            (count, 2 * len(stations)),
        )
        stay = csr_matrix((np.ones(len(self.kept)), (self.others, self.kept)), (count, self.around.size))
        everywhere = self.opening.copy()
        everywhere[circles.points] = opening
        tangents = self.tangents
        if tangents is not None and circles.surface is not None:
            tangents = self._tangents(opening)
        gaps = csr_matrix(stay @ self.around.gap_matrix + rows @ circles.plane, shape=(count, size))
        return replace(self, gap_matrix=gaps, tangents=tangents, opening=everywhere, walls=self._walls(opening))

    def _walls(self, opening: Array) -> Walls:
        """Return the motions of walls with the openings along directions of the stations, (k, 2)."""
        if not self.walls.motions or len(self.circles.shifts) == 0:
            return self.walls
        growths = self.walls.growths.copy()
        growths[:, self.circles.points] = self.circles.growths(opening)
        return replace(self.walls, growths=growths)

    def at(self, interface_values: Array, time: float = 0.0) -> CircleOperator:
        """Return the operator in a state: stations open toward the middle of their holes."""
        circles = self.circles_at(time)
        return self.turned(-circles.directions(circles.places(interface_values)))

    def _tangents(self, opening: Array) -> csr_matrix:
        """Return T: along the beam and around the section, of all points, (2m, interface.size)."""
        circles = self.circles
        assert circles.surface is not None
        assert self.around.tangents is not None
        unit, others = unit_vectors(opening, -DOWN), self.others
        k, touched = len(unit), -circles.radii[:, None] * unit
        numbers, ones = np.arange(k), np.ones(k)
        along = _rows(np.column_stack([ones, touched, np.zeros(k)]), 4 * numbers, 4 * k)
        turn = _rows(-circles.radii[:, None], 4 * numbers + 3, 4 * k)
        sideways = _rows(np.column_stack([-unit[:, 1], unit[:, 0]]), 2 * numbers, 2 * k)
        of_circles = (along @ circles.surface, turn @ circles.surface + sideways @ circles.plane)
        total = csr_matrix((2 * self.size, self.interface.size))
        for axis, rows in enumerate(of_circles):
            here = csr_matrix((ones, (2 * circles.points + axis, numbers)), (2 * self.size, k))
            there = csr_matrix(
                (np.ones(len(others)), (2 * others + axis, 2 * self.kept + axis)), (2 * self.size, 2 * self.around.size)
            )
            total = total + here @ rows + there @ self.around.tangents
        return csr_matrix(total)

    def depth(self, interface_values: Array, time: float = 0.0) -> Array:
        """Return the penetration, |r| - c at stations, (m,), m."""
        found = super().depth(interface_values, time)
        circles = self.circles_at(time)
        found[circles.points] = circles.penetrations(circles.places(interface_values))
        return found

    def penetration(self, interface_values: Array, time: float = 0.0) -> Array:
        """Return the same."""
        return self.depth(interface_values, time)

    def added_up(self, sizes: Array) -> Array:
        """Return the sums of the sizes of all terms, those of y and z at stations, (m,), m."""
        found, circles = super().added_up(sizes), self.circles
        both = (abs(circles.plane) @ sizes).reshape(-1, 2) + np.abs(circles.middles)
        found[circles.points] = both.sum(axis=1) + np.abs(circles.clearances)
        return found

    def springs(self, stiffness: float | Array) -> Springs:
        """Return springs along the normals of the whole faces; points around a section share that of its station."""
        if isinstance(stiffness, np.ndarray):
            everywhere = np.empty(self.around.size)
            everywhere[self.kept] = stiffness[self.others]
            for point, members in zip(self.circles.points, self.circles.members, strict=True):
                everywhere[members] = stiffness[point]
            stiffness = everywhere
        return self._section_springs(stiffness) if self.sections else self.around.springs(stiffness)

    def _section_springs(self, stiffness: float | Array) -> Springs:
        """Return springs at the points around sections that keep their shape.

        With c the directions and s the springs of the points around a station, and P the motions of its section along y
        and z, they are P^T L D L^T P, L D L^T = sum_i s_i c_i c_i^T: two rows of a dense basis for each station, fewer
        than its points.

        Args:
            stiffness: One for all points of `around`, or that of each, Pa/m.
        """
        around, circles = self.around, self.circles
        springs = stiffness * around.weights
        sums = [around.across[one].T @ (springs[one, None] * around.across[one]) for one in circles.members]
        along, across, mixed = (np.array([found[at] for found in sums]) for at in ((0, 0), (1, 1), (0, 1)))
        shares = np.divide(mixed, along, out=np.zeros_like(mixed), where=along > 0.0)
        first = circles.plane[::2] + circles.plane[1::2].multiply(shares[:, None])
        rows = vstack([first, circles.plane[1::2], around.gap_matrix[self.kept]], format="csr")
        sizes = [along, np.maximum(across - shares * mixed, 0.0), springs[self.kept]]
        return Springs(self.interface, spring_matrix(rows, np.concatenate(sizes)))

    def holding(self, forces: Array, interface_values: Array) -> csr_matrix:
        """Return the stiffness that contact forces N at rest add as they turn, (interface.size, interface.size).

        sum N / |r| t t^T with t across the direction of each station.

        Args:
            forces: N, (m,), N.
            interface_values: Motions of the interface at which the contact forces act.
        """
        circles = self.circles
        places = circles.places(interface_values)
        unit = circles.directions(places)
        rates = np.maximum(forces[circles.points], 0.0) / np.maximum(np.hypot(*places.T), np.abs(circles.clearances))
        sideways = _rows(np.column_stack([-unit[:, 1], unit[:, 0]]), 2 * np.arange(len(unit)), 2 * len(unit))
        return spring_matrix(csr_matrix(sideways @ circles.plane), rates)

    def with_gaps_of(self, faces: Sequence[Face]) -> CircleOperator:
        """Return the operator of the same faces with other gaps."""
        moved = super().with_gaps_of(faces)
        assert isinstance(moved, CircleOperator)
        middles, clearances = _holes(moved.support, moved.faces, moved.positions, self.circles.points)
        circles = replace(self.circles, middles=middles, clearances=clearances)
        return replace(moved, around=self.around.with_gaps_of(faces), circles=circles)

    def spread(self, forces: Array) -> Array:
        """Return the forces at the points where the faces were integrated, (q,) or (q, times), N.

        A station shares its force among the points around it by the cosine of their angle to its direction.
        """
        circles = self.circles
        found = np.zeros((self.around.size, *forces.shape[1:]))
        found[self.kept] = forces[self.others]
        for point, members in zip(circles.points, circles.members, strict=True):
            share = self.around.weights[members] * np.maximum(self.around.across[members] @ self.across[point], 0.0)
            found[members] = np.multiply.outer(share / share.sum(), forces[point])
        return self.around.spread(found)

    def reactions(self, found: Reactions) -> Reactions:
        """Return the reactions of joints to forces at these points, of those to forces at the points of `around`.

        Forces on a section that keeps its shape are the sums of forces at its points.
        """
        r, circles, rubs = len(found.pressure), self.circles, self.rubbed is not None
        pressure, friction = np.zeros((r, self.size)), np.zeros((r, self.size, 2 * rubs))
        rubbed = found.friction.reshape(r, self.around.size, -1)
        pressure[:, self.others], friction[:, self.others] = found.pressure[:, self.kept], rubbed[:, self.kept]
        stations = np.zeros((r, len(circles), 6))
        for number, (members, radius) in enumerate(zip(circles.members, circles.radii, strict=True)):
            across = self.around.across[members]
            plane = np.linalg.lstsq(across, found.pressure[:, members].T)[0]
            stations[:, number, :2] = plane.T
            if rubs:
                basis, sideways, arms = surface_basis(self.around, members)
                axial = np.linalg.lstsq(basis, rubbed[:, members, 0].T)[0]
                turn = np.linalg.lstsq(arms, rubbed[:, members, 1].T - sideways @ plane)[0]
                stations[:, number, 2:] = np.concatenate([axial[:1], -radius * axial[1:], -radius * turn]).T
        return replace(found, pressure=pressure, friction=friction.reshape(r, -1), stations=stations.reshape(r, -1))


def circle_contact(points: ContactOperator, exact: Sequence[bool], deforms: bool = False) -> CircleOperator:
    """Return contact with one station for all points at one x of the faces that are met as circles.

    Args:
        points: The operator at points around sections that keep their shape.
        exact: Whether each face is met as a circle.
        deforms: Whether sections deform: a station then moves as the rigid section that fits its points best.

    Raises:
        UserError: The points of a section do not move together.

    Not collective.
    """
    chosen = np.asarray(exact)[points.faces]
    kept = np.flatnonzero(~chosen)
    members = tuple(stations_of(points, np.flatnonzero(chosen)))
    planes, surfaces = zip(*(section_motions(points, one, deforms) for one in members), strict=True)
    size = points.interface.size
    rings = np.array([int(points.faces[one[0]]) for one in members])
    radii = np.array([float(np.hypot(*points.positions[one, 1:].T).mean()) for one in members])
    x = np.array([float(points.positions[one, 0].mean()) for one in members])
    positions = np.concatenate([points.positions[kept], np.column_stack([x, np.zeros(len(x)), -radii])])
    faces = np.concatenate([points.faces[kept], rings])
    stations = len(kept) + np.arange(len(members))
    middles, clearances = _holes(points.support, faces, positions, stations)
    circles = Circles(
        stations,
        members,
        csr_matrix(np.concatenate(planes)),
        None if points.tangents is None else csr_matrix(np.concatenate(surfaces)),
        radii,
        middles,
        clearances,
    )
    areas = np.array([points.weights[one].sum() / pi for one in members])
    initial = np.concatenate([points.initial_gap[kept], -circles.penetrations(-middles)])
    opening = np.concatenate([points.across[kept], np.tile(-DOWN, (len(members), 1))])
    empty = csr_matrix((len(faces), size))
    contact = CircleOperator(
        interface=points.interface,
        gap_matrix=empty,
        weights=np.concatenate([points.weights[kept], areas]),
        initial_gap=initial,
        faces=faces,
        support=points.support,
        positions=positions,
        tangents=None if points.tangents is None else csr_matrix((2 * len(faces), size)),
        walls=points.walls,
        frictionless=points.frictionless,
        measures_sliding=points.measures_sliding,
        slip_modes=points.slip_modes,
        around=points,
        kept=kept,
        circles=circles,
        opening=opening,
        sections=not deforms and not isinstance(points, ResultantOperator),
    )
    return contact.turned(opening[stations])


def _holes(support: Support, faces: Indices, positions: Array, stations: Indices) -> tuple[Array, Array]:
    """Return the middles of holes, (k, 2), and their clearances, (k,), m."""
    middles, clearances = list[tuple[float, float]](), list[float]()
    for point in stations:
        face = support.faces[faces[point]]
        assert isinstance(face, AroundFace)
        lift = face.offset + float(face.rise(positions[point : point + 1])[0])
        middles.append((face.lateral, lift))
        clearances.append(face.gap)
    return np.array(middles), np.array(clearances)


def _rows(values: Array, first: Indices, columns: int) -> csr_matrix:
    """Return a matrix with some neighbors in each row, (k, columns)."""
    count, width = values.shape
    places = first[:, None] + np.arange(width)
    return csr_matrix((values.reshape(-1), (np.repeat(np.arange(count), width), places.reshape(-1))), (count, columns))
