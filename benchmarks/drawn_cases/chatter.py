"""Drawn beams that chatter in stiff stops: 40 to 150 steps in a period of the load, contacts of a few steps."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np

from benchmarks.drawn_cases.scenes import CLAMPED, GRAVITY, MATERIALS, Scene

SEED = 15
MODELS = ("reduced", "beam", "rigid", "beam", "reduced")


def chattering_scene(number: int) -> Scene:
    """Return the scene of a number, which is always the same; five numbers in a row go through all models."""
    draw, kind = np.random.default_rng([SEED, number]), MODELS[number % len(MODELS)]
    E, nu, rho = MATERIALS[draw.integers(4)]
    length = float(10.0 ** draw.uniform(-2.0, 0.7))
    thickness = length / draw.uniform(15.0, 80.0)
    joint = "" if kind == "rigid" else str(draw.choice(["clamped", "clamped", "pinned", ""]))
    automatic, region = bool(draw.random() < 0.3), str(draw.choice(["slot", "slot", "stop"]))
    count = int(draw.integers(1, 3)) if joint == "clamped" else 2
    count = int(draw.integers(1, 3)) if joint == "pinned" else count
    wide, clearance = draw.uniform(0.02, 0.08) * length, thickness * 10.0 ** draw.uniform(-3.0, -0.7)
    if count == 1:
        places = [length - wide if draw.random() < 0.6 else draw.uniform(0.4, 0.85) * length]
    else:
        places = [length / (count + 1) if joint else 0.0, length - wide]
    supports = [
        {
            "name": f"s{i}", "from": place, "to": min(place + wide, length),
            "clearance": clearance * (1.0 if i == 0 else float(draw.choice([1.0, 1.5]))),
            "region": "slot" if region == "slot" else {"type": "stop", "side": "below"},
        }
        for i, place in enumerate(places)
    ]  # fmt: skip
    free = max(length - places[-1] - wide, places[0], places[-1] - places[0], 0.25 * length)
    free = length if joint == "clamped" and count == 1 else free
    first = CLAMPED * sqrt(E / rho) * thickness / free**2
    slow = min(first, sqrt(GRAVITY / clearance) / (2.0 * pi)) if kind == "rigid" else first
    frequency = slow * draw.uniform(0.15, 1.1)
    strength = ((2.0 * pi * first) ** 2 * clearance if joint else GRAVITY) * 10.0 ** draw.uniform(-0.3, 1.0)
    stiffness, ratio = E / thickness * 10.0 ** draw.uniform(-1.0, 1.0), float(draw.choice([0.01, 0.03]))
    steps = int(draw.choice([40, 60, 100, 150])) * max(1, min(3, round(first / frequency)))
    periods = float(draw.choice([2, 3, 5, 8, 16]))
    law: dict[str, Any] = {"type": str(draw.choice(["kelvin-voigt", "kelvin-voigt", "kelvin-voigt", "hunt-crossley"]))}
    if law["type"] == "hunt-crossley":
        law |= {"restitution": float(draw.choice([0.5, 0.8, 0.95])), "exponent": 1.0}
    scheme: dict[str, Any] = {"type": str(draw.choice([*["discrete-gradient"] * 4, "generalized-alpha"]))}
    scheme |= {"rho_inf": 0.5} if scheme["type"] == "generalized-alpha" else {}
    width, start = thickness * draw.uniform(0.5, 3.0), str(draw.choice(["seat", "seat", "undeformed"]))
    if draw.random() < 0.75:
        load = {"type": "base_motion", "amplitude": strength, "ramp": float(draw.choice([0.5, 2.0])) / frequency}
    else:
        force = 0.1 * strength * rho * length * thickness * width
        load = {"type": "harmonic_force", "point": length, "amplitude": force, "ramp": 1.0 / frequency}
    tables = {
        "beam": {"length": length, "thickness": thickness, "width": width},
        "material": {"young_modulus": E, "poisson_ratio": nu, "density": rho},
        "damping": {"frequencies": [first, 6.0 * first], "ratios": [ratio, ratio]},
        "support": supports,
        "mesh": {
            "dimension": 2, "cells_through_thickness": 2, "support_size": min(0.5 * thickness, 0.45 * wide),
        },
        "model": {"type": kind},
        "contact": {"law": law} | ({} if automatic else {"stiffness": stiffness}),
        "load": [{"type": "gravity"}, load | {"name": "shaker", "frequency": frequency}],
        "probe": [{"name": "tip", "point": length}, {"name": "mid", "point": 0.5 * length}],
        "analysis": {"type": "transient", "start": start},
        "time": {"end": periods / frequency, "step": 1.0 / (frequency * steps), "scheme": scheme},
    } | ({"joint": [{"type": joint, "name": "root", "point": 0.0}]} if joint else {})  # fmt: skip
    choices = {"law": law["type"], "scheme": scheme["type"], "joint": joint or "none", "region": region, "start": start}
    return Scene(tables, kind, automatic, "start-up", choices)
