"""Cells around a beam that contact in a hole needs: a rigid tube that its weight presses into two holes.

    python3 -m benchmarks.hole_points

Depth and direction are compared with the closed form of a smooth wall, F(r) = K R b (r (a + sin a cos a) - 2 c sin a),
cos a = c / r; the weight points between two contact points, 20 degrees off the vertical.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, atan2, cos, hypot, pi, radians, sin
from typing import Any

import numpy as np
from mpi4py import MPI

import gapbeam
from benchmarks.table import Cell, Table, options
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import VALUE

LENGTH, DIAMETER, WALL, CLEARANCE, WIDE, STIFFNESS = 0.2, 0.04, 0.004, 2.0e-4, 0.02, 2.0e9
MASS = 7850.0 * pi / 4.0 * (DIAMETER**2 - (DIAMETER - 2.0 * WALL) ** 2) * LENGTH
TILT = radians(20.0)
DEPTHS, CELLS = (0.002, 0.01, 0.05, 0.2), (2, 4, 8, 16)


def rows() -> Iterator[tuple[Cell, ...]]:
    """Yield cells around, contact points around, and for each depth the errors of depth and direction."""
    for cells in CELLS:
        errors = []
        for depth in DEPTHS:
            r = (1.0 + depth) * CLEARANCE
            a = acos(1.0 / (1.0 + depth))
            force = STIFFNESS * DIAMETER * WIDE * (r * (a + sin(a) * cos(a)) - 2.0 * CLEARANCE * sin(a))
            y, z = seated(cells, force / MASS)
            errors.append(f"{100.0 * (hypot(y, z) - r) / (r - CLEARANCE):.2g} %, {abs(atan2(y, -z) - TILT):.1g} rad")
        yield 4 * cells, 16 * cells, *errors


def seated(cells: int, acceleration: float) -> tuple[float, float]:
    """Return the place of the middle of the tube at rest, y and z in m."""
    tables: dict[str, Any] = {
        "beam": {"length": LENGTH, "thickness": DIAMETER, "width": DIAMETER, "section": {"type": "tube", "wall": WALL}},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [
            {"name": f"s{start:g}".replace(".", "_"), "from": start, "to": start + WIDE, "clearance": CLEARANCE}
            | {"region": "hole"}
            for start in (0.0, LENGTH - WIDE)
        ],
        "mesh": {"dimension": 3, "cells_through_thickness": cells, "cells_across_width": cells},
        "model": {"type": "rigid"},
        "contact": {"stiffness": STIFFNESS},
        "load": [{"type": "gravity", "acceleration": acceleration, "direction": [0.0, sin(TILT), -cos(TILT)]}],
        "probe": [{"name": "mid", "point": LENGTH / 2.0}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    model = build_model(gapbeam.read_case(tables), MPI.COMM_SELF)
    u = Simulation(model).seat().state.u[VALUE]
    _, y, z = np.asarray(model.probes["mid"].evaluate(u, model.system.operators))
    return float(y), float(z)


if __name__ == "__main__":
    columns = ("cells around", "points around", *(f"depth {depth:g} c" for depth in DEPTHS))
    title = "Errors of depth and direction of a contact in a hole"
    Table("hole_points", title, columns, tuple(rows())).write(options(__doc__).output)
