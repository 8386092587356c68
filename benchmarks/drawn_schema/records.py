"""Measured signals that were never measured: files for recorded and random loads."""

from __future__ import annotations

import math
import random

from benchmarks.drawn_schema.scene import Scene

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
