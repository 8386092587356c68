"""Two free structures that strike each other: momentum, energy, wave theory, and a textbook Newton on the pair."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

import gapbeam as gb

Array = np.ndarray
SECTION, STEEL = gb.CrossSection(1.2e-4, 1e-9, 1e-4), gb.material(2e11, 8000.0)
SHIFT = 0.13  # of the second beam along the first, m


def heave_and_pitch(one: gb.Structure, shift: float) -> Array:
    """Return the rigid motions about the origin of space as columns, from the places of the two ends."""
    assert one.rigid is not None
    ends = np.vstack([one["left"].rows, one["right"].rows]) @ one.rigid
    x = np.array([0.0, LENGTHS[one.name]]) + shift
    return np.asarray(one.rigid @ np.linalg.solve(ends, np.column_stack([np.ones(2), x])))


LENGTHS = {"a": 0.5, "b": 0.4}


@pytest.mark.parametrize("reduced", [False, True], ids=["all", "reduced"])
def test_two_free_beams_exchange_momentum_and_angular_momentum(reduced: bool) -> None:
    """What one beam gives the other gets, to round-off at every step; energy is kept."""
    a = gb.beam(0.5, SECTION, STEEL, {"left": 0.0, "right": 0.5, "one": 0.17, "two": 0.41}, elements=12, name="a")
    b = gb.beam(0.4, SECTION, STEEL, {"left": 0.0, "right": 0.4, "one": 0.04, "two": 0.28}, elements=9, name="b")
    if reduced:
        a, b = gb.reduced_at_points(a, 6), gb.reduced_at_points(b, 5)
    law = gb.KelvinVoigt(stiffness=1e7)
    pairs = [gb.Contact((a[name], b[name]), gb.HalfPlane(1e-5), law, name=name) for name in ("one", "two")]
    scene, h = gb.Scene(a, b, contacts=pairs), 2e-6
    R = [heave_and_pitch(a, 0.0), heave_and_pitch(b, SHIFT)]
    M = [np.asarray(one.M) for one in (a, b)]
    start = scene.state(velocity={a: R[0] @ [1.0, 2.0], b: R[1] @ [-0.5, 1.0]})
    # the DOFs of the structures, from the coordinates of the scene
    X = [one.modes[2] for one in (a, b)]
    cuts = (slice(0, a.size), slice(a.size, None))

    def moments(v: Array) -> Array:
        return np.array([r.T @ m @ x @ v[cut, 0] for r, m, x, cut in zip(R, M, X, cuts, strict=True)])

    first, impulse, worst, most = moments(start.v), np.zeros(2), np.zeros(2), np.abs(moments(start.v)).max(axis=0)
    arms, touched, begin, drift = np.array([0.17, 0.41]), 0, None, 0.0
    for step in gb.march(scene, h, 6e-3, start):
        force = np.array([step.contacts[name].force for name in ("one", "two")])
        impulse += h * np.array([force.sum(), arms @ force])
        touched += int(np.any(force != 0.0))
        now = moments(step.state.v)
        most = np.maximum(most, np.abs(now).max(axis=0))
        given, taken = now[0] - first[0] - impulse, now[1] - first[1] + impulse
        worst = np.maximum(worst, np.maximum(np.abs(given), np.abs(taken)))
        begin = step.balance if begin is None else begin
        drift = max(drift, abs(step.balance - begin) / begin)
    assert touched > 100
    assert np.abs(impulse).min() > 0.1 * most.max()  # the beams did strike
    assert np.all(worst < 1e-12 * most), worst / most
    assert drift < 1e-10


def rod(elements: int, name: str) -> gb.Structure:
    """Return a free rod of length, stiffness E A and mass 1, so c = 1, of linear elements with consistent mass."""
    size = 1.0 / elements
    ends = np.ones(elements + 1)
    ends[[0, -1]] = 0.5
    side = np.ones(elements)
    K = sp.diags([-side, 2 * ends, -side], [-1, 0, 1]) / size
    M = sp.diags([side, 4 * ends, side], [-1, 0, 1]) * (size / 6.0)
    points = {"left": np.eye(elements + 1)[:1], "right": np.eye(elements + 1)[-1:]}
    return gb.Structure(M, K, None, points, np.ones(elements + 1), name)


def test_two_equal_rods_exchange_their_velocities() -> None:
    """Wave theory: contact for 2 L / c, then the first rod is at rest; the error falls with the size of the mesh."""
    left, ends = [], []
    for elements in (25, 50, 100, 200):
        a, b = rod(elements, "a"), rod(elements, "b")
        law = gb.KelvinVoigt(stiffness=4.0 * elements)
        touch = gb.Contact((a["right"], b["left"]), gb.HalfPlane(0.05), law, name="touch")
        scene, h = gb.Scene(a, b, contacts=[touch]), 0.5 / elements
        found, momentum = [], []
        for step in gb.march(scene, h, 2.5, scene.state(velocity={a: 1.0})):
            q = step.state.v[:, 0]
            means = [one.M @ np.ones(one.size) @ one.modes[2] for one in (a, b)]
            momentum.append([means[0] @ q[: a.size], means[1] @ q[a.size :]])
            found.append([step.t, step.contacts["touch"].force, step.balance])
        t, force, energy = np.array(found).T
        p = np.array(momentum)
        assert np.abs(p.sum(axis=1) - 1.0).max() < 1e-10
        assert np.abs(p[:, 0] - h * force.cumsum() - 1.0).max() < 1e-10
        assert np.abs(energy - 0.5).max() < 0.5e-10
        left.append(abs(p[-1, 0]))
        ends.append([t[force != 0.0][0], t[force != 0.0][-1]])
    orders = np.log2(np.array(left[:-1]) / left[1:])
    assert np.all(orders > 0.4)
    assert left[-1] < 5e-3
    late = np.abs(np.array(ends) - [0.05, 2.05])
    assert late.max() < 0.015
    assert late[-1].max() < 0.0055


def hermite(s: float, size: float) -> Array:
    """Return the cubic shape functions of an element at s of its length, for deflection and slope of both ends."""
    return np.array([1 - 3 * s**2 + 2 * s**3, size * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, size * (s**3 - s**2)])


def euler_beam(elements: int, length: float, stations: dict[str, float]) -> tuple[Array, Array, dict[str, Array]]:
    """Return mass, stiffness and rows of an Euler-Bernoulli beam clamped at its start, by quadrature of the shapes."""
    size, EI, mass = length / elements, 200.0, 0.96
    M, K = np.zeros((2 * elements + 2,) * 2), np.zeros((2 * elements + 2,) * 2)
    places, weights = np.polynomial.legendre.leggauss(4)
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        for s, w in zip(0.5 * (places + 1), 0.5 * size * weights, strict=True):
            bend = np.array([12 * s - 6, size * (6 * s - 4), 6 - 12 * s, size * (6 * s - 2)]) / size**2
            M[at, at] += w * mass * np.outer(hermite(s, size), hermite(s, size))
            K[at, at] += w * EI * np.outer(bend, bend)
    rows = {}
    for name, x in stations.items():
        e = int(x / size)
        rows[name] = np.zeros((1, 2 * elements + 2))
        rows[name][0, 2 * e : 2 * e + 4] = hermite(x / size - e, size)
    return M[2:, 2:], K[2:, 2:], {name: row[:, 2:] for name, row in rows.items()}


def test_beams_with_stations_between_nodes_follow_a_newton_on_the_assembled_pair() -> None:
    """Newmark's scheme with a full Newton on all DOFs of both beams, in a dozen lines of numpy: the same motion."""
    stations = {"one": 0.113, "two": 0.237, "three": 0.391}
    parts = [euler_beam(7, 0.5, stations), euler_beam(5, 0.45, stations)]
    a, b = (gb.Structure(M, K, None, rows, name=name) for (M, K, rows), name in zip(parts, "ab", strict=True))
    stiff, power, gap, h, end = 4e8, 1.5, 1e-4, 1e-5, 0.02
    law = gb.HuntCrossley(stiffness=stiff, exponent=power)
    pairs = [gb.Contact((a[name], b[name]), gb.HalfPlane(gap), law, name=name) for name in stations]

    def drive(t: Any) -> Any:
        return 40.0 * np.sin(2 * np.pi * 90.0 * t)

    load = gb.Force(a["three"], drive, name="drive")
    found = gb.history(gb.Scene(a, b, contacts=pairs, loads=[load]), h, end, scheme=gb.newmark())
    M, K = (sl.block_diag(parts[0][k], parts[1][k]) for k in (0, 1))
    B = np.array([np.concatenate([parts[0][2][name][0], -parts[1][2][name][0]]) for name in stations])
    pattern = np.concatenate([parts[0][2]["three"][0], np.zeros(b.size)])
    u, v, acceleration = np.zeros(len(M)), np.zeros(len(M)), np.zeros(len(M))
    motion, force = [], []
    for k in range(1, round(end / h) + 1):
        guess = u + h * v + 0.25 * h * h * acceleration
        new = guess.copy()
        for _ in range(30):
            deep = np.maximum(B @ new - gap, 0.0)
            rest = M @ (new - guess) * 4 / h**2 + K @ new + B.T @ (stiff * deep**power) - pattern * drive(k * h)
            slope = B.T @ (stiff * power * deep ** (power - 1) * B.T).T
            change = np.linalg.solve(M * 4 / h**2 + K + slope, -rest)
            new += change
            if np.abs(change).max() <= 1e-14 * np.abs(new).max():
                break
        last, acceleration = acceleration, 4 / h**2 * (new - guess)
        u, v = new, v + 0.5 * h * (last + acceleration)
        motion.append([row[0] @ u[: a.size] for row in parts[0][2].values()])
        force.append(-stiff * np.maximum(B @ u - gap, 0.0) ** power)
    own = [[found.displacement[f"a.{name}"] for name in stations], [found.force[name] for name in stations]]
    for given, ours in zip((motion, force), own, strict=True):
        assert np.abs(np.transpose(ours) - given).max() < 1e-8 * np.abs(given).max()
    assert np.count_nonzero(force) > 200
