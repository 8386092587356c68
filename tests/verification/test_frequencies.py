"""Natural frequencies of the assembled beam against beam theory: free, and clamped by a stiff interference fit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from gapbeam.solver.case.computed_defaults import overhang_frequency
from tests.shared.models import beam_case, beam_model, bending_frequencies, spread, stiffness_of

E, NU, DENSITY = 2.1e11, 0.3, 7919.0
SPEED = np.sqrt(E / DENSITY)  # of sound in a bar, m/s
FREE = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464])  # cos x cosh x = 1
CLAMPED = np.array([1.8751040687119611, 4.694091132974174])  # cos x cosh x = -1
WEAK = {"axial": 1.0, "lateral": 1.0}  # N/m
SHEAR = {2: 5.0 * (1.0 + NU) / (6.0 + 5.0 * NU), 3: 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU)}
"""Shear coefficients of a rectangle: plane stress (Kaneko 1975) and solid (Cowper 1966)."""


def euler_bernoulli(roots, length, thickness):
    """Frequencies, Hz: f = (x / L)^2 r c / (2 pi), r the radius of gyration and c the speed in a bar."""
    return (roots / length) ** 2 * thickness / np.sqrt(12.0) * SPEED / (2.0 * np.pi)


def timoshenko_free(length, thickness, coefficient, count):
    """Frequencies, Hz, of a free Timoshenko beam: roots of the determinant of the exact transfer matrix.

    With W, P, Q, M for deflection, rotation, shear force and bending moment per unit width,
    W' = P + Q/(k G h), P' = M/(E I), Q' = -rho h w^2 W, M' = -Q - rho I w^2 P; Q = M = 0 at both ends.
    """
    area, inertia, shear = thickness, thickness**3 / 12.0, coefficient * E / (2.0 * (1.0 + NU)) * thickness
    scales = np.array([length, 1.0, E * inertia / length**2, E * inertia / length])

    def determinant(frequency):
        square = (2.0 * np.pi * frequency) ** 2 * DENSITY
        rates = np.zeros((4, 4))
        rates[0, 1], rates[0, 2], rates[1, 3] = 1.0, 1.0 / shear, 1.0 / (E * inertia)
        rates[2, 0], rates[3, 1], rates[3, 2] = -square * area, -square * inertia, -1.0
        transfer = expm(length * rates * scales / scales[:, None])
        return np.linalg.det(transfer[2:, :2])

    return np.array([brentq(determinant, 0.9 * f, f) for f in euler_bernoulli(FREE[:count], length, thickness)])


def clamped_by_interference(slenderness, dimension):
    """Frequencies over Euler-Bernoulli's, of a 460 mm overhang of some slenderness pressed over six thicknesses."""
    overhang = 0.46
    thickness = overhang / slenderness
    mesh = {"dimension": dimension, "size": overhang / 48, "support_size": 0.25 * thickness}
    mesh |= {"cells_through_thickness": 1} | ({"cells_across_width": 1} if dimension == 3 else {})
    model = beam_model(
        {
            "beam": {"length": overhang + 6.0 * thickness, "thickness": thickness, "width": 1.6 * thickness},
            "support": {"length": 6.0 * thickness, "clearance": -1e-3 * thickness},
            "restraint": WEAK,
            "contact": {"stiffness": 100.0 * E / thickness},
            "mesh": mesh,
        }
    )
    springs = spread(model.system.contact.springs(model.law.stiffness), model.system.operators.size)
    found = bending_frequencies(model, len(CLAMPED), stiffness_of(model) + springs)
    return found / euler_bernoulli(CLAMPED, overhang, thickness)


def test_known_frequencies_of_the_paper_beam() -> None:
    """Known answers: free 510 mm 244.2 Hz; clamped 460 mm 47.18 Hz, or 47.38 and 296.94 with 7850 kg/m^3."""
    assert euler_bernoulli(FREE, 0.51, 0.012)[0] == pytest.approx(244.2, abs=0.05)
    assert euler_bernoulli(CLAMPED, 0.46, 0.012)[0] == pytest.approx(47.18, abs=0.005)
    lighter = euler_bernoulli(CLAMPED, 0.46, 0.012) * np.sqrt(DENSITY / 7850.0)
    assert lighter == pytest.approx([47.38, 296.94], rel=1e-4)
    assert overhang_frequency(beam_case()) == pytest.approx(47.176, abs=1e-3)


@pytest.mark.parametrize("thickness", [0.006, 0.012, 0.024])
def test_free_slice_is_a_timoshenko_beam(thickness: float) -> None:
    """The first four frequencies of a free slice in plane stress: those of Timoshenko within 0.05 %."""
    model = beam_model({"beam": {"thickness": thickness}, "mesh": {"size": 0.01, "support_size": 0.01}})
    expected = timoshenko_free(0.51, thickness, SHEAR[2], 4)
    assert bending_frequencies(model, 4) == pytest.approx(expected, rel=5e-4)


def test_free_solid_is_a_timoshenko_beam() -> None:
    """The first three frequencies of a free solid with one cell across: those of Timoshenko within 0.2 %."""
    mesh = {"dimension": 3, "size": 0.01, "support_size": 0.01, "cells_through_thickness": 1}
    model = beam_model({"mesh": mesh | {"cells_across_width": 1}, "restraint": WEAK})
    assert bending_frequencies(model, 3) == pytest.approx(timoshenko_free(0.51, 0.012, SHEAR[3], 3), rel=2e-3)


def test_free_slender_beams_tend_to_euler_bernoulli() -> None:
    """The deviation falls with the square of the thickness; extrapolated to zero it is below 5e-5 and 1.5e-4."""
    ratios = []
    for thickness in (0.51 / 20, 0.51 / 40, 0.51 / 80):
        model = beam_model({"beam": {"thickness": thickness}, "mesh": {"size": 0.0085, "support_size": 0.0085}})
        ratios.append(bending_frequencies(model, 2) / euler_bernoulli(FREE[:2], 0.51, thickness))
    thick, middle, thin = ratios
    assert (1.0 - thick) / (1.0 - middle) == pytest.approx(4.0, rel=0.05)
    assert (1.0 - middle) / (1.0 - thin) == pytest.approx(4.0, rel=0.05)
    limit = (thick - 20.0 * middle + 64.0 * thin) / 45.0  # of a + b h^2 + c h^4
    assert limit[0] == pytest.approx(1.0, abs=5e-5)
    assert limit[1] == pytest.approx(1.0, abs=1.5e-4)


@pytest.mark.parametrize("dimension", [2, 3])
def test_interference_fit_tends_to_the_clamped_beam(dimension: int) -> None:
    """K + G^T (w eps) G with eps = 100 E/h: an elastic clamp lengthens the overhang by about half a thickness.

    So the frequencies are those of the Euler-Bernoulli cantilever but for a deviation that starts linearly in h / L;
    extrapolated to h = 0 by a parabola through three slendernesses, the first two agree to 1e-4 and 5e-4.
    """
    ratios = [clamped_by_interference(slenderness, dimension) for slenderness in (20, 40, 80)]
    longer = [(ratio[0] ** -0.5 - 1.0) * slenderness for ratio, slenderness in zip(ratios, (20, 40, 80), strict=True)]
    assert np.ptp(longer) < 0.02
    assert 0.45 < min(longer) < max(longer) < 0.6
    limit = (ratios[0] - 6.0 * ratios[1] + 8.0 * ratios[2]) / 3.0
    assert limit[0] == pytest.approx(1.0, abs=1e-4)
    assert limit[1] == pytest.approx(1.0, abs=5e-4)


def test_clamped_paper_beam() -> None:
    """The interference fit of the paper, 0.006 mm: between 44.5 Hz of a compliant clamp and 47.18 Hz of a rigid one."""
    model = beam_model({"support": {"clearance": -0.006e-3}})
    springs = spread(model.system.contact.springs(model.law.stiffness), model.system.operators.size)
    first = bending_frequencies(model, 1, stiffness_of(model) + springs)[0]
    assert 44.5 < first < 47.18
