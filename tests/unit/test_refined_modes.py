"""Modes of stiff and soft motions together: the low frequencies and the high ones to round-off."""

import numpy as np

from gapbeam.solver.models.timoshenko_beam import SteppedBeam, TimoshenkoBeam
from gapbeam.solver.system.dense_operators import DenseOperators


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


def test_rigid_motions_of_a_beam_with_an_added_mass_stay_rigid():
    """They differ by round-off of the stiffest element only, and must not be mixed by dividing by it."""
    beam = SteppedBeam((TimoshenkoBeam(0.51, 51, 604.8, 1.6e7, 1.9, 2.28e-5),), (0.0,))
    body = beam.operators().dense
    pattern = beam.rows(np.array([0.28]))[0].toarray()[0]
    operators = DenseOperators(body.mass + 0.39 * np.outer(pattern, pattern), body.stiffness)

    found, shapes = operators.modes

    assert np.abs(shapes.T @ operators.mass @ shapes - np.identity(beam.size)).max() < 1e-10
    assert np.abs(found[:2]).max() < 1e-6 * found[2]
    energies = np.einsum("ij,ik,kj->j", shapes[:, :2], operators.stiffness, shapes[:, :2])
    assert np.abs(energies).max() < 1e-6 * found[2]
