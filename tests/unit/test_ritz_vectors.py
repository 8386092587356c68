"""Which directions of a reduced basis count as independent: the same ones, however round-off falls."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.models.reduction.modal_basis import INDEPENDENT, first_kept, unit_directions

SIZE, ROUND_OFF = 40, 2.0e-14  # products with a stiff K cancel


def energies(apart: float, seed: int) -> np.ndarray:
    """Return V^T V, with round-off, of 12 vectors of which one is a sum of two others but for `apart`."""
    vectors = np.linalg.qr(np.random.default_rng(1).standard_normal((SIZE, 12)))[0]
    vectors[:, 5] = (vectors[:, 2] + vectors[:, 3]) / np.sqrt(2.0) + apart * vectors[:, 5]
    noise = np.random.default_rng([2, seed]).standard_normal((12, 12))
    return np.asarray(vectors.T @ vectors + ROUND_OFF * (noise + noise.T))


@pytest.mark.parametrize("apart", 10.0 ** np.arange(-8.0, -3.0, 0.25))
def test_round_off_does_not_decide(apart: float) -> None:
    """A basis has as many vectors on any machine: round-off of a hundred kinds makes no difference."""
    assert len({unit_directions(energies(apart, seed), INDEPENDENT).shape[1] for seed in range(100)}) == 1


def test_what_is_independent_is_kept_and_the_rest_is_left_out() -> None:
    """Far from round-off all directions are kept, at round-off one is left out; all have unit energy."""
    for apart, count in ((1.0e-4, 12), (1.0e-9, 11)):
        energy = energies(apart, 0)
        combine = unit_directions(energy, INDEPENDENT)
        assert combine.shape == (12, count)
        np.testing.assert_allclose(combine.T @ energy @ combine, np.eye(count), atol=1e-6)


def test_the_widest_gap_decides() -> None:
    """Between the limits the widest gap does, outside the limits do; vectors of no length give nothing."""
    assert first_kept(np.array([1.0e-17, 2.0e-13, 1.3e-12, 1.0e-4, 1.0]), (1.0e-14, 1.0e-10)) == 3
    assert first_kept(np.array([1.0e-17, 5.0e-12, 8.0e-10, 1.0e-8, 1.0]), (1.0e-14, 1.0e-10)) == 1
    assert first_kept(np.array([1.0e-9, 1.0e-2, 1.0]), (1.0e-14, 1.0e-10)) == 0
    assert first_kept(np.array([0.9e-12, 1.1e-12, 1.0]), (1.0e-12, 1.0e-12)) == 1
    assert first_kept(np.zeros(3), (1.0e-14, 1.0e-10)) == 3
