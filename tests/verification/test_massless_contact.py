"""Massless contact nodes, lumped masses and the explicit scheme on finite element models."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.diagnostics.energy_ledger import Ledger, enter_step, open_ledger, restate
from gapbeam.solver.integrators.stable_step import SAFETY, stable_step
from gapbeam.solver.linear_algebra.smooth_modes import rigid_body_modes
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.semi_discrete import State
from tests.shared.command import DEMO, RATTLE, alone, called, on_ranks, settings
from tests.shared.models import SOLID, beam_model, mass_of, seat_of, spread, stiffness_of, thrown

MESHES: dict[str, dict[str, Any]] = {
    "quadrilaterals": {},
    "triangles": {"cell": "triangle"},
    "linear": {"degree": 1, "cells_through_thickness": 3},
    "hexahedra": {**SOLID, "cells_through_thickness": 2},
    "tetrahedra": {**SOLID, "cells_through_thickness": 2, "cell": "tetrahedron"},
}
UNDAMPED_EXPLICIT = {"scheme": "central-difference", "step": 1.0e-9, "end": 1.0e-6}


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("mesh", MESHES)
def test_rigid_motions_keep_momentum_and_energy(mesh: str) -> None:
    """R^T M R of translations and rotations: mass, center of gravity and inertia are those of the full matrix."""
    whole = beam_model({"mesh": MESHES[mesh]})
    moved = beam_model({"mesh": MESHES[mesh], "contact": {"mass": "redistributed"}})
    motions = rigid_body_modes(whole.space)
    before, after = (motions.T @ (mass_of(model) @ motions) for model in (whole, moved))
    assert np.abs(after - before).max() < 1e-13 * np.abs(before).max()
    massless = moved.system.operators.massless
    interface = moved.system.contact.interface
    assert massless[interface.owned].all()
    assert not whole.system.operators.massless.any()
    matrix = mass_of(moved)
    assert abs(matrix[massless]).sum() == 0.0
    least = eigsh(matrix[~massless][:, ~massless], 1, sigma=0.0, return_eigenvectors=False)[0]
    assert least > 0.0


@pytest.mark.parametrize("mesh", MESHES)
def test_lumped_masses_keep_the_mass(mesh: str) -> None:
    """Diagonal, positive, and of the mass of the beam, on every node or on those inside the body."""
    mass = 7919.0 * 0.51 * 0.012 * 0.02
    dimension = MESHES[mesh].get("dimension", 2)
    for way in ("consistent", "redistributed"):
        model = beam_model({"mesh": MESHES[mesh], "contact": {"mass": way}, "time": UNDAMPED_EXPLICIT})
        matrix = mass_of(model)
        diagonal = matrix.diagonal()
        assert matrix.nnz == len(diagonal)
        assert diagonal[~model.system.operators.massless].min() > 0.0
        assert diagonal.sum() == pytest.approx(dimension * mass, rel=1e-12)
        x = model.space.tabulate_dof_coordinates()[:, 0]
        assert diagonal[::dimension] @ x / mass == pytest.approx(0.255, rel=1e-3)


def test_one_layer_of_nodes_is_not_enough() -> None:
    """Linear cells, two through the thickness, leave one layer of nodes between the faces."""
    mesh = {"degree": 1, "cells_through_thickness": 1, "edge_size": 6.0e-3}
    with pytest.raises(UserError, match="two layers"):
        beam_model({"mesh": mesh, "contact": {"mass": "redistributed"}})


def test_cells_that_are_long_for_their_height_are_not_enough() -> None:
    """Two layers of cells of 25 mm by 6 mm are too few nodes; shorter cells, as the message says, are enough."""
    mesh = {"cells_through_thickness": 2, "size": 0.05, "support_size": 0.025, "edge_size": 0.025}
    with pytest.raises(UserError, match=r"a smaller mesh\.support_size"):
        beam_model({"mesh": mesh, "contact": {"mass": "redistributed"}})
    beam_model({"mesh": mesh | {"support_size": 0.006, "edge_size": 0.006}, "contact": {"mass": "redistributed"}})


@pytest.mark.parametrize("mesh", ["quadrilaterals", "linear"])
@pytest.mark.parametrize("way", ["consistent", "redistributed"])
def test_stable_step_follows_from_the_highest_frequency(mesh: str, way: str) -> None:
    """2/omega with omega by ARPACK on M^-1 (K + springs of the closed contact), or on the DOFs with mass."""
    model = beam_model({"mesh": MESHES[mesh], "contact": {"mass": way}, "time": UNDAMPED_EXPLICIT})
    system, free = model.system, ~model.system.operators.massless
    matrix = stiffness_of(model)
    if way == "consistent":
        matrix = matrix + spread(system.contact.springs(model.law.stiffness), matrix.shape[0])
    squared = eigsh(matrix[free][:, free], 1, mass_of(model)[free][:, free], which="LM")[0][0]
    limit = SAFETY * 2.0 / np.sqrt(squared)
    found = stable_step(system, model.law, 1e-6)
    assert 0.94 * limit <= found.step <= limit * 1.0001
    assert found.frequency == pytest.approx(np.sqrt(squared), rel=2e-3)


def flight(model: Model, dt: float, steps: int) -> tuple[Ledger, State]:
    """Throw the beam through its clearance; the ledger and the state at the end."""
    scheme = model.case.time.scheme
    state = thrown(model)
    plan = March(model.system, model.law, scheme, EffectiveOperators(model.system, scheme), dt, steps)
    ledger = open_ledger(model.system, model.law, state)
    for step in march(plan, state):
        ledger = enter_step(model.system, model.law, ledger, step)
        if step.refreshed is not None:
            ledger = restate(model.system, model.law, ledger, step.refreshed)
        state = step.refreshed or step.new
    return ledger, state


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("way", ["consistent", "redistributed"])
def test_explicit_flights_conserve_energy_below_the_limit_only(way: str) -> None:
    """At the limit the balance closes and little is created; 1.3 times the limit without safety blows up."""
    changes = {"mesh": MESHES["linear"], "contact": {"mass": way}, "time": UNDAMPED_EXPLICIT}
    model = beam_model(changes, loads=())
    limit = stable_step(model.system, model.law, 1e-6).step
    ledger, _ = flight(model, limit, 3000)
    assert abs(ledger.residual) < 1e-6 * ledger.exchanged
    assert abs(ledger.created) < 5e-3 * ledger.exchanged
    with np.errstate(all="ignore"):
        beyond, _ = flight(model, 1.3 * limit / SAFETY, 100)
    assert not abs(beyond.created) < ledger.exchanged


def test_explicit_and_implicit_flights_agree() -> None:
    """Exact contact on massless nodes: after 0.75 ms with impacts within 2 % of the way."""
    contact = {"mass": "redistributed", "formulation": "unilateral"}
    ends = []
    for scheme, step in (("central-difference", 1.0e-9), ("implicit-midpoint", 1.0e-6)):
        time = {"scheme": scheme, "step": step, "end": 1.0e-3}
        model = beam_model({"mesh": MESHES["linear"], "contact": contact, "time": time}, loads=())
        dt = stable_step(model.system, model.law, 1e-6).step if scheme == "central-difference" else step
        ledger, state = flight(model, 7.5e-4 / np.ceil(7.5e-4 / dt), int(np.ceil(7.5e-4 / dt)))
        assert ledger.exchanged > 0.0
        ends.append(state.u[0])
    way = np.abs(ends[1]).max()
    assert np.abs(ends[1] - ends[0]).max() < 0.02 * way


def test_steps_beyond_the_limit_are_refused(tmp_path: Path) -> None:
    """Exit status 2, the step that is allowed in the message, and nothing written."""
    done = called("run", DEMO, "--set", 'time.scheme="central-difference"', "--output", tmp_path / "results")
    assert done.returncode == 2
    for words in ("time.step", "0.0001 s", "expected at most", "without damping", "discrete-gradient"):
        assert words in done.stderr
    assert not (tmp_path / "results").exists()


def test_velocity_of_a_node_without_mass_is_that_of_its_displacement(tmp_path: Path) -> None:
    """A probe on a contact node records du/dt, not the rate that a scheme carries where no inertia holds it.

    The mass of the neighbors is moved there too, so that the velocity of the body beside is of the same size.
    """
    probes = "probe=[{name = 'node', point = [0.025, -0.006]}, {name = 'inside', point = [0.025, 0.0]}]"
    words = (*RATTLE, "time.end=0.03", "contact.mass=redistributed", probes)
    outcome = gapbeam.run(DEMO, words, tmp_path / "out")
    assert outcome.summary["peak_contact_force"]["base"] > 500.0
    found = open_results(tmp_path / "out").history
    place, velocity = (found[name].sel(probe="node").values for name in ("displacement", "velocity"))
    mean = np.diff(place, axis=0) / np.diff(found["time"].values)[:, None]
    np.testing.assert_allclose(velocity[1:], mean, rtol=0.0, atol=1e-12)
    inside = found["velocity"].sel(probe="inside").values
    assert np.abs(velocity).max() < 5.0 * np.abs(inside).max()


@pytest.mark.parametrize("formulation", ["unilateral", "augmented-lagrangian", "nitsche", "penalty"])
def test_massless_nodes_go_with_every_formulation(formulation: str) -> None:
    """The seat is the same with and without mass on the faces, and a short flight keeps its balance."""
    contact = {"formulation": formulation}
    scheme = {"scheme": "implicit-midpoint", "step": 2.0e-5, "end": 1.0e-3}
    whole, moved = (
        beam_model({"contact": {**contact, "mass": way}, "time": scheme}) for way in ("consistent", "redistributed")
    )
    reactions = [float(seat_of(model).state.pressure @ model.system.contact.weights) for model in (whole, moved)]
    assert reactions[1] == pytest.approx(reactions[0], rel=0.01)
    ledger, _ = flight(moved, 2.0e-5, 100)
    assert abs(ledger.residual) < 1e-6 * ledger.exchanged
    assert ledger.created < 1e-6 * ledger.exchanged


@pytest.mark.slow
@alone
def test_ranks_agree_explicitly(tmp_path: Path) -> None:
    """The explicit scheme with massless nodes on two ranks: the same motion as on one."""
    overrides = settings(
        "time.scheme=central-difference",
        "contact.mass=redistributed",
        "damping={mass=4.0,stiffness=0.0}",
        "mesh.degree=1",
        "mesh.cells_through_thickness=4",
        "load.shaker.ramp=0",
        "load.shaker.amplitude=2000",
        "time.step=4e-7",
        "time.end=1e-3",
        "output.history_interval=1e-4",
        "output.fields_interval=5e-4",
    )
    ends = []
    for count in (1, 2):
        folder = tmp_path / str(count)
        done = on_ranks(count, "run", DEMO, "--output", folder, *overrides)
        assert done.returncode == 0, done.stderr
        ends.append(gapbeam.open_results(folder).history)
    first, second = ends
    for name in ("displacement", "velocity"):
        size = np.abs(first[name].values).max()
        assert np.abs(first[name].values - second[name].values).max() < 1e-8 * size
