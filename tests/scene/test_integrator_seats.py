"""Seats of scenes whose controllers integrate: what they read is 0 at rest, as bordered systems of equations say."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import gapbeam as gb

Matrix = np.ndarray


def bordered(K: Matrix, f: Matrix, E: Matrix, stops: Matrix, gap: float, k: float) -> tuple[Matrix, Matrix, Matrix]:
    """Return displacements, forces of integrators and of stops: K u = f + E s + F with E^T u = 0, over all contacts."""
    n, held = E.shape
    for closed in product([0.0, 1.0], repeat=len(stops)):
        stiff, pushed = K.copy(), f.copy()
        for at, shut in zip(stops, closed, strict=True):
            stiff[at, at] += shut * k
            pushed[at] += shut * k * gap
        found = np.linalg.solve(
            np.block([[stiff, -E], [E.T, np.zeros((held, held))]]), np.concatenate([pushed, np.zeros(held)])
        )
        over = found[stops] - gap
        if np.array_equal(over > 0.0, np.array(closed) > 0.0):
            return found[:n], found[n:], -k * np.maximum(over, 0.0)
    raise AssertionError


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("seed", range(6))
def test_an_integrator_brings_what_it_reads_to_nothing(size: float, seed: int) -> None:
    """Drawn chains with PI and PID controllers in drawn coordinates of their states, and stops; then nothing moves."""
    rng = np.random.default_rng(seed)
    n, m, k = int(rng.integers(1, 7)), size**3, size
    springs = k * rng.uniform(0.5, 2.0, n + 1)
    K = np.diag(springs[:-1] + springs[1:]) - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)
    chain = gb.Structure(
        m * np.eye(n), K, 0.1 * np.sqrt(m * k) * np.eye(n), {f"p{i}": i for i in range(n)}, name="chain"
    )
    places = rng.permutation(n)
    held, stops = places[: int(rng.integers(1, min(n, 3) + 1))], np.sort(places[-2:])
    w, gap, stiff = np.sqrt(k / m), 0.1 * size, 30.0 * k
    controllers, gains, whole = [], [], K.copy()
    for at in held:
        D = -k * rng.uniform(0.5, 2.0)
        whole[at, at] -= D
        A, B, C = np.diag([0.0, -20.0 * w]), np.diag([1.0, 20.0]), -k * np.array([[0.2 * w, 0.05 * w]])
        T = rng.normal(size=(2, 2))
        turned = T @ A @ np.linalg.inv(T), T @ B, C @ np.linalg.inv(T), [[D, 0.1 * D / w]]
        controllers.append(gb.Feedback(chain[f"p{at}"], chain[f"p{at}"], *turned, name=f"c{at}"))
        gains.append(turned[2])
    contacts = [
        gb.Contact(chain[f"p{at}"], gb.HalfPlane(gap), gb.KelvinVoigt(stiffness=stiff), name=f"s{at}") for at in stops
    ]
    f = k * size * rng.uniform(-1.0, 1.0, n)
    pushes = [gb.Force(chain[f"p{i}"], float(f[i]), name=f"f{i}") for i in range(n)]
    scene = gb.Scene(chain, contacts=contacts, loads=pushes, feedbacks=controllers)
    u, forces, pressed = bordered(whole, f, np.eye(n)[:, held], stops, gap, stiff)
    rest = gb.seat(scene)
    shapes = chain.modes[2]
    assert shapes @ rest.q[:, 0] == pytest.approx(u, abs=1e-9 * size)
    assert rest.F[:, 0] == pytest.approx(pressed, abs=1e-7 * k * size)
    found = [float((C @ z).item()) for C, z in zip(gains, np.split(rest.z[:, 0], len(held)), strict=True)]
    assert found == pytest.approx(forces, abs=1e-8 * k * size)
    after = gb.history(scene, step=0.02 / w, end=20.0 / w, start=rest)
    assert max(np.ptp(one) for one in after.displacement.values()) < 1e-9 * size


REFUSED = {
    "an unstable sign": ([[0.0]], [[1.0, 0.0]], [[5.0]], "divergence"),
    "a sum of sums": ([[0.0, 1.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], [[-5.0, -1.0]], "no rest"),
    "a sum that acts nowhere": ([[0.0]], [[1.0, 0.0]], [[0.0]], "depends on the past"),
    "a sum of velocities": ([[0.0]], [[0.0, 1.0]], [[-5.0]], "depends on the past"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_single_rest_is_refused(name: str) -> None:
    """Equilibria that grow, or that depend on the past, are none."""
    A, B, C, words = REFUSED[name]
    block = gb.mass(1.0, stiffness=1.0, name="block")
    loop = gb.Feedback(block["at"], block["at"], A, B, C)
    with pytest.raises(gb.UserError, match=words):
        gb.seat(gb.Scene(block, loads=[gb.Force(block["at"], 1.0)], feedbacks=[loop]))


def test_an_integrator_elsewhere_is_refused() -> None:
    """One that reads another mass than the one that it pushes is no spring."""
    pair = gb.Structure(np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]), points={"a": 0, "b": 1})
    loop = gb.Feedback(pair["a"], pair["b"], [[0.0]], [[1.0, 0.0]], [[-1.0]])
    with pytest.raises(gb.UserError, match="elsewhere"):
        gb.seat(gb.Scene(pair, feedbacks=[loop]))
