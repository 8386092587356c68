"""Shapes of the structures of a scene in `shapes.json`: undeformed, at the start, and at their largest displacement."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.run.output.atomic_files import written
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.schema.record_table import SHAPES_FILE
from gapbeam.solver.system.operators import Array

ANGLES = 48  # of the outline of a region in a plane
FARTHEST = 0.5  # of the size of the structures: a wall that is farther away is none
HALVINGS = 60


def has_shapes(scene: Scene) -> bool:
    """Return whether a structure of a scene has nodes in space."""
    return any(one.geometry is not None for one in scene.structures)


def displacements(scene: Scene, q: Array) -> list[Array | None]:
    """Return the displacements of the nodes of each structure, (nodes, 3), m; None where it has none in space.

    Args:
        scene: The scene.
        q: Its coordinates, (n,).
    """
    found: list[Array | None] = []
    for one, i, j in zip(scene.structures, scene.start, scene.start[1:], strict=False):
        u = q[i:j] if scene.is_large else one.modes[2] @ q[i:j]
        found.append(None if one.geometry is None else one.geometry.displacements(u))
    return found


def largest(scene: Scene, q: Array) -> float:
    """Return the largest displacement of a node, m."""
    moved = (one for one in displacements(scene, q) if one is not None)
    return max((float(np.linalg.norm(one, axis=1).max()) for one in moved), default=0.0)


def write_shapes(folder: Path, scene: Scene, states: dict[str, tuple[float, Array]]) -> None:
    """Write the shapes of a run; nothing where no structure has nodes in space.

    Args:
        folder: Results folder.
        scene: The scene.
        states: Time, s, and coordinates by name.

    Raises:
        NotWritten: The file could not be written.
    """
    if not has_shapes(scene):
        return
    moved = {name: displacements(scene, q) for name, (_, q) in states.items()}
    known = [(k, one, one.geometry) for k, one in enumerate(scene.structures) if one.geometry is not None]
    size = float(np.linalg.norm(np.ptp(np.vstack([shape.places for _, _, shape in known]), axis=0)))
    bodies = []
    for k, one, shape in known:
        shapes = {name: found[k] for name, found in moved.items()}
        bodies.append({"name": one.name, "places": shape.places.tolist(), "lines": np.asarray(shape.lines).tolist(),
                       "shapes": {name: u.tolist() for name, u in shapes.items() if u is not None}})  # fmt: skip
    contents = {
        "structures": bodies,
        "supports": [found for one in scene.contacts for found in _support(scene, one, FARTHEST * size)],
        "times": {name: t for name, (t, _) in states.items()},
    }
    path = folder / SHAPES_FILE
    with written(path):
        path.write_text(json.dumps(contents, allow_nan=False) + "\n", encoding="utf-8")


def _support(scene: Scene, contact: Contact, far: float) -> Iterator[dict[str, Any]]:
    """Yield a contact of a point whose place is known: where it is, its directions, and how far it may move."""
    point = contact.points[0]
    placed = _placed(scene, point)
    if placed is None or len(contact.points) > 1:
        return
    place, ways = placed
    found = {"name": contact.name, "place": place.tolist(), "ways": ways.tolist(), "walls": []}
    if not contact.law.kind.adhesive:
        found["walls"] = _walls(contact, far).tolist()
    yield found


def _placed(scene: Scene, point: StructurePoint) -> tuple[Array, Array] | None:
    place = scene.place_of(point.structure, "a contact")
    shape = scene.structures[place].geometry
    return None if shape is None else shape.points.get(point.name)


def _walls(contact: Contact, far: float) -> Array:
    """Return the near places of walls around a point, (walls, motions), m: both ways, all around, or of a flat wall."""
    turns = np.linspace(0.0, 2.0 * np.pi, ANGLES, endpoint=False)
    flat = contact.region.normals if contact.region.motions == 3 else np.array([[1.0], [-1.0]])
    rays = np.column_stack([np.cos(turns), np.sin(turns)]) if contact.region.motions == 2 else flat
    at = contact.place_at_rest[: contact.region.motions, 0]
    low: Array = np.zeros(len(rays))
    high: Array = np.full(len(rays), far)
    open_ = contact.region.penetration(at + high[:, None] * rays)[0] < 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        inside = contact.region.penetration(at + middle[:, None] * rays)[0] < 0.0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    found: Array = (low[:, None] * rays)[~open_]
    return found
