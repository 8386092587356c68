"""Sections 2 and 3 of the paper: printed roots against textbooks, the settled rigid beam against statics."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.li2013 import PLATEAUS, peaks, plateaus

G = 9.81  # m/s^2
TEXTBOOK = {  # roots of Blevins' tables, rigid motions counted
    (np.inf, np.inf): (1.87510407, 4.69409113, 7.85475744),
    (0.0, np.inf): (0.0, 2.36502037, 5.49780392),
    (np.inf, 0.0): (0.0, 3.92660231, 7.06858275),
}


def test_printed_plateaus_are_limits_of_their_roots_except_for_pinned_ends() -> None:
    """For pinned ends the paper prints the roots of sliding ends."""
    for (mode, printed, _, limits), (_, limit, at_thresholds) in zip(PLATEAUS, plateaus(), strict=True):
        assert limit == pytest.approx(TEXTBOOK[limits][mode - 1], rel=1e-8)
        as_printed = (0.0, np.inf) if limits == (np.inf, 0.0) else limits
        assert printed == pytest.approx(TEXTBOOK[as_printed][mode - 1], abs=1e-3)
        assert at_thresholds == pytest.approx(limit, rel=0.05)


def test_a_settled_rigid_beam_on_its_seat_follows_from_statics() -> None:
    """At 2 N the rigid beam rocks on slopes and dampers of the contact, the same in any clearance."""
    changes = {"contact.law.full_depth": 1e-5, "load.shaker.amplitude": 2.0}
    found = [peaks(changes | {"support.clearance": clearance}) for clearance in (0.107e-3, 0.243e-3)]
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-3)
    # the amplitude of the rigid beam on two springs, n F / d each, with dampers at 20 Hz
    weight = 7919.0 * 0.51 * 0.012 * 0.02 * G
    near, far = 0.005 / 6.0, 0.05 - 0.005 / 6.0
    gland = weight * (0.255 - far) / (far - near)
    forces = np.array([gland, gland + weight])
    slopes = 2.2 * forces ** (1.2 / 2.2) * (1.0e5 * 1.0e3**2.2) ** (1.0 / 2.2)
    arms = np.array([near, far]) - 0.255
    mass, inertia = weight / G, weight / G * (0.51**2 + 0.012**2) / 12.0
    stiffness = np.array([[slopes.sum(), slopes @ arms], [slopes @ arms, slopes @ arms**2]])
    omega = 40.0 * np.pi
    dampers = 1.0e4 * np.array([[2.0, arms.sum()], [arms.sum(), arms @ arms]])  # full at these depths
    dynamic = stiffness - omega**2 * np.diag([mass, inertia]) + 1j * omega * dampers
    place = np.linalg.solve(dynamic, 2.0 * np.array([1.0, 0.15 - 0.255])) @ np.array([1.0, 0.37 - 0.255])
    assert found[0][1] == pytest.approx(2.0 * omega**2 * abs(place) / G, rel=0.02)
    # gravity makes the fall, not the force: larger from higher
    assert found[1][0] > 1.3 * found[0][0] > 10.0 * found[0][1]
