"""Modes of stiff and soft motions together: the low frequencies and the high ones to round-off."""

import numpy as np
import pytest

from solver.dense import DenseOperators
from solver.timoshenko import TimoshenkoBeam


def test_modes_of_frequencies_far_apart_are_normed_and_uncoupled():
    """A spring couples motions up to 1e6 rad/s and two rigid ones, as an exciter does in a reduced basis."""
    squares = np.concatenate([[0.0, 0.0], np.logspace(2.0, 13.5, 50)])
    pattern = np.random.default_rng(1).standard_normal(len(squares))
    operators = DenseOperators(np.identity(len(squares)), np.diag(squares) + 300.0 * np.outer(pattern, pattern))

    found, shapes = operators.modes

    eye = np.identity(len(squares))
    assert np.abs(shapes.T @ operators.mass @ shapes - eye).max() < 1e-14
    coupling = shapes.T @ operators.stiffness @ shapes - np.diag(found)
    scale = np.sqrt(np.abs(np.outer(found, found))) + 1.0
    assert np.abs(coupling / scale).max() < 1e-9
    # secular equation of a diagonal matrix with an added spring: 1 + k sum b^2 / (s_j - s) = 0
    elastic = found[(found > 10.0) & (found < 1.0e6)]
    terms = 300.0 * pattern**2 / (squares - elastic[:, None])
    assert np.abs(1.0 + terms.sum(axis=1)).max() < 1e-10


def test_modes_of_a_floating_beam_are_normed():
    """Two rigid motions that differ by round-off alone are not turned against each other."""
    for elements in (25, 51, 102):
        beam = TimoshenkoBeam(length=0.51, elements=elements, bending=604.8, shear=1.65e7, mass=1.9, inertia=2.28e-5)
        operators = beam.operators()
        squares, shapes = operators.modes
        eye = np.identity(operators.size)
        assert np.abs(shapes.T @ operators.mass @ shapes - eye).max() < 1e-10
        assert np.abs(squares[:2]).max() < 1e-9 * squares[2]
        # Euler-Bernoulli free-free, less what shear and rotation of the section take: 0.2 % of the first
        assert np.sqrt(squares[2]) == pytest.approx(4.7300407**2 * np.sqrt(604.8 / 1.9) / 0.51**2, rel=4e-3)
