"""Agreement of beam elements with solids: bending frequencies of cantilevers of all cross-sections.

    python3 -m benchmarks.section_modes

A cantilever of 0.6 m, 40 mm thick, steel. The solid is a reduced basis of 30 modes on a mesh with cells of h / 2 along
the beam, h its thickness, and h / 2.5 at a support that it does not touch. The basis has no motion out of the bending
plane; axial modes are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi
from typing import Any

import numpy as np
from mpi4py import MPI

import gapbeam
from benchmarks.table import Cell, Table, options
from gapbeam.solver.models.model import build_model
from gapbeam.solver.seat.contact_modes import Sections
from gapbeam.solver.system.dense_operators import DenseOperators

LENGTH, THICKNESS, COUNT = 0.6, 0.04, 4
Section = str | dict[str, Any]
TUBE: dict[str, Any] = {"type": "tube", "wall": 0.004}
BOX: dict[str, Any] = {"type": "box", "wall": 0.004}
PROFILE: dict[str, Any] = {"type": "i", "web": 0.006, "flange": 0.006}
ROWS: dict[str, tuple[Section, float]] = {
    "tube, wall 4 mm": (TUBE, 0.04),
    "round": ("round", 0.04),
    "box, 30 mm wide, wall 4 mm": (BOX, 0.03),
    "box, 60 mm wide, wall 4 mm": (BOX, 0.06),
    "I, 30 mm wide, web and flanges 6 mm": (PROFILE, 0.03),
    "I, 60 mm wide, web and flanges 6 mm": (PROFILE, 0.06),
}
"""The section of each row, and its width, m."""
BEAM: dict[str, Any] = {"type": "beam", "elements": 40}
SOLID: dict[str, Any] = {"type": "reduced", "modes": 30}
FINE: dict[str, Any] = {"size": THICKNESS / 2.0, "support_size": THICKNESS / 2.5}


def rows(
    sections: Mapping[str, tuple[Section, float]] = ROWS, mesh: dict[str, Any] = FINE
) -> Iterator[tuple[Cell, ...]]:
    """Yield each section with the frequencies of beam elements and of the solid."""
    for name, (section, width) in sections.items():
        found = [bending_frequencies(section, width, model, mesh) for model in (BEAM, SOLID)]
        yield name, *(", ".join(map(four_digits, one)) for one in found)


def four_digits(value: float) -> str:
    """Return a number with four digits."""
    return f"{value:#.4g}".rstrip(".")


def bending_frequencies(section: Section, width: float, model: dict[str, Any], mesh: dict[str, Any]) -> Sequence[float]:
    """Return the first bending frequencies of a cantilever with a section, Hz.

    Args:
        section: `section` of [beam].
        width: `width` of [beam], m.
        model: The table [model].
        mesh: Keys of [mesh] beside the dimension.
    """
    tables: dict[str, Any] = {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": width, "section": section},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
        "support": [{"name": "far", "from": 0.9 * LENGTH, "to": 0.95 * LENGTH, "clearance": 9.0e-3}],
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "restraint": {"axial": 1e-6, "lateral": 1e-6},
        "mesh": {"dimension": 3, **mesh},
        "model": model,
        "load": [{"type": "harmonic_force", "point": LENGTH, "amplitude": 1.0, "frequency": 5.0}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    made = build_model(gapbeam.read_case(tables), MPI.COMM_SELF)
    operators, sections = made.system.operators, Sections(made)
    assert isinstance(operators, DenseOperators)
    squares, shapes = operators.modes
    bending = (
        float(np.sqrt(max(square, 0.0))) / (2.0 * pi)
        for square, shape in zip(squares, shapes.T, strict=True)
        if sections.motion(shape).kind != "axial"
    )
    return [frequency for frequency, _ in zip(bending, range(COUNT), strict=False)]


if __name__ == "__main__":
    title = "First four bending frequencies of a cantilever in Hz"
    Table("section_modes", title, ("section", "beam elements", "solid"), tuple(rows())).write(options(__doc__).output)
