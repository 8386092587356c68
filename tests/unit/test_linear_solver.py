"""Which linear solver a model gets, and that contact by iterations is that by a factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

import gapbeam
from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.case.beam_motions import axial_restraint, lateral_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import SolverTable
from gapbeam.solver.contact.solve.condensation import CondensedOperator, MatrixFreeOperator, condensed_operator
from gapbeam.solver.linear_algebra.iterative_factor import ConjugateGradients
from gapbeam.solver.linear_algebra.petsc_operators import GIGABYTE, PetscOperators, linear_solver
from gapbeam.solver.memory.memory_estimate import MemoryNeeds, free_here, free_memory, memory_needs
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.run.run_case import run_case
from tests.shared.command import alone, called
from tests.shared.models import beam_case, beam_model

pytestmark = [alone, pytest.mark.versions]

NEEDS = MemoryNeeds(8.0e9, 15.0e9, 6.0e9)
SHAKEN = {"time": {"end": 0.004, "step": 1.0e-4}, "damping": {"frequencies": [40.0, 300.0], "ratios": [0.02, 0.02]}}
LOADS = [
    {"type": "gravity"},
    {"type": "harmonic_force", "name": "shaker", "point": 0.15, "amplitude": 300.0, "frequency": 100.0},
]
PROBES = {"tip": 0.51}
THREE = {
    "time": {"end": 0.002, "step": 1.0e-4},
    "mesh": {
        "dimension": 3,
        "size": 0.06,
        "support_size": 0.025,
        "cells_through_thickness": 1,
        "cells_across_width": 1,
    },
}


def shaken(solver: dict[str, object], changes: dict[str, object] | None = None) -> Case:
    return beam_case({**SHAKEN, **(changes or {}), "solver": solver}, LOADS, PROBES)


@pytest.mark.parametrize(
    ("table", "free", "needed", "iterative", "columns"),
    [
        ({}, 40e9, None, False, 0.9 * 40e9 - 23e9),
        ({}, 20e9, None, True, 0.0),
        ({}, 20e9, "friction", False, 0.0),
        ({"memory": 24.0}, 1e9, None, False, 1e9),
        ({"effective": "iterative"}, 1e12, None, True, 0.9e12 - 23e9),
        ({"effective": "factor"}, 1e9, None, False, 0.0),
        ({"effective": "factor", "columns": "keep"}, 1e9, None, False, None),
        ({"columns": "drop"}, 1e12, None, False, 0.0),
    ],
)
def test_a_factor_is_taken_as_long_as_it_fits(
    table: dict[str, object], free: float, needed: str | None, iterative: bool, columns: float | None
) -> None:
    chosen = linear_solver(SolverTable(**table), NEEDS, free, needed)
    assert chosen.iterative == iterative
    assert chosen.columns_limit == (None if columns is None else pytest.approx(columns))
    if needed is not None:
        assert needed in chosen.reason


def test_needs_follow_the_measured_ones() -> None:
    # docs/benchmarks/large-models.md: peaks of whole processes with a factor, responses not kept
    for dofs, measured in ((195_075, 3.57e9), (363_825, 6.45e9), (956_217, 18.35e9)):
        needs = memory_needs(dofs, 3)
        assert needs.matrices + needs.factor == pytest.approx(measured, rel=0.05)
    # a march of 956 217 DOFs by iterations took 13.3 GB (docs/benchmarks/large-models.md)
    needs = memory_needs(956_217, 3)
    assert needs.matrices + needs.preconditioner == pytest.approx(13.3e9, rel=0.1)
    assert memory_needs(1e6, 2).factor < 0.1 * memory_needs(1e6, 3).factor


def test_memory_of_the_machine_is_found() -> None:
    total = 1024.0 * float(Path("/proc/meminfo").read_text().split("MemTotal:")[1].split()[0])
    assert 0.01 * GIGABYTE < free_here() <= total
    assert free_memory(MPI.COMM_SELF) == pytest.approx(free_here(), rel=0.5)


def test_iterations_solve_with_the_effective_operator() -> None:
    model = beam_model({"solver": {"effective": "iterative", "tolerance": 1e-11}}, LOADS)
    operators = model.system.operators
    assert isinstance(operators, PetscOperators)
    force = model.body.patterns[1]
    for mass, stiffness in ((2.0e4, 5.0e-5), (1.0e5, 1.0)):
        factor = operators.factor(mass, stiffness)
        assert isinstance(factor, ConjugateGradients)
        x = factor.solve(force)
        left = force - mass * operators.apply_mass(x) - stiffness * operators.apply_stiffness(x)
        assert np.linalg.norm(left) < 1e-7 * np.linalg.norm(force)
        assert factor.iterations < 40  # multigrid: not hundreds, as by the diagonal


def test_response_to_contact_forces_is_that_of_the_delassus_operator() -> None:
    by_factor = beam_model({"solver": {"effective": "factor"}}, LOADS).system
    by_iterations = beam_model({"solver": {"effective": "iterative", "tolerance": 1e-12}}, LOADS).system
    dense, free = (condensed_operator(system, 2.0e4, 5.0e-5) for system in (by_factor, by_iterations))
    assert isinstance(dense, CondensedOperator)
    assert isinstance(free, MatrixFreeOperator)
    forces = np.random.default_rng(0).standard_normal(by_factor.contact.size)
    assert free.respond(forces).gaps == pytest.approx(
        dense.delassus @ forces, rel=1e-8, abs=1e-9 * np.abs(dense.delassus).max()
    )
    active = np.arange(3, 40)
    compliance = np.full(len(active), 1e-9)
    target, known = np.linspace(1.0, 2.0, len(active)) * 1e-6, np.zeros_like(forces)
    found, response = free.solve_linearized(5.0e-5, active, compliance, target, known, None)
    matrix = 5.0e-5 * dense.delassus[np.ix_(active, active)] + np.diag(compliance)
    assert found[active] == pytest.approx(np.linalg.solve(matrix, target), rel=1e-6)
    assert response.gaps == pytest.approx(dense.delassus @ found, rel=1e-6, abs=1e-12)


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(
    "changes",
    [{}, {"mesh": {"degree": 1}}, pytest.param(THREE, marks=pytest.mark.slow)],
    ids=["2D", "degree 1", "3D"],
)
def test_beam_rattles_by_iterations_as_by_a_factor(tmp_path: Path, changes: dict[str, object]) -> None:
    """Forces and deflections are the same to 1e-6; where the weak restraint alone holds the beam, its forces are.

    What iterations leave of a force, a share e, moves the beam by e F / k there: as much as the spring k is soft.
    """
    case, outcomes = shaken({}, changes), {}
    for name, solver in (
        ("factor", {"effective": "factor", "columns": "keep"}),
        ("dropped", {"effective": "factor", "columns": "drop"}),
        ("iterative", {"effective": "iterative", "tolerance": 1e-11}),
    ):
        outcome = run_case(shaken(solver, changes), tmp_path / name, MPI.COMM_SELF)
        assert outcome.exit_status == 0
        outcomes[name] = open_results(tmp_path / name)
    reference = outcomes["factor"].history
    forces = reference["contact_force"].values
    assert np.min(forces) == 0.0  # it lifts off
    held = {"x": axial_restraint(case).value}
    if case.mesh.dimension == 3:
        held["y"] = lateral_restraint(case).value
    for name in ("dropped", "iterative"):
        history = outcomes[name].history
        assert np.max(np.abs(history["contact_force"].values - forces)) < 1e-6 * np.max(forces), name
        apart = np.abs(history["displacement"] - reference["displacement"]).max(("time", "probe"))
        for component in apart.component.values:
            off, size = float(apart.sel(component=component)), np.max(np.abs(reference["displacement"].values))
            springs = held.get(str(component), np.max(forces) / size)
            assert springs * off < 1e-6 * np.max(forces), (name, component)
    assert outcomes["iterative"].summary["model"]["solver"]["iterative"] is True
    assert any("conjugate gradients" in words for words in outcomes["iterative"].summary["warnings"])


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("interface", ["free", "fixed"])
def test_a_basis_by_iterations_spans_what_one_by_a_factor_does(tmp_path: Path, interface: str) -> None:
    reduced = {"model": {"type": "reduced", "modes": 8, "interface": interface}}
    histories = []
    for effective in ("factor", "iterative"):
        outcome = run_case(shaken({"effective": effective}, reduced), tmp_path / effective, MPI.COMM_SELF)
        assert outcome.exit_status == 0
        histories.append(open_results(tmp_path / effective).history)
    wanted, found = (history["displacement"].values for history in histories)
    assert np.max(np.abs(found - wanted)) < 1e-5 * np.max(np.abs(wanted))


@pytest.mark.slow(minutes=0.5)
def test_modes_of_thin_walls_are_found_by_iterations() -> None:
    """The preconditioner is weak on thin walls: hundreds of steps, over which round-off must not add up."""
    tube = {
        "beam": {
            "length": 0.236,
            "thickness": 0.00306,
            "width": 0.00306,
            "section": {"type": "tube", "wall": 0.00073},
        },
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.41, "density": 7850.0},
        "support": {"length": 0.0862, "clearance": 1.0e-6},
        "mesh": {
            "dimension": 3,
            "size": 0.0283,
            "support_size": 0.0345,
            "edge_size": 0.0129,
            "cells_through_thickness": 1,
            "cells_across_width": 1,
        },
        "model": {"type": "reduced", "modes": 6},
        "load": [{"type": "gravity"}],
        "time": {"end": 0.01, "step": 1.0e-4},
    }
    exact, found = (
        gapbeam.model(gapbeam.read_case(tube | {"solver": {"effective": effective}})).model.body.basis
        for effective in ("factor", "iterative")
    )
    assert exact is not None
    assert found is not None
    assert found.modes == exact.modes
    assert found.highest_mode == pytest.approx(exact.highest_mode, rel=1e-6)


def test_options_of_petsc_reach_the_iterations() -> None:
    options = PETSc.Options()
    options["gapbeam_effective_ksp_max_it"] = 1
    try:
        model = beam_model({"solver": {"effective": "iterative"}}, LOADS)
        with pytest.raises(RunError, match="conjugate gradients did not solve"):
            model.system.operators.factor(2.0e4, 5.0e-5).solve(model.body.patterns[1])
    finally:
        options.delValue("gapbeam_effective_ksp_max_it")


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ("[contact.friction]\ncoefficient = 0.2\n", "friction"),
        ('[contact]\nformulation = "nitsche"\n', "nitsche"),
    ],
)
def test_what_needs_a_factor_refuses_iterations(tmp_path: Path, changes: str, named: str) -> None:
    path = tmp_path / "case.toml"
    path.write_text(Path("cases/demo.toml").read_text() + changes)
    result = called("run", str(path), "--set", "solver.effective=iterative", "--output", str(tmp_path / "out"))
    assert result.returncode == 2
    assert "effective" in result.stderr
    assert named in result.stderr
    assert not (tmp_path / "out").exists()
