"""Nodes with coordinates and named sets, from input of Abaqus and CalculiX, tables, or meshes by meshio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gapbeam.solver.scene.given_numbers import ArgumentError
from gapbeam.solver.system.operators import Array

TABLES = (".txt", ".csv", ".dat", ".nodes", ".nod")
BLOCK = 3


@dataclass(frozen=True)
class Nodes:
    """Nodes of a model.

    Attributes:
        places: Coordinates by node, (3,), in the unit of the file.
        sets: Nodes by the name of their set, in capitals.
    """

    places: dict[str, Array]
    sets: dict[str, list[str]] = field(default_factory=dict)

    def of_set(self, name: str, argument: str) -> list[str]:
        """Return the nodes of a set.

        Raises:
            ArgumentError: There is none of that name.
        """
        if name.upper() not in self.sets:
            known = ", ".join(sorted(self.sets)) or "none"
            raise ArgumentError(f"found the set {name!r}, expected one of the file of nodes: {known}", argument)
        return self.sets[name.upper()]

    def nearest(self, place: Array, among: Mapping[str, object]) -> str:
        """Return the node nearest to a place, in the unit of the file, of some nodes."""
        names = [one for one in self.places if one in among]
        distances = np.linalg.norm(np.array([self.places[one] for one in names]) - place, axis=1)
        return names[int(distances.argmin())]


def read_nodes(path: Path) -> Nodes:
    """Return the nodes of a file: `.inp`, "node x y z" lines, or what meshio reads, whose nodes count from 1 on.

    Raises:
        ArgumentError: The file cannot be read, or holds no nodes.
    """
    try:
        if path.suffix == ".inp":
            found = _inp(path.read_text(encoding="utf-8"))
        elif path.suffix in TABLES:
            found = Nodes(_rows(path.read_text(encoding="utf-8").splitlines()))
        else:
            found = _by_meshio(path)
    except ArgumentError:
        raise
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise ArgumentError(f"{path}: cannot be read as node x y z ({error})", "nodes") from None
    if not found.places:
        raise ArgumentError(f"{path}: found no nodes, expected lines of node x y z", "nodes")
    wrong = next((one for one, at in found.places.items() if not np.all(np.isfinite(at))), None)
    if wrong is not None:
        raise ArgumentError(f"{path}: found coordinates of node {wrong} that are not finite", "nodes")
    return found


def _rows(lines: Sequence[str]) -> dict[str, Array]:
    split = [line.replace(",", " ").split() for line in lines]
    return {one[0]: np.array(one[1:4], dtype=float) for one in split if len(one) == 1 + BLOCK and one[0].isdigit()}


def _inp(text: str) -> Nodes:
    """Return nodes and sets of input of Abaqus or CalculiX: what stands below *NODE and *NSET."""
    places: dict[str, Array] = {}
    sets: dict[str, list[str]] = {}
    kind, name, generated = "NODE", "", False  # included files have no keyword
    for line in text.splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            kind, *options = [part.strip() for part in line[1:].upper().split(",")]
            given = dict(option.partition("=")[::2] for option in options)
            name = {key.strip(): value.strip() for key, value in given.items()}.get("NSET", "")
            generated = "GENERATE" in given
            continue
        fields = line.replace(",", " ").split()
        if kind == "NODE":
            places[fields[0]] = np.array([*map(float, fields[1:]), 0.0, 0.0][:3])
            members = fields[:1]
        elif kind == "NSET":
            members = fields
            if generated:
                first, last, step = [*map(int, fields), 1][:3]
                members = [str(node) for node in range(first, last + 1, step)]
            members = [node for one in members for node in ([one] if one.isdigit() else sets.get(one.upper(), []))]
        else:
            continue
        if name:
            sets.setdefault(name, []).extend(members)
    return Nodes(places, sets)


def _by_meshio(path: Path) -> Nodes:
    import meshio

    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, SystemExit, KeyError, AssertionError) as error:
        raise ValueError(str(error) or "meshio gave up") from None
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    places = {str(i + 1): at for i, at in enumerate(points)}
    sets = {name.upper(): [str(int(i) + 1) for i in np.ravel(group)] for name, group in mesh.point_sets.items()}
    return Nodes(places, sets)
