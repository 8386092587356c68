"""The region that a support around the beam leaves to its axis, and the ring that it is drawn as."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.postprocess.figures.motion_figures import room_of
from gapbeam.postprocess.results.columns_of_run import RunFace
from gapbeam.postprocess.scene.support_surface import inner_radii, outer_radius, ring_of

CLEARANCE = 1.0e-4  # m
HEXAGON = (0.0, 60.0, 120.0, 180.0, -120.0, -60.0)


def face(
    angles: tuple[float, ...] = (), recesses: tuple[float, ...] = (), flat: bool = False, **more: float
) -> RunFace:
    """Return a face around the beam."""
    return RunFace("f", False, CLEARANCE, True, angles=angles, recesses=recesses, flat=flat, **more)


def area(outline: np.ndarray) -> float:
    """Return the area in a closed outline, m^2."""
    y, z = outline.T
    return 0.5 * abs(float(np.sum(y[:-1] * z[1:] - y[1:] * z[:-1])))


def test_rooms_by_hand() -> None:
    """A hole leaves a disc, six walls a hexagon, each around the middle of the support."""
    moved = face(offset=2.0e-5, lateral=-3.0e-5)
    assert area(room_of(moved)) == pytest.approx(np.pi * CLEARANCE**2, rel=1e-3)
    assert room_of(moved)[:-1].mean(axis=0) == pytest.approx([-3.0e-5, 2.0e-5], abs=1e-9)
    six = room_of(face(HEXAGON, (0.0,) * 6, flat=True))
    assert area(six) == pytest.approx(2.0 * np.sqrt(3.0) * CLEARANCE**2)
    assert not np.any(np.isnan(six))
    groove = face((-90.0, 0.0, 90.0, 180.0), (0.0, 5.0e-5, 0.0, 0.0))
    assert room_of(groove)[:, 1].min() == pytest.approx(-1.5e-4, rel=0.03)


def test_the_room_of_a_v_block_is_open() -> None:
    """Two lines that meet sqrt 2 times the clearance below; they end beyond the motion, and nothing joins them."""
    room = room_of(face((-45.0, 45.0), (0.0, 0.0), flat=True), 1.0e-2)
    lowest = room[np.nanargmin(room[:, 1])]
    assert lowest == pytest.approx([0.0, -np.sqrt(2.0) * CLEARANCE], abs=1e-12)
    assert np.nanmax(room) == pytest.approx(1.2e-2)
    assert np.any(np.isnan(room))
    assert len(room_of(RunFace("f", False, -CLEARANCE, True))) == 0


def test_rings_touch_where_the_beam_touches() -> None:
    """In the direction of a wall a ring begins the enlarged gap away from the beam; a V-block is open above."""
    walls = face((-45.0, 45.0), (0.0, 1.0e-4), flat=True)
    turns = np.array([-45.0, 45.0, 0.0, 180.0])
    found = inner_radii(walls, 0.02, 10.0, turns)
    assert found[:2] == pytest.approx([0.011, 0.012])
    assert found[2] == pytest.approx(0.011 * np.sqrt(2.0))
    assert np.isinf(found[3])
    ring = ring_of(walls, (0.1, 0.2), (0.0, 0.0), 0.02, 10.0)
    assert ring.bounds[4] == pytest.approx(-outer_radius(walls, 0.02, 10.0))
    assert ring.bounds[5] < 0.5 * outer_radius(walls, 0.02, 10.0)
    whole = ring_of(face(), (0.1, 0.2), (0.0, 1.0e-3), 0.02, 10.0)
    assert whole.bounds[4:] == pytest.approx((1.0e-3 - 0.017, 1.0e-3 + 0.017))
