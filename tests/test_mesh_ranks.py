"""The same mesh on one, two and three ranks, and errors of rank 0 on all of them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mpi4py import MPI

from meshes.build import build_beam
from meshes.describe import describe
from meshes.sizing import BeamSizing
from tests.test_meshes import CELLS, POINTS_3D, beam, integral

PROJECT = Path(__file__).parent.parent

pytestmark = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="starts ranks of its own")

BUILD = """
import json
from tests.test_meshes import *

for cell in CELLS:
    geometry = beam(cell, *POINTS_3D)
    tagged = build_beam(COMM, geometry, BeamSizing(cell))
    owned = COMM.allgather(tagged.mesh.topology.index_map(tagged.dimension).size_local)
    assert min(owned) > 0 and sum(owned) == tagged.cell_count, owned
    facets = COMM.allgather(len(tagged.facets_of("base")))
    assert sum(facets) == tagged.facet_counts["base"], facets
    assert max(facets) <= 2 * min(facets), facets
    figures = COMM.allgather(json.dumps(describe(tagged)))
    assert len(set(figures)) == 1, figures
    areas = [integral(tagged, name) for name in tagged.groups]
    distances = [nearest_vertex(tagged, point) for point in geometry.points]
    if COMM.rank == 0:
        print(json.dumps([json.loads(figures[0]), areas, max(distances)]))
"""

FAIL = """
import sys
from mpi4py import MPI
from meshes.build import build_beam
from meshes.errors import MeshError
from meshes.files import read_mesh
from meshes.geometry import BeamGeometry
from meshes.sizing import BeamSizing

comm = MPI.COMM_WORLD
geometry = BeamGeometry(3, 0.3, 0.01, 0.02, 0.05)
for work in (
    lambda: read_mesh(comm, sys.argv[1], geometry),
    lambda: read_mesh(comm, sys.argv[1] + ".not", geometry),
    lambda: build_beam(comm, geometry, BeamSizing("hexahedron", size=1e-9)),
):
    try:
        work()
    except MeshError as error:
        messages = comm.allgather(str(error))
        assert len(set(messages)) == 1, messages
        if comm.rank == 0:
            print(messages[0])
    else:
        raise SystemExit("no error")
"""


def on_ranks(count: int, program: str, *arguments: str) -> list[str]:
    """Run a Python program on several ranks; returns the lines it printed."""
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    command = ["mpirun", "-n", str(count), sys.executable, "-m", "mpi4py", "-c", program, *arguments]
    done = subprocess.run(
        command, cwd=PROJECT, env=environment, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("count", [2, 3])
def test_same_mesh_on_ranks(count: int) -> None:
    """Counts, sizes, areas and the points; every rank has cells and knows the same figures."""
    lines = on_ranks(count, BUILD)
    assert len(lines) == len(CELLS)
    for cell, line in zip(CELLS, lines, strict=True):
        figures, areas, distance = json.loads(line)
        tagged = build_beam(MPI.COMM_SELF, beam(cell, *POINTS_3D), BeamSizing(cell))
        alone = json.loads(json.dumps(describe(tagged)))
        for name in alone:
            if isinstance(alone[name], float):
                assert figures[name] == pytest.approx(alone[name], rel=1e-12), name
            else:
                assert figures[name] == alone[name], name
        assert areas == pytest.approx([integral(tagged, name) for name in tagged.groups], rel=1e-12)
        assert distance < 1e-12


def test_errors_of_rank_zero_reach_all(tmp_path: Path) -> None:
    """A damaged file, a missing one and an absurd size: the same MeshError everywhere, and nobody waits."""
    path = tmp_path / "beam.msh"
    path.write_bytes(b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1 1\n$EndNodes\n")
    damaged, missing, absurd = on_ranks(2, FAIL, str(path))
    assert "damaged" in damaged
    assert "found no such file" in missing
    assert "In the same folder: beam.msh" in missing
    assert "layers" in absurd
