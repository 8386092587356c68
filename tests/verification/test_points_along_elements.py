"""Flat beams meet supports at few points along each element: their rule, wedges of depths, a beam on an elastic bed.

A depth that grows from 0 to d over the length b, on a face of stiffness K per area and width w, is pressed by

    F = K w d b / 2,    at b / 3 from the deep end.

A free beam of length L on an elastic bed k = K w per length, under a force P in its middle, sinks there by

    y = P q / (2 k) (cosh qL + cos qL + 2) / (sinh qL + sin qL),    q^4 = k / (4 E I),

and by less at its ends, y = 2 P q / k cosh(qL/2) cos(qL/2) / (sinh qL + sin qL): all of it is pressed for qL < pi.

Source: Hetenyi (1946), Beams on Elastic Foundation, section 13, eqs. 26.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.assembly.gauss_rule import gauss_rule
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, THICKNESS, WIDTH, START, END = 0.2, 2.0e-3, 8.0e-3, 0.06, 0.1  # m
YOUNG, STIFFNESS = 2.0e11, 1.0e11  # Pa, Pa/m


@given(st.integers(0, 10**6), st.integers(2, 5), st.integers(6, 60), st.sampled_from([-1.0, 1.0]), st.floats(0.0, 0.5))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_a_rule_with_a_node_at_an_edge_integrates_polynomials(
    seed: int, count: int, points: int, side: float, beyond: float
) -> None:
    """K nodes, one of them at the edge, integrate the degree 2 k - 2 like the points, with areas above 0."""
    draw = np.random.default_rng(seed)
    y, weights = draw.uniform(-1.0, 1.0, points), draw.uniform(0.1, 1.0, points)
    edge = side * (np.abs(y).max() + beyond)
    rule = gauss_rule(y, weights, count, edge)
    nodes = rule.rows @ y
    assert np.abs(nodes - edge).min() <= 1e-12 * abs(edge)
    assert np.all(rule.areas > 0.0)
    for degree in range(2 * count - 1):
        assert rule.areas @ nodes**degree == pytest.approx(weights @ y**degree, abs=1e-10 * weights.sum())
    for degree in range(count):
        assert rule.rows @ y**degree == pytest.approx(nodes**degree, abs=1e-9)


def beam(model: str, dimension: int, cells: int, **tables: Any) -> Simulation:
    """Return a flat beam in one support."""
    size = {"size": 0.02, "support_size": 4.0e-2 / cells, "cells_through_thickness": 1, "dimension": dimension}
    return gapbeam.model(
        {
            "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
            "material": {"young_modulus": YOUNG, "poisson_ratio": 0.0, "density": 8000.0},
            "support": [{"name": "plate", "from": START, "to": END, "clearance": 1.0e-4}],
            "model": {"type": model},
            "mesh": size,
            "contact": {"stiffness": STIFFNESS},
            "time": {"end": 1.0e-3, "step": 1.0e-6},
        }
        | tables
    )


@cache
def contact(model: str, dimension: int, cells: int) -> tuple[Any, Any]:
    """Return the contact points of a beam, and its law."""
    built = beam(model, dimension, cells).model
    return built.system.contact, built.law


@pytest.mark.parametrize(("model", "dimension"), [("rigid", 2), ("beam", 2), ("rigid", 3), ("beam", 3)])
@given(st.floats(0.2, 1.0), st.floats(1.0e-7, 1.0e-5), st.booleans(), st.sampled_from([64, 256]))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_a_wedge_of_depths_has_force_and_couple_of_the_integral(
    model: str, dimension: int, part: float, depth: float, first: bool, cells: int
) -> None:
    """Depths that grow over a fifth of the support or more; a finer mesh hardly has more points."""
    points, law = contact(model, dimension, cells)
    assert points.size <= 1.2 * contact(model, dimension, 64)[0].size
    x, below = points.positions[:, 0], points.faces == 0
    assert [x.min(), x.max()] == pytest.approx([START, END], rel=1e-12)
    b = part * (END - START)
    along = x - START if first else END - x
    depths = np.where(below, depth * (1.0 - along / b), -1.0)
    forces = points.weights * law.static(depths).pressure
    force = 0.5 * STIFFNESS * WIDTH * depth * b
    assert forces.sum() == pytest.approx(force, rel=5.0e-3)
    assert forces @ along == pytest.approx(force * b / 3.0, rel=1.0e-2)


@pytest.mark.parametrize(("length_in_bed", "dimension"), [(0.8, 2), (1.5, 3), (2.5, 2)])
def test_a_beam_on_an_elastic_bed_sinks_as_in_closed_form(length_in_bed: float, dimension: int) -> None:
    """The middle and the ends, under a force in the middle."""
    force, inertia = 2.0, WIDTH * THICKNESS**3 / 12.0
    q = length_in_bed / LENGTH
    bed = 4.0 * YOUNG * inertia * q**4
    simulation = beam(
        "beam", dimension, 200,
        support=[{"name": "bed", "from": 0.0, "to": LENGTH, "clearance": 0.0, "region": {"type": "stop"}}],
        contact={"stiffness": bed / WIDTH},
        load=[{
            "type": "constant_force", "name": "P", "point": LENGTH / 2, "direction": [0.0] * (dimension - 1) + [-1.0],
            "amplitude": force,
        }],
        probe=[{"name": "middle", "point": LENGTH / 2}, {"name": "end", "point": LENGTH}],
    )  # fmt: skip
    u, model = simulation.seat().state.u[VALUE], simulation.model
    middle, end = (-model.probes[name].evaluate(u, model.system.operators)[-1] for name in ("middle", "end"))
    bottom = np.sinh(length_in_bed) + np.sin(length_in_bed)
    top = np.cosh(length_in_bed) + np.cos(length_in_bed) + 2.0
    half = 0.5 * length_in_bed
    assert middle == pytest.approx(force * q / (2.0 * bed) * top / bottom, rel=2e-3)
    assert end == pytest.approx(2.0 * force * q / bed * np.cosh(half) * np.cos(half) / bottom, rel=5e-3)
