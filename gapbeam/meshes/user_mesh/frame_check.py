"""Size, place and orientation of a user's mesh against the dimensions of the beam."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.contact_span import ContactSpan
from gapbeam.meshes.mesh_errors import MeshError

TOLERANCE = 0.01
"""How much a dimension of the file may differ from the case, relative to that dimension."""

Coordinates = npt.NDArray[np.float64]


def check_frame(where: str, geometry: BeamGeometry, faces: dict[str, Coordinates], body: Coordinates) -> None:
    """Check that the mesh is the beam of the case.

    Args:
        where: The file, for messages.
        geometry: The beam of the case.
        faces: Coordinates (nodes, 3) of what faces each support, by name, in m.
        body: Coordinates (nodes, 3) of the body, in m.

    Raises:
        MeshError: another size, place or orientation; a face does not cover its support.
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
    for span in geometry.spans:
        _check_support(f"{where}, group {span.name}", geometry, span, faces[span.name][:, 0])
    means = {span: float(faces[span.name][:, dimension - 1].mean()) for span in geometry.spans}
    for lower, upper in permutations(geometry.spans, 2):
        alike = (lower.start, lower.end) == (upper.start, upper.end)
        if alike and lower.below and not upper.below and means[lower] >= means[upper]:
            axis = "xyz"[dimension - 1]
            raise MeshError(
                where,
                found=f"{lower.name} at {axis} = {means[lower]:g} m and {upper.name} at {axis} = {means[upper]:g} m "
                "on average",
                expected=f"{lower.name} below {upper.name}, {axis} pointing up",
                hint=f'Perhaps the names "{lower.name}" and "{upper.name}" are exchanged.',
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


def _check_support(where: str, geometry: BeamGeometry, span: ContactSpan, x: Coordinates) -> None:
    """A contact face reaches from the start to the end of its support."""
    length, wanted = geometry.length, np.array([span.start, span.end])
    ends = np.array([x.min(), x.max()])
    if np.all(np.abs(ends - wanted) <= TOLERANCE * (span.end - span.start)):
        return
    mirrored = np.all(np.abs(ends - (length - wanted[::-1])) <= TOLERANCE * length)
    raise MeshError(
        where,
        found=f"facets from x = {ends[0]:g} m to x = {ends[1]:g} m",
        expected=f"from x = {span.start:g} to x = {span.end:g} m, the length of the support",
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
