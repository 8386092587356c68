"""Stress at points as rows of DOFs: at the surface of beams and frames, from the forces at the ends of elements.

Forces K_e u at the end of an element are those that the section carries there: N along the axis, M_y and M_z across, T
about it. At a place (y, z) of the surface of a round section of diameter D, with axes of the section,

    axial stress = N / A + M_y z / I_y - M_z y / I_z,     shear by twist = T D / (2 J).

At a node between two elements the mean of both is taken. Stresses of static forces at nodes are exact; where a force q
per length acts, as weight and inertia do, the moment misses q l^2 / 12 in an element of length l.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.system.operators import Array

ACROSS = 0.5
"""Least sine of the angle between a direction of stress and the axis."""


TENSOR = 6
"""Components xx, yy, zz, yz, xz, xy of a stress; x is along the axis of a beam, or the direction of a gauge."""


def von_mises(stress: Array) -> Array:
    """Return the von Mises stress, (...,), of stresses, (..., 6)."""
    xx, yy, zz, yz, xz, xy = np.moveaxis(stress, -1, 0)
    spread = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.asarray(np.sqrt(0.5 * spread + 3.0 * (yz**2 + xz**2 + xy**2)))


def surface_tensor(axial: Any, shear: Any) -> list[Any]:
    """Return the rows of a stress at a surface: along the axis, and by twist; each (DOFs,)."""
    none = np.zeros_like(axial)
    return [axial, none, none, none, none, shear]


def gauge_rows(
    gauges: Iterable[str], points: Mapping[str, object], driven: Mapping[str, Array], where: str,
    rows_at: Callable[[str, str, str], Array], kept: Callable[[Array], Any],
) -> dict[str, Array]:  # fmt: skip
    """Return the rows of the stress at points with gauges, (6 motions, DOFs), by name; see `Structure.gauges`.

    Args:
        gauges: Names of the points.
        points: All points by name.
        driven: Motions of all DOFs with supports that loads move, (all DOFs, motions), by name.
        where: Name of the structure in messages.
        rows_at: Returns the rows of all DOFs at a point of a name; for messages it takes place and argument, too.
        kept: Returns the part of rows that belongs to the DOFs of the structure.

    Raises:
        ArgumentError: A name is no point, or a support moves an end of the element, whose motion the rows miss.
    """
    found = dict[str, Array]()
    for key in gauges:
        if key not in points:
            raise ArgumentError(f"{where}: found a stress at {key!r}, which is no point of it", "gauges")
        named, argument = f"{where}: point {key}", f"points.{key}"
        rows = rows_at(key, named, argument)
        for name, moved in driven.items():
            if np.any(rows @ moved):
                raise ArgumentError(
                    f"{named}: found a stress within an element of the support {name}, which a load moves, expected a "
                    "place farther from it, or more elements",
                    argument,
                )
        found[key] = np.asarray(kept(rows))
    return found


def end_forces(stiffness: Array, node: int, ends: tuple[int, int], size: int) -> Array:
    """Return the rows of the forces that the section at a node carries in an element, (motions, DOFs).

    Args:
        stiffness: Matrix of the element, (2 motions, 2 motions).
        node: The node.
        ends: Its nodes at the start and at the end along the axis.
        size: Number of DOFs of all nodes.
    """
    motions = len(stiffness) // 2
    at = np.concatenate([motions * end + np.arange(motions) for end in ends])
    found = np.zeros((motions, size))
    found[:, at] = stiffness[motions:] if node == ends[1] else -stiffness[:motions]
    return found


def mean_of_sides(sides: Sequence[Array], where: str, argument: str, breaks: bool) -> Array:
    """Return the mean of what the elements on both sides of a place have.

    Args:
        sides: One or two of them.
        where: Name of the place in messages.
        argument: Argument that gives the place.
        breaks: Whether a clamp or another member stands there, so that the stress jumps.

    Raises:
        ArgumentError: The stress jumps at the place.
    """
    if breaks and len(sides) > 1:
        raise ArgumentError(
            f"{where}: found a stress where a clamp or another member is, expected a place beside: it jumps there",
            argument,
        )
    return np.asarray(np.mean(sides, axis=0))


def surface_rows(
    forces: Array, axes: Array, directions: Iterable[Array], section: Any, where: str, argument: str
) -> Array:
    """Return the rows of axial stress and of shear by twist at the surface of a round section, (6 directions, DOFs).

    Args:
        forces: Rows of forces and moments along x, y and z of space, (6, DOFs).
        axes: Axes of the section as rows: along the axis, y, z.
        directions: Directions from the axis to the surface, (3,) each.
        section: Figures of the section, a `SpaceSection`.
        where: Name of the place in messages.
        argument: Argument that gives the place.

    Raises:
        ArgumentError: The section is not round, or a direction is along the axis.
    """
    if not section.diameter > 0.0:
        raise ArgumentError(
            f"{where}: found a stress of a section that is not round, expected one of type round or tube: the shear by "
            "twist is known there only",
            argument,
        )
    (n, _, _), (t, m_y, m_z) = axes @ forces[:3], axes @ forces[3:]
    found = []
    for way in directions:
        _, y, z = axes @ way
        across = float(np.hypot(y, z))
        if not across > ACROSS:
            raise ArgumentError(
                f"{where}: found a stress on the side of {np.round(way, 6).tolist()}, along the axis, expected a "
                "direction across it",
                argument,
            )
        y, z = (0.5 * section.diameter * one / across for one in (y, z))
        axial = n / section.area + m_y * z / section.second_moment - m_z * y / section.lateral_moment
        found += surface_tensor(axial, 0.5 * section.diameter / section.torsion_constant * t)
    return np.array(found)
