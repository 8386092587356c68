"""Contact lines: a Gauss rule with few points on each line of contact points across a face.

The contact points (x, y_j) with weights w_j of one line make a discrete measure. Its Gauss rule has k nodes y_i, and
the polynomial of degree k - 1 that fits the gaps of the line best gives the gap at a node, g_i = sum_j P_ij g_j
(`assembly.gauss_rule`). Motions that are symmetric about the bending plane are polynomials in y^2: the measure is then
one of y^2, and k nodes integrate twice the degree.

A mean over points with other initial gaps is the gap of no place: the lowest point of a round face touches long before.
Lines whose initial gaps differ keep the points of the mesh, those within reach of the face that they are met by; where
all motion is symmetric, the points at y and -y are one. Holes keep all points of the mesh.

Shapes of pressure on the contact faces are hat functions along the support times powers across it. A truncation check
finds the share of the contact faces' static flexibility that a basis misses: under a pressure z the faces give way by
z^T D z, D = G (K + sigma M)^-1 G^T, and a basis by less,

    sum_j (phi_j^T G^T z)^2 / (s_j + sigma).

The share of what is missing, rigid motions left out, is averaged over random pressures.

Contact points around the stations of supports have the angles and areas of those of the mesh. A force at a point is
shared among the points of the mesh on the same line along the beam that are nearest to its station.

Contact points that a reduced model keeps across the width, and a check of them against the mesh.

A model whose points are means over the points of a mesh is compared with that mesh where it lies undeformed, and where
it is seated: the deepest points of each face have to be as deep, or the beam rests elsewhere than its mesh would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gapbeam.solver.assembly.gauss_rule import gauss_rule
from gapbeam.solver.case.beam_profile import Beam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import line_radii
from gapbeam.solver.case.solution_tables import ELEMENTS_IN_SUPPORT
from gapbeam.solver.contact.formulations.contact_points import (
    ElementOperator,
    ResultantOperator,
    mean_operator,
    shares_of,
)
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import apart
from gapbeam.solver.models.reduction.modal_basis import Basis
from gapbeam.solver.system.operators import Array, Factor, Indices, Operators
from gapbeam.solver.system.semi_discrete import ContactOperator

SAME_PLACE = 1.0e-6  # of the length of a face
EVEN = 1.0e-6  # of the size of a face; initial gaps of a line that differ by less are one
FEWEST = 3  # points on a line for each node


def within_reach(contact: ContactOperator, reach: float) -> NDArray[np.bool_]:
    """Return the points that lie less than a distance, m, above the lowest point of their face, (m,)."""
    lowest = np.full(len(contact.face_names), np.inf)
    np.minimum.at(lowest, contact.faces, contact.initial_gap)
    return np.asarray(contact.initial_gap - lowest[contact.faces] <= reach)


def across_lines(
    contact: ContactOperator, count: int, symmetric: bool, spacing: float, reach: float = np.inf
) -> ContactOperator:
    """Return the operator with `count` points on each line across the faces; the same where lines have no more.

    Args:
        contact: Operator at the points of the mesh.
        count: k.
        symmetric: Whether all motion is symmetric about the bending plane.
        spacing: Length along x that is taken for one line where the points do not lie on lines, m.
        reach: Points of uneven lines that lie higher above the lowest point of their face never touch, m.
    """
    touching = within_reach(contact, reach)
    length = float(np.ptp(contact.positions[:, 0]))
    rows: list[tuple[Indices, Array]] = []
    areas: list[float] = []
    owners: list[int] = []
    for face, met in enumerate(contact.support.faces):
        here = np.flatnonzero(contact.faces == face)
        for line in [here] if met.around else _lines(contact, here, count, spacing):
            if met.around or np.ptp(contact.initial_gap[line]) > EVEN * length:
                kept = line if met.around else line[touching[line]]
                for points in _mirrored(contact, kept, symmetric and not met.around):
                    rows.append((points, np.full(len(points), 1.0 / len(points))))
                    areas.append(float(contact.weights[points].sum()))
                    owners.append(face)
                continue
            y, weights = contact.positions[line, 1], contact.weights[line]
            if symmetric:
                y = (y - 0.5 * (y.max() + y.min())) ** 2
            rule = gauss_rule(y, weights, count)
            for area, row in zip(rule.areas, rule.rows, strict=True):
                rows.append((line, row))
                areas.append(area)
                owners.append(face)
    if len(rows) >= contact.size:
        return contact
    return mean_operator(contact, shares_of(rows, contact.size), areas, owners)


ALONG = 4  # points on a line along an element, whose motion is a cubic


def support_parts(case: Case, parts: int = 0) -> Array:
    """Return x of equal parts of each support, so many or two for each graded element there, (k,), m."""
    count = max(parts, 2 * ELEMENTS_IN_SUPPORT)
    return np.asarray(np.unique(np.concatenate([np.linspace(*span, count + 1) for span in case.layout.face_spans])))


def along_elements(contact: ContactOperator, spans: Sequence[tuple[float, float]], nodes: Array) -> ContactOperator:
    """Return the operator with few points on each line along an element; the same where they are no less than half.

    Lines begin and end at the edges of supports, which a beam that tilts meets first. They keep their points around a
    beam, and where their initial gaps are no polynomial of the rule.

    Args:
        contact: Operator at points whose motion is a polynomial of degree ALONG - 1 in each element.
        spans: First and last x of each face, m.
        nodes: x of the ends of elements, (k,), m.
    """
    rows, areas, owners = list[tuple[Indices, Array]](), list[float](), list[int]()
    length = float(np.ptp(contact.positions[:, 0]))
    for face, met in enumerate(contact.support.faces):
        here = contact.points_of_faces[face]
        for line in here[:, None] if met.around else _along(contact, here, nodes):
            x, sizes, shares = contact.positions[line, 0], contact.weights[line], np.identity(len(line))
            if len(line) > ALONG:
                element = int(np.searchsorted(nodes, x[0], "right"))
                start, end = nodes[element - 1 : element + 1]
                along = (x - start) / (end - start)
                edges = (np.array(spans[face]) - start) / (end - start)
                edge = next((round(one) for one in edges if abs(one * (1.0 - one)) <= SAME_PLACE), None)
                rule, gaps = gauss_rule(along, sizes, ALONG, edge), contact.initial_gap[line]
                fitted = (rule.moments @ gaps) @ rule.values(along, along)
                if np.abs(fitted - gaps).max() <= EVEN * length:
                    shares, sizes = rule.rows, rule.areas
            rows += [(line, row) for row in shares]
            areas += list(sizes)
            owners += [face] * len(sizes)
    if 2 * len(rows) > contact.size:
        return contact
    return mean_operator(contact, shares_of(rows, contact.size), areas, owners, ElementOperator)


def _along(contact: ContactOperator, points: Indices, nodes: Array) -> list[Indices]:
    """Return the points of a face by the lines along the beam, and on these by elements, each in the order along it."""
    across = np.ptp(contact.positions, axis=0)
    same = SAME_PLACE * max(across[1], across[2], SAME_PLACE * across[0])
    x, y, z = contact.positions[points].T
    keys = [np.searchsorted(nodes, x, "right"), np.round(y / same), np.round(z / same)]
    order = np.lexsort([x, *keys])
    breaks = np.flatnonzero(np.any([np.diff(key[order]) != 0 for key in keys], axis=0)) + 1
    return np.split(points[order], breaks)


def _lines(contact: ContactOperator, points: Indices, count: int, spacing: float) -> list[Indices]:
    """Return the points of a face line by line: by equal x, or in strips where hardly any x is equal."""
    points = points[np.argsort(contact.positions[points, 0], kind="stable")]
    x = contact.positions[points, 0]
    breaks = np.flatnonzero(np.diff(x) > SAME_PLACE * np.ptp(x)) + 1
    if len(points) < FEWEST * count * (len(breaks) + 1):
        strip = np.floor((x - x[0]) / spacing * (1.0 - SAME_PLACE))
        breaks = np.flatnonzero(np.diff(strip) > 0.0) + 1
    return np.split(points, breaks)


def _mirrored(contact: ContactOperator, line: Indices, symmetric: bool) -> list[Indices]:
    """Return the points of a line one by one, or in pairs at y and -y, where symmetric motion moves both alike."""
    if not symmetric:
        return list(line[:, None])
    away = np.abs(contact.positions[line, 1])
    order = np.argsort(away, kind="stable")
    breaks = np.flatnonzero(np.diff(away[order]) > SAME_PLACE * away.max(initial=0.0)) + 1
    return [points for points in np.split(line[order], breaks) if len(points)]


HARMONICS = 4  # around a hole


def face_shapes(
    contact: ContactOperator, count: int, powers: tuple[int, ...], touching: NDArray[np.bool_] | None = None
) -> Array:
    """Return pressures of unit size at the contact points, (m, shapes): hat functions times y^k, face by face.

    In holes they are hat functions times cos(k t) and sin(k t), with t the angle about the axis.

    Args:
        contact: The contact points.
        count: Number of hat functions along each face, at least 2.
        powers: The powers k; y is measured from the middle of the face over half its width.
        touching: Whether each point can touch, (m,); pressure is on these alone, and their width counts. None: all.
    """
    along, across = contact.positions[:, 0], contact.positions[:, 1]
    columns = []
    for face, met in enumerate(contact.support.faces):
        here = contact.faces == face
        if met.around:
            columns += _around(contact, here, count)
            continue
        if touching is not None:
            here &= touching
        x, y = along[here], across[here]
        knots = np.linspace(x.min(), x.max(), count)
        span = knots[1] - knots[0]
        half = 0.5 * np.ptp(y)
        side = (y - 0.5 * (y.max() + y.min())) / half if half > 0.0 else np.zeros_like(y)
        for knot in knots:
            hat = np.maximum(1.0 - np.abs(x - knot) / span, 0.0)
            for power in powers if half > 0.0 else (0,):
                column = np.zeros(contact.size)
                column[here] = hat * side**power
                columns.append(column)
    return np.stack(columns, axis=1)


def _around(contact: ContactOperator, here: NDArray[np.bool_], count: int) -> list[Array]:
    """Return the pressures of a hole; along it no more hat functions than places, two for three of them."""
    x, y, z = contact.positions[here].T
    places = 1 + int(np.sum(np.diff(np.sort(x)) > SAME_PLACE * np.ptp(x)))
    knots = np.linspace(x.min(), x.max(), max(2, min(count, 2 * places // 3)))
    angles = np.arctan2(z, y)
    waves = [np.ones_like(angles)]
    for number in range(1, HARMONICS + 1):
        waves += [np.cos(number * angles), np.sin(number * angles)]
    found = list[Array]()
    for knot in knots:
        hat = np.maximum(1.0 - np.abs(x - knot) / (knots[1] - knots[0]), 0.0)
        for wave in waves:
            column = np.zeros(contact.size)
            column[here] = hat * wave
            found.append(column)
    return found


RIGID = 0.5  # of the shift; modes below are motions of the floating body on its weak restraint


def neglected_shares(
    operators: Operators, contact: ContactOperator, factor: Factor, basis: Basis, shift: float, pressures: list[Array]
) -> list[float]:
    """Return the shares of the flexibility that a basis misses, at least 0, one for each set of pressures.

    Args:
        operators: M and K.
        contact: The contact points.
        factor: The factor of K + sigma M.
        basis: V and its frequencies.
        shift: sigma, 1/s^2.
        pressures: Sets of pressures at the contact points, columns (m, k).

    Collective.
    """
    missing, elastic = flexibilities(operators, contact, factor, basis, shift, np.concatenate(pressures, axis=1))
    ends = np.cumsum([columns.shape[1] for columns in pressures])[:-1]
    return [
        max(float(missed.sum() / whole.sum()), 0.0) if whole.sum() > 0.0 else 0.0
        for missed, whole in zip(np.split(missing, ends), np.split(elastic, ends), strict=True)
    ]


def flexibilities(
    operators: Operators, contact: ContactOperator, factor: Factor, basis: Basis, shift: float, pressures: Array
) -> tuple[Array, Array]:
    """Return z^T D z less its value on a basis, and z^T D z, both without rigid motions, (k,), J.

    Args:
        operators: M and K.
        contact: The contact points.
        factor: The factor of K + sigma M.
        basis: V and its frequencies.
        shift: sigma, 1/s^2.
        pressures: Pressures at the contact points, (m, k), Pa.

    Collective.
    """
    interface = contact.interface
    loads = np.asarray(contact.resultants @ (contact.weights[:, None] * pressures))
    moved = factor.solve_columns(interface, csr_matrix(loads))
    forces = loads[interface.slots]
    full = operators.sum(np.einsum("ij,ij->j", moved[interface.owned], forces))
    shares = operators.sum(np.ascontiguousarray(basis.columns[interface.owned].T @ forces)) ** 2
    flexibility = shares / (basis.squares + shift)[:, None]
    rigid = flexibility[basis.squares < RIGID * shift].sum(axis=0)
    return full - flexibility.sum(axis=0), full - rigid


def random_pressures(contact: ContactOperator, count: int, shapes: Array | None = None) -> Array:
    """Return random pressures, (m, count), always the same: from point to point, or of random sizes of given shapes."""
    random = np.random.default_rng(0)
    if shapes is None:
        return np.asarray(random.choice([-1.0, 1.0], (contact.size, count)))
    return np.asarray(shapes @ random.choice([-1.0, 1.0], (shapes.shape[1], count)))


ONE_LINE = 1.0e-6  # rad, between the contact points of a line along the beam
CUT = 1.0  # rad, where angles begin: no line of points lies there


@dataclass(frozen=True)
class PointsAround:
    """Contact points around stations, one station after the other.

    Attributes:
        positions: (m, 3), m.
        weights: Areas, (m,), m^2.
        gaps: Gaps of the undeformed beam, (m,), m.
        faces: Index of the face of each, (m,).
        stations: Number of the station of each, (m,).
        shares: Shares of a force on each among the points of the mesh, (m, points).
    """

    positions: Array
    weights: Array
    gaps: Array
    faces: Indices
    stations: Indices
    shares: csr_matrix


def points_around(contact: ContactOperator, places: Array, areas: Array, faces: Indices) -> PointsAround:
    """Return the points around stations.

    Args:
        contact: The operator at the points of the mesh, all of them around the beam.
        places: x of the stations, face by face, (k,), m.
        areas: Surface that belongs to each, (k,), m^2.
        faces: Index of the face of each, (k,).
    """
    positions, weights, owners, stations = list[Array](), list[Array](), list[Indices](), list[Indices]()
    shares = list[tuple[Indices, Array]]()
    for face in range(len(contact.face_names)):
        here, ringed = contact.points_of_faces[face], np.flatnonzero(faces == face)
        parts = areas[ringed] / areas[ringed].sum()
        lines = _points_around_lines(contact, here)
        across = np.array([contact.positions[line, 1:].mean(axis=0) for line in lines])
        surfaces = np.array([contact.weights[line].sum() for line in lines])
        for number, station in enumerate(ringed):
            positions.append(np.column_stack([np.full(len(lines), places[station]), across]))
            weights.append(parts[number] * surfaces)
            owners.append(np.full(len(lines), face))
            stations.append(np.full(len(lines), station))
            shares += [_share(contact, line, parts, number) for line in lines]
    spots, owned = np.concatenate(positions), np.concatenate(owners)
    gaps = np.empty(len(spots))
    for face, met in enumerate(contact.support.faces):
        gaps[owned == face] = met.gaps(spots[owned == face])
    shared = shares_of(shares, contact.size)
    return PointsAround(spots, np.concatenate(weights), gaps, owned, np.concatenate(stations), shared)


def _points_around_lines(contact: ContactOperator, points: Indices) -> list[Indices]:
    """Return the contact points of a face line by line along the beam, each in the order along it."""
    y, z = contact.positions[points, 1:].T
    turns = np.mod(np.arctan2(z, y) + CUT, 2.0 * np.pi)
    order = np.argsort(turns, kind="stable")
    breaks = np.flatnonzero(np.diff(turns[order]) > ONE_LINE) + 1
    return [line[np.argsort(contact.positions[line, 0])] for line in np.split(points[order], breaks)]


def _share(contact: ContactOperator, line: Indices, parts: Array, number: int) -> tuple[Indices, Array]:
    """Return the points of a line among which a station shares its force, and their shares.

    Stations own parts of the line one after the other, and points those of their areas.

    Args:
        contact: The points.
        line: Some of them, in the order along the beam.
        parts: Parts of the line that belong to the stations, (k,).
        number: The station.
    """
    ends = np.cumsum(contact.weights[line]) / contact.weights[line].sum()
    begins = np.concatenate([[0.0], ends[:-1]])
    last = parts[: number + 1].sum()
    overlap = np.minimum(ends, last) - np.maximum(begins, last - parts[number])
    met = overlap > 0.0
    return line[met], overlap[met] / overlap[met].sum()


SPACING = 0.25  # of a facet, between lines of points that do not lie on lines
REACH = 0.05  # of the thickness: what lies higher touches only where displacements are not small
UNSYMMETRIC = 4  # times as many points across the width, where faces may close on one side alone


def gathered_points(
    case: Case, contact: ContactOperator, symmetric: bool, across: int | Literal["auto", "all"], facet_length: float
) -> ContactOperator:
    """Return the operator with few points on each line across the faces of a solid, and the mesh's points elsewhere.

    Lines of faces that are not flat across keep the points of the mesh that can touch.

    Args:
        case: The case.
        contact: Operator at the points of the mesh.
        symmetric: Whether all motion is symmetric about the bending plane.
        across: Points on a line, four times as many where the motion is not symmetric; "all": those of the mesh;
            "auto": 1 for solid rectangles, else all, as the pressure of a hollow section gathers under its webs.
        facet_length: Mean length of the contact facets along the beam, m.
    """
    if across == "auto":
        across = 1 if all(_is_filled(piece.beam) for piece in case.profile.supported(case.layout)) else "all"
    if case.mesh.dimension == 2 or across == "all" or case.contact.points is not None or contact.rubbed is not None:
        return contact
    count = across if symmetric else UNSYMMETRIC * across
    return across_lines(contact, count, symmetric, SPACING * facet_length, REACH * case.profile.thinnest)


def _is_filled(beam: Beam) -> bool:
    """Return whether a section is a solid rectangle, or round, whose lines are not flat."""
    return beam.section.round or isclose(beam.area, beam.thickness * beam.width, rel_tol=1e-9)


OF_CLEARANCE = 0.1
OF_THICKNESS = 1.0e-4
OF_DEPTH = 0.05  # of what a soft support gives way


def refuse_other_faces(case: Case, contact: ContactOperator, interface_values: Array, pose: str) -> None:
    """Refuse a model whose faces are not where those of its mesh are.

    Args:
        case: The case.
        contact: The contact operator of the model.
        interface_values: The pose, (interface.size,), m.
        pose: Its name.

    Raises:
        UserError: The deepest points of a face differ by more than a tenth of the clearance, 1e-4 of the thickness and
            a twentieth of their depth together.
    """
    if isinstance(contact, ElementOperator):
        contact = contact.distributed
    if not isinstance(contact, ResultantOperator) or case.contact.points is not None:
        return
    own, mesh = contact.depth(interface_values), contact.distributed.depth(interface_values)
    allowed = OF_CLEARANCE * abs(case.layout.clearance) + OF_THICKNESS * case.profile.thinnest
    finer = "more stations" if case.model.rings else 'points_across = "all" (reduced)'
    for face, (name, radius) in enumerate(zip(contact.face_names, line_radii(case), strict=True)):
        if radius is not None:  # motion along a flat wall closes gaps of points around a section, but not of lines
            continue
        found = float(np.max(own[contact.faces == face], initial=-np.inf))
        there = float(np.max(mesh[contact.distributed.faces == face]))
        differs = allowed + OF_DEPTH * max(found, there, 0.0)
        if not abs(found - there) <= differs:
            here, meant = apart(found, there)
            raise UserError(
                f'[model] type = "{case.model.type}": its {name} differs from the mesh it comes from, {pose}\n'
                f"  found:    the deepest contact point {here} m deep, in the mesh {meant} m\n"
                f"  expected: the same to {differs:.2g} m, or the beam rests elsewhere than its mesh would\n"
                f'  try:      {finer} in [model], or type = "full"'
            )
