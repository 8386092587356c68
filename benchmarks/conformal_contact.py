"""A solid cylinder that is pressed into a round hole: contact angle and peak pressure with cells around.

    python3 -m benchmarks.conformal_contact

Persson's problem: a disc of the radius R in a hole that is wider by dR, pressed by Q per length, without friction.
Pressure that is even in the angle t from the line of the load, p = sum p_n cos nt, opens the gap by c_n p_n cos nt:

    dR - d cos t + c_0 p_0 + sum_(n > 1) c_n p_n cos nt + p / K = 0 where p > 0,    pi R p_1 = Q

with  c_0 = 2 R/E,  c_n = 4 (R/E) n / (n^2 - 1)        for a disc and a plate of the same material,
      c_0 = R/E,    c_n = (R/E) (2n - 1) / (n^2 - 1)   for a disc without Poisson's ratio in a rigid hole,

by plane elasticity of a disc and of a plate with a hole (Airy's function of every n), and K the stiffness of the
contact per area. Persson has a closed form of the first of them.

Source: Persson (1964), On the stress distribution of cylindrical elastic bodies in contact; Ciavarella and Decuzzi
(2001), Int. J. Solids Struct. 38, 4507-4523.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, pi
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

import gapbeam
from benchmarks.table import Cell, Table, options
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import Array

YOUNG, RADIUS, LENGTH, CLEARANCE, DENSITY = 2.0e11, 0.02, 0.002, 1.0e-5, 1000.0
STIFFNESS = 100.0 * YOUNG / RADIUS
ELASTIC, RIGID = "elastic", "rigid"  # the hole
LOADS, CELLS = (0.125, 0.5, 2.0), (4, 8, 12)  # Q / (E dR); a fourth of the cells around
WIDEST = 0.7 * pi  # beyond any contact angle


class Contact(NamedTuple):
    """Half of the contact angle, rad, and the largest pressure as p R / Q."""

    angle: float
    peak: float


def by_series(hole: str, ratio: float, softness: float = 0.0, size: int = 300, terms: int = 6000) -> Contact:
    """Return the contact by the series above: constant pressure on cells, the gap at their middles.

    Args:
        hole: ELASTIC or RIGID.
        ratio: E dR / Q.
        softness: E / (K R).
        size: Cells on half of the widest contact angle.
        terms: Terms of the series.
    """
    wide = WIDEST / size
    t, n = wide * (np.arange(size) + 0.5), np.arange(2, terms)
    mean, opening = (2.0, 4.0 * n / (n * n - 1.0)) if hole == ELASTIC else (1.0, (2.0 * n - 1.0) / (n * n - 1.0))
    waves = np.cos(np.outer(t, n))
    opened = (waves * (4.0 / pi * np.sin(0.5 * n * wide) / n * opening)) @ waves.T + mean * wide / pi
    carried = 4.0 * np.sin(0.5 * wide) * np.cos(t)
    pressed = t < 0.25 * pi
    while True:
        at = np.flatnonzero(pressed)
        matrix = np.zeros((len(at) + 1, len(at) + 1))
        matrix[:-1, :-1] = opened[np.ix_(at, at)] + softness * np.eye(len(at))
        matrix[:-1, -1], matrix[-1, :-1] = -np.cos(t[at]), carried[at]
        found = np.linalg.solve(matrix, np.append(np.full(len(at), -ratio), 1.0))
        pressure = np.zeros(size)
        pressure[at] = found[:-1]
        gap = ratio - found[-1] * np.cos(t) + opened @ pressure
        wanted = np.where(pressed, pressure > 0.0, gap < 0.0)
        if np.array_equal(wanted, pressed):
            return Contact(wide * len(at), float(pressure.max()))
        pressed = wanted


def pressed_disc(quarter: int, load: float) -> Contact:
    """Return the contact of the solid disc in a rigid hole by finite elements.

    Args:
        quarter: Cells on a quarter of the circumference.
        load: Q / (E dR).
    """
    force = load * YOUNG * CLEARANCE
    tables: dict[str, Any] = {
        "beam": {"length": LENGTH, "thickness": 2.0 * RADIUS, "width": 2.0 * RADIUS, "section": {"type": "round"}},
        "material": {"young_modulus": YOUNG, "poisson_ratio": 0.0, "density": DENSITY},
        "support": [{"name": "hole", "from": 0.0, "to": LENGTH, "clearance": CLEARANCE, "region": "hole"}],
        "mesh": {"dimension": 3, "cells_through_thickness": quarter, "cells_across_width": quarter, "size": LENGTH},
        "model": {"type": "full"},
        "contact": {"stiffness": STIFFNESS},
        "load": [{"type": "gravity", "acceleration": force / (DENSITY * pi * RADIUS**2)}],
        "probe": [{"name": "mid", "point": 0.5 * LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    model = build_model(gapbeam.read_case(tables), MPI.COMM_SELF)
    pressure: Array = Simulation(model).seat().state.pressure
    places = model.system.contact.positions
    angles = [abs(atan2(y, -z)) for _, y, z in places[pressure > 0.0]]
    return Contact(max(angles), float(pressure.max()) * RADIUS / force)


def rows() -> Iterator[tuple[Cell, ...]]:
    """Yield points around, and for each load the errors of contact angle and peak pressure."""
    exact = [by_series(RIGID, 1.0 / load, YOUNG / (STIFFNESS * RADIUS), 600, 12000) for load in LOADS]
    yield "by series", *(f"{one.angle:.3f} rad, {one.peak:.3f}" for one in exact)
    for quarter in CELLS:
        found = [pressed_disc(quarter, load) for load in LOADS]
        errors = [
            f"{disc.angle - one.angle:+.2f} rad, {100.0 * (disc.peak / one.peak - 1.0):+.2g} %"
            for disc, one in zip(found, exact, strict=True)
        ]
        yield 16 * quarter, *errors


if __name__ == "__main__":
    columns = ("points around", *(f"Q = {load:g} E dR" for load in LOADS))
    title = "Half the contact angle and peak pressure (p R / Q) by series, and errors of finite elements"
    Table("conformal_contact", title, columns, tuple(rows())).write(options(__doc__).output)
