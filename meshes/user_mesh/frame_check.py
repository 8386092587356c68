"""Size, place and orientation of a user's mesh against the dimensions of the beam."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.group_names import CONTACT_FACES
from gapbeam.meshes.mesh_errors import MeshError

TOLERANCE = 0.01
"""How much a dimension of the file may differ from the case, relative to that dimension."""

Coordinates = npt.NDArray[np.float64]


def check_frame(where: str, geometry: BeamGeometry, faces: dict[str, Coordinates], body: Coordinates) -> None:
    """Check that the mesh is the beam of the case.

    Args:
        where: The file, for messages.
        geometry: The beam of the case.
        faces: Coordinates (nodes, 3) of base and gland, in m.
        body: Coordinates (nodes, 3) of the body, in m.

    Raises:
        MeshError: another size, place or orientation; base or gland do not cover the support.
    """
    dimension = geometry.dimension
    if not np.all(np.isfinite(body)):
        raise MeshError(where, found="coordinates that are not finite", expected="finite coordinates")
    if dimension == 2 and np.ptp(body[:, 2]) > TOLERANCE * geometry.thickness:
        raise MeshError(
            where,
            found=f"z between {body[:, 2].min():g} and {body[:, 2].max():g} m",
            expected="a plane mesh: x along the beam, y in the bending direction, z constant",
        )
    lower, upper = body[:, :dimension].min(axis=0), body[:, :dimension].max(axis=0)
    expected = np.array(geometry.upper) - np.array(geometry.lower)
    _check_size(where, upper - lower, expected)
    _check_place(where, lower, np.array(geometry.lower), expected)
    for name in CONTACT_FACES:
        _check_support(f"{where}, group {name}", geometry, faces[name][:, 0])
    heights = [faces[name][:, dimension - 1].mean() for name in CONTACT_FACES]
    if heights[0] >= heights[1]:
        axis = "xyz"[dimension - 1]
        raise MeshError(
            where,
            found=f"base at {axis} = {heights[0]:g} m and gland at {axis} = {heights[1]:g} m on average",
            expected=f"base below gland, {axis} pointing up",
            hint='Perhaps the names "base" and "gland" are exchanged.',
        )


def _check_size(where: str, found: Coordinates, expected: Coordinates) -> None:
    if np.all(np.abs(found - expected) <= TOLERANCE * expected):
        return
    raise MeshError(
        where,
        found=f"a mesh of {_sizes(found)} m",
        expected=f"{_sizes(expected)} m, the {_names(len(expected))} of the beam within {TOLERANCE:.0%}",
        hint=_size_hint(found, expected),
    )


def _size_hint(found: Coordinates, expected: Coordinates) -> str:
    factor = float(np.exp(np.mean(np.log(np.maximum(found, 1e-300) / expected))))
    if np.all(np.abs(found - factor * expected) <= TOLERANCE * factor * expected):
        if abs(factor - 1000) < 30:
            return "The file seems to be in mm: save it with Mesh.ScalingFactor = 0.001."
        if abs(factor - 0.001) < 3e-5:
            return "The dimensions of the beam in the case seem to be in mm: they are in m."
        return f"The file is {factor:.4g} times as large: scale it by {1 / factor:.4g}."
    for order in permutations(range(len(expected))):
        if np.all(np.abs(found[list(order)] - expected) <= TOLERANCE * expected):
            return f"The axes seem to be exchanged: {_axes(len(expected))}."
    return ""


def _check_place(where: str, found: Coordinates, expected: Coordinates, size: Coordinates) -> None:
    if np.any(np.abs(found - expected) > TOLERANCE * size):
        raise MeshError(
            where,
            found=f"a mesh that begins at {_point(found)} m",
            expected=f"one that begins at {_point(expected)} m",
            hint=f"Move it by {_point(expected - found)} m: x = 0 is the supported end, "
            "the other coordinates are measured from the beam axis.",
        )


def _check_support(where: str, geometry: BeamGeometry, x: Coordinates) -> None:
    """Base and gland reach from x = 0 to the end of the support."""
    length, support = geometry.length, geometry.support_length
    ends = np.array([x.min(), x.max()])
    if np.all(np.abs(ends - (0.0, support)) <= TOLERANCE * support):
        return
    mirrored = np.all(np.abs(ends - (length - support, length)) <= TOLERANCE * length)
    raise MeshError(
        where,
        found=f"facets from x = {ends[0]:g} m to x = {ends[1]:g} m",
        expected=f"from x = 0 to x = {support:g} m, the length of the support",
        hint="The supported end seems to be at the far end: turn the mesh around." if mirrored else "",
    )


def _names(dimension: int) -> str:
    return "length (x) and thickness (y)" if dimension == 2 else "length (x), width (y) and thickness (z)"


def _axes(dimension: int) -> str:
    return "x is along the beam, y across its thickness" + (
        "" if dimension == 2 else "; z takes the thickness and y the width"
    )


def _sizes(values: Coordinates) -> str:
    return " x ".join(f"{value:.4g}" for value in values)


def _point(values: Coordinates) -> str:
    return f"({', '.join(f'{value + 0.0:.4g}' for value in values)})"
