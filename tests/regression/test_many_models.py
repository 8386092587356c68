"""Many models in one process: communicators of MPI, of which MPICH has 2048, are let go of."""

from __future__ import annotations

import gc
import weakref
from copy import copy

import pytest
from dolfinx import fem
from dolfinx.fem import petsc

from gapbeam.meshes.versions.mesh_geometry import cell_matrix, let_go
from gapbeam.solver.models import body
from tests.shared.models import beam_model

pytestmark = pytest.mark.versions


def test_meshes_that_nothing_needs_are_let_go_of() -> None:
    """Whether or not Python looks for cycles; a segmentation fault in DOLFINx came after some 600 meshes."""
    meshes = []
    gc.disable()
    try:
        for _ in range(2 * body.FEWEST):
            meshes.append(weakref.ref(beam_model({"mesh": {"degree": 1}}).body.meshed.tagged.mesh))
    finally:
        gc.enable()
    assert sum(mesh() is not None for mesh in meshes) <= body.FEWEST


def test_matrices_that_nothing_needs_are_freed() -> None:
    """With DOLFINx alone they stayed: 25 MB and a communicator of each model of 58 000 DOFs."""
    space = beam_model({}).body.meshed.space
    linear = fem.functionspace(space.mesh, ("Lagrange", 1, (2,)))
    for make in (lambda: cell_matrix(space), lambda: let_go(petsc.interpolation_matrix(linear, space))):
        matrix = make()
        same = copy(matrix)
        assert same.getRefCount() == 2
        del matrix
        assert same.getRefCount() == 1
