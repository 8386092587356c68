"""The same mesh on one, two and three ranks, and errors of rank 0 on all of them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mpi4py import MPI

from gapbeam.meshes.mesh_size import BeamSizing
from gapbeam.meshes.tagged_mesh import build_beam
from tests.shared.mesh_figures import described
from tests.shared.processes import LONGEST
from tests.unit.test_meshes import CELLS, POINTS_3D, beam, integral

PROJECT = Path(__file__).parents[2]
pytestmark = [
    pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="starts ranks of its own"),
    pytest.mark.versions,
]


def on_ranks(count: int, program: str, *arguments: str) -> list[str]:
    """Run a Python program on several ranks; returns the lines it printed."""
    environment = {**os.environ, "PYTHONPATH": str(PROJECT)}
    command = [
        "mpirun",
        "-n",
        str(count),
        sys.executable,
        "-m",
        "mpi4py",
        "-m",
        f"tests.programs.{program}",
        *arguments,
    ]
    done = subprocess.run(
        command, cwd=PROJECT, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("count", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_same_mesh_on_ranks(count: int) -> None:
    """Counts, sizes, areas and the points; every rank has cells and knows the same figures."""
    lines = on_ranks(count, "meshes_on_ranks")
    assert len(lines) == len(CELLS)
    for cell, line in zip(CELLS, lines, strict=True):
        figures, areas, distance = json.loads(line)
        tagged = build_beam(MPI.COMM_SELF, beam(cell, *POINTS_3D), BeamSizing(cell))
        alone = json.loads(json.dumps(described(tagged)))
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
    damaged, missing, absurd = on_ranks(2, "mesh_faults_on_ranks", str(path))
    assert "damaged" in damaged
    assert "found no such file" in missing
    assert "In the same folder: beam.msh" in missing
    assert "layers" in absurd
