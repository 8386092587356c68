"""The beam on end springs: its roots against the printed determinant at 50 digits, its shapes, its limits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from benchmarks.roots import LIMIT, MODES, SPRINGS, compare
from gapbeam.studies.modes.beam_theory import (
    SpringBeam,
    clamped_roots,
    free_roots,
    mode_shape,
    pinned_roots,
    roots,
    sliding_roots,
)

INF = np.inf
FAR = (0.0, 1e-12, 1e-3, 1.0, 1e3, 1e8, INF)
STEEL = (2.1e11 * 0.02 * 0.012**3 / 12.0, 7919.0 * 0.02 * 0.012)
"""E I and rho A of the paper's beam."""


def test_roots_are_those_of_the_printed_determinant() -> None:
    """The first ten roots to 1e-14 of those that mpmath finds in Eq. 8 at 50 digits; none missed, none too many."""
    found = compare((0.0, 1e2, 1e6, INF), MODES)
    assert found.roots == 160
    assert found.missed == ()
    assert found.worst < 1e-14


@pytest.mark.slow
def test_roots_over_the_whole_grid() -> None:
    found = compare(SPRINGS, MODES)
    assert found.missed == ()
    assert found.worst < LIMIT


def test_limits_are_the_known_roots() -> None:
    """The tables of textbooks; the paper's plateaus of pinned beams, 2.365 and 5.497, are those of sliding ones."""
    first = np.arange(1, 5)
    assert clamped_roots(first) == pytest.approx([1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349], abs=1e-9)
    assert free_roots(first) == pytest.approx([0.0, 0.0, 4.7300407449, 7.8532046241], abs=1e-9)
    assert sliding_roots(first) == pytest.approx([0.0, 2.3650203724, 5.4978039190, 8.6393798287], abs=1e-9)
    assert pinned_roots(first) == pytest.approx([0.0, 3.9266023120, 7.0685827456, 10.2101761228], abs=1e-9)
    for draught, torsion, limit in (
        (INF, INF, clamped_roots),
        (INF, 0.0, pinned_roots),
        (0.0, INF, sliding_roots),
        (0.0, 0.0, free_roots),
    ):
        assert roots(first, draught, torsion) == pytest.approx(limit(first), rel=1e-14, abs=0.0)


def test_high_modes_neither_overflow_nor_drift() -> None:
    """Modes 100 to 10 000: (n - 1/2) pi etc. where cosh is infinite; mode 100 on springs against mpmath."""
    high = np.array([100, 1000, 10_000])
    assert clamped_roots(high) == pytest.approx((high - 0.5) * np.pi, rel=1e-14)
    assert free_roots(high) == pytest.approx((high - 1.5) * np.pi, rel=1e-14)
    assert pinned_roots(high) == pytest.approx((high - 0.75) * np.pi, rel=1e-14)
    assert sliding_roots(high) == pytest.approx((high - 1.25) * np.pi, rel=1e-14)
    found = float(roots(100, 1e7, 200.0))
    with mpmath.workdps(200):
        x, s1, s2 = mpmath.mpf(found), mpmath.mpf(1e7), mpmath.mpf(200)

        def equation(x: mpmath.mpf) -> mpmath.mpf:  # Eq. 9
            c, s, ch, sh = mpmath.cos(x), mpmath.sin(x), mpmath.cosh(x), mpmath.sinh(x)
            bending = 1 + c * ch - x / s2 * (s * ch - c * sh)
            return bending + x**3 / s1 * (x / s2 * (1 - c * ch) - (s * ch + c * sh))

        assert equation(x * (1 - mpmath.mpf("1e-14"))) * equation(x * (1 + mpmath.mpf("1e-14"))) < 0


@pytest.mark.parametrize("ratio", [1e-12, 1e-3, 1.0, 1e3, 1e12])
@pytest.mark.parametrize("soft", [1e-8, 1e-30, 1e-200])
def test_soft_springs_carry_a_rigid_beam(soft: float, ratio: float) -> None:
    """Two small roots, with s1, s2 to 0: lambda^8 - (4 s1 + 12 s2) lambda^4 + 12 s1 s2 = 0, the rigid beam's."""
    draught, torsion = soft * min(ratio, 1.0), soft / max(ratio, 1.0)
    half = 2.0 * draught + 6.0 * torsion
    larger = half + np.sqrt(half**2 - 12.0 * draught * torsion)
    found = roots(np.array([1, 2, 3]), draught, torsion)
    assert found[1] ** 4 == pytest.approx(larger, rel=1e-7)
    assert found[0] == pytest.approx((12.0 * (draught / larger) * torsion) ** 0.25, rel=1e-7)
    assert found[2] == pytest.approx(free_roots(3), rel=1e-7)


def test_roots_rise_with_both_springs() -> None:
    """Monotone over 60 orders of magnitude and apart from the next root: nothing jumps from root to root."""
    springs = np.concatenate([[0.0], np.logspace(-30, 30, 121), [INF]])
    found = roots(np.arange(1, 6)[:, None, None], springs[:, None], springs)
    slack = 1e-14 * found  # round-off differs from processor to processor
    assert np.all(np.diff(found, axis=1) >= -slack[:, 1:])
    assert np.all(np.diff(found, axis=2) >= -slack[:, :, 1:])
    inner = found[:, 1:, 1:]
    assert np.all(inner[1:] > inner[:-1] * 1.2)


@pytest.mark.parametrize("mode", [1, 2, 3, 7, 50, 200])
def test_shapes_meet_their_conditions(mode: int) -> None:
    """Nodes are n - 1 (so no root was missed); unit norm; the conditions of Eqs. 5 and 6, from free to clamped."""
    places, weights = np.polynomial.legendre.leggauss(max(40, 4 * mode))
    places, weights = 0.5 * (1.0 + places), 0.5 * weights
    for draught in FAR:
        for torsion in FAR:
            shape = mode_shape(mode, draught, torsion)
            heights = shape(np.linspace(0.0, 1.0, 12 * (mode + 2))[1:])
            assert np.count_nonzero(np.diff(np.signbit(heights))) == mode - 1
            assert weights @ shape(places) ** 2 == pytest.approx(1.0, rel=1e-10)
            wave = max(shape.root, 1e-300)
            y, slope, moment, shear = (float(shape(np.array(0.0), order)) for order in range(4))
            held, turned = min(draught, 1e100), min(torsion, 1e100)
            assert abs(shear + held * y) <= 1e-9 * (wave**3 + held)
            assert abs(moment - turned * slope) <= 1e-9 * (wave**2 + turned * wave + turned * abs(slope))
            end = shape(np.array([1.0]), 2), shape(np.array([1.0]), 3)
            assert abs(end[0][0]) <= 1e-9 * wave**2
            assert abs(end[1][0]) <= 1e-9 * wave**3


def test_shapes_are_orthogonal() -> None:
    places, weights = np.polynomial.legendre.leggauss(200)
    places, weights = 0.5 * (1.0 + places), 0.5 * weights
    for draught, torsion in ((0.0, 0.0), (0.0, 3.0), (2.0, 0.0), (1e-6, 1e-9), (50.0, 4.0), (INF, INF)):
        shapes = np.array([mode_shape(mode, draught, torsion)(places) for mode in range(1, 9)])
        assert shapes @ (weights[:, None] * shapes.T) == pytest.approx(np.identity(8), abs=1e-8)


def test_sensitivities_are_the_slopes_of_the_frequencies() -> None:
    beam, modes = SpringBeam(0.46, *STEEL), np.arange(1, 6)
    for springs in (np.array([3e4, 2e3]), np.array([1e-3, 1e3]), np.array([1e9, 1e-4])):
        found = beam.sensitivities(modes, *springs)
        for spring in (0, 1):
            up = np.where(np.arange(2) == spring, np.exp(1e-4), 1.0)
            rise = np.log(beam.frequencies(modes, *(springs * up)) / beam.frequencies(modes, *(springs / up)))
            assert found[:, spring] == pytest.approx(rise / 2e-4, abs=1e-7)


def test_known_frequencies_of_the_paper_beam() -> None:
    """Clamped, 460 mm: 47.18, or 47.38, 296.94 and 831.45 Hz with 7850 kg/m^3; free, 510 mm: 244.2 Hz."""
    bending, mass = STEEL
    clamped = SpringBeam(0.46, bending, mass).frequencies(np.arange(1, 4), INF, INF)
    assert clamped[0] == pytest.approx(47.18, abs=5e-3)
    assert clamped * np.sqrt(7919.0 / 7850.0) == pytest.approx([47.38, 296.94, 831.45], abs=6e-3)
    assert SpringBeam(0.51, bending, mass).frequencies(3, 0.0, 0.0) == pytest.approx(244.2, abs=0.05)


@pytest.mark.parametrize("wrong", [(0, 1.0, 1.0), (1.5, 1.0, 1.0), (1, -1.0, 1.0), (1, 1.0, np.nan)])
def test_what_is_no_mode_or_no_spring_is_refused(wrong: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match=r"expected 0 to infinity|not a positive integer"):
        roots(*wrong)
