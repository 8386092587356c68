"""Models with fewer contact points on round faces: the seat agrees with the mesh, or the model is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

from gapbeam.meshes.gmsh_model import gmsh_session
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.models.reduction.contact_lines import across_lines, within_reach
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.models import beam_model

LENGTH, RADIUS, SUPPORT = 0.4, 0.02, 0.08  # m
REDUCED = {"type": "reduced", "modes": 10, "shapes": 5}


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Mesh a round bar; its lower and its upper half in the support are base and gland."""
    path: Path = tmp_path_factory.mktemp("bar") / "bar.msh"
    with gmsh_session(MPI.COMM_SELF):
        model = gmsh.model.occ
        halves: list[tuple[int, int]] = []
        for x, length in ((0.0, SUPPORT), (SUPPORT, LENGTH - SUPPORT)):
            for bottom in (-2.0 * RADIUS, 0.0):
                round_bar = (3, model.addCylinder(x, 0, 0, length, 0, 0, RADIUS))
                half_space = (3, model.addBox(x, -2.0 * RADIUS, bottom, length, 4.0 * RADIUS, 2.0 * RADIUS))
                halves += model.intersect([round_bar], [half_space])[0]
        model.fragment(halves, [])
        model.synchronize()
        solids = [tag for _, tag in gmsh.model.getEntities(3)]
        faces: dict[str, list[int]] = {"base": [], "gland": []}
        for _, tag in gmsh.model.getBoundary([(3, tag) for tag in solids], oriented=False):
            x, _, z = gmsh.model.occ.getCenterOfMass(2, tag)
            if 1e-6 < x < SUPPORT - 1e-6 and abs(z) > 0.3 * RADIUS:
                faces["base" if z < 0.0 else "gland"].append(tag)
        gmsh.model.addPhysicalGroup(3, solids, name="body")
        for name, tags in faces.items():
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.02)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    return path


def model_of(bar: Path, model: Mapping[str, Any]) -> Model:
    """Return the bar under its weight as a model."""
    return beam_model(
        {
            "beam": {"length": LENGTH, "thickness": 2.0 * RADIUS, "width": 2.0 * RADIUS},
            "support": {"length": SUPPORT, "clearance": 0.2e-3},
            "mesh": {"dimension": 3, "file": str(bar)},
            "model": model,
        },
        probes={"tip": LENGTH},
    )


def tip_of(model: Model) -> float:
    """Return the height of the tip at the seat, m."""
    state = Simulation(model).seat().state
    return float(model.probes["tip"].evaluate(state.u[VALUE], model.system.operators)[-1])


@pytest.mark.slow(minutes=0.1)
def test_the_seat_is_that_of_the_mesh(bar: Path) -> None:
    """Reduced and rigid models on fewer points tilt in the play as the full one does, to a few percent."""
    full = tip_of(model_of(bar, {"type": "full"}))
    # by hand the bar turns about the edge of the base until its end meets the gland; few points lie near both
    assert 1.0 < full / (-0.2e-3 * (LENGTH - SUPPORT) / SUPPORT) < 2.0
    reduced = model_of(bar, REDUCED)
    assert isinstance(reduced.system.contact, ResultantOperator)
    assert tip_of(reduced) == pytest.approx(full, rel=1e-3)
    assert tip_of(model_of(bar, {"type": "rigid"})) == pytest.approx(full, rel=0.02)


def test_points_out_of_reach_are_left_out(bar: Path) -> None:
    """Flat lines are gathered, round ones keep the points of the mesh that lie near the lowest."""
    contact = model_of(bar, {"type": "full"}).system.contact
    reach = 0.1 * RADIUS
    kept = across_lines(contact, 4, False, 1e-3, reach)
    near = within_reach(contact, reach)
    assert 0 < near.sum() < contact.size
    assert kept.size == near.sum()
    assert np.sort(kept.initial_gap) == pytest.approx(np.sort(contact.initial_gap[near]), abs=1e-15)
    for face in (0, 1):
        of_face = contact.faces == face
        height = np.abs(contact.positions[:, 2])
        assert height[of_face & near].min() >= height[of_face].max() - reach - 1e-12
        assert height[of_face & ~near].max() < height[of_face].max() - reach
    flat = across_lines(replace(contact, initial_gap=np.zeros(contact.size)), 4, False, 1e-3, reach)
    assert flat.size < contact.size
    assert float(flat.weights.sum()) == pytest.approx(float(contact.weights.sum()), rel=1e-12)


def test_means_over_a_round_face_are_refused(bar: Path) -> None:
    """A model whose points are means over other gaps than those of their place does not get to its seat."""
    model = model_of(bar, {"type": "rigid"})
    contact = model.system.contact
    assert isinstance(contact, ResultantOperator)
    mesh = contact.distributed
    even = across_lines(replace(mesh, initial_gap=np.zeros(mesh.size)), 4, False, 1e-3)
    assert isinstance(even, ResultantOperator)
    means = replace(
        even,
        initial_gap=np.asarray(even.shares @ mesh.initial_gap),
        gap_matrix=csr_matrix(even.shares @ mesh.gap_matrix),
        distributed=mesh,
        support=contact.support,
    )
    averaged = replace(model, system=replace(model.system, contact=means))
    with pytest.raises(UserError) as refused:
        Simulation(averaged).seat()
    for words in ('[model] type = "rigid"', "base", "undeformed", "found:", "expected:", "try:"):
        assert words in str(refused.value)
    assert refused.value.exit_status == 2
