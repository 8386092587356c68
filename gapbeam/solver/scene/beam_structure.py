"""Beams as structures: Timoshenko elements, or a rigid bar; no mesh, no DOLFINx."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import pairwise
from math import inf
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from pydantic import TypeAdapter, ValidationError

from gapbeam.solver.case.beam_table import Material
from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.given_numbers import finite, positive
from gapbeam.solver.scene.structure import LARGE, Structure
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.system.operators import Array

ELEMENTS = 40
"""Elements of a beam by default, at least: the tenth mode is then right to 1e-5."""


class CrossSection(NamedTuple):
    """Figures of a cross-section for bending in one plane.

    Attributes:
        area: m^2.
        second_moment: About the centroid, m^4.
        shear_area: Share of the area that carries shear times the area, m^2; infinite: shear does not strain.
    """

    area: float
    second_moment: float
    shear_area: float = inf


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
        poisson_ratio: For the shear coefficient.
        values: Other keys of the section's table, such as wall = 1e-3.

    Raises:
        UserError: The type is unknown, or a key is.
    """
    size = (float(positive(thickness, "section: thickness")), float(positive(width or thickness, "section: width")))
    try:
        table = _sections().validate_python({"type": type, **values})
    except ValidationError as error:
        faults = "; ".join(
            f"{'.'.join(map(str, one['loc'][1:])) or 'type'}: {one['msg'][0].lower()}{one['msg'][1:]}"
            for one in error.errors()
        )
        raise UserError(f"section {type!r}: {faults}") from None
    area = table.area(*size)
    return CrossSection(area, table.second_moment(*size), area * table.shear_coefficient(*size, poisson_ratio))


@cache
def _sections() -> TypeAdapter[Any]:
    return TypeAdapter(SectionChoice)


def material(young_modulus: float, density: float, poisson_ratio: float = 0.3) -> Material:
    """Return an isotropic linear elastic material: Pa, kg/m^3.

    Raises:
        UserError: A value is out of range.
    """
    try:
        return Material(young_modulus=young_modulus, density=density, poisson_ratio=poisson_ratio)
    except ValidationError as error:
        faults = "; ".join(f"{one['loc'][0]}: {one['msg'][0].lower()}{one['msg'][1:]}" for one in error.errors())
        raise UserError(f"material: {faults}") from None


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
    name: str = "",
) -> Structure:
    """Return a straight beam that bends in one plane.

    Elements are exact for static loads at their nodes; nodes stand at all points and supports, so that a point is a
    deflection of a node. The inertia of rotation counts.

    Args:
        length: m.
        section: Of `section`, or own figures.
        material: Of `material`.
        points: Places along the beam by name, m from its start; each moves across the beam.
        model: "beam", or "rigid": deflection and rotation only.
        clamped: Places that neither move nor rotate, m.
        pinned: Places that do not move, m.
        elements: At least so many; default 40.
        modes: Kept modes; default all of them.
        ratio: Damping ratio of each mode.
        name: Of the structure.

    Raises:
        UserError: A place is off the beam, the model is unknown, or a rigid beam is held.

    Source: Friedman and Kosmatka (1993), Comput. Struct. 47, 473, for the matrices.
    """
    where = f"beam {name or '?'}"
    size = float(positive(length, f"{where}: length"))
    places = {key: float(finite(x, f"{where}: point {key}")) for key, x in points.items()}
    held = [float(x) for x in (*clamped, *pinned)]
    off = {key: x for key, x in (places | {f"support at {x:g}": x for x in held}).items() if not 0.0 <= x <= size}
    if off:
        raise UserError(f"{where}: expected places from 0 to {size:g} m, found {off}")
    mass, bending = material.density * section.area, material.young_modulus * section.second_moment
    rotary = material.density * section.second_moment
    if model == "rigid":
        if held or ratio or modes:
            raise UserError(f"{where}: a rigid beam has neither supports nor modes; hold it by contacts or joints")
        about = np.array([[mass * size, 0.0], [0.0, mass * size**3 / 12.0 + rotary * size]])
        rows = {key: np.array([[1.0, x - 0.5 * size]]) for key, x in places.items()}
        return Structure(about, np.zeros((2, 2)), None, rows, np.eye(2), name, [mass * size, 0.0])
    if model != "beam":
        raise UserError(f'{where}: found model {model!r}, expected "beam" or "rigid"')
    shear = material.young_modulus / (2.0 * (1.0 + material.poisson_ratio)) * section.shear_area
    x = _nodes(size, [*places.values(), *held], elements or ELEMENTS)
    M, K = _matrices(x, bending, shear, mass, rotary)
    fixed = {2 * _node(x, one) for one in held} | {2 * _node(x, one) + 1 for one in clamped}
    free = np.array([i for i in range(2 * len(x)) if i not in fixed])
    rows = {key: np.eye(2 * len(x))[2 * _node(x, one)][free] for key, one in places.items()}
    rigid = np.column_stack([np.tile([1.0, 0.0], len(x)), np.column_stack([x, np.ones_like(x)]).ravel()])
    left = 2 - np.linalg.matrix_rank(rigid[sorted(fixed)]) if fixed else 2
    if left == 1:  # one pin: it rotates about that
        rigid = rigid[:, 1:] - np.outer(rigid[:, 0], [held[0]])
    carried = (M @ np.tile([1.0, 0.0], len(x)))[free]
    M, K = M[free][:, free], K[free][:, free]
    if len(free) <= LARGE:
        M, K = M.toarray(), K.toarray()
    whole = Structure(M, K, None, rows, rigid[free] if left else None, name, carried)
    return whole if modes is None and not ratio else whole.reduced(modes or len(free), ratio)


def _nodes(length: float, places: Sequence[float], elements: int) -> Array:
    """Return nodes at all places and ends, and between them so that there are enough elements of nearly one length."""
    stops = np.unique(np.array([0.0, length, *places]))
    stops = stops[np.concatenate([[True], np.diff(stops) > 1e-9 * length])]
    stops[-1] = length
    parts = [np.linspace(a, b, max(1, round(elements * (b - a) / length)) + 1)[:-1] for a, b in pairwise(stops)]
    return np.concatenate([*parts, [length]])


def _node(x: Array, place: float) -> int:
    return int(np.abs(x - place).argmin())


def _matrices(x: Array, bending: float, shear: float, mass: float, rotary: float) -> tuple[Any, Any]:
    """Return mass and stiffness of all elements, sparse; DOFs are deflection and rotation of each node."""
    n = 2 * len(x)
    M, K = sp.lil_matrix((n, n)), sp.lil_matrix((n, n))
    s, weights = np.polynomial.legendre.leggauss(4)
    for e, l in enumerate(np.diff(x)):  # noqa: E741
        f = 12.0 * bending / (shear * l * l)
        k = bending / (l**3 * (1.0 + f)) * np.array([
            [12.0, 6.0 * l, -12.0, 6.0 * l],
            [6.0 * l, (4.0 + f) * l * l, -6.0 * l, (2.0 - f) * l * l],
            [-12.0, -6.0 * l, 12.0, -6.0 * l],
            [6.0 * l, (2.0 - f) * l * l, -6.0 * l, (4.0 + f) * l * l],
        ])  # fmt: skip
        m = np.zeros((4, 4))
        for at, weight in zip((s + 1.0) / 2.0, weights / 2.0, strict=True):
            u, t = _shapes(float(at), float(l), f)
            m += weight * l * (mass * np.outer(u, u) + rotary * np.outer(t, t))
        here = slice(2 * e, 2 * e + 4)
        K[here, here] += k
        M[here, here] += m
    return M.tocsr(), K.tocsr()


def _shapes(s: float, l: float, f: float) -> tuple[Array, Array]:  # noqa: E741
    """Return the functions of deflection and of rotation of an element at s in [0, 1], for 12 EI / (G A_s l^2) = f."""
    u = np.array([
        1 - 3 * s**2 + 2 * s**3 + f * (1 - s), l * (s - 2 * s**2 + s**3 + f / 2 * (s - s**2)),
        3 * s**2 - 2 * s**3 + f * s, l * (s**3 - s**2 + f / 2 * (s**2 - s)),
    ])  # fmt: skip
    t = np.array([6 * (s**2 - s) / l, 1 - 4 * s + 3 * s**2 + f * (1 - s), 6 * (s - s**2) / l, 3 * s**2 - 2 * s + f * s])
    return u / (1 + f), t / (1 + f)
