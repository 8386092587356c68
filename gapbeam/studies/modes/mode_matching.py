"""Modes matched by shape: the modal assurance criterion between the sections of a body and a beam of the theory.

    MAC = (x . y)^2 / ((x . x) (y . y)),    x . y = sum_slices m x y

from the springs to the tip: of a beam that begins at the edge of the base, only the overhang.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from gapbeam.solver.beam_theory.spring_beam import SpringBeam
from gapbeam.solver.modes.contact_modes import HeldModes
from gapbeam.solver.system.operators import Array

ALIKE = 0.5  # the least MAC of a pair


@dataclass(frozen=True)
class TheoryMode:
    """One mode of a beam of the theory, and the mode of the body that looks like it.

    Attributes:
        mode: n.
        root: lambda_n.
        frequency: f_n, Hz.
        matched: Number of that mode among the bending modes of the body, from 1; None: none looks like it.
        mac: Their MAC; 0 without one.
    """

    mode: int
    root: float
    frequency: float
    matched: int | None
    mac: float


def matched_modes(
    body: HeldModes, beam: SpringBeam, springs: tuple[float, float], count: int
) -> tuple[TheoryMode, ...]:
    """Return the first modes of a beam, each with the bending mode of a body that looks most like it.

    Args:
        body: Modes of a body.
        beam: Theory; its free end is the tip of the body, where its springs are follows from its length.
        springs: k1, N/m, and k2, N m/rad, in [0, inf].
        count: How many modes.
    """
    numbers = np.arange(1, count + 1)
    found = beam.roots(numbers, *springs)
    frequencies, motions = body.bending()
    tip = float(body.length)
    xi = np.asarray((body.places - (tip - beam.length)) / beam.length, dtype=np.float64)
    beyond = xi >= 0.0
    table = np.zeros((count, len(frequencies)))
    for row, mode in enumerate(numbers):
        shape = beam.shape(int(mode), *springs)(xi[beyond])
        table[row] = [assurance(shape, motion[beyond], body.masses[beyond]) for motion in motions]
    rows, columns = linear_sum_assignment(-table)
    pairs = {int(row): int(column) for row, column in zip(rows, columns, strict=True) if table[row, column] >= ALIKE}
    return tuple(
        TheoryMode(
            mode=int(mode),
            root=float(found[row]),
            frequency=float(beam.frequency_unit * found[row] ** 2),
            matched=pairs[row] + 1 if row in pairs else None,
            mac=float(table[row, pairs[row]]) if row in pairs else 0.0,
        )
        for row, mode in enumerate(numbers)
    )


def assurance(x: Array, y: Array, masses: Array) -> float:
    """Return the modal assurance criterion of two shapes, (slices,), 0 to 1."""
    return float((masses @ (x * y)) ** 2 / ((masses @ x**2) * (masses @ y**2)))
