"""Torsion constants of cross-sections against published figures, Bredt's formula and another way to compute them."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from scipy.sparse import csc_matrix, identity, kron
from scipy.sparse.linalg import spsolve

from gapbeam.solver.sections.section_choice import BoxSection, ISection, torsion_of_blocks
from gapbeam.solver.sections.section_table import RectangularSection, RoundSection, TubeSection

RECTANGLE = RectangularSection(type="rectangle")


def box(wall: float) -> BoxSection:
    """Return a box."""
    return BoxSection(type="box", wall=wall)


# J / (a b^3): Timoshenko and Goodier (1970), Theory of Elasticity, table in sec. 109
@pytest.mark.parametrize(
    ("slenderness", "share"), [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)]
)
def test_a_rectangle_has_the_published_constant(slenderness: float, share: float) -> None:
    """To the digits of the table, lying or standing."""
    found = RECTANGLE.torsion_constant(0.02, slenderness * 0.02) / (slenderness * 0.02**4)
    assert found == pytest.approx(share, abs=6e-4)
    assert RECTANGLE.torsion_constant(slenderness * 0.02, 0.02) == pytest.approx(found * slenderness * 0.02**4)


def test_round_sections_have_their_polar_moment() -> None:
    """The value pi d^4 / 32, less the value of the bore."""
    disc, tube = RoundSection(type="round"), TubeSection(type="tube", wall=0.004)
    assert disc.torsion_constant(0.03, 0.03) == pytest.approx(pi * 0.03**4 / 32.0)
    assert disc.polar_moment(0.03, 0.03) == pytest.approx(pi * 0.03**4 / 32.0)
    assert tube.torsion_constant(0.03, 0.03) == pytest.approx(pi * (0.03**4 - 0.022**4) / 32.0)


def test_polar_moments_are_those_by_hand() -> None:
    """Of a rectangle, b h (b^2 + h^2) / 12."""
    assert RECTANGLE.polar_moment(0.02, 0.05) == pytest.approx(0.02 * 0.05 * (0.02**2 + 0.05**2) / 12.0)


def test_finite_elements_find_the_constant_of_a_rectangle() -> None:
    """Four blocks that fill a rectangle, against its series."""
    filled = ((True, True), (True, True))
    found = torsion_of_blocks((0.012, 0.004), (0.02, 0.01), filled)
    assert found == pytest.approx(RECTANGLE.torsion_constant(0.02, 0.04), rel=2e-5)


def test_thin_boxes_follow_the_formula_of_bredt() -> None:
    """4 A_m^2 t / s: what is missing vanishes with the wall."""
    missing = []
    for wall in (4.0e-4, 2.0e-4, 1.0e-4):
        middle, around = (0.06 - wall) * (0.04 - wall), 2.0 * (0.1 - 2.0 * wall)
        missing.append(box(wall).torsion_constant(0.04, 0.06) / (4.0 * middle**2 * wall / around) - 1.0)
    assert 0.0 < missing[2] < 2e-3
    assert missing[0] / missing[1] == pytest.approx(2.0, rel=0.05)
    assert missing[1] / missing[2] == pytest.approx(2.0, rel=0.05)


def test_thick_boxes_tend_to_the_solid_rectangle() -> None:
    """With a square bore of a hundredth, to 1e-3."""
    solid = RECTANGLE.torsion_constant(0.04, 0.04)
    assert box(0.0198).torsion_constant(0.04, 0.04) == pytest.approx(solid, rel=1e-3)


# El Darwish and Johnston (1965), J. Struct. Div. 91, 203-227, a fit to computed figures of I sections without fillets
@pytest.mark.parametrize(("web", "flange"), [(0.006, 0.01), (0.01, 0.015), (0.008, 0.008)])
def test_i_sections_have_the_published_constant(web: float, flange: float) -> None:
    """2/3 b t_f^3 + (h - 2 t_f) t_w^3 / 3 + 2 alpha D^4 - 0.42 t_f^4, to the percent of that fit."""
    height, width = 0.1, 0.06
    ratio = web / flange
    alpha = -0.042 + 0.2204 * ratio - 0.0725 * ratio**2
    circle = flange + web**2 / (4.0 * flange)
    strips = 2.0 / 3.0 * width * flange**3 + (height - 2.0 * flange) * web**3 / 3.0
    published = strips + 2.0 * alpha * circle**4 - 0.42 * flange**4
    found = ISection(type="i", web=web, flange=flange).torsion_constant(height, width)
    assert found == pytest.approx(published, rel=0.012)


def test_an_i_section_lies_above_the_stress_function_of_prandtl() -> None:
    """The stress function by finite differences gives J from below, the warping function from above: 0.3 % apart."""
    height, width, web, flange = 0.1, 0.06, 0.01, 0.015
    found = ISection(type="i", web=web, flange=flange).torsion_constant(height, width)

    def stress(cell: float) -> float:
        columns, rows = round(width / cell) - 1, round(height / cell) - 1
        y = (np.arange(1, columns + 1) * cell - 0.5 * width)[:, None]
        z = (np.arange(1, rows + 1) * cell - 0.5 * height)[None, :]
        inside = ((abs(y) < 0.5 * web - 1e-9) | (abs(z) > 0.5 * height - flange + 1e-9)).reshape(-1)
        second = [np.eye(n, k=1) + np.eye(n, k=-1) - 2.0 * np.eye(n) for n in (columns, rows)]
        laplace = csc_matrix(kron(second[0], identity(rows)) + kron(identity(columns), second[1])) / cell**2
        kept = np.flatnonzero(inside)
        return float(2.0 * spsolve(laplace[np.ix_(kept, kept)], np.full(len(kept), -2.0)).sum() * cell**2)

    below = stress(1.0e-3), stress(5.0e-4)
    assert below[0] < below[1] < found
    assert found == pytest.approx(below[1] + (below[1] - below[0]) / (2.0 ** (4.0 / 3.0) - 1.0), rel=3e-3)
