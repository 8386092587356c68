"""Drawn faults of mesh files: refused with what is wrong and where, or the same body as without them."""

from __future__ import annotations

import random
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gapbeam.meshes.mesh_errors import MeshError
from tests.shared.command import alone
from tests.shared.forms import compiled_form
from tests.unit.test_mesh_files import LENGTH, SUPPORT, THICKNESS, read, user_file
from tests.unit.test_meshes import integral

pytestmark = [pytest.mark.versions, alone]


@dataclass
class MeshText:
    """A file of version 2.2 in words: what is before the nodes, the nodes, and the cells with their facets."""

    head: list[str]
    nodes: list[list[str]]
    cells: list[list[str]]

    @classmethod
    def read(cls, path: Path) -> MeshText:
        """Read a file."""
        lines = path.read_text(encoding="utf-8").split("\n")
        nodes, cells = lines.index("$Nodes"), lines.index("$Elements")
        words = [line.split() for line in lines]
        return cls(
            lines[:nodes],
            words[nodes + 2 : nodes + 2 + int(lines[nodes + 1])],
            words[cells + 2 : cells + 2 + int(lines[cells + 1])],
        )

    def write(self, path: Path) -> None:
        """Write a file."""
        nodes = ["$Nodes", str(len(self.nodes)), *map(" ".join, self.nodes), "$EndNodes"]
        cells = ["$Elements", str(len(self.cells)), *map(" ".join, self.cells), "$EndElements", ""]
        path.write_text("\n".join([*self.head, *nodes, *cells]), encoding="utf-8")


def no_number(mesh: MeshText, chance: random.Random) -> None:
    chance.choice(mesh.nodes)[chance.randrange(1, 4)] = chance.choice(["nan", "inf", "-inf", "1e400", "x"])


def moved(mesh: MeshText, chance: random.Random) -> None:
    node = chance.choice(mesh.nodes)
    node[chance.randrange(1, 4)] = repr(float(node[1]) + chance.choice((-1, 1)) * 10.0 ** chance.uniform(-2, 2))


def crack(mesh: MeshText, chance: random.Random) -> None:
    """Two nodes at one place."""
    node = list(chance.choice(mesh.nodes))
    before, node[0] = node[0], str(len(mesh.nodes) + 1)
    mesh.nodes.append(node)
    cell = chance.choice([one for one in mesh.cells if before in one[5:]])
    cell[5:] = [node[0] if one == before else one for one in cell[5:]]


def inverted(mesh: MeshText, chance: random.Random) -> None:
    cell = chance.choice(mesh.cells)
    one, other = chance.sample(range(5, len(cell)), 2)
    cell[one], cell[other] = cell[other], cell[one]


def flat(mesh: MeshText, chance: random.Random) -> None:
    cell = chance.choice(mesh.cells)
    cell[5] = cell[6]


def unknown_node(mesh: MeshText, chance: random.Random) -> None:
    chance.choice(mesh.cells)[-1] = str(len(mesh.nodes) + chance.randrange(1, 9))


def twice(mesh: MeshText, chance: random.Random) -> None:
    mesh.cells.append([str(len(mesh.cells) + 1), *chance.choice(mesh.cells)[1:]])


def node_twice(mesh: MeshText, chance: random.Random) -> None:
    mesh.nodes.append(list(chance.choice(mesh.nodes)))


def lone_node(mesh: MeshText, chance: random.Random) -> None:
    mesh.nodes.append([str(len(mesh.nodes) + 1), repr(chance.random()), "0.1", "0"])


def swapped(mesh: MeshText, chance: random.Random) -> None:
    one, other = chance.sample(mesh.nodes, 2)
    one[1:], other[1:] = other[1:], one[1:]


def lost_facet(mesh: MeshText, chance: random.Random) -> None:
    mesh.cells.remove(chance.choice([cell for cell in mesh.cells if cell[1] == "1"]))


def lost_group(mesh: MeshText, chance: random.Random) -> None:
    names = [line for line in mesh.head if line.count('"') == 2]
    lost = chance.choice(names)
    mesh.cells = [cell for cell in mesh.cells if cell[3] != lost.split()[1]]
    if chance.random() < 0.5:
        mesh.head[mesh.head.index(lost)] = lost.replace('"', '"x', 1)


def other_dimension(mesh: MeshText, chance: random.Random) -> None:
    """Facets alone, or the body as a group of curves."""
    kept = chance.choice(("1", "2"))
    mesh.cells = [cell for cell in mesh.cells if cell[1] == kept]


def turned(mesh: MeshText, chance: random.Random) -> None:
    """Another axis along the beam."""
    one, other = chance.sample((1, 2, 3), 2)
    for node in mesh.nodes:
        node[one], node[other] = node[other], node[one]


FAULTS: tuple[Callable[[MeshText, random.Random], None], ...] = (
    no_number, moved, crack, inverted, flat, unknown_node, twice, node_twice, lone_node, swapped, lost_facet,
    lost_group, other_dimension, turned,
)  # fmt: skip


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[int, MeshText]:
    """A mesh of triangles (0) and one of quadrilaterals."""
    folder = tmp_path_factory.mktemp("meshes")
    return {
        layers: MeshText.read(user_file(folder / f"{layers}.msh", dimension=2, layers=layers, MshFileVersion=2.2))
        for layers in (0, 3)
    }


@pytest.mark.slow(minutes=0.5)
@settings(deadline=None, max_examples=60, derandomize=True, suppress_health_check=list(HealthCheck))
@given(fault=st.sampled_from(FAULTS), layers=st.sampled_from((0, 3)), seed=st.integers(0, 2**20))
def test_drawn_faults_are_refused_or_change_nothing(
    fault: Callable[[MeshText, random.Random], None],
    layers: int,
    seed: int,
    good: dict[int, MeshText],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """A mesh that is accepted has the area, the surface and the faces of the body, and numbers only."""
    mesh, path = deepcopy(good[layers]), tmp_path_factory.mktemp("mesh") / "mesh.msh"
    fault(mesh, random.Random(seed))
    mesh.write(path)
    try:
        tagged = read(path, 2)
    except MeshError as refused:
        complete = refused.exit_status == 2 and refused.found and refused.expected
        assert complete
        return
    assert np.all(np.isfinite(tagged.mesh.geometry.x))
    surface = compiled_form(fem.Constant(tagged.mesh, 1.0) * ufl.Measure("ds", domain=tagged.mesh))
    assert integral(tagged) == pytest.approx(LENGTH * THICKNESS, rel=0.01)
    assert fem.assemble_scalar(surface) == pytest.approx(2.0 * (LENGTH + THICKNESS), rel=0.01)
    for face in ("base", "gland"):
        assert integral(tagged, face) == pytest.approx(SUPPORT, rel=0.01)
