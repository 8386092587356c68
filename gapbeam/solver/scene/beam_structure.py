"""Beams as structures: Timoshenko elements, or a rigid bar; no mesh, no DOLFINx."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import inf
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from pydantic import TypeAdapter, ValidationError

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam, heave_and_pitch_at, of_elements
from gapbeam.solver.scene.argument_checks import ArgumentError, check_section, checked, finite, positive
from gapbeam.solver.scene.imported_points import has_negative_direction
from gapbeam.solver.scene.structure import LARGE, Structure
from gapbeam.solver.scene.surface_stress import end_forces, gauge_rows, mean_of_sides, surface_tensor
from gapbeam.solver.schema.table import faults_in
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.system.operators import Array

ELEMENTS = 40
"""Elements of a beam by default, about: the tenth mode is then right to 1e-5."""
SAME = 1e-9  # of the length: places that are one


class CrossSection(NamedTuple):
    """Figures of a cross-section for bending in one plane.

    Attributes:
        area: m^2.
        second_moment: About the centroid, m^4.
        shear_area: Share of the area that carries shear times the area, m^2; infinite: shear does not strain.
        surface: Distance of the surface on the side of the motion from the centroid, for stresses, m; 0: not known.
    """

    area: float
    second_moment: float
    shear_area: float = inf
    surface: float = 0.0


@checked
def section(
    type: str,  # noqa: A002 - as the key is called
    thickness: float,
    width: float | None = None,
    poisson_ratio: float = 0.3,
    **values: Any,
) -> CrossSection:
    """Return the figures of a section by the name that it has in case files.

    Args:
        type: "rectangle", "round", "tube", "box", "i" or "polygon".
        thickness: Outer size in the bending direction, m.
        width: Outer size across it, m; default the thickness.
        poisson_ratio: Poisson's ratio, for the shear coefficient.
        values: Other keys of the section's table, such as wall = 1e-3.

    Raises:
        UserError: The type or a key is unknown, or the sizes do not fit together.
    """
    table, size = section_table(type, thickness, width, values)
    return figures(table, *size, poisson_ratio)


def section_table(
    name: str, thickness: float, width: float | None, values: Mapping[str, Any]
) -> tuple[Any, tuple[float, float]]:
    """Return the table of a section, and its outer sizes, m.

    Raises:
        UserError: The type or a key is unknown, or the sizes do not fit together.
    """
    size = (float(positive(thickness, "section: thickness")), float(positive(width or thickness, "section: width")))
    try:
        table = _sections().validate_python({"type": name, **values})
    except ValidationError as error:
        raise UserError(f"section {name!r}: {faults_in(error, 1)}") from None
    if faults := list(table.faults(*size)):
        raise UserError(
            f"section {name!r}: "
            + "; ".join(f"{one.key[-1]}: found {one.found}, expected {one.expected}" for one in faults)
        )
    return table, size


def figures(table: Any, thickness: float, width: float, poisson_ratio: float) -> CrossSection:
    """Return the figures of a section's table at outer sizes, m."""
    area = table.area(thickness, width)
    second, shear = table.second_moment(thickness, width), table.shear_coefficient(thickness, width, poisson_ratio)
    return CrossSection(area, second, area * shear, 0.5 * thickness - table.centroid(thickness, width)[1])


@cache
def _sections() -> TypeAdapter[Any]:
    return TypeAdapter(SectionChoice)


@checked
def material(young_modulus: float, density: float, poisson_ratio: float = 0.3) -> Material:
    """Return an isotropic linear elastic material: Pa, kg/m^3.

    Raises:
        UserError: A value is out of range.
    """
    try:
        return Material(young_modulus=young_modulus, density=density, poisson_ratio=poisson_ratio)
    except ValidationError as error:
        raise UserError(f"material: {faults_in(error)}") from None


@checked
def beam(
    length: float,
    section: CrossSection,
    material: Material,
    points: Mapping[str, float],
    *,
    model: Literal["beam", "rigid"] = "beam",
    clamped: Sequence[float] = (),
    pinned: Sequence[float] = (),
    elements: int | None = None,
    modes: int | None = None,
    ratio: float = 0.0,
    added_mass: float = 0.0,
    tension: float = 0.0,
    name: str = "",
    driven: Mapping[str, float] = MappingProxyType({}),
    gauges: Sequence[str] = (),
) -> Structure:
    """Return a straight beam that bends in one plane, or a string with its bending stiffness.

    Elements are exact for static loads at their nodes without tension; nodes stand at all points and supports, so that
    a point is a deflection of a node. The inertia of rotation counts.

    Args:
        length: m.
        section: Result of `section`, or own figures.
        material: Result of `material`.
        points: Places along the beam by name, m from its start; each moves across the beam.
        model: "beam", or "rigid": deflection and rotation only.
        clamped: Places that neither move nor rotate, m.
        pinned: Places that do not move, m.
        elements: About so many; default 40.
        modes: Kept modes; default all of them.
        ratio: Damping ratio of each mode.
        added_mass: Added mass of a fluid that moves with the beam, per length, kg/m; it has no weight.
        tension: Axial preload, which keeps its direction and size, N; below 0: compression.
        name: Name of the structure.
        driven: Places of supports that move by s, m, by name: the beam then has the points "NAME: K" and "NAME: M",
            whose rows times s and s'' are the forces on it; see `driven_rows`.
        gauges: Points whose stress is recorded, at the surface on the side of the motion.

    Raises:
        UserError: A place is off the beam, the model is unknown, a rigid beam is held or has a preload, compression
            buckles the beam, or a stress is not known.

    Source: `gapbeam.solver.models.timoshenko_beam`, for the elements.
    """
    where = f"beam {name or '?'}"
    size = float(positive(length, f"{where}: length"))
    places = {key: float(finite(x, f"{where}: point {key}")) for key, x in points.items()}
    clamps, pins = ([float(x) for x in finite(some, f"{where}: supports").ravel()] for some in (clamped, pinned))
    held, count = [*clamps, *pins], element_count(elements, where)
    off = {key: x for key, x in (places | {f"support at {x:g}": x for x in held}).items() if not 0.0 <= x <= size}
    if off:
        raise UserError(f"{where}: expected places from 0 to {size:g} m, found {off}")
    check_section(section, where)
    mass, bending = material.density * section.area, material.young_modulus * section.second_moment
    rotary = material.density * section.second_moment
    added = float(positive(added_mass, f"{where}: added mass", zero=True))
    if model == "rigid":
        if held or ratio or modes or tension or gauges:
            raise UserError(
                f"{where}: a rigid beam has no supports, modes, preload or stress; hold it by contacts or joints"
            )
        moved = mass + added
        about = np.array([[moved * size, 0.0], [0.0, moved * size**3 / 12.0 + rotary * size]])
        rows = {key: np.array([[1.0, x - 0.5 * size]]) for key, x in places.items()}
        return Structure(about, np.zeros((2, 2)), None, rows, np.eye(2), name, [mass * size, 0.0], [1.0, 0.0])
    if model != "beam":
        raise UserError(
            f'{where}: found model {model!r}, expected "beam" or "rigid"; a reduced model of a mesh comes from a case: '
            "gapbeam.scene(case)"
        )
    shear = material.shear_modulus * section.shear_area
    pull = float(finite(tension, f"{where}: tension"))
    uniform = TimoshenkoBeam(size, count, bending, shear, mass + added, rotary, pull)
    parts = _parts(uniform, [*places.values(), *held])
    ends = np.cumsum([0.0, *(part.length for part in parts)])
    x = np.concatenate([*(end + part.places[:-1] for end, part in zip(ends, parts, strict=False)), [size]])
    operators = of_elements(parts)
    M, K = operators.mass, operators.stiffness
    fixed = {2 * _node(x, one) for one in held} | {2 * _node(x, one) + 1 for one in clamps}
    free = np.array([i for i in range(2 * len(x)) if i not in fixed])
    rows = {key: np.eye(2 * len(x))[2 * _node(x, one)][free] for key, one in places.items()}
    shoved = {key: np.eye(2 * len(x))[:, [2 * _node(x, one)]] for key, one in driven.items()}
    rows |= driven_rows(shoved, {"K": K, "M": M}, lambda forces: forces[free])
    rigid = heave_and_pitch_at(x).T
    along = rigid[:, 0]
    carried = (M @ along)[free] * (mass / (mass + added))
    left = 2 - np.linalg.matrix_rank(rigid[sorted(fixed)]) if fixed else 2
    if tension and left:  # it turns the beam back to its direction
        left, rigid = (0, rigid) if fixed else (1, rigid[:, :1])
    if left == 1 and fixed:  # one pin: it rotates about that
        rigid = rigid[:, 1:] - np.outer(rigid[:, 0], [held[0]])
    M, K = M[free][:, free], K[free][:, free]
    if tension < 0.0:
        refuse_buckling(K if fixed else None, tension, where)
    if len(free) <= LARGE:
        M, K = M.toarray(), K.toarray()
    whole = Structure(M, K, None, rows, rigid[free] if left else None, name, carried, along[free])
    clamped_nodes = [_node(x, one) for one in clamps]

    def stress(key: str, named: str, argument: str) -> Array:
        node = _node(x, places[key])
        return _stress(uniform, x, node, section, node in clamped_nodes, named, argument)

    whole.gauges = gauge_rows(gauges, places, shoved, where, stress, lambda rows: rows[:, free])
    return whole if modes is None and not ratio else whole.reduced(modes or len(free), ratio)


def _stress(
    uniform: TimoshenkoBeam, x: Array, node: int, section: CrossSection, clamped: bool, where: str, argument: str
) -> Array:
    """Return the rows of the stress at a node, (6, DOFs of all nodes); nothing twists.

    Raises:
        ArgumentError: The section's surface is not known, or the stress jumps.
    """
    if not section.surface > 0.0:
        raise ArgumentError(
            f"{where}: found a stress of a section of own figures without `surface`, expected the distance of its "
            "surface from its centroid, m",
            argument,
        )
    moments = []
    for a, b in pairwise(range(max(node - 1, 0), min(node + 2, len(x)))):
        K = replace(uniform, length=float(x[b] - x[a]), elements=1).element_matrices()[1]
        moments.append(end_forces(K, node, (a, b), 2 * len(x))[1])
    axial = -mean_of_sides(moments, where, argument, clamped) * section.surface / section.second_moment
    return np.array(surface_tensor(axial, np.zeros_like(axial)))


def refuse_buckling(K: Any, tension: float, where: str, argument: str = "tension") -> None:
    """Refuse a compression that buckles the structure.

    Args:
        K: Stiffness with it of what supports leave, sparse; None: not all is held.
        tension: The compression, below 0, N.
        where: Name of the structure in messages.
        argument: Argument that gives the compression.

    Raises:
        ArgumentError: The compression buckles the structure.
    """
    if K is None or has_negative_direction(K):
        raise ArgumentError(
            f"{where}: found a compression of {-tension:g} N under which it buckles, expected less than the critical "
            "load; look at its supports",
            argument,
        )


def element_count(elements: int | None, where: str = "beam") -> int:
    """Return about how many elements a beam or a frame has.

    Raises:
        UserError: Fewer than one were asked for.
    """
    if elements is not None and elements < 1:
        raise UserError(f"{where}: elements: found {elements}, expected 1 or more")
    return ELEMENTS if elements is None else elements


def driven_rows(
    motions: Mapping[str, Array], matrices: Mapping[str, Any], kept: Callable[[Array], Array]
) -> dict[str, Array]:
    """Return the rows of points at which supports that move drive a structure, (motions, DOFs), by name.

    The other DOFs u of a structure whose supports move by d s obey

        M u'' + C u' + K u = -(M d)_u s'' - (C d)_u s' - (K d)_u s.

    Args:
        motions: Motions d of all DOFs, 0 but at the support, (all DOFs, motions), by the name of the support.
        matrices: Matrices of all DOFs, by the letter behind the name of the point.
        kept: Returns the part of forces on all DOFs, (all DOFs, motions), that acts on those of the structure.
    """
    return {
        f"{name}: {letter}": -np.asarray(kept(A @ d)).T for name, d in motions.items() for letter, A in matrices.items()
    }


def in_two_planes(one: Structure) -> Structure:
    """Return a beam that bends in two planes alike, with points of two motions; the frame moves along the first.

    Args:
        one: The beam in one plane, of a section with equal second moments.
    """
    M, K, C = (None if A is None else _twice(A) for A in (one.M, one.K, one.C))
    rows = {name: np.kron(np.eye(2), point.rows) for name, point in one.points.items()}
    rigid = None if one.rigid is None else np.kron(np.eye(2), one.rigid)
    inertia = None if one.inertia is None else np.concatenate([one.inertia, np.zeros(one.size)])
    frame = {name: np.append(along, 0.0) for name, along in one.frame.items()}
    made = Structure(M, K, C, rows, rigid, one.name, inertia, frame or None)
    made.gauges = {name: np.asarray(np.kron(np.eye(2), stress)) for name, stress in one.gauges.items()}
    return made


def _twice(A: Any) -> Any:
    return sp.block_diag([A, A], format="csr") if sp.issparse(A) else np.kron(np.eye(2), A)


def _parts(whole: TimoshenkoBeam, places: Sequence[float]) -> list[TimoshenkoBeam]:
    """Return the beam in parts that end at all places, with elements of nearly one length."""
    stops = np.unique(np.array([0.0, whole.length, *places]))
    stops = stops[np.concatenate([[True], np.diff(stops) > SAME * whole.length])]
    stops[-1] = whole.length
    return [
        replace(whole, length=float(b - a), elements=max(1, round(whole.elements * (b - a) / whole.length)))
        for a, b in pairwise(stops)
    ]


def _node(x: Array, place: float) -> int:
    return int(np.abs(x - place).argmin())
