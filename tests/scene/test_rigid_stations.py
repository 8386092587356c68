"""Many contacts that move with few motions, as stations of rigid sections do, are solved by these motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg as sl
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import gapbeam as gb
from gapbeam.solver.scene import scene as scenes
from gapbeam.solver.scene.linear_scheme import low_rank_factor
from gapbeam.solver.scene.marcher import Marcher

Array = np.ndarray
LAWS = {
    "linear": gb.KelvinVoigt(stiffness=2e6, damping=20.0),
    "power": gb.HuntCrossley(3e8, 0.4, 1.5),
    "own": gb.Cubic(stiffness=2e6, scale=1e-4),
}


def tube(stations: int, law: Any, region: Any, motions: int = 1, modes: int = 9) -> gb.Scene:
    """Return a tube in two supports with stations of a rigid section, shaken at its tip."""
    k = (np.arange(modes) + 0.5) * np.pi
    along = np.linspace(-0.02, 0.02, stations)[:, None]
    lines = np.concatenate([np.sin(k * x) + along * k * np.cos(k * x) for x in (0.31, 0.74)])
    rows = [np.kron(np.eye(motions), one) for one in lines] + [np.kron([1.0, 0.7][:motions], np.sin(k))]
    names = [f"s{i}" for i in range(2 * stations)]
    body = gb.from_modes(np.tile(70.0 * k**1.5, motions), 0.01, dict(zip([*names, "tip"], rows, strict=True)))
    gaps = [gb.Contact(body[name], region, law, name=name) for name in names]
    push = gb.Force(body["tip"], gb.sine, amplitude=300.0, frequency=25.0)
    return gb.Scene(body, contacts=gaps, loads=[push])


def marched(scene: gb.Scene, steps: int) -> tuple[Array, Array, int, float]:
    """Return displacements of the modes, forces, columns of the factor, and the change of the balance."""
    marcher, seen = Marcher(scene, 2e-4), list[Array]()
    for _ in range(steps):
        marcher.advance(1)
        seen.append(np.concatenate([marcher.q[:, 0], marcher.F[:, 0]]))
    found, n = np.array(seen), len(marcher.q)
    return found[:, :n], found[:, n:], marcher.linear.low_rank.shape[1], abs(float(marcher.balance))


@settings(max_examples=12, deadline=None)
@given(
    stations=st.integers(10, 14), law=st.sampled_from(sorted(LAWS)), motions=st.sampled_from([1, 2]),
    clearance=st.floats(1e-5, 4e-4),
)  # fmt: skip
@example(stations=12, law="linear", motions=1, clearance=1e-4)
def test_the_short_way_moves_as_the_long_one(stations: int, law: str, motions: int, clearance: float) -> None:
    """Forces are those of the equations of every station, energy is kept, and two motions a plane are found."""
    region = gb.Slot(clearance) if motions == 1 else gb.Disc(clearance)
    scene = tube(stations, LAWS[law], region, motions)
    q, F, columns, balance = marched(scene, 200)
    assert columns == 4 * motions
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scenes, "low_rank_factor", lambda *given: np.zeros((len(given[0]), 0)))
        other, felt, none, _ = marched(scene, 200)
    assert none == 0
    assume((np.count_nonzero(felt, axis=1) > 2 * columns).any())  # the short way was taken
    assert np.abs(q - other).max() <= 1e-9 * np.ptp(other)
    assert np.abs(F - felt).max() <= 1e-8 * np.abs(felt).max()
    assert balance <= 1e-10 * np.abs(0.5 * (scene.squares[None] * q**2).sum(1)).max()


def test_a_body_on_many_springs_heaves_and_pitches_as_on_two() -> None:
    """All stations closed: sum of K and of K x^2, with the frequencies w' = 2/h atan(w h / 2) of the midpoint rule."""
    M, K, h, press = np.diag([3.0, 0.2]), 4e5, 1e-4, 2e-3
    x = np.linspace(-0.5, 0.3, 11)
    body = gb.Structure(M, np.zeros((2, 2)), None, {f"s{i}": np.array([[1.0, a]]) for i, a in enumerate(x)})
    names, law = [f"s{i}" for i in range(len(x))], gb.KelvinVoigt(stiffness=K)
    touches = [gb.Contact(body[name], gb.HalfPlane(0.0), law, name=name) for name in names]
    loads = [gb.Force(body[name], lambda t: K * press + 0.0 * t) for name in names]
    scene, rest, moved = gb.Scene(body, contacts=touches, loads=loads), np.array([press, 0.0]), np.array([3e-4, 1e-3])
    marcher = Marcher(scene, h, scene.state(displacement={body: rest + moved}))
    assert marcher.linear.low_rank.shape == (len(x), 2)
    squares, shapes = sl.eigh(K * np.array([[len(x), x.sum()], [x.sum(), (x**2).sum()]]), M)
    turns = 2.0 / h * np.arctan(np.sqrt(squares) * h / 2.0)
    for _ in range(40):
        marcher.advance(17)
        expected = shapes @ (np.cos(turns * marcher.t) * (shapes.T @ M @ moved)) + rest
        assert np.abs(marcher.y[:, 0] - expected @ np.vstack([np.ones(len(x)), x])).max() <= 1e-10 * press
    assert (marcher.F > 0.0).all() or (marcher.F < 0.0).all()


@settings(max_examples=30, deadline=None)
@given(m=st.integers(3, 30), rank=st.integers(1, 12), seed=st.integers(0, 1000), size=st.floats(-8.0, 8.0))
def test_the_factor_is_exact_or_not_given(m: int, rank: int, seed: int, size: float) -> None:
    """Operators of few motions are met to round-off, of rows of any size; all others are left to the long way."""
    draw = np.random.default_rng(seed)
    B = draw.normal(size=(m, rank)) * 10.0 ** (size * draw.random((m, 1)))
    D = B @ B.T
    Q = low_rank_factor(D, False)
    assert Q.shape == (m, rank if 2 * rank < m else 0)
    if Q.shape[1]:
        scale = np.sqrt(np.diag(D))
        assert np.abs((Q @ Q.T - D) / scale / scale[:, None]).max() < 1e-12
        D[0, 1] *= 1.001  # a flow that couples motions in one way
        assert low_rank_factor(D, False).shape[1] == 0
    assert low_rank_factor(B @ B.T, True).shape[1] == 0
