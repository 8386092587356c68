"""Shapes of the structures of a scene over a run: `shapes.json` for pictures, `shapes.xdmf` and `shapes.h5` for films.

Places are those of the undeformed structures; displacements are in space, m.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.run.output.atomic_files import new_hdf5, written
from gapbeam.solver.run.output.hdf5_files import GrowingSeries
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.schema.record_table import SHAPES_DATA_FILE, SHAPES_FIELDS_FILE, SHAPES_FILE
from gapbeam.solver.system.operators import Array

ANGLES = 48  # of the outline of a region in a plane
FARTHEST = 0.5  # of the size of the structures: a wall that is farther away is none
HALVINGS = 60
FRAMES = 200
"""Shapes over a run, where it does not say how many."""
AT_ONCE = 2**22  # numbers of all shapes of a run, where it does not say how many


class ShapeFrames:
    """Coordinates of a scene at the start, from time to time, and at the end of a march.

    Attributes:
        every: Steps from one to the next.
        q: Coordinates, (frames, n); without nodes in space none are kept.
        times: s; NaN: not yet.
    """

    def __init__(self, marcher: Marcher, steps: int, every: int | None) -> None:
        size, bodies = marcher.scene.size, marcher.scene.structures
        nodes = sum(len(one.geometry.places) for one in bodies if one.geometry is not None)
        self.every = every or -(-steps // max(2, min(FRAMES, AT_ONCE // max(size, 3 * nodes, 1))))
        count = -(-steps // self.every) + 1 if nodes else 0
        self.q, self.times = np.zeros((count, size)), np.full(count, np.nan)
        self.take(marcher)

    @property
    def taken(self) -> int:
        """Number of shapes up to now."""
        return int(np.isfinite(self.times).sum())

    def due(self, count: int) -> int:
        """Return the steps from `count` to the next shape."""
        return max(1, self.taken * self.every - count)

    def take(self, marcher: Marcher, last: bool = False) -> None:
        """Keep the shape after a step where one is due, or where the march ends."""
        k = self.taken
        if k < len(self.times) and (last or marcher.count >= k * self.every) and np.isfinite(marcher.q).all():
            self.q[k], self.times[k] = marcher.q[:, 0], marcher.t


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


def write_shapes(folder: Path, scene: Scene, frames: ShapeFrames) -> None:
    """Write the shapes of a run; nothing where no structure has nodes in space.

    Args:
        folder: Results folder.
        scene: The scene.
        frames: Its shapes.

    Raises:
        NotWritten: A file could not be written.
    """
    if not frames.taken:
        return
    times = frames.times[: frames.taken]
    moved = [displacements(scene, q) for q in frames.q[: frames.taken]]
    sizes = [max(float(np.linalg.norm(u, axis=1).max()) for u in one if u is not None) for one in moved]
    chosen = {"start": 0, "largest": int(np.argmax(sizes))}
    known = [(k, one, one.geometry) for k, one in enumerate(scene.structures) if one.geometry is not None]
    size = float(np.linalg.norm(np.ptp(np.vstack([shape.places for _, _, shape in known]), axis=0)))
    bodies = []
    for k, one, shape in known:
        shapes = {name: moved[i][k] for name, i in chosen.items()}
        bodies.append({"name": one.name, "places": shape.places.tolist(), "lines": np.asarray(shape.lines).tolist(),
                       "shapes": {name: u.tolist() for name, u in shapes.items() if u is not None}})  # fmt: skip
    contents = {
        "structures": bodies,
        "supports": [found for one in scene.contacts for found in _support(scene, one, FARTHEST * size)],
        "times": {name: float(times[i]) for name, i in chosen.items()},
    }
    path = folder / SHAPES_FILE
    with written(path):
        path.write_text(json.dumps(contents, allow_nan=False) + "\n", encoding="utf-8")
    start, lines = 0, list[Array]()
    for _, _, shape in known:
        lines.append(np.asarray(shape.lines, dtype=int).reshape(-1, 2) + start)
        start += len(shape.places)
    data = folder / SHAPES_DATA_FILE
    with written(data), new_hdf5(data) as file:
        file["places"], file["lines"] = np.vstack([shape.places for _, _, shape in known]), np.vstack(lines)
        file["times"] = times
        for i, parts in enumerate(moved):
            file[f"displacement/{i}"] = np.vstack([one for one in parts if one is not None])
    fields, drawn = folder / SHAPES_FIELDS_FILE, sum(map(len, lines))
    with written(fields):
        GrowingSeries(fields).finish([_grid(i, float(t), start, drawn) for i, t in enumerate(times)])


def _grid(number: int, time: float, nodes: int, lines: int) -> str:
    """Return the XML of a shape: lines between nodes, or the nodes alone."""

    def item(name: str, shape: str, kind: str) -> str:
        place = f"{SHAPES_DATA_FILE}:/{name}"
        return f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="8" Format="HDF">{place}</DataItem>'

    cells = f'<Topology TopologyType="Polyvertex" NumberOfElements="{nodes}"/>'
    if lines:
        cells = f'<Topology TopologyType="Polyline" NodesPerElement="2" NumberOfElements="{lines}">'
        cells += item("lines", f"{lines} 2", "Int") + "</Topology>"
    return (
        f'<Grid Name="shape {number}" GridType="Uniform"><Time Value="{time!r}"/>{cells}'
        f'<Geometry GeometryType="XYZ">{item("places", f"{nodes} 3", "Float")}</Geometry>'
        '<Attribute Name="displacement" AttributeType="Vector" Center="Node">'
        f"{item(f'displacement/{number}', f'{nodes} 3', 'Float')}</Attribute></Grid>"
    )


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
