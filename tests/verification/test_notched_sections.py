"""Polygons with sharp re-entrant corners, thin slots and many points: figures in closed form, and their torsion."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest

from gapbeam.meshes.sections.section_mesh import PolygonOutline
from gapbeam.solver.sections.saint_venant import saint_venant

Points = list[tuple[float, float]]


def star(tips: int, outer: float, inner: float) -> Points:
    """Return the corners of a star, whose first tip looks up."""
    radii = (outer, inner)
    return [
        (radii[n % 2] * cos(pi * n / tips + 0.5 * pi), radii[n % 2] * sin(pi * n / tips + 0.5 * pi))
        for n in range(2 * tips)
    ]


def sector(opening: float, sides: int) -> Points:
    """Return a disc of radius 1 without a wedge at its top, as many sides around as wide; its area is that of arcs."""
    angle = 2.0 * pi - opening
    radius = sqrt(angle / sides / sin(angle / sides))
    turns = [0.5 * pi + 0.5 * opening + angle * n / sides for n in range(sides + 1)]
    return [(0.0, 0.0), *((radius * cos(turn), radius * sin(turn)) for turn in turns)]


def torsion_of_sector(angle: float) -> float:
    """Return J of a sector of radius 1.

    With Psi = sum f_n(r) sin(nu t), nu = n pi / angle, n odd, and f_n = C (r^2 - r^nu), C = 8 / (n pi (nu^2 - 4)),
    lap Psi is -2, and J = 2 int Psi dA = 8 angle / pi^2 sum 1 / (n (nu + 2))^2.
    """
    n = np.arange(1, 20001, 2)
    return float(8.0 * angle / pi**2 * np.sum(1.0 / (n * (n * pi / angle + 2.0)) ** 2))


def test_the_series_is_that_of_the_handbook() -> None:
    """Timoshenko and Goodier (1970), art. 111: pi / 2 - 4 / pi for half a disc, 0.878 for a slit one."""
    found = [torsion_of_sector(angle) for angle in (pi, 2.0 * pi)]
    assert found == pytest.approx([0.5 * pi - 4.0 / pi, 0.878], rel=3e-4)


@pytest.mark.parametrize("degrees", [5.0, 20.0, 60.0])
def test_a_sharp_notch_to_the_center_twists_as_the_series_says(degrees: float) -> None:
    """A disc of 120 sides with a wedge cut out: stress grows without bound at the tip of the notch."""
    opening = radians(degrees)
    figures = saint_venant(PolygonOutline.of(sector(opening, 120), ()))
    assert figures.torsion_constant == pytest.approx(torsion_of_sector(2.0 * pi - opening), rel=1e-3)
    assert figures.error < 1.0e-4


@pytest.mark.parametrize(("tips", "inner"), [(5, 0.2), (6, 0.25), pytest.param(12, 0.5, marks=pytest.mark.slow)])
def test_stars_have_figures_in_closed_form(tips: int, inner: float) -> None:
    """A = n R r sin(pi / n), I = A (R^2 + R r cos(pi / n) + r^2) / 12 about all axes; they twist about the center."""
    outline = PolygonOutline.of(star(tips, 1.0, inner), ())
    area = tips * inner * sin(pi / tips)
    about_center = area * (1.0 + inner * cos(pi / tips) + inner**2) / 12.0
    assert outline.moments.area == pytest.approx(area, rel=1e-12)
    assert outline.second_moments == pytest.approx((about_center, about_center, 0.0), rel=1e-12, abs=1e-15)
    figures = saint_venant(outline)
    y, z = outline.centroid
    assert figures.shear_center == pytest.approx((y, z), abs=2e-5)
    assert figures.error < 1.0e-4
    assert figures.torsion_constant < area**2 / (2.0 * pi), "a disc of the same area is stiffer: Polya"


def test_a_thin_slot_parts_a_bar() -> None:
    """Two strips of 1 x 3 that a bridge of 0.04 holds: J is that of both strips, nearly."""
    slot = 0.01
    points = [(-1.0, 0.0), (1.0, 0.0), (1.0, 3.0), (0.5 * slot, 3.0), (0.5 * slot, 0.04), (-0.5 * slot, 0.04)]
    points += [(-0.5 * slot, 3.0), (-1.0, 3.0)]
    outline = PolygonOutline.of(points, ())
    assert outline.moments.area == pytest.approx(6.0 - slot * 2.96, rel=1e-12)
    strip = 3.0 * (1.0 / 3.0 - 64.0 / pi**5 / 3.0 * sum(np.tanh(1.5 * n * pi) / n**5 for n in range(1, 99, 2)))
    assert saint_venant(outline).torsion_constant == pytest.approx(2.0 * strip, rel=0.03)


def test_an_ellipse_of_many_sides_twists_as_an_ellipse() -> None:
    """J = pi a^3 b^3 / (a^2 + b^2); areas are the same."""
    count, a, b = 200, 0.03, 0.012
    scale = sqrt(2.0 * pi / count / sin(2.0 * pi / count))
    turns = 2.0 * pi * (np.arange(count) + 0.5) / count
    points = [(scale * a * cos(turn), scale * b * sin(turn)) for turn in turns]
    figures = saint_venant(PolygonOutline.of(points, ()))
    assert figures.torsion_constant == pytest.approx(pi * a**3 * b**3 / (a**2 + b**2), rel=5e-4)
