"""Bases span by span: exact under the forces that they are made for, sparse, and as large as the number of spans."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_matrix

from gapbeam.solver.models.reduction.span_basis import SpanBasis, cut_nodes, free_motions, span_basis
from gapbeam.solver.models.timoshenko_beam import SteppedBeam, TimoshenkoBeam, of_elements
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

IN_BAY, BAY, TOP = 20, 0.4, 2.0e3  # elements, m, Hz


def bays(count: int) -> tuple[SparseOperators, csr_matrix, Array, SpanBasis]:
    """Return a tube that is pressed at two places in each of some bays, by its weight and at one end, and its basis."""
    beam = SteppedBeam((TimoshenkoBeam(BAY * count, IN_BAY * count, 2.0e3, 3.0e6, 0.5, 2.0e-5),), (0.0,))
    operators = beam.operators()
    places = (np.arange(count)[:, None] + np.array([0.48, 0.52])).reshape(-1) * BAY
    rows, _ = beam.rows(places)
    weight = operators.apply_mass(beam.heave_and_pitch()[0])
    nodes = cut_nodes(np.full(beam.elements, BAY / IN_BAY), count)
    cuts = np.concatenate([2 * nodes, 2 * nodes + 1])
    return operators, rows, weight, span_basis(operators, cuts, rows, [weight, *np.eye(2, operators.size)], TOP, 50)


@pytest.mark.parametrize("count", [3, 12])
def test_static_responses_of_the_held_beam_are_exact(count: int) -> None:
    """Clamped at one end: against the elements themselves, to the round-off of their solution."""
    operators, rows, weight, basis = bays(count)
    hold = np.eye(2, operators.size)
    inner = SparseOperators(*(basis.columns.T @ one @ basis.columns for one in (operators.mass, operators.stiffness)))
    free = free_motions(hold @ basis.columns, inner, 1.0e4)
    assert np.abs(hold @ (basis.columns @ free).toarray()).max() < 1.0e-12
    columns = basis.columns @ free
    stiffness = (columns.T @ operators.stiffness @ columns).toarray()
    forces = np.column_stack([rows.toarray().sum(axis=0), weight])
    found = columns @ np.linalg.solve(stiffness, columns.T @ forces)
    whole = np.linalg.solve(operators.stiffness.toarray()[2:, 2:], forces[2:])
    assert found[2:] == pytest.approx(whole, abs=1.0e-9 * count**4 * np.abs(whole).max())
    mass = (columns.T @ operators.mass @ columns).toarray()
    squares = eigh(stiffness, mass, eigvals_only=True)[:count]
    wanted = eigh(operators.stiffness.toarray()[2:, 2:], operators.mass.toarray()[2:, 2:], eigvals_only=True)[:count]
    assert squares == pytest.approx(wanted, rel=1.0e-4)


def test_columns_and_their_entries_grow_with_the_spans() -> None:
    """Four times as many bays: four times as many columns and entries, to those of the ends, and no more per bay."""
    small, large = bays(10)[3], bays(40)[3]
    assert large.columns.shape[1] < 4.2 * small.columns.shape[1]
    assert large.columns.nnz < 4.2 * small.columns.nnz
    assert max(small.neglected, large.neglected) < 1.0e-3


def test_two_holds_of_one_motion_are_one() -> None:
    """The second says nothing new: one DOF follows from the others, and the motion is 0."""
    operators = of_elements([TimoshenkoBeam(1.0, 8, 2.0e3, 3.0e6, 0.5, 2.0e-5)])
    hold = np.zeros((2, operators.size))
    hold[:, 6], hold[:, 7] = 1.0, 0.3
    free = free_motions(hold, operators, 1.0e4)
    assert free.shape == (operators.size, operators.size - 1)
    assert np.abs(hold @ free).max() < 1.0e-12


@pytest.mark.parametrize(("asked", "kept", "root"), [(1.0, 3, 14.1371655), (2.0e4, 5, 20.4203522), (1.0e9, 39, np.inf)])
def test_a_basis_has_all_modes_below_a_frequency_that_is_not_the_one_asked_for(
    asked: float, kept: int, root: float
) -> None:
    """The first that it leaves out of two clamped bays is that of textbooks: (beta L)^2 sqrt(E I / rho A) / L^2."""
    elements = of_elements([TimoshenkoBeam(2 * BAY, 2 * IN_BAY, 2.0e3, 1.0e10, 0.5, 0.0)])
    free = slice(2, elements.size - 2)
    held = SparseOperators(*(csr_matrix(csr_matrix(one)[free, free]) for one in (elements.mass, elements.stiffness)))
    cuts = np.array([2 * IN_BAY, 2 * IN_BAY + 1]) - 2
    basis = span_basis(held, cuts, csr_matrix(np.eye(1, held.size, 8)), [], asked, 6)
    assert basis.modes == 2 + 2 * min(kept, 2 * IN_BAY - 2)
    assert basis.highest_mode == pytest.approx(root**2 / (2.0 * np.pi * BAY**2) * np.sqrt(2.0e3 / 0.5), rel=1e-3)
