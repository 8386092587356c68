"""Frames in space as structures: Timoshenko elements along routes with elbows, six motions a node.

An elbow of a tube ovalizes as it bends, and is softer than its section: its flexibility in bending is multiplied by

    k = 1.65 / h >= 1,     h = t R / r^2,

with wall t, bend radius R and mean radius r of the tube. Source: Clark and Reissner (1951), Adv. Appl. Mech. 2, 93, in
the form of ASME B31.3, appendix D. Ends that flanges stiffen, and internal pressure, are not in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, pi
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, null_space, qr

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam
from gapbeam.solver.scene.argument_checks import ArgumentError, check_section, checked, finite, positive, shown
from gapbeam.solver.scene.beam_structure import driven_rows, element_count, refuse_buckling, section_table
from gapbeam.solver.scene.frame_hinges import MOTIONS, hinges_of, tie_of
from gapbeam.solver.scene.frame_route import SAME, FrameAxes, FrameRoute, RoutePart, Station
from gapbeam.solver.scene.structure import LARGE, Structure
from gapbeam.solver.scene.structure_geometry import ALONG, StructureGeometry, directions_across
from gapbeam.solver.scene.support_force import support_force
from gapbeam.solver.scene.surface_stress import end_forces, gauge_rows, mean_of_sides, surface_rows
from gapbeam.solver.system.operators import Array

ANGLE = pi / 16.0
"""Largest angle of a bend that an element spans."""
STRONG, WEAK = [2, 4, 8, 10], [1, 5, 7, 11]  # u_z, r_y and u_y, r_z of both ends
AXIAL, TWIST = [0, 6], [3, 9]


class SpaceSection(NamedTuple):
    """Figures of a cross-section that bends both ways and carries twist and tension.

    Attributes:
        area: m^2.
        second_moment: Second moment of area for bending along the thickness, m^4.
        lateral_moment: Second moment of area for bending along the width, m^4.
        torsion_constant: m^4.
        shear_area: Area that carries shear along the thickness, m^2; infinite: shear does not strain.
        lateral_shear_area: Shear area along the width.
        mean_radius: Mean radius of a tube, m; 0: no tube, whose elbows do not ovalize.
        wall: Wall of a tube, m.
        diameter: Outer diameter of a round section or a tube, for stresses, m; 0: it is another section.
    """

    area: float
    second_moment: float
    lateral_moment: float
    torsion_constant: float
    shear_area: float = inf
    lateral_shear_area: float = inf
    mean_radius: float = 0.0
    wall: float = 0.0
    diameter: float = 0.0

    def flexibility(self, radius: float) -> float:
        """Return the flexibility factor of an elbow of a bend radius, m; 1 where the section is no tube."""
        if not self.mean_radius > 0.0:
            return 1.0
        return max(1.0, 1.65 * self.mean_radius**2 / (self.wall * radius))


@checked
def space_section(
    type: str,  # noqa: A002 - as the key is called
    thickness: float,
    width: float | None = None,
    poisson_ratio: float = 0.3,
    **values: Any,
) -> SpaceSection:
    """Return the figures of a section in space; see `section` for its arguments.

    Raises:
        UserError: The type is unknown, or a key is.
    """
    table, size = section_table(type, thickness, width, values)
    return space_figures(table, *size, poisson_ratio)


def space_figures(table: Any, thickness: float, width: float, poisson_ratio: float) -> SpaceSection:
    """Return the figures of a section's table at outer sizes, m."""
    area, size = table.area(thickness, width), (thickness, width)
    wall = table.wall if table.type == "tube" else 0.0
    return SpaceSection(
        area,
        table.second_moment(*size),
        table.lateral_moment(*size),
        table.torsion_constant(*size),
        area * table.shear_coefficient(*size, poisson_ratio),
        area * table.lateral_shear_coefficient(*size, poisson_ratio),
        0.5 * (thickness - wall) if wall else 0.0,
        wall,
        thickness if table.round else 0.0,
    )


@dataclass(frozen=True)
class Member:
    """A part of a frame along a route of its own; see `frame` for its attributes.

    Attributes:
        route: Its ends and corners, (count, 3), m.
        section: Its cross-section.
        material: Its material.
        bends: Radius of its bends, m.
        flexibility: Factor of its elbows.
        up: Direction of its thickness.
        hinged: Ends of a branch that bend freely: "start", "end" or both; twist is carried over.
        added_mass: Added mass of a fluid that moves with it across its axis.
        tension: Axial preload of a straight member.
    """

    route: Sequence[Sequence[float]]
    section: SpaceSection
    material: Material
    bends: float | Sequence[float] = 0.0
    flexibility: float | None = None
    up: Sequence[float] = (0.0, 0.0, 1.0)
    hinged: Sequence[Literal["start", "end"]] = ()
    added_mass: float = 0.0
    tension: float = 0.0


@checked
def frame(
    route: Sequence[Sequence[float]],
    section: SpaceSection,
    material: Material,
    points: Mapping[str, tuple[Station, ArrayLike]],
    *,
    bends: float | Sequence[float] = 0.0,
    flexibility: float | None = None,
    clamped: Sequence[Station] = (),
    pinned: Sequence[Station] = (),
    held: Sequence[tuple[Station, ArrayLike]] = (),
    up: Sequence[float] = (0.0, 0.0, 1.0),
    branches: Sequence[Member] = (),
    elements: int | None = None,
    added_mass: float = 0.0,
    tension: float = 0.0,
    name: str = "",
    driven: Mapping[str, Station] = MappingProxyType({}),
    gauges: Sequence[str] = (),
    reactions: Mapping[str, Station] = MappingProxyType({}),
) -> Structure:
    """Return a frame in space: beams that bend both ways and carry twist and tension along a route and its branches.

    Weight and base motions act along any direction of space. Nodes stand at all points and supports.

    Args:
        route: Its ends and corners, (count, 3), m.
        section: Result of `space_section`, or own figures.
        material: Result of `material`.
        points: Place and direction of each point by name: the direction, (3,), or two at right angles, (2, 3), of its
            motions. Six numbers are a motion and a rotation: (0, 0, 0, 0, 0, 1) is the rotation about z, rad.
        bends: Radius of the bends at the corners, m: one for all, or one for each; 0: sharp corners that are rigid.
        flexibility: Factor of all elbows; default by the standard formula for tubes, 1 for other sections.
        clamped: Places that neither move nor rotate.
        pinned: Places that do not move.
        held: Places that do not move in some directions, (place, directions).
        up: Direction of the thickness, for sections that are not as stiff both ways.
        branches: More members. They are joined rigidly where an end of one lies on the axis of another, except for ends
            that are hinged.
        elements: About so many along all members; default 40. Bends have one for each pi / 16 at least.
        added_mass: Mass of a fluid that moves with the member across its axis, per length, kg/m; it has no weight.
        tension: Axial preload of a straight member, which keeps its direction and size, N; below 0: compression.
        name: Name of the structure.
        driven: Places of supports that move along x, y and z by name; see `beam`.
        gauges: Points whose stress is recorded: at the surface on the side of each of their directions, of round
            sections, without what ovalization adds in elbows.
        reactions: Places of supports whose force and moment are recorded, by name. `Structure.reduced` drops them where
            it leaves out modes.

    Raises:
        UserError: A route is none, a place is off the route, a direction is none, a branch meets no other member, all
            members at a joint are hinged, a preload is not of a straight member or supports let it tilt,
            compression buckles it, a stress is not known, or a reaction is of a place that nothing holds.
    """
    where = f"frame {name or '?'}"
    members = (Member(route, section, material, bends, flexibility, up, (), added_mass, tension), *branches)
    axes = frame_axes([(one.route, one.bends) for one in members], where)
    placed = {key: _placed(one, f"{where}: point {key}") for key, one in points.items()}
    known = {key: axes.along(at, f"{where}: point {key}", f"points.{key}") for key, (at, _) in placed.items()}
    fixed = [(at, np.eye(3), kind == "clamped") for kind, group in (("clamped", clamped), ("pinned", pinned))
             for at in group]  # fmt: skip
    pairs = [_placed(one, f"{where}: support") for one in held]
    fixed += [(at, _directions(way, f"{where}: support", (3,)), False) for at, way in pairs]
    supports = [(axes.along(at, f"{where}: support"), ways, rotates) for at, ways, rotates in fixed]
    longest = axes.length / element_count(elements, where)
    stations = axes.stations([*known.values(), *(at for at, _, _ in supports)], longest, ANGLE)
    nodes = axes.nodes(stations)
    x = np.empty((1 + max(int(some.max()) for some in nodes), 3))
    for route_of, s, some in zip(axes.routes, stations, nodes, strict=True):
        x[some] = [route_of.at(float(one)) for one in s]
    hinges, own = hinges_of(members, axes, nodes, where)
    every = x[[*range(len(x)), *(one.node for one in hinges)]]
    tie = tie_of(len(x), hinges)
    K, M, fluid = (tie.T @ one @ tie for one in _assembled(members, axes, stations, own, every, where))
    size = MOTIONS * len(x)

    def node_at(along: tuple[int, float]) -> int:
        return int(nodes[along[0]][np.abs(stations[along[0]] - along[1]).argmin()])

    C: Array = np.zeros((0, size))
    for at, ways, rotates in supports:
        node = node_at(at)
        stays: Array = np.zeros((len(ways) + 3 * rotates, size))
        stays[: len(ways), MOTIONS * node : MOTIONS * node + 3] = ways
        if rotates:
            stays[len(ways) :, MOTIONS * node + 3 : MOTIONS * node + 6] = np.eye(3)
        C = np.vstack([C, stays])
    Z, R = _free(C), _rigid(x)
    if hinges:
        Z = sp.csr_matrix(sp.block_diag([Z, sp.identity(tie.shape[1] - size)]))
        R = np.vstack([R, *(np.hstack([np.zeros((2, 3)), one.across]) for one in hinges)])
        C = np.hstack([C, np.zeros((len(C), tie.shape[1] - size))])
    left = null_space(C @ R) if len(C) else np.eye(MOTIONS)
    rows_of: dict[str, Array] = {}
    drawn: dict[str, tuple[Array, Array]] = {}
    for key, (_, way) in placed.items():
        node = node_at(known[key])
        ways = _directions(way, f"{where}: point {key}", (3, MOTIONS), f"points.{key}")
        rows_of[key] = np.zeros((len(ways), tie.shape[1]))
        rows_of[key][:, MOTIONS * node : MOTIONS * node + ways.shape[1]] = ways
        if ways.shape[1] == len(x[node]):
            drawn[key] = x[node], ways
    along = R[:, :3]
    moved = {key: rows @ along for key, rows in rows_of.items()}
    inertia = np.asarray(Z.T @ (M @ along))
    Kf, Mf = Z.T @ K @ Z, Z.T @ (M + fluid) @ Z
    _check_preload(members, _without(Kf, Z.T @ (R @ left)), left, where)
    if Z.shape[1] <= LARGE:
        Kf, Mf = Kf.toarray(), Mf.toarray()
    still = np.asarray(Z.T @ (R @ left)) if left.shape[1] else None
    rows = {key: np.asarray((Z.T @ row.T).T) for key, row in rows_of.items()}

    def held_at(place: Station, count: int, named: str, argument: str = "clamped") -> Array:
        """Return the part of the first motions of a place that its support holds, (DOFs with hinges, count)."""
        first = MOTIONS * node_at(axes.along(place, named, argument))
        fixed_ways, found = C[:, first : first + count], np.zeros((tie.shape[1], count))
        found[first : first + count] = np.linalg.pinv(fixed_ways) @ fixed_ways
        return found

    shoved = {key: held_at(place, 3, f"{where}: support") for key, place in driven.items()}
    rows |= driven_rows(shoved, {"K": K, "M": M + fluid}, lambda forces: Z.T @ forces)
    shifts = (MOTIONS * np.arange(len(x))[:, None] + np.arange(3)).ravel()
    lines = np.concatenate([np.column_stack([some[:-1], some[1:]]) for some in nodes])
    geometry = StructureGeometry(x, sp.csr_matrix(Z)[shifts], lines, drawn)
    made = Structure(0.5 * (Mf + Mf.T), 0.5 * (Kf + Kf.T), None, rows, still, name, inertia, moved, geometry)
    clamps = [at for at, _, rotates in supports if rotates]

    def stress(key: str, named: str, argument: str) -> Array:
        ways = _directions(placed[key][1], named, (3,), argument)
        return np.asarray(_stress(members, axes, stations, own, every, known[key], ways, clamps, where, key) @ tie)

    made.gauges = gauge_rows(gauges, placed, shoved, where, stress, lambda rows: (Z.T @ rows.T).T)
    for key, place in reactions.items():
        named = f"{where}: reaction {key}"
        D = held_at(place, MOTIONS, named, f"reactions.{key}")
        if not np.any(D):
            raise ArgumentError(f"{named}: found a place that nothing holds, expected that of a support", "reactions")
        matrices = {"K": K, "M": M + fluid}
        made.reactions[key] = support_force(D, matrices, M @ along, shoved, lambda rows: (Z.T @ rows.T).T)
    return made


def _stress(
    members: Sequence[Member], axes: FrameAxes, stations: Sequence[Array], nodes: Sequence[Array], x: Array,
    along: tuple[int, float], directions: Array, clamps: Sequence[tuple[int, float]], where: str, key: str,
) -> Array:  # fmt: skip
    """Return the rows of the stress at a point, (6 directions, DOFs of all nodes and hinges)."""
    k, named = along[0], f"{where}: point {key}"
    s, some, member = stations[k], nodes[k], members[k]
    i, section = int(np.abs(s - along[1]).argmin()), member.section
    up, sides = np.asarray(member.up, dtype=float), []
    for a, b in pairwise(range(max(i - 1, 0), min(i + 2, len(s)))):
        ends, length = (int(some[a]), int(some[b])), float(s[b] - s[a])
        soft = _softness(member, axes.routes[k].part_at(0.5 * (s[a] + s[b])))
        stiffness = _element(x[ends[0]], x[ends[1]], length, member, soft, up, where)[0]
        forces = end_forces(stiffness, int(some[i]), ends, MOTIONS * len(x))
        chord = x[ends[1]] - x[ends[0]]
        own = _axes(chord / np.linalg.norm(chord), section, up, where)
        sides.append(surface_rows(forces, own, directions, section, named, f"points.{key}"))
    stops = [*clamps, *(one for both in axes.meetings for one in both)]
    breaks = any(j == k and abs(t - s[i]) <= SAME * axes.length for j, t in stops)
    return mean_of_sides(sides, named, f"points.{key}", breaks)


def _softness(one: Member, part: RoutePart) -> float:
    """Return the flexibility factor of a member in a part of its route."""
    if part.inward is None:
        return 1.0
    return one.section.flexibility(part.radius) if one.flexibility is None else one.flexibility


def frame_axes(routes: Sequence[tuple[Any, Any]], where: str) -> FrameAxes:
    """Return the axes of a frame from corners and bend radii of its members.

    Raises:
        UserError: A route is none, or a branch meets no other.
    """
    made = []
    for k, (corners, radius) in enumerate(routes):
        try:
            made.append(FrameRoute(corners, radius, where if k == 0 else f"{where}: member {k}"))
        except ArgumentError as error:
            raise ArgumentError(str(error), error.argument if k == 0 else f"members.{k - 1}.{error.argument}") from None
    return FrameAxes(made, where)


def _placed(given: Any, where: str) -> tuple[Station, ArrayLike]:
    """Return a place and its directions."""
    if not (isinstance(given, tuple | list) and len(given) == 2):
        raise UserError(f"{where}: found {shown(given)}, expected (place, directions)")
    return given[0], given[1]


def _directions(ways: ArrayLike, where: str, lengths: Sequence[int], argument: str = "supports") -> Array:
    """Return one or several directions of length 1, (count, 3) or (count, 6); so are rotations where nothing moves."""
    given = np.atleast_2d(finite(ways, where))
    sizes = np.linalg.norm(given[:, :3], axis=1)
    sizes = np.where(sizes > 0.0, sizes, np.linalg.norm(given, axis=1))
    if given.shape[1] not in lengths or not np.all(sizes > 0.0):
        words = f"{where}: found direction {np.asarray(ways).tolist()}, expected (x, y, z), not all 0"
        raise ArgumentError(words, argument)
    found = given / sizes[:, None]
    if np.abs(np.triu(found @ found.T, 1)).max() > ALONG:
        raise ArgumentError(f"{where}: found directions that are not at right angles", argument)
    return np.asarray(found)


def _assembled(
    members: Sequence[Member], axes: FrameAxes, stations: Sequence[Array], nodes: Sequence[Array], x: Array, where: str
) -> tuple[Any, Any, Any]:
    """Return stiffness and mass of all nodes, and the mass of fluids, sparse."""
    places, matrices = [], []
    for one, axis, s, some in zip(members, axes.routes, stations, nodes, strict=True):
        up = finite(one.up, f"{where}: up")
        if up.shape != (3,) or not np.linalg.norm(up) > 0.0:
            raise UserError(f"{where}: found up {shown(one.up)}, expected three numbers that are not all 0")
        if one.flexibility is not None:
            positive(one.flexibility, f"{where}: flexibility")
        check_section(one.section, where)
        for (a, b), (i, j) in zip(pairwise(s), pairwise(some), strict=True):
            soft = _softness(one, axis.part_at(0.5 * (a + b)))
            matrices.append(_element(x[i], x[j], float(b - a), one, soft, up, where))
            places.append(np.concatenate([MOTIONS * end + np.arange(MOTIONS) for end in (i, j)]))
    at, size = np.array(places), MOTIONS * len(x)
    rows, columns = np.repeat(at, 2 * MOTIONS, axis=1).ravel(), np.tile(at, (1, 2 * MOTIONS)).ravel()
    K, M, fluid = (
        sp.csr_matrix((np.ravel(some), (rows, columns)), (size, size)) for some in np.swapaxes(matrices, 0, 1)
    )
    return K, M, fluid


def _check_preload(members: Sequence[Member], K: Any, left: Array, where: str) -> None:
    """Refuse preloads of bent members, of those that supports let tilt, (6, free), and those that buckle the frame."""
    pressed, pressed_key = 0.0, ""
    for k, one in enumerate(members):
        key = "tension" if k == 0 else f"members.{k - 1}.tension"
        tension = float(finite(one.tension, f"{where}: tension"))
        if tension:
            way = np.subtract(one.route[-1], one.route[0])
            tilts = np.abs(np.cross(left[3:].T, way)) > ALONG * np.linalg.norm(way)
            found = (
                "a route with corners" if len(one.route) > 2 else "a frame that tilts as a whole" if tilts.any() else ""
            )
            if found:
                raise ArgumentError(
                    f"{where}: found a tension of {found}, expected a straight member of a frame whose supports keep "
                    "its direction",
                    key,
                )
        if tension < pressed:
            pressed, pressed_key = tension, key
    if pressed < 0.0:
        refuse_buckling(K, pressed, where, pressed_key)


def _without(K: Any, still: Array) -> Any:
    """Return a sparse stiffness without as many DOFs as there are motions that do not strain it, and move them.

    It is as definite as the stiffness of all other motions.
    """
    if not still.shape[1]:
        return K
    kept = np.sort(qr(still.T, mode="r", pivoting=True)[1][still.shape[1] :])
    return sp.csr_matrix(K)[kept][:, kept]


def _element(
    a: Array, b: Array, arc: float, one: Member, soft: float, up: Array, where: str
) -> tuple[Array, Array, Array]:
    """Return stiffness, mass, and mass of fluid of an element in space, (12, 12) each; the mass is of the arc."""
    section, material, length = one.section, one.material, float(np.linalg.norm(b - a))
    E, G = material.young_modulus, material.shear_modulus
    heavy = material.density * arc / length
    wet = float(positive(one.added_mass, f"{where}: added mass", zero=True)) * arc / length
    K, M, fluid = np.zeros((3, 12, 12))
    both = (section.second_moment, section.shear_area), (section.lateral_moment, section.lateral_shear_area)
    for (second, shear), at, sense in zip(both, (STRONG, WEAK), (-1.0, 1.0), strict=True):
        beam = TimoshenkoBeam(
            length, 1, E * second / soft, G * shear, heavy * section.area, heavy * second, one.tension
        )
        m, k = beam.element_matrices()
        turned = np.outer(*[np.array([1.0, sense, 1.0, sense])] * 2)  # w' is -r_y, and r_z
        K[np.ix_(at, at)], M[np.ix_(at, at)] = k * turned, m * turned
        if wet:
            fluid[np.ix_(at, at)] = replace(beam, mass=wet, inertia=0.0).element_matrices()[0] * turned
    unit, share = np.array([[1.0, -1.0], [-1.0, 1.0]]) / length, np.array([[2.0, 1.0], [1.0, 2.0]]) * length / 6.0
    polar = section.second_moment + section.lateral_moment
    for at, stiff, inert in (
        (AXIAL, E * section.area, heavy * section.area), (TWIST, G * section.torsion_constant, heavy * polar)
    ):  # fmt: skip
        K[np.ix_(at, at)], M[np.ix_(at, at)] = stiff * unit, inert * share
    T = block_diag(*[_axes(np.asarray((b - a) / length), section, up, where)] * 4)
    return T.T @ K @ T, T.T @ M @ T, T.T @ fluid @ T


def _axes(along: Array, section: SpaceSection, up: Array, where: str) -> Array:
    """Return the own axes of an element as rows: along it, across, and along the thickness."""
    z = up - (up @ along) * along
    if np.linalg.norm(z) < ALONG * np.linalg.norm(up):
        unequal = abs(section.second_moment - section.lateral_moment) > 1e-9 * section.second_moment
        if unequal:
            raise UserError(
                f"{where}: found a leg along up, {up.tolist()}, expected `up` across all legs of a section that is not "
                "as stiff both ways"
            )
        z = directions_across(along)[0]
    z = z / np.linalg.norm(z)
    return np.array([along, np.cross(z, along), z])


def _rigid(x: Array) -> Array:
    """Return six rigid motions, (DOFs, 6): along x, y, z, and about them through the middle of all nodes."""
    R = np.zeros((MOTIONS * len(x), MOTIONS))
    for node, arm in enumerate(x - x.mean(axis=0)):
        at = MOTIONS * node
        R[at : at + 3, :3] = np.eye(3)
        R[at : at + 3, 3:] = np.cross(np.eye(3), arm).T
        R[at + 3 : at + 6, 3:] = np.eye(3)
    return R


def _free(C: Array) -> Any:
    """Return a basis of the motions that supports leave, (DOFs, free), sparse: node by node."""
    blocks = []
    for at in range(0, C.shape[1], MOTIONS):
        own = C[:, at : at + MOTIONS]
        own = own[np.abs(own).max(axis=1, initial=0.0) > 0.0]
        kept = null_space(own) if len(own) else np.eye(MOTIONS)
        blocks.append(sp.csr_matrix(kept if kept.size else np.zeros((MOTIONS, 0))))
    return sp.csr_matrix(sp.block_diag(blocks, format="csr"))
