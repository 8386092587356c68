"""Hypothesis strategies of whole cases: models, sections, supports, laws, loads, joints, schemes and starts.

Sizes are drawn relative to each other: the length sets the thickness, the thickness the clearances, the first bending
frequency of the longest free part frequencies and steps. Every choice is drawn by itself; pairs that the checks of a
case refuse are drawn again. What is marched in Python is drawn less often and with half of the steps: a drawn run takes
seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import pi, sqrt
from typing import Any, TypeVar

from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as some

import gapbeam

MODELS = ("full", "reduced", "beam", "rigid", "rigid sections")
SETTLED, START_UP = "settled", "start-up"
CLASSES = tuple(
    (kind, automatic, motion) for motion in (SETTLED, START_UP) for automatic in (False, True) for kind in MODELS
)
MATERIALS = ((2.1e11, 0.3, 7850.0), (7.0e10, 0.33, 2700.0), (1.1e11, 0.34, 4430.0), (3.0e9, 0.35, 1200.0))
IN_PYTHON = ("piecewise-linear", "elastic-plastic")  # laws whose steps are not compiled
LAWS = (
    "kelvin-voigt",
    "kelvin-voigt",
    "hunt-crossley",
    "lankarani-nikravesh",
    "hunt-crossley, exponent",
    "lankarani-nikravesh, exponent",
    "adams-impact",
    "adams-impact",
    *IN_PYTHON,
)
EXPONENT = 1.5
PLANE: dict[str, Any] = {"slot": "slot", "stop": {"type": "stop", "side": "below"}}
AROUND: dict[str, Any] = {
    "hole": {"type": "hole"},
    "circle": {"type": "hole", "contact": "circle"},
    "polygon": {"type": "polygon", "walls": [-135.0, -45.0, 45.0, 135.0]},
    "V-block": {"type": "polygon", "walls": [-45.0, 45.0]},
}
SCHEMES: dict[str, Any] = {
    "discrete-gradient": {"type": "discrete-gradient"},
    "implicit-midpoint": {"type": "implicit-midpoint"},
    "generalized-alpha": {"type": "generalized-alpha", "rho_inf": 0.5},
}
STARTS = ("seat", "seat", "seat", "undeformed", "centered")
JOINTS = ("clamped", "pinned", "elastic")
LOADS = {SETTLED: ("base_motion", "harmonic_force"), START_UP: ("base_motion", "harmonic_force", "step_force", "sine")}
PERIODS = {SETTLED: (16,), START_UP: (3, 5)}  # of the load
STEPS = {SETTLED: 50, START_UP: 120}  # in a period
RUBBING = {SETTLED: ("none",), START_UP: ("none", "none", "friction")}
FEWER = 0.5  # steps that are marched in Python, over others
MOST_PERIODS = 3  # of the first bending, in one of the load
GRAVITY = 9.81  # m/s^2
CLAMPED = 0.1615  # f L^2 / (c h), the first bending frequency of a clamped strip of height h and wave speed c
SINKING = 0.01  # of the clearance: where laws change their slope or have the drawn one
Value = TypeVar("Value")
EXAMPLES = 3  # drawn for a number: the first ones are simple, the last is as good as new


@dataclass(frozen=True)
class Scene:
    """A drawn case.

    Attributes:
        tables: For `gapbeam.read_case`.
        kind: Its model, or rigid sections.
        automatic: Whether the contact stiffness is computed.
        motion: "settled", many periods of a load, or "start-up", a few.
        choices: Other choices, by name.
    """

    tables: dict[str, Any]
    kind: str
    automatic: bool
    motion: str
    choices: dict[str, str]


@some.composite
def scenes(draw: some.DrawFn, kind: str, automatic: bool, motion: str) -> Scene:
    """Draw a case that the checks accept.

    Args:
        draw: Draws from a strategy.
        kind: One of MODELS.
        automatic: Whether the contact stiffness is computed.
        motion: SETTLED or START_UP.
    """
    around = kind == "rigid sections" or (kind in ("beam", "rigid") and draw(some.integers(0, 2)) == 2)
    young, poisson, density = draw(some.sampled_from(MATERIALS))
    length = 10.0 ** draw(some.floats(-2.0, 0.7))
    thickness = length / draw(some.floats(12.0, 25.0) if around else some.floats(15.0, 60.0))
    joint = "" if kind == "rigid" else draw(some.sampled_from(("", "", *JOINTS)))
    region = draw(some.sampled_from(tuple(AROUND if around else PLANE)))
    supports, span = _supports(draw, length, thickness, (AROUND if around else PLANE)[region], around, joint)
    clearance = min(one["clearance"] for one in supports)
    first = CLAMPED * sqrt(young / density) * thickness / span**2
    fall = sqrt(GRAVITY / clearance) / (2.0 * pi)
    frequency = (min(first, fall) if kind == "rigid" else first) * draw(some.floats(0.2, 1.2))
    mass = density * length * thickness**2
    choices = {
        "region": region,
        "joint": joint or "none",
        "law": draw(some.sampled_from(LAWS)),
        "scheme": draw(some.sampled_from(("discrete-gradient", *SCHEMES))),
        "start": draw(some.sampled_from(STARTS)),
        "load": draw(some.sampled_from(LOADS[motion])),
        "body": draw(some.sampled_from(("none", "none", "body"))),
        "friction": draw(some.sampled_from(("none", *RUBBING[motion]))),
        "mass": draw(some.sampled_from(("none", "none", "mass"))),
    }
    if choices["body"] == "body":
        supports[-1]["body"] = _body(draw, mass, clearance)
    usual = (2.0 * pi * first) ** 2 * clearance if joint else GRAVITY
    stiffness = young / thickness * 10.0 ** draw(some.floats(-1.5, 0.0))
    ratio = draw(some.sampled_from((0.01, 0.03)))
    slow = kind == "full" or choices["law"] in IN_PYTHON or choices["friction"] == "friction"
    periods = draw(some.sampled_from(PERIODS[motion])) * (FEWER if slow and motion == SETTLED else 1.0)
    steps = round(STEPS[motion] * (FEWER if slow else 1.0))
    tables: dict[str, Any] = {
        "beam": {"length": length, "thickness": thickness, "width": thickness} | _section(draw, thickness, around),
        "material": {"young_modulus": young, "poisson_ratio": poisson, "density": density},
        "damping": {"frequencies": [first, 6.0 * first], "ratios": [ratio, ratio]},
        "support": supports,
        "mesh": _mesh(thickness, around),
        "model": {"type": "reduced", "sections": "rigid"} if kind == "rigid sections" else {"type": kind},
        "contact": _contact(draw, choices, stiffness, clearance, first),
        "load": [
            {"type": "gravity", "name": "weight"},
            _load(draw, choices["load"], frequency, length, mass, usual),
        ],
        "probe": [{"name": "tip", "point": length}],
        "analysis": {"type": "transient", "start": choices["start"]},
        "time": {
            "end": periods / frequency,
            "step": 1.0 / (frequency * steps * min(MOST_PERIODS, max(1, round(first / frequency)))),
            "scheme": SCHEMES[choices["scheme"]],
        },
    }
    if not automatic:
        power = "exponent" in choices["law"] or choices["law"] == "adams-impact"
        tables["contact"]["stiffness"] = stiffness * ((SINKING * clearance) ** (1.0 - EXPONENT) if power else 1.0)
    if joint:
        tables["joint"] = [_joint(joint, mass, length, first)]
    if choices["mass"] == "mass":
        tables["mass"] = [{"name": "lump", "point": 0.5 * length, "mass": mass * draw(some.floats(0.05, 0.5))}]
    try:
        gapbeam.read_case(tables)
    except gapbeam.CaseError:
        reject()
    return Scene(tables, kind, automatic, motion, choices)


def _section(draw: some.DrawFn, thickness: float, around: bool) -> dict[str, Any]:
    if not around:
        return {"width": thickness * draw(some.floats(0.5, 3.0))}
    return {"section": draw(some.sampled_from(({"type": "tube", "wall": 0.12 * thickness}, {"type": "round"})))}


def _mesh(thickness: float, around: bool) -> dict[str, Any]:
    if not around:
        return {"dimension": 2, "cells_through_thickness": 2, "support_size": 0.5 * thickness}
    return {"dimension": 3, "size": 2.0 * thickness, "support_size": thickness, "cells_through_thickness": 2}


def _supports(
    draw: some.DrawFn, length: float, thickness: float, region: Any, around: bool, joint: str
) -> tuple[list[dict[str, Any]], float]:
    """Draw one to three supports, and return them with the longest part of the beam that none holds, m."""
    count = draw(some.integers(2 if around and joint != "clamped" else 1, 3))
    wide = draw(some.floats(0.03, 0.06 if around else 0.12)) * length
    first = length / (count + 1) if joint else 0.0
    places = [first + (length - wide - first) * number / max(count - 1, 1) for number in range(count)]
    if count == 1:
        places = [length - wide if joint else 0.0]
        wide = wide if joint else max(wide, 0.15 * length)
    clearance = thickness * 10.0 ** draw(some.floats(-3.0, -1.5))
    supports = [
        {
            "name": f"s{number}",
            "from": place,
            "to": min(place + wide, length),
            "clearance": clearance * draw(some.sampled_from((1.0, 1.0, 1.5))),
            "region": region,
        }
        for number, place in enumerate(places)
    ]
    edges = sorted({0.0, length, *(one["from"] for one in supports), *(one["to"] for one in supports)})
    return supports, max(*(last - start for start, last in pairwise(edges)), 0.25 * length)


def _body(draw: some.DrawFn, mass: float, clearance: float) -> dict[str, Any]:
    """Draw a flexible support: its deflection under the weight of the beam is a share of the clearance."""
    own = mass * draw(some.floats(0.05, 1.0))
    spring = mass * GRAVITY / (clearance * draw(some.floats(0.1, 1.0)))
    return {"mass": own, "stiffness": spring, "damping": 0.1 * sqrt(spring * own)}


def _joint(kind: str, mass: float, length: float, frequency: float) -> dict[str, Any]:
    found: dict[str, Any] = {"type": kind, "name": "root", "point": 0.0}
    if kind == "elastic":
        spring = mass * (2.0 * pi * frequency) ** 2
        found["stiffness"] = {"axial": spring, "vertical": spring, "rotation": spring * length**2}
    return found


def _contact(
    draw: some.DrawFn, choices: dict[str, str], stiffness: float, clearance: float, frequency: float
) -> dict[str, Any]:
    """Draw the law of contact, with friction where that was chosen."""
    name, _, exponent = choices["law"].partition(", ")
    depth = SINKING * clearance
    law: dict[str, Any] = {"type": name}
    match name:
        case "hunt-crossley" | "lankarani-nikravesh":
            law["restitution"] = draw(some.sampled_from((0.5, 0.8, 0.95)))
            law["exponent"] = EXPONENT if exponent else 1.0
        case "adams-impact":
            law |= {"exponent": EXPONENT, "damping": 0.05 * stiffness / (2.0 * pi * frequency), "full_depth": depth}
        case "piecewise-linear":
            law |= {"depths": [depth], "factors": [3.0]}
        case "elastic-plastic":
            law |= {"yield_pressure": stiffness * depth, "hardening": 0.3}
    rubs = {"friction": {"coefficient": 0.2}} if choices["friction"] == "friction" else {}
    return {"law": law} | rubs


def _load(draw: some.DrawFn, kind: str, frequency: float, length: float, mass: float, usual: float) -> dict[str, Any]:
    """Draw a load between a third of a usual acceleration, which lifts or closes a gap, and ten times as much."""
    strength = usual * 10.0 ** draw(some.floats(-0.5, 1.0))
    push = 0.1 * strength * mass
    match kind:
        case "base_motion":
            waves = {"frequency": frequency, "ramp": 2.0 / frequency}
            return {"type": kind, "name": "shaker", "amplitude": strength} | waves
        case "step_force":
            times = {"start": 0.1 / frequency, "ramp": 0.05 / frequency}
            return {"type": kind, "name": "push", "point": length, "amplitude": -push} | times
        case _:
            waves = {"frequency": frequency} | ({} if kind == "sine" else {"ramp": 2.0 / frequency})
            return {"type": "harmonic_force", "name": "push", "point": length, "amplitude": push} | waves


def last_drawn(
    strategy: some.SearchStrategy[Value], number: int, refused: Callable[[Value], bool] = lambda _: False
) -> Value:
    """Return an example that is not refused; that of a number is always the same.

    Hypothesis begins with its simplest example and varies those that it has; the last of a few is as good as new.
    """
    found: list[Value] = []

    @seed(number)
    @settings(
        max_examples=EXAMPLES,
        phases=[Phase.generate],
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def keep(value: Value) -> None:
        if refused(value):
            reject()
        found.append(value)

    keep()
    return found[-1]


def drawn_scene(number: int) -> Scene:
    """Return the scene of a number; twenty numbers in a row go through all classes."""
    return last_drawn(scenes(*CLASSES[number % len(CLASSES)]), number)
