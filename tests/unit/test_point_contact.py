"""Results of contact points from records: a known motion against closed forms, in pieces, from a checkpoint."""

from __future__ import annotations

import json
from math import asin, cos, pi

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.point_contact import KEPT, PIECE, PointContact
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, WallMotion, Walls
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem

AMPLITUDE, SPEED, STIFFNESS = 1.0e-3, 2.0 * pi * 10.0, 1.0e9  # m, rad/s, Pa/m
GAPS, AREAS = np.array([2.0e-4, 6.0e-4, 5.0e-4, 2.0e-3]), np.array([1.0e-5, 3.0e-5, 2.0e-5, 1.0e-5])
ABOVE, BELOW, OUT_OF_REACH = 0, 1, 2
FACES = np.array([ABOVE, ABOVE, BELOW, OUT_OF_REACH])
TIMES = np.linspace(0.0, 1.0, 20001)  # ten periods
IMPULSES = np.array([8.0, 2.0, 0.0])  # N s: whatever the march has found


def contact(walls: Walls | None = None) -> PointContact:
    """Return the contact points of a mass that moves up and down: two above, one below, one that it does not reach."""
    signs = np.array([-1.0, -1.0, 1.0, -1.0])
    faces = (Face("above", -1.0), Face("below", 1.0), Face("far", -1.0))
    operator = ContactOperator(
        interface=Interface(1, np.array([0]), np.array([0])),
        gap_matrix=csr_matrix(signs[:, None]),
        weights=AREAS,
        initial_gap=GAPS,
        faces=FACES,
        support=Support(faces, area=float(AREAS.sum())),
        positions=np.zeros((4, 3)),
        **({} if walls is None else {"walls": walls}),
    )
    system = SemiDiscreteSystem(DenseOperators(np.eye(1), np.eye(1)), operator)
    return PointContact(system, ContactLaw(Spring(STIFFNESS)))


def show(points: PointContact, times: np.ndarray) -> None:
    """Show some records of a sine."""
    angles = SPEED * times[:, None]
    points.see(times, AMPLITUDE * np.sin(angles), SPEED * AMPLITUDE * np.cos(angles))


def seen(points: PointContact, *cuts: int) -> PointContact:
    """Show a sine to contact points, cut at some records."""
    for piece in np.split(np.arange(len(TIMES)), cuts):
        show(points, TIMES[piece])
    return points


def test_a_sine_is_known() -> None:
    """First touch, share of time, penetration, and the loads in the ratio of their integrals."""
    found = seen(contact())
    angles = np.array([asin(gap / AMPLITUDE) for gap in GAPS[:3]])
    first = angles / SPEED
    first[BELOW + 1] += pi / SPEED  # it moves up first
    assert found.first_touch[:3] == pytest.approx(first, abs=TIMES[1])
    assert found.first_touch[3] == np.inf
    assert found.shares == pytest.approx([*(0.5 - angles / pi), 0.0], abs=1e-3)
    assert found.deepest == pytest.approx(AMPLITUDE - GAPS, rel=1e-6)
    integrals = [
        10.0 * AREAS[k] * STIFFNESS * (2.0 * AMPLITUDE * cos(a) - GAPS[k] * (pi - 2.0 * a)) / SPEED
        for k, a in enumerate(angles)
    ]
    assert found.load == pytest.approx([*integrals, 0.0], rel=1e-5)
    impulses = found.impulses(IMPULSES)
    assert impulses == pytest.approx([*(8.0 * found.load[:2] / found.load[:2].sum()), 2.0, 0.0], rel=1e-12)
    assert np.bincount(FACES, impulses) == pytest.approx(IMPULSES)


@pytest.mark.parametrize("cuts", [(1,), (PIECE, PIECE + 3, 7 * PIECE), (20000,)])
def test_pieces_and_checkpoints_change_nothing(cuts: tuple[int, ...]) -> None:
    """Records that come block by block, with the sums written and read between, are those that come at once."""
    whole, parts = seen(contact()), contact()
    for piece in np.split(np.arange(len(TIMES)), cuts):
        stored = json.loads(json.dumps(parts.as_json()))
        parts = contact()
        for name in KEPT:
            kept = stored[name]
            setattr(parts, name, np.array(kept) if isinstance(kept, list) else kept)
        show(parts, TIMES[piece])
    for name in ("first_touch", "deepest"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name))
    for name in ("time", "load", "begin", "last"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-12)


def test_walls_that_move_are_followed() -> None:
    """A wall that closes by 0.1 mm/s over a second touches a body that rests when its gap is gone."""
    closing = WallMotion(0, lambda time: 1.0e-3 * time, lambda time: 1.0e-3 + 0.0 * time)
    points = contact(Walls((closing,), np.array([[-1.0, -1.0, -1.0, -1.0]])))
    points.see(TIMES, *np.zeros((2, len(TIMES), 1)))
    assert points.first_touch[:3] == pytest.approx(GAPS[:3] / 1.0e-3, abs=2.0 * TIMES[1])
    assert points.deepest == pytest.approx(1.0e-3 - GAPS)


def test_what_no_record_shows_is_not_known() -> None:
    """A face that was pressed between records only has impulses that nobody knows; one record has no shares."""
    points = contact()
    points.see(TIMES[:1], *np.zeros((2, 1, 1)))
    assert not points.shares.any()
    assert np.isnan(points.impulses(np.array([1.0, 0.0, 0.0]))).tolist() == [True, True, False, False]
