"""What works on many vectors at once, without a factor, against a factor, a matrix and each vector alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from gapbeam.solver.linear_algebra.iterative_factor import ConjugateGradients
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.models.reduction.vibration_modes import lowest_modes
from gapbeam.solver.system.operators import Array, Factor, Springs
from tests.shared.command import alone
from tests.shared.models import beam_model

pytestmark = [alone, pytest.mark.versions]

SHIFT = 1.0e5
THREE = {
    "dimension": 3,
    "size": 0.03,
    "support_size": 0.0125,
    "cells_through_thickness": 2,
    "cells_across_width": 2,
}
MESHES = [{}, {"degree": 1}, THREE]
NAMES = ["2D", "degree 1", "3D"]
ALL = [*MESHES[:2], pytest.param(THREE, marks=pytest.mark.slow(minutes=0.1))]


def operators_of(mesh: dict[str, object], effective: str) -> PetscOperators:
    operators = beam_model({"mesh": mesh, "solver": {"effective": effective}}).system.operators
    assert isinstance(operators, PetscOperators)
    return operators


@pytest.mark.parametrize("mesh", MESHES, ids=NAMES)
@pytest.mark.parametrize("count", [1, 16, 37])
def test_operators_multiply_columns_as_each_alone(mesh: dict[str, object], count: int) -> None:
    operators = operators_of(mesh, "factor")
    x = np.random.default_rng(0).standard_normal((operators.size, count))
    for apply in (operators.apply_mass, operators.apply_stiffness, operators.apply_restraint):
        for layout in ("C", "F"):
            images = apply(np.asarray(x, order=layout))
            assert images.shape == x.shape
            for column, found in zip(x.T, images.T, strict=True):
                alone_ = apply(np.ascontiguousarray(column))
                assert found == pytest.approx(alone_, rel=1e-12, abs=1e-12 * np.abs(alone_).max())


def test_a_basis_reads_its_matrices_for_many_vectors_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two projections: two products with each matrix, however many vectors there are."""
    operators = operators_of({}, "factor")
    products: list[tuple[str, int]] = []
    for name in ("apply_mass", "apply_stiffness"):
        apply = getattr(operators, name)
        monkeypatch.setattr(
            operators, name, lambda x, name=name, apply=apply: products.append((name, x.ndim)) or apply(x)
        )
    modal_basis(operators, np.random.default_rng(0).standard_normal((operators.size, 40)), SHIFT)
    assert sorted(products) == [("apply_mass", 2)] * 2 + [("apply_stiffness", 2)] * 2


def test_modes_of_a_body_with_mass_everywhere_take_no_more_solves_than_directions() -> None:
    """A shape is not solved for once more: only a singular M needs that."""
    operators = operators_of({}, "factor")
    factor = operators.shifted_factor(SHIFT)
    solves = {}
    for massless in (False, True):
        counted = _Counted(factor)
        modes = lowest_modes(*operators.products(), counted, SHIFT, 12, massless=massless)
        solves[massless] = counted.solves
        gram = np.stack([operators.apply_mass(x) for x in modes.shapes.T]) @ modes.shapes
        assert gram == pytest.approx(np.identity(12), abs=1e-9)
        image = np.stack([operators.apply_stiffness(x) for x in modes.shapes.T], axis=1)
        assert np.diag(modes.shapes.T @ image) + SHIFT == pytest.approx(modes.squares + SHIFT, rel=1e-8)
    assert solves[False] + 12 <= solves[True]


class _Counted:
    """A factor that counts its solves."""

    def __init__(self, factor: Factor) -> None:
        self._factor, self.solves = factor, 0

    def solve(self, right_side: Array) -> Array:
        self.solves += 1
        return self._factor.solve(right_side)


def test_iterations_feel_no_more_of_rigid_motions_than_their_inertia() -> None:
    """The assembled K of a fine mesh resists rigid motions by round-off, which is more than the shift adds."""
    fine = {**THREE, "size": 0.01, "support_size": 0.005, "cells_through_thickness": 4, "cells_across_width": 4}
    operators, shift = operators_of(fine, "iterative"), 1.0e-3
    factor = operators.shifted_factor(shift)
    assert isinstance(factor, ConjugateGradients)
    motions = factor.rigid
    heavy = np.stack([shift * operators.apply_mass(motion) for motion in motions.T], axis=1)
    held = np.stack([operators.apply_restraint(motion) for motion in motions.T], axis=1)
    exact = motions.T @ (heavy + held)
    assert motions.T @ factor.multiply(motions) == pytest.approx(exact, rel=1e-9, abs=1e-9 * np.abs(exact).max())
    both = np.random.default_rng(0).standard_normal((operators.size, 2)) + 1e3 * motions[:, :2]
    images = factor.multiply(both)
    assert both[:, 0] @ images[:, 1] == pytest.approx(both[:, 1] @ images[:, 0], rel=1e-12)
    assembled = operators.shifted_solver(*operators.matrices(), shift, 1e-7)
    assert isinstance(assembled, ConjugateGradients)
    assert np.abs(motions.T @ assembled.multiply(motions) - exact).max() > 1e-6 * np.abs(exact).max()


@pytest.mark.parametrize("mesh", ALL, ids=NAMES)
def test_modes_without_a_solve_are_those_by_a_factor(mesh: dict[str, object]) -> None:
    found = {}
    for effective in ("factor", "iterative"):
        operators = operators_of(mesh, effective)
        factor = operators.shifted_solver(*operators.matrices(), SHIFT, 1e-7)
        for below in (None, 2000.0):
            modes = lowest_modes(*operators.products(), factor, SHIFT, 8, below)
            gram = np.stack([operators.apply_mass(x) for x in modes.shapes.T]) @ modes.shapes
            assert gram == pytest.approx(np.identity(len(gram)), abs=1e-9)
            found[effective, below] = modes.squares
    for below in (None, 2000.0):
        wanted = found["factor", below]
        assert len(wanted) == len(found["iterative", below])
        assert found["iterative", below] + SHIFT == pytest.approx(wanted + SHIFT, rel=1e-8)


@pytest.mark.parametrize("mesh", [{}, THREE], ids=["2D", "3D"])
def test_solves_with_stiff_springs_iterate_little_once_the_preconditioner_has_them(mesh: dict[str, object]) -> None:
    model = beam_model({"mesh": mesh, "solver": {"effective": "iterative"}})
    operators, contact = model.system.operators, model.system.contact
    factor = operators.factor(2.0e4, 5.0e-5)
    assert isinstance(factor, ConjugateGradients)
    gap, stiff = contact.gap_matrix, 1.0e12 * contact.weights
    springs = Springs(contact.interface, csr_matrix(gap.T @ gap.multiply(stiff[:, None])))
    force = np.zeros(operators.size)
    contact.interface.add(force, contact.resultant(contact.weights))
    iterations = []
    for _ in range(2):
        before = factor.iterations
        x = factor.solve_stiffened(force, springs, None)
        iterations.append(factor.iterations - before)
    before = factor.iterations
    factor.solve(force)
    assert iterations[1] < 0.6 * iterations[0]
    assert iterations[1] <= 1.5 * (factor.iterations - before)
    pulled = np.zeros(operators.size)
    contact.interface.add(pulled, springs.matrix @ contact.interface.trace(x, operators))
    left = 2.0e4 * operators.apply_mass(x) + 5.0e-5 * operators.apply_stiffness(x) + pulled - force
    assert np.linalg.norm(left) < 1e-6 * np.linalg.norm(force)
