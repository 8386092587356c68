"""Nodes with their sets from input of Abaqus and CalculiX, tables, and meshes that meshio reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.system.operators import Array

TABLES = (".txt", ".csv", ".dat", ".nodes", ".nod")
BLOCK = 3


@dataclass(frozen=True)
class Nodes:
    """Nodes of a model.

    Attributes:
        places: Coordinates by node, (3,), in the unit of the file.
        sets: Nodes by the name of their set, in capitals.
        added: Nodes that no file has, of a finer mesh: clamps hold them, points leave them out.
    """

    places: dict[str, Array]
    sets: dict[str, list[str]] = field(default_factory=dict)
    added: frozenset[str] = frozenset()

    def of_set(self, name: str, argument: str) -> list[str]:
        """Return the nodes of a set.

        Raises:
            ArgumentError: No set has this name.
        """
        if name.upper() not in self.sets:
            known = ", ".join(sorted(self.sets)) or "none"
            raise ArgumentError(f"found the set {name!r}, expected one of the file of nodes: {known}", argument)
        return self.sets[name.upper()]

    def nearest(self, place: Array, among: Mapping[str, object]) -> tuple[str, float, float]:
        """Return the node nearest to a place, of some nodes, its distance, and the size of all, in the file's unit."""
        names = [one for one in self.places if one in among]
        distances = np.linalg.norm(np.array([self.places[one] for one in names]) - place, axis=1)
        span = np.ptp([*self.places.values()], axis=0)
        return names[int(distances.argmin())], float(distances.min()), float(np.linalg.norm(span))


def read_nodes(path: Path) -> Nodes:
    """Return the nodes of a file: `.inp`, "node x y z" lines, or a format of meshio, whose nodes count from 1 on.

    Raises:
        ArgumentError: The file cannot be read, or holds no nodes.
    """
    try:
        if path.suffix == ".inp":
            found = nodes_of_input(input_blocks(path.read_text(encoding="utf-8-sig")))
        elif path.suffix in TABLES:
            found = Nodes(_rows(path.read_text(encoding="utf-8-sig").splitlines()))
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


class InputBlock(NamedTuple):
    """A keyword of Abaqus or CalculiX with its options, in capitals, and the fields of the lines below it."""

    keyword: str
    options: dict[str, str]
    rows: list[list[str]]


def input_blocks(text: str) -> list[InputBlock]:
    """Return the blocks of input of Abaqus or CalculiX; included files have no keyword before their nodes."""
    blocks = [InputBlock("NODE", {}, [])]
    for line in text.splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            kind, *options = [part.strip() for part in line[1:].upper().split(",")]
            pairs = (option.partition("=")[::2] for option in options)
            blocks.append(InputBlock(kind, {key.strip(): value.strip(' "') for key, value in pairs}, []))
        elif '"' in line:
            blocks[-1].rows.append([field.strip(' "') for field in line.split(",") if field.strip()])
        else:
            blocks[-1].rows.append(line.replace(",", " ").split())
    return blocks


def set_members(block: InputBlock, sets: Mapping[str, list[str]]) -> list[str]:
    """Return the numbers in a block of a set: one by one, a range, or those of other sets.

    Raises:
        ArgumentError: A name is that of no set above.
    """
    if "GENERATE" in block.options:
        ranges = ([*map(int, row), 1][:3] for row in block.rows)
        return [str(one) for first, last, step in ranges for one in range(first, last + 1, step)]
    found = list[str]()
    for name in [name.upper() for row in block.rows for name in row]:
        own = name if name in sets else name.rpartition(".")[2]  # an instance stands before its nodes and sets
        if not own.isdigit() and own not in sets:
            words = f"found {name} below *{block.keyword}, expected a number or a set above"
            raise ArgumentError(f"{words}: {', '.join(sets) or 'none'}", "file")
        found += [own] if own.isdigit() else sets[own]
    return found


def nodes_of_input(blocks: Sequence[InputBlock]) -> Nodes:
    """Return nodes and sets of input of Abaqus or CalculiX, from *NODE and *NSET."""
    places: dict[str, Array] = {}
    sets: dict[str, list[str]] = {}
    for block in blocks:
        if block.keyword == "NODE":
            for row in block.rows:
                places[row[0]] = np.array([*map(float, row[1:]), 0.0, 0.0][:3])
            members = [row[0] for row in block.rows]
        elif block.keyword == "NSET" and "ELSET" not in block.options:
            members = set_members(block, sets)
        else:
            continue
        if block.options.get("NSET"):
            sets.setdefault(block.options["NSET"], []).extend(members)
    return Nodes(places, sets)


def meshio_mesh(path: Path) -> Any:
    """Return the mesh of a file that meshio reads, without its prints.

    Raises:
        ValueError: The file has no mesh that meshio reads.
    """
    import meshio

    try:
        with redirect_stdout(StringIO()):
            return meshio.read(path)
    except (meshio.ReadError, SystemExit, KeyError, AssertionError, RuntimeError, ImportError) as error:
        raise ValueError(str(error) or "meshio gave up") from None


def _by_meshio(path: Path) -> Nodes:
    mesh = meshio_mesh(path)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    places = {str(i + 1): at for i, at in enumerate(points)}
    sets = {name.upper(): [str(int(i) + 1) for i in np.ravel(group)] for name, group in mesh.point_sets.items()}
    return Nodes(places, sets)
