"""The Gauss rule of a discrete measure: that of Legendre for many points, and points that lie at one place."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.assembly.gauss_rule import gauss_rule


def test_the_rule_of_many_points_integrates_as_they_do() -> None:
    """Four nodes integrate polynomials of degree 7 like the 12 Gauss points of a line, and are those of Legendre."""
    y, weights = np.polynomial.legendre.leggauss(12)
    rule = gauss_rule(y, weights, 4)
    nodes = rule.rows @ y
    expected, areas = np.polynomial.legendre.leggauss(4)
    order = np.argsort(nodes)
    assert nodes[order] == pytest.approx(expected, abs=1e-12)
    assert rule.areas[order] == pytest.approx(areas, abs=1e-12)


@pytest.mark.parametrize("y", [[-0.00202754], [0.3, 0.3 + 1e-17], [0.0, 0.0, 0.0]])
def test_points_at_one_place_are_one_node(y: list[float]) -> None:
    """Round-off of a coordinate is no distance: a line with one point had nodes without area (drawn case 3504)."""
    weights = np.full(len(y), 1.14798257e-05)
    rule = gauss_rule(np.array(y), weights, 4)
    assert rule.areas == pytest.approx([weights.sum()])
    assert rule.rows @ np.array(y) == pytest.approx([y[0]])
