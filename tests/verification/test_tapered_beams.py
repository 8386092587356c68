"""Tapered cantilevers as staircases of segments, against Kirchhoff's solution and published frequencies.

Of a wedge of constant width whose thickness is h0 z, z = 1 at the root and r at the tip, the modes are

    w = z^(-1/2) (c1 J1 + c2 Y1 + c3 I1 + c4 K1)(2 p sqrt(z)),    p^4 = rho A0 omega^2 l^4 / E I0,    l = L / (1 - r)

Source: Kirchhoff (1882); Naguleswaran (1994), J. Sound Vib. 172, 289-304, for the frequencies.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

import gapbeam
from gapbeam.solver.models.timoshenko_beam import SteppedBeam
from gapbeam.solver.system.operators import Array

LENGTH, ROOT, YOUNG, DENSITY = 1.0, 2.5e-3, 2.1e11, 7850.0  # slender: shear and rotary inertia take 1e-4 at most
ELEMENTS = 160
PUBLISHED = {0.5: (3.8238, 18.3173, 47.2648), 1.0e-6: (5.3151, 15.2071, 30.0198)}  # omega L^2 sqrt(rho A0 / E I0)


def of_kirchhoff(tip: float, count: int = 3) -> Array:
    """Return omega L^2 sqrt(rho A0 / E I0) of a clamped wedge whose tip has this part of the thickness of its root."""

    def missed(p: float) -> float:
        near, far = 2.0 * p * np.sqrt(tip), 2.0 * p
        rows = [
            [jv(3, near), yv(3, near), iv(3, near), kv(3, near)],  # no moment at the tip
            [jv(2, near), yv(2, near), iv(2, near), -kv(2, near)],  # no shear force
            [jv(1, far), yv(1, far), iv(1, far), kv(1, far)],  # no deflection at the root
            [-jv(2, far), -yv(2, far), iv(2, far), -kv(2, far)],  # no slope
        ]
        matrix = np.array(rows)
        return float(np.linalg.det(matrix / np.abs(matrix).max(axis=0)))

    places = np.linspace(1.0, 25.0, 500)
    values = [missed(place) for place in places]
    roots = [
        brentq(missed, one, other, xtol=1e-12)
        for one, other, before, after in zip(places, places[1:], values, values[1:], strict=False)
        if before * after < 0.0
    ]
    return np.array(roots[:count]) ** 2 * (1.0 - tip) ** 2


def of_staircase(tip: float, steps: int) -> Array:
    """Return the same of beam elements with segments that are as thick as the wedge is in their middle."""
    ends = np.linspace(0.0, LENGTH, steps + 1)
    segments = [
        {"name": f"step{number}", "from": float(one), "to": float(other), "thickness": thickness}
        for number, (one, other) in enumerate(pairwise(ends))
        for thickness in [float(ROOT * (1.0 - (1.0 - tip) * 0.5 * (one + other) / LENGTH))]
    ]
    tables = {
        "beam": {"length": LENGTH, "thickness": ROOT, "width": 0.01},
        "material": {"young_modulus": YOUNG, "poisson_ratio": 0.3, "density": DENSITY},
        "segment": segments,
        "support": [{"name": "far", "from": 0.981, "to": 0.991, "clearance": 2.0e-4}],
        "model": {"type": "beam", "elements": ELEMENTS},
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    operators = SteppedBeam.of_case(gapbeam.read_case(tables), ELEMENTS).operators().dense
    free = slice(2, None)  # deflection and rotation of the root come first
    squares = eigh(operators.stiffness[free, free], operators.mass[free, free], eigvals_only=True)[:3]
    return np.asarray(np.sqrt(squares) * LENGTH**2 * np.sqrt(12.0 * DENSITY / YOUNG) / ROOT)


@pytest.mark.parametrize("tip", PUBLISHED)
def test_published_frequencies_are_those_of_kirchhoff(tip: float) -> None:
    """The solution of this file against the table of another one."""
    np.testing.assert_allclose(of_kirchhoff(tip), PUBLISHED[tip], rtol=2e-5)


def test_a_staircase_of_segments_is_a_taper() -> None:
    """The error falls with the square of the number of steps, to 2e-3 of the first three frequencies in 20."""
    theory = of_kirchhoff(0.5)
    errors = {steps: np.abs(of_staircase(0.5, steps) / theory - 1.0).max() for steps in (10, 20)}
    assert errors[10] < 6e-3
    assert errors[20] < 2e-3
    assert errors[10] / errors[20] == pytest.approx(4.0, rel=0.25)
