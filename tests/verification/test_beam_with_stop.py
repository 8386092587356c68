"""A cantilever with a stop at its tip, code_aster's validation case SDNL104 (its parameters and figures).

L = 1, solid circle R = 0.1, E = 1e10, rho = 1e6, gap 1e-4 under the tip, stop 1e8 N/m, F = -1000 N at the tip, t > 0.
Euler-Bernoulli elements written here; the march, the contact solve and the law are gapbeam's.
"""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Interface, Load
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged
from tests.shared.toys import SCHEMES, steps_of

GAP, STOP, FORCE = 1.0e-4, 1.0e8, -1000.0


def cantilever(elements: int) -> SemiDiscreteSystem:
    """Hermite beam elements, clamped at x = 0; the last but one DOF is the deflection of the tip."""
    radius, modulus, density = 0.1, 1.0e10, 1.0e6
    area, inertia, h = pi * radius**2, 0.25 * pi * radius**4, 1.0 / elements
    stiff = modulus * inertia / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    inert = density * area * h / 420.0 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    size = 2 * elements + 2
    mass, stiffness = np.zeros((2, size, size))
    for e in range(elements):
        span = slice(2 * e, 2 * e + 4)
        mass[span, span] += inert
        stiffness[span, span] += stiff
    tip = np.zeros(size - 2)
    tip[-2] = 1.0
    stop = ContactOperator(
        interface=Interface(1, np.array([size - 4]), np.array([0])),
        gap_matrix=csr_matrix([[1.0]]),
        weights=np.array([1.0]),
        initial_gap=np.array([GAP]),
        faces=np.array([0]),
        support=Support((Face("stop", -1.0),), area=1.0),
        positions=np.array([[1.0, 0.0, 0.0]]),
    )
    return SemiDiscreteSystem(
        DenseOperators(mass[2:, 2:], stiffness[2:, 2:]), stop, (Load("force", tip, lambda _time: FORCE),)
    )


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("name", ["discrete-gradient", "newmark"])
def test_known_figures(name: str) -> None:
    """Code_aster gives u = -1.85334e-6 m at 0.1315 s and v = -4.63284e-3 m/s at 0.1566 s at the tip."""
    system = cantilever(20)
    rest = imaged(system.operators, np.zeros(system.operators.size))
    state = State(0.0, rest, rest, np.array([-GAP]), np.zeros(1))
    dt = 1.0e-5
    steps = steps_of(system, kelvin_voigt(STOP), SCHEMES[name], state, dt, 16000)
    times = np.array([step.new.time for step in steps])
    u, v = (np.array([getattr(step.new, part)[0, -2] for step in steps]) for part in "uv")
    assert np.interp(0.1315, times, u) == pytest.approx(-1.85334e-6, abs=2e-7)
    assert np.interp(0.1566, times, v) == pytest.approx(-4.63284e-3, rel=0.02)
    assert u.min() < -GAP


@pytest.mark.slow(minutes=0.2)
def test_known_figures_from_a_case_file() -> None:
    """The same by a case: a clamped joint, a narrow stop under the tip, and a section of the same E I and rho A.

    The section is thin, so that shear and rotary inertia add less than 1e-4.
    """
    length, thickness, narrow = 1.0, 0.005, 2.0e-4
    bending, line = 1.0e10 * 0.25 * pi * 0.1**4, 1.0e6 * pi * 0.1**2
    case = {
        "beam": {"length": length, "thickness": thickness, "width": 1.0},
        "material": {
            "young_modulus": 12.0 * bending / thickness**3,
            "poisson_ratio": 0.3,
            "density": line / thickness,
        },
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "support": [{"name": "stop", "from": length - narrow, "to": length, "clearance": GAP, "region": "stop"}],
        "model": {"type": "beam", "elements": 20},
        "mesh": {"size": 0.05, "support_size": 1.0e-4, "cells_through_thickness": 1},
        "contact": {"stiffness": STOP / narrow},
        "load": [
            {
                "type": "harmonic_force",
                "point": length,
                "amplitude": FORCE,
                "frequency": 1.0e-6,
                "phase": 90.0,
                "ramp": 0.0,
            }
        ],
        "probe": [{"name": "tip", "point": length}],
        "analysis": {"type": "transient", "start": "undeformed"},
        "time": {"end": 0.16, "step": 1.0e-5},
    }
    model = gapbeam.model(gapbeam.read_case(case))
    states = [step.new for step in model.march()]
    times, tip = np.array([state.time for state in states]), model.model.probes["tip"]
    u, v = (
        np.array([tip.evaluate(getattr(state, part)[0], model.model.system.operators)[-1] for state in states])
        for part in "uv"
    )
    assert np.interp(0.1315, times, u) == pytest.approx(-1.85334e-6, abs=4e-7)
    assert np.interp(0.1566, times, v) == pytest.approx(-4.63284e-3, abs=0.03 * np.ptp(v))
    assert u.min() < -GAP
