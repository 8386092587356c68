"""Order of convergence of static contact in the cell size, in the energy norm, for every formulation.

A square block is pressed between a flat gland and a base with a smooth hump, which touches part of it. There are no
singularities: the corners are free or slide, and the pressure goes to zero like a square root. Linear quadrilaterals.

Source: Chouly and Hild (2013), SIAM J. Numer. Anal. 51, 1295-1307, for Nitsche's method: O(h) for every theta; the same
for unilateral contact at the nodes, and for a penalty that grows like 1 / h (Chouly and Hild 2013, Appl. Numer. Math. 65).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from solver.analyses.static import find_seat
from tests.models import beam_model, stiffness_of

SIDE, E = 0.05, 2.1e11  # m, Pa
INTERFERENCE, HUMP = 5.0e-5, 4.0e-5  # m
CELLS, FINEST = (8, 16, 32), 128
FORMULATIONS = {
    "penalty": {"type": "penalty"},
    "nitsche 1": {"type": "nitsche", "theta": 1},
    "nitsche 0": {"type": "nitsche", "theta": 0},
    "nitsche -1": {"type": "nitsche", "theta": -1},
    "unilateral": {"type": "unilateral"},
}


class Pressed:
    """The block with a number of cells along each side, pressed."""

    def __init__(self, name, cells):
        size = SIDE / cells
        self.model = beam_model(
            {
                "beam": {"length": SIDE, "thickness": SIDE},
                "support": {"length": SIDE, "clearance": -INTERFERENCE},
                "mesh": {
                    "size": size,
                    "support_size": size,
                    "edge_size": size,
                    "cells_through_thickness": cells,
                    "degree": 1,
                },
                "contact": {
                    "formulation": FORMULATIONS[name],
                    "stiffness": 4.0 * E / size if name == "penalty" else "auto",
                },
                "time": {"scheme": {"type": "implicit-midpoint"}},
            },
            loads=(),
        )
        system = self.model.system
        contact = system.contact
        hump = HUMP * (1.0 + np.cos(2.0 * np.pi * contact.positions[:, 0] / SIDE))
        self.base = contact.faces == contact.face_names.index("base")
        contact = replace(contact, initial_gap=contact.initial_gap + self.base * hump)
        seat = find_seat(replace(system, contact=contact), self.model.law, self.model.seat_springs)
        self.u, self.pressure, self.weights = seat.state.u[0].reshape(-1, 2), seat.state.pressure, contact.weights
        self.x = self.model.space.tabulate_dof_coordinates()[:, :2]

    def at(self, places):
        """Displacement at places: bilinear in cells that form a grid."""
        order = np.lexsort((self.x[:, 1], np.round(self.x[:, 0] / SIDE * 1e6)))
        count = round(np.sqrt(len(order)))
        ticks = self.x[order, 0].reshape(count, count)[:, 0], self.x[order, 1].reshape(count, count)[0]
        values = self.u[order].reshape(count, count, 2)
        inside = [np.clip(places[:, k], ticks[k][0], ticks[k][-1]) for k in (0, 1)]
        return RegularGridInterpolator(ticks, values)(np.stack(inside, axis=1))


@cache
def reference():
    """The finest block and its stiffness."""
    finest = Pressed("unilateral", FINEST)
    return finest, stiffness_of(finest.model)


def energy_error(name, cells):
    """Energy norm of the difference from the finest solution, relative."""
    finest, stiffness = reference()
    difference = (Pressed(name, cells).at(finest.x) - finest.u).reshape(-1)
    exact = finest.u.reshape(-1)
    return float(np.sqrt(difference @ (stiffness @ difference) / (exact @ (stiffness @ exact))))


def test_the_hump_touches_part_of_the_base() -> None:
    """Between a fifth and four fifths of the base carry; the gland carries everywhere."""
    finest, _ = reference()
    touched = finest.weights[finest.base] @ (finest.pressure[finest.base] > 0.0) / finest.weights[finest.base].sum()
    assert 0.2 < touched < 0.8
    assert np.all(finest.pressure[~finest.base] > 0.0)


@pytest.mark.parametrize("name", FORMULATIONS)
def test_order_of_static_contact(name: str) -> None:
    """The error in the energy norm falls with order 1 at least, within 0.1, between 8, 16 and 32 cells along the side."""
    errors = np.array([energy_error(name, cells) for cells in CELLS])
    orders = np.log2(errors[:-1] / errors[1:])
    print(name, errors, orders)
    assert np.all(orders > 0.9)
    assert errors[-1] < 0.1
