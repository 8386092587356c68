"""Faults of meshes that rank 0 finds: an error with the same words on all ranks."""

from __future__ import annotations

import sys
from collections.abc import Callable

from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BeamGeometry
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.mesh_size import BeamSizing
from gapbeam.meshes.tagged_mesh import build_beam
from gapbeam.meshes.user_mesh.user_mesh import read_mesh

comm = MPI.COMM_WORLD
geometry = BeamGeometry(3, 0.3, 0.01, 0.02, 0.05)
works: tuple[Callable[[], object], ...] = (
    lambda: read_mesh(comm, sys.argv[1], geometry),
    lambda: read_mesh(comm, sys.argv[1] + ".not", geometry),
    lambda: build_beam(comm, geometry, BeamSizing("hexahedron", size=1e-9)),
)
for work in works:
    try:
        work()
    except MeshError as error:
        messages = comm.allgather(str(error))
        assert len(set(messages)) == 1, messages
        if comm.rank == 0:
            print(messages[0])
    else:
        raise SystemExit("no error")
