"""The scales of a drawn case, which all of its numbers are drawn relative to, and made-up records for its loads."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from pathlib import Path

ELASTIC = ((2.1e11, 7850.0), (7.0e10, 2700.0), (3.0e9, 1200.0))
"""Young's modulus, Pa, and density, kg/m^3: steel, aluminum, a plastic."""


@dataclass(frozen=True)
class Scene:
    """A beam in its support, and how fast it moves.

    Attributes:
        folder: Where the files of the case go.
        seed: Seed of the case.
        length: m.
        thickness: m.
        width: m.
        support: Length of the support, m.
        clearance: m; negative: an interference fit.
        modulus: Young's modulus, Pa.
        density: kg/m^3.
        bending: First bending frequency of the clamped overhang, Hz.
        frequency: Frequency of the forcing, Hz.
        step: Time step, s, about a whole part of the forcing period.
        periods: Forcing periods in the run.
    """

    folder: Path
    seed: int
    length: float
    thickness: float
    width: float
    support: float
    clearance: float
    modulus: float
    density: float
    bending: float
    frequency: float
    step: float
    periods: int

    @property
    def mass(self) -> float:
        """Mass of the beam, kg."""
        return self.density * self.length * self.thickness * self.width

    @property
    def stiffness(self) -> float:
        """Young's modulus over a third of the thickness, Pa/m: the scale of contact stiffness."""
        return 3.0 * self.modulus / self.thickness

    @property
    def shallow(self) -> float:
        """A depth that contacts reach, m."""
        return 1.0e-2 * abs(self.clearance)


def drawn_scene(chance: random.Random, folder: Path, seed: int) -> Scene:
    """Draw the scales of a case: beams of 0.1 to 1 m, some short and thick, most slender."""
    length = chance.uniform(0.1, 1.0)
    thickness = length * chance.choice((0.015, 0.03, 0.05, 0.1)) * chance.uniform(0.8, 1.2)
    support = length * chance.uniform(0.1, 0.4)
    modulus, density = chance.choice(ELASTIC)
    bending = 0.1615 * (modulus / density) ** 0.5 * thickness / (length - support) ** 2
    frequency = float(f"{bending * chance.uniform(0.1, 1.5):.3g}")
    interference = chance.random() < 0.15
    play = -chance.uniform(1e-4, 5e-4) if interference else 10.0 ** chance.uniform(-3.5, -1.7)
    count = chance.choice((50, 100)) * max(1, round(bending / frequency))
    return Scene(
        folder,
        seed,
        length,
        thickness,
        thickness * chance.uniform(0.5, 3.0),
        support,
        thickness * play,
        modulus,
        density,
        bending,
        frequency,
        float(f"{1.0 / (frequency * count):.3g}"),
        chance.choice((3, 5, 8)),
    )


ROWS = 24  # in a forcing period
NAME, SPECTRUM = "record.csv", "spectrum.csv"


def write_record(chance: random.Random, scene: Scene) -> str:
    """Write a record of a size of about 1 that covers the run, and return its path.

    A sum of three waves of one to three times the forcing frequency, with the rows of a logger that is not quite even.
    """
    waves = [(chance.uniform(0.2, 1.0), order, chance.uniform(0.0, 6.28)) for order in (1, 2, 3)]
    total = sum(size for size, _, _ in waves)
    period = 1.0 / scene.frequency
    lines = ["time [s],signal"]
    for row in range(int((scene.periods + 2) * ROWS) + 1):
        time = period * row / ROWS
        value = sum(size * math.sin(6.2831853 * order * time / period + phase) for size, order, phase in waves)
        lines.append(f"{time:.9g},{value / total:.6g}")
    path = scene.folder / NAME
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def write_spectrum(chance: random.Random, scene: Scene) -> str:
    """Write densities of about 1 around the forcing frequency, and return the path of their file."""
    rows = [f"{share * scene.frequency:.9g};{chance.uniform(0.1, 1.0):.4g}" for share in (0.5, 1.0, 2.0, 4.0)]
    path = scene.folder / SPECTRUM
    path.write_text("\n".join(["f [Hz];S", *rows]) + "\n", encoding="utf-8")
    return str(path)
