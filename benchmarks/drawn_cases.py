"""Cases drawn at random: sections, clearances, loads, laws, damping, steps, meshes, models; no draw is chosen."""

from __future__ import annotations

import random
from typing import Any

LAWS: tuple[dict[str, Any], ...] = (
    {"type": "kelvin-voigt"},
    {"type": "hunt-crossley", "restitution": 0.8},
    {"type": "hunt-crossley", "restitution": 0.5},
)
SCHEMES: tuple[dict[str, Any], ...] = (
    {"type": "discrete-gradient"},
    {"type": "discrete-gradient"},
    {"type": "generalized-alpha", "rho_inf": 0.5},
)


def drawn_case(seed: int) -> dict[str, Any]:
    """Return the tables of a plane case, for `gapbeam.read_case`; the same seed gives the same case.

    Steel and aluminum beams of 0.2 to 1 m, lying in a support by gravity or clamped by interference, are shaken, pushed
    by a harmonic force, or struck by half a period of one.
    """
    chance = random.Random(seed)
    length = chance.uniform(0.2, 1.0)
    thickness = length * chance.uniform(0.015, 0.05)
    support = length * chance.uniform(0.08, 0.25)
    steel = chance.random() < 0.6
    # the first bending frequency of the overhang, clamped, in Hz, sets the scale of frequencies
    wave = (2.1e11 / 7850.0) ** 0.5 if steel else (7.0e10 / 2700.0) ** 0.5
    first = 0.1615 * wave * thickness / (length - support) ** 2
    frequency = first * chance.uniform(0.2, 1.5)
    periods = chance.choice((8, 12, 20))
    step = 1.0 / (frequency * chance.choice((50, 100, 200)) * max(1.0, round(first / frequency)))
    interference = chance.random() < 0.15
    load = _load(chance, frequency, length)
    return {
        "title": f"drawn {seed}",
        "beam": {"length": length, "thickness": thickness, "width": thickness * chance.uniform(0.5, 3.0)},
        "material": {
            "young_modulus": 2.1e11 if steel else 7.0e10,
            "poisson_ratio": 0.3,
            "density": 7850.0 if steel else 2700.0,
        },
        "damping": {"frequencies": [first, 6.0 * first], "ratios": [chance.choice((0.005, 0.01, 0.03))] * 2},
        "support": {
            "length": support,
            "clearance": thickness
            * (-chance.uniform(1e-4, 5e-4) if interference else 10.0 ** chance.uniform(-3.5, -1.5)),
        },
        "mesh": {"size": thickness * chance.uniform(1.0, 2.0), "cells_through_thickness": chance.choice((2, 4))},
        "model": chance.choice(("reduced", "reduced", "reduced", "full")),
        "contact": {"law": chance.choice(LAWS)},
        "load": [{"type": "gravity", "name": "weight"}, load],
        "probe": [{"name": "tip", "point": length}],
        "time": {"end": periods / frequency, "step": step, "scheme": chance.choice(SCHEMES)},
    }


def _load(chance: random.Random, frequency: float, length: float) -> dict[str, Any]:
    if chance.random() < 0.7:
        acceleration = 9.81 * 10.0 ** chance.uniform(-0.7, 1.0)
        return {
            "type": "base_motion",
            "name": "shaker",
            "amplitude": acceleration,
            "frequency": frequency,
            "ramp": 2.0 / frequency,
        }
    return {
        "type": "harmonic_force",
        "name": "push",
        "point": length,
        "amplitude": 10.0 ** chance.uniform(-1.0, 1.5),
        "frequency": frequency,
        "ramp": 2.0 / frequency,
    }
