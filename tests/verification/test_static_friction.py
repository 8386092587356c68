"""Static and dynamic friction: two masses on a plane, stick-slip behind a spring, and a beam on a shaken floor.

* code_aster's SDND106: two masses of 5 kg, 1e4 N/m between them; 1e4 N press the first on a plane with the coefficients
  0.3 and 0.2; 3000 N pull the second for 0.2 s. The first sticks until the spring pulls with 3000 N. Between its events
  the system is linear: the figures follow from SciPy's integration with events, too.
* A mass m behind a spring k whose end moves at V. It sticks until the extension is mu_s N / k and slides until it has
  stopped. With A = (mu_s - mu) N / k and w = sqrt(k / m) the period is 2 A / V + 2 (pi - atan(A w / V)) / w, and the
  extension reaches from mu N / k - B to mu N / k + B, B = sqrt(A^2 + V^2 / w^2): by hand.
* A block on a floor that shakes with a sin(w t): it slides from mu_s g = a sin(w t1) on, relative to the floor by the
  integral of a sin(w t) - mu g (Newmark 1965).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import atan, hypot, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, Step, imaged
from tests.shared.toys import ledger_of, steps_of
from tests.verification.test_friction import FRICTION_SCHEMES, MIDPOINT_SCHEMES

STATIC, DYNAMIC = 0.3, 0.2
MASS, SPRING, PRESSED, PULL, PULLED = 5.0, 1.0e4, 1.0e4, 3000.0, 0.2  # kg, N/m, N, N, s
PLANE = 1.0e9  # N/m
KNOWN = {(0.02, 1): 0.11221, (0.15, 0): 1.35332, (0.15, 1): 1.80751, (0.34, 1): 3.96813}  # m, at a time, of a mass
SLIDES, STICKS = 0.03512, 0.31492  # s
END = 0.34
SLOW = pytest.param("moreau-jean", marks=pytest.mark.slow(minutes=0.1))


def on_a_plane(springs: Array, pull: Callable[[float], float], pressed: float) -> SemiDiscreteSystem:
    """Masses in a row, of which the first is pressed on a plane and the last is pulled; the last DOF is the height."""
    size = len(springs) + 1
    stiffness, height = np.zeros((size, size)), np.eye(size)[-1]
    stiffness[:-1, :-1] = springs
    contact = ContactOperator(
        interface=Interface(size, np.arange(size), np.arange(size)),
        gap_matrix=csr_matrix(height[None]),
        weights=np.array([1.0]),
        initial_gap=np.array([0.0]),
        faces=np.array([0]),
        support=Support((Face("plane", -1.0),), area=1.0),
        positions=np.zeros((1, 3)),
        tangents=csr_matrix(np.eye(size)[:1]),
    )
    loads = (Load("press", -height, lambda _time: pressed), Load("pull", np.eye(size)[-2], pull))
    return SemiDiscreteSystem(DenseOperators(MASS * np.eye(size), stiffness), contact, loads)


def marched(
    system: SemiDiscreteSystem, name: str, pressed: float, v0: float, dt: float, end: float, static: float = STATIC
) -> tuple[ContactLaw, State, list[Step]]:
    """Steps from rest, the first mass in balance with the plane across it."""
    impulses = name == "moreau-jean"
    law = ContactLaw(Spring(PLANE), friction=CoulombFriction(DYNAMIC, v0, static), stores_energy=not impulses)
    place = np.zeros(system.operators.size)
    place[-1] = 0.0 if impulses else -pressed / PLANE
    still = imaged(system.operators, np.zeros(len(place)))
    depth = system.contact.depth(place)
    start = State(0.0, imaged(system.operators, place), still, depth, np.array([pressed]))
    return law, start, steps_of(system, law, FRICTION_SCHEMES[name], start, dt, round(end / dt))


def two_masses() -> SemiDiscreteSystem:
    """SDND106."""
    springs = SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return on_a_plane(springs, lambda time: PULL if time < PULLED else 0.0, PRESSED)


def changes(steps: list[Step]) -> list[float]:
    """Times after which the state of the first mass is another one, s."""
    slides = [step.new.slides is not None and bool(step.new.slides.any()) for step in steps]
    return [step.new.time for step, (a, b) in zip(steps[1:], pairwise(slides), strict=True) if a != b]


def test_known_figures_are_those_of_the_events() -> None:
    """An integration from event to event gives the six figures of code_aster, within 3 in their last digit."""

    def sticking(_time: float, y: Array) -> list[float]:
        return [0.0, 0.0, y[3], (PULL - SPRING * y[2]) / MASS]

    def sliding(time: float, y: Array) -> list[float]:
        spring, pull = SPRING * (y[2] - y[0]), PULL if time < PULLED else 0.0
        return [y[1], (spring - DYNAMIC * PRESSED) / MASS, y[3], (pull - spring) / MASS]

    def breaks_away(_time: float, y: Array) -> float:
        return float(SPRING * y[2] - STATIC * PRESSED)

    def stops(_time: float, y: Array) -> float:
        return float(y[1])

    breaks_away.terminal = stops.terminal = True  # type: ignore[attr-defined]
    stops.direction = -1.0  # type: ignore[attr-defined]
    precise: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}
    held = solve_ivp(sticking, (0.0, 0.1), np.zeros(4), events=breaks_away, **precise)
    pulled = solve_ivp(sliding, (held.t[-1], PULLED), held.y[:, -1], **precise)
    free = solve_ivp(sliding, (PULLED + 1e-15, 1.0), pulled.y[:, -1], events=stops, **precise)
    assert [held.t[-1], free.t[-1]] == pytest.approx([SLIDES, STICKS], abs=1e-5)
    x1, _, x2, v2 = free.y[:, -1]
    w, after = sqrt(SPRING / MASS), END - free.t[-1]
    assert SPRING * hypot(x2 - x1, v2 / w) < STATIC * PRESSED  # the first mass stays where it is
    found = {
        (0.02, 1): held.sol(0.02)[2],
        (0.15, 0): pulled.sol(0.15)[0],
        (0.15, 1): pulled.sol(0.15)[2],
        (0.34, 1): x1 + (x2 - x1) * np.cos(w * after) + v2 / w * np.sin(w * after),
    }
    assert found == pytest.approx(KNOWN, abs=3e-5)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", ["discrete-gradient", "generalized-alpha"])
def test_two_masses_as_code_aster_has_them(name: str) -> None:
    """A step of 0.2 ms: 0.5 % in the places, three steps in the times; the first mass slides once."""
    dt = 2.0e-4
    _, _, steps = marched(two_masses(), name, PRESSED, 1.0e-5, dt, END)
    found = {key: steps[round(key[0] / dt) - 1].new.u[0, key[1]] for key in KNOWN}
    assert found == pytest.approx(KNOWN, rel=5e-3)
    assert changes(steps) == pytest.approx([SLIDES, STICKS], abs=3.0 * dt)


@pytest.mark.parametrize("name", [x if x != "moreau-jean" else SLOW for x in MIDPOINT_SCHEMES])
def test_friction_takes_energy_in_every_step(name: str) -> None:
    """Power never positive, a closed balance, no traction beyond mu_s p but in the two steps that break away."""
    system = two_masses()
    law, start, steps = marched(system, name, PRESSED, 1.0e-3, 1.0e-3, END)
    tractions = [float(step.stage.traction[0, 0]) for step in steps if step.stage.traction is not None]
    moved = [float(step.new.u[0, 0] - step.old.u[0, 0]) for step in steps]
    assert all(t * x <= 0.0 for t, x in zip(tractions, moved, strict=True))
    beyond = [abs(t) > STATIC * PRESSED * (1.0 + 1e-9) for t in tractions]
    assert sum(beyond) <= 2
    assert max(abs(t) for t in tractions) <= sqrt(1.01) * STATIC * PRESSED
    ledger = ledger_of(system, law, start, steps)
    assert abs(ledger.residual) < 1e-11 * ledger.exchanged
    assert ledger.friction_loss == pytest.approx(-float(np.dot(tractions, moved)), rel=1e-12)


def test_the_error_is_of_first_order_in_the_step() -> None:
    """States change where a step ends: a fourth of the step leaves less than half of the error at 0.34 s."""
    errors = []
    for dt in (2.0e-3, 5.0e-4):
        _, _, steps = marched(two_masses(), "discrete-gradient", PRESSED, 1.0e-6, dt, END)
        errors.append(abs(float(steps[-1].new.u[0, 1]) - KNOWN[0.34, 1]))
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("name", ["discrete-gradient", "generalized-alpha"])
def test_stick_slip_of_a_pulled_mass(name: str) -> None:
    """Period and range of the extension over three periods."""
    pressed, speed, spring = 50.0, 0.2, 500.0
    w, jump = sqrt(spring / MASS), (STATIC - DYNAMIC) * pressed / spring
    period = 2.0 * jump / speed + 2.0 * (pi - atan(jump * w / speed)) / w
    reach = hypot(jump, speed / w)
    system = on_a_plane(np.array([[spring]]), lambda time: spring * speed * time, pressed)
    dt = period / 500.0
    first = STATIC * pressed / spring / speed
    _, _, steps = marched(system, name, pressed, 1.0e-6, dt, first + 3.2 * period)
    slides = changes(steps)[::2]
    assert slides == pytest.approx([first + number * period for number in range(4)], abs=6.0 * dt)
    assert np.diff(slides) == pytest.approx(period, rel=5e-3)
    extension = np.array([speed * step.new.time - step.new.u[0, 0] for step in steps if step.new.time > first])
    ends = DYNAMIC * pressed / spring + reach * np.array([-1.0, 1.0])
    assert [extension.min(), extension.max()] == pytest.approx(ends, abs=1e-2 * 2.0 * reach)


def test_equal_coefficients_are_one_coefficient() -> None:
    """A static coefficient of the size of the dynamic one changes no bit."""
    one = marched(two_masses(), "discrete-gradient", PRESSED, 1.0e-5, 1.0e-3, END, DYNAMIC)[2]
    law = ContactLaw(Spring(PLANE), friction=CoulombFriction(DYNAMIC, 1.0e-5))
    other = steps_of(two_masses(), law, FRICTION_SCHEMES["discrete-gradient"], one[0].old, 1.0e-3, len(one))
    assert np.array_equal(one[-1].new.u, other[-1].new.u)


LENGTH, THICKNESS, SHAKEN, FREQUENCY, GRAVITY = 0.1, 0.01, 3.2, 10.0, 9.81  # m, m, m/s^2, Hz, m/s^2
IN_CONTACT: tuple[dict[str, float], dict[str, float]] = ({"coefficient": DYNAMIC, "static_coefficient": STATIC}, {})
AT_SUPPORT = ({"coefficient": 0.5, "static_coefficient": 0.6}, {"friction": DYNAMIC, "static_friction": STATIC})


@pytest.mark.parametrize(
    ("friction", "own"),
    [pytest.param(*IN_CONTACT, marks=pytest.mark.slow(minutes=0.1)), AT_SUPPORT],
    ids=["contact", "support"],
)
def test_a_block_on_a_shaken_floor(friction: dict[str, float], own: dict[str, float], tmp_path: Path) -> None:
    """A short beam slides from the instant and as far as Newmark's block, within 2 %; summary and history have it."""
    w, step = 2.0 * pi * FREQUENCY, 1.0e-4
    case = {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "floor", "from": 0.0, "to": LENGTH, "clearance": 0.0, "region": "stop", **own}],
        "restraint": {"axial": 1.0e-3},
        "contact": {"stiffness": 1.0e9, "friction": {**friction, "slip_velocity": 1.0e-8}},
        "mesh": {"size": 0.05, "support_size": 0.05},
        "model": {"type": "beam", "elements": 2},
        "load": [
            {"type": "gravity", "acceleration": GRAVITY},
            {"type": "base_motion", "amplitude": SHAKEN, "frequency": FREQUENCY, "direction": [1.0, 0.0], "ramp": 0.0},
        ],
        "probe": [{"name": "middle", "point": 0.5 * LENGTH}],
        "time": {"end": 0.065, "step": step, "scheme": "discrete-gradient"},
        "output": {"history_interval": step, "fields_interval": 0.065},
    }
    outcome = gapbeam.run(case, {}, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    results = gapbeam.open_results(tmp_path / "run")
    assert results.summary["friction"]["static_coefficient"] == STATIC
    assert results.summary["friction"]["coefficient"] == DYNAMIC
    time = results.history["time"].values
    place = np.abs(results.history["displacement"].sel(probe="middle").values[:, 0])
    begins = np.arcsin(STATIC * GRAVITY / SHAKEN) / w

    def speed(t: float) -> float:
        return float(SHAKEN * (np.cos(w * begins) - np.cos(w * t)) / w - DYNAMIC * GRAVITY * (t - begins))

    ends = brentq(speed, 0.04, 0.065)
    mean = SHAKEN * np.cos(w * begins) / w * (ends - begins) - SHAKEN * (np.sin(w * ends) - np.sin(w * begins)) / w**2
    distance = mean - 0.5 * DYNAMIC * GRAVITY * (ends - begins) ** 2
    assert place[time < begins].max() < 1e-6
    assert place[-1] == pytest.approx(distance, rel=0.02)
    assert place[np.searchsorted(time, ends + 3.0 * step)] == pytest.approx(place[-1], rel=2e-3)
