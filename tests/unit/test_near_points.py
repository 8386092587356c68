"""The points around rigid sections that may touch in a step: none that touches is left out."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.march.compiled.point_motions import (
    AroundPoints,
    around_points,
    count_in_play,
    delassus_entry,
    set_motions,
)
from gapbeam.solver.march.compiled.turning_points import begin_near, choose_near, raise_closest, stay_in_bounds
from gapbeam.solver.system.modal_coordinates import modal_system
from tests.shared.dense_beams import dense_beam, dense_shaft

NO_STATIONS = np.zeros((0, 2, 0))


def shaft() -> tuple[np.ndarray, np.ndarray, np.ndarray, AroundPoints]:
    """Return Phi, g0, R and the points around the sections of a shaft."""
    modal = modal_system(dense_shaft(sections=4))
    assert modal is not None
    contact = modal.system.contact
    rows, around = around_points(modal.gaps, contact, modal.planes)
    assert around is not None
    return modal.gaps, contact.initial_gap, rows, around


def test_points_share_the_rows_of_their_sections() -> None:
    """Phi = T R, and entries of D = Phi A Phi^T follow from R A R^T."""
    gaps, _, rows, around = shaft()
    assert rows.shape == (8, 8)
    x = np.cos(np.arange(8.0))
    moved = np.zeros(len(gaps))
    set_motions(rows, around, x, moved)
    assert moved == pytest.approx(gaps @ x, abs=1e-13)
    inverse = np.diag(1.0 / (1.0 + np.arange(8.0)))
    whole, shared = gaps @ inverse @ gaps.T, rows @ inverse @ rows.T
    found = [delassus_entry(shared, around, i, j) for i in (0, 7, 50) for j in (0, 31, 95)]
    assert found == pytest.approx([whole[i, j] for i in (0, 7, 50) for j in (0, 31, 95)], abs=1e-13)


def test_points_of_other_bodies_keep_rows_of_their_own() -> None:
    """A beam between flat faces, and a shaft of which one point moves by itself."""
    flat = dense_beam()
    assert around_points(flat.contact.gap_matrix.toarray(), flat.contact, NO_STATIONS)[1] is None
    contact = dense_shaft().contact
    gaps = contact.gap_matrix.toarray()
    gaps[5] *= 1.0 + 1.0e-6
    assert around_points(gaps, contact, NO_STATIONS)[1] is None


@pytest.mark.parametrize("seed", range(5))
def test_no_point_that_touches_is_left_out(seed: int) -> None:
    """Sections that move by the guess, by what is free and by half of the bound in any direction."""
    random = np.random.default_rng(seed)
    gaps, gap, rows, around = shaft()
    pressure = np.zeros(len(gap))
    left_out = 0
    for _ in range(20):
        q = 0.02 * random.standard_normal(8)
        depth = -(gap + gaps @ q)
        pressure[:] = np.where(depth > 0.0, 1.0, 0.0)
        begin_near(around, q, pressure)
        around.guess[:], around.free[:] = 1.0e-3 * random.standard_normal((2, 8))
        choose_near(around, gap, pressure, False)
        near = around.near[: count_in_play(around, len(gap))].copy()
        turns = random.uniform(0.0, 2.0 * np.pi, 4)
        pushed = 0.5 * around.bound[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
        motions = [rows @ q, around.guess, around.free, pushed.ravel()]
        for count in range(1, 5):
            place = np.sum(motions[:count], axis=0)
            touching = np.flatnonzero(-(gap + np.sum(around.directions * place[around.pairs], axis=1)) > 0.0)
            assert set(touching) <= set(near.tolist())
        left_out += len(gap) - len(near)
    assert left_out > 500, "hardly any point was left out"


def test_forces_that_move_a_section_farther_are_seen() -> None:
    """Half of the bound is allowed for."""
    _, gap, rows, around = shaft()
    begin_near(around, np.zeros(8), np.ones(len(gap)))
    choose_near(around, gap, np.ones(len(gap)), False)
    motions = rows @ rows.T @ _on_rows(around, 3)
    allowed = float(np.min(0.5 * around.bound / np.hypot(*motions.reshape(-1, 2).T)))

    def stays(force: float) -> bool:
        around.motions[:] = force * motions
        return bool(stay_in_bounds(around))

    assert stays(0.99 * allowed)
    assert not stays(1.01 * allowed)
    choose_near(around, gap, np.zeros(len(gap)), True)
    assert count_in_play(around, len(gap)) == len(gap)
    assert stays(1.0e9)


def test_the_closest_approach_counts_points_that_cannot_touch() -> None:
    """Of each face, the largest penetration of all points, where it is a new largest one."""
    gaps, gap, rows, around = shaft()
    around.after[:] = 0.5 * around.least_gap.min() * np.sin(np.arange(8.0))
    q = np.linalg.solve(rows, around.after)
    expected = np.full(2, -np.inf)
    np.maximum.at(expected, around.faces[around.pairs[:, 0] // 2], -(gap + gaps @ q))
    deepest = np.full(2, -np.inf)
    raise_closest(around, gap, deepest, np.array([-np.inf, 0.0]))
    assert deepest == pytest.approx([expected[0], -np.inf])


def _on_rows(around: AroundPoints, point: int) -> np.ndarray:
    """Return T^T of a unit force at a point."""
    found = np.zeros(len(around.place))
    found[around.pairs[point]] = around.directions[point]
    return found
