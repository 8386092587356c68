"""What field files take of a motion at the corners of the cells, against interpolation by DOLFINx."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from scipy.spatial import KDTree

import gapbeam
from gapbeam.meshes.mesh_readings import vector_space
from gapbeam.meshes.serial_mesh import SerialMesh
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.output.nodal_stresses import CornerValues
from tests.verification.test_joints_and_masses import ROOT, joint, tables

pytestmark = pytest.mark.versions

SOLID: dict[str, Any] = {"dimension": 3, "size": 0.05, "support_size": 0.02, "cells_through_thickness": 2}


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(
    "more",
    [
        {"model": {"type": "full"}},
        {"model": {"type": "full"}, "mesh": {"degree": 1, "cell": "triangle"}},
        {"model": {"type": "reduced"}, "mesh": SOLID},
        {"model": {"type": "reduced"}, "mesh": SOLID | {"cell": "tetrahedron"}},
        {"model": {"type": "beam", "elements": 12}},
    ],
    ids=["slice", "triangles of degree 1", "reduced solid", "reduced tetrahedra", "beam"],
)
def test_corners_move_as_interpolation_says(more: dict[str, Any]) -> None:
    """The linear function through the corners is what DOLFINx interpolates, for any motion of what is marched.

    Of meshes that are arrays, which DOLFINx does not know, corners are nodes.
    """
    model = build_model(gapbeam.read_case(tables(joint=[joint(ROOT, "clamped")], **more)), MPI.COMM_SELF)
    dimension = model.case.mesh.dimension
    motion = np.random.default_rng(3).normal(size=model.system.operators.size)
    if isinstance(model.space.mesh, SerialMesh):
        linear = vector_space(model.space.mesh, 1)
        nodes = KDTree(model.space.tabulate_dof_coordinates()).query(linear.tabulate_dof_coordinates())[1]
        (found,) = CornerValues.of_model(model, linear).vectors(motion[None])
        wanted = model.expand(motion).reshape(-1, dimension)[nodes]
        assert found[:, :dimension] == pytest.approx(wanted, rel=1e-12, abs=1e-12 * np.abs(wanted).max())
        return
    linear = fem.functionspace(model.space.mesh, ("Lagrange", 1, (dimension,)))
    fine, coarse = fem.Function(model.space), fem.Function(linear)
    fine.x.array[:] = model.expand(motion)
    coarse.interpolate(fine)
    (found,) = CornerValues.of_model(model, linear).vectors(motion[None])
    wanted = coarse.x.array.reshape(-1, dimension)
    assert found[:, :dimension] == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())
    assert not np.any(found[:, dimension:])
