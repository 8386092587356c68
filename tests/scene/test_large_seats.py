"""Seats of large structures: the equilibrium of all DOFs, as a textbook Newton on the assembled matrices finds it."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla

import gapbeam as gb

SECTION, STEEL, STIFF = gb.section("rectangle", 0.012, 0.02), gb.material(2.1e11, 7850.0), 1e6
POINTS = {"left": 0.05, "middle": 0.31, "right": 0.47, "tip": 0.5}


def beam(elements: int, name: str = "beam", **held: object) -> gb.Structure:
    return gb.beam(0.5, SECTION, STEEL, POINTS, elements=elements, name=name, **held)  # type: ignore[arg-type]


def by_newton(K: sp.csr_matrix, f: np.ndarray, B: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and contact forces at rest in slots, by an active set of springs in the sparse matrix."""
    closed, q = np.zeros(len(B)), np.zeros(len(f))
    for _ in range(30):
        on = np.flatnonzero(closed)
        rows = B[on]
        A = sp.csc_matrix(K + STIFF * sp.csr_matrix(rows).T @ sp.csr_matrix(rows))
        q = sla.spsolve(A, f + STIFF * half * rows.T @ closed[on])
        now = np.where(B @ q > half, 1.0, np.where(B @ q < -half, -1.0, 0.0))
        if np.array_equal(now, closed):
            break
        closed = now
    y = B @ q
    return q, -STIFF * np.sign(y) * np.maximum(np.abs(y) - half, 0.0)


def test_a_held_structure_of_many_dofs_rests_as_assembled() -> None:
    """A cantilever of 1 000 DOFs in three slots: displacements within 1e-8 of a Newton on the assembled matrix."""
    one = beam(520, clamped=[0.0])
    assert one.size > 1000
    names, half = ("left", "middle", "right"), 1e-5
    gaps = [gb.Contact(one[name], gb.Slot(2 * half), gb.KelvinVoigt(stiffness=STIFF), name=name) for name in names]
    push, weigh = gb.Force(one["tip"], 30.0), gb.weight(one, -9.81)
    rest = gb.seat(gb.Scene(one, contacts=gaps, loads=[push, weigh]))
    B = np.vstack([one[name].rows for name in names])
    q, F = by_newton(sp.csr_matrix(one.K), push.pattern * 30.0 + weigh.pattern * -9.81, B, half)
    assert np.abs(rest.q[:, 0] - q).max() <= 1e-8 * np.abs(q).max()
    assert np.abs(rest.F[:, 0] - F).max() <= 1e-8 * np.abs(F).max()
    assert np.count_nonzero(F) >= 1


@pytest.mark.parametrize("known", [True, False])
def test_a_free_structure_rests_as_its_small_twin(known: bool) -> None:
    """A free beam in two slots under its weight, with rigid motions given or found: forces add up to the weight."""
    found, moments = {}, {}
    for count in (100, 400):
        free = beam(count)
        one = free if known else gb.Structure(
            free.M, free.K, None, {name: point.rows for name, point in free.points.items()}, None, "beam", free.inertia
        )  # fmt: skip
        gaps = [
            gb.Contact(one[name], gb.Slot(1e-4), gb.KelvinVoigt(stiffness=STIFF), name=name)
            for name in ("left", "right")
        ]
        rest = gb.seat(gb.Scene(one, contacts=gaps, loads=[gb.weight(one, -9.81)]))
        found[count], moments[count] = (
            rest.F[:, 0],
            one["tip"].rows @ (rest.q[:, 0] if one.is_large else one.modes[2] @ rest.q[:, 0]),
        )
        assert rest.F.sum() == pytest.approx(9.81 * free.inertia @ np.tile([1.0, 0.0], free.size // 2), rel=1e-9)
    assert found[400] == pytest.approx(found[100], rel=1e-8)
    assert moments[400] == pytest.approx(moments[100], rel=1e-6)


def test_what_nothing_holds_has_no_seat() -> None:
    """A large free beam above one stop at its tip rotates away; the certificate is its motion in DOFs."""
    one = beam(400)
    stop = gb.Contact(one["tip"], gb.HalfPlane(0.0, -1.0), gb.KelvinVoigt(stiffness=STIFF))
    with pytest.raises(gb.NoSeat) as refused:
        gb.seat(gb.Scene(one, contacts=[stop], loads=[gb.weight(one, -9.81)]))
    (motion,) = refused.value.escape.motion.values()
    assert np.abs(one.K @ motion).max() <= 1e-8 * abs(one.K).max() * np.abs(motion).max()
    assert one.inertia @ motion < 0.0
