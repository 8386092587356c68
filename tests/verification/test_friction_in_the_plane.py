"""Isotropic friction in the plane: a mass on two springs, released on the diagonal, code_aster's SDND100.

m = 1 kg under 10 m/s^2 slides with mu = 0.1 on a plane, on k = 1e4 N/m in both directions. Isotropic friction keeps it
on the diagonal, where it is the oscillator of Coulomb and Den Hartog: every half period pi / w0 takes 2 mu m g / k of
the amplitude, .85, .65, .45, .25, .05 mm; then mu m g = 1 N holds the 0.5 N of the springs. Friction per direction
would take sqrt(2) times as much.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.damper import CoulombFriction
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Load
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State, imaged
from tests.shared.toys import IMPLICIT, SCHEMES, steps_of

MASS, SPRING, WEIGHT, MU = 1.0, 1.0e4, 10.0, 0.1  # kg, N/m, N, no unit
PLANE = 1.0e8  # N/m, of the plane
START = 0.85e-3 / sqrt(2.0)  # m, of x and of y
HALF = pi / sqrt(SPRING / MASS)  # s
KNOWN = np.array([-4.596e-4, 3.182e-4, -1.768e-4, 3.536e-5])  # m, x after 1 to 4 half periods, as code_aster prints it
EXACT = np.array([-0.65e-3, 0.45e-3, -0.25e-3, 0.05e-3]) / sqrt(2.0)
PLANE_SCHEMES: dict[str, TimeScheme] = {
    **{name: SCHEMES[name] for name in IMPLICIT},
    "hht-alpha": scheme_of("hht-alpha", alpha=0.1),
    "moreau-jean": scheme_of("moreau-jean", theta=0.5),
}
MIDPOINT = ("discrete-gradient", "implicit-midpoint", "moreau-jean")


def sliding_mass() -> SemiDiscreteSystem:
    """A point on a plane, with springs along x and y; its last DOF is the height."""
    contact = ContactOperator(
        interface=Interface(3, np.arange(3), np.arange(3)),
        gap_matrix=csr_matrix([[0.0, 0.0, 1.0]]),
        weights=np.array([1.0]),
        initial_gap=np.array([0.0]),
        faces=np.array([0]),
        support=Support((Face("plane", -1.0),), area=1.0),
        positions=np.zeros((1, 3)),
        tangents=csr_matrix(np.eye(3)[:2]),
    )
    operators = DenseOperators(MASS * np.eye(3), np.diag([SPRING, SPRING, 0.0]))
    return SemiDiscreteSystem(operators, contact, (Load("weight", np.array([0.0, 0.0, -1.0]), lambda _time: WEIGHT),))


def ends_of_halves(name: str, slip_velocity: float, count: int) -> Array:
    """Return x and y of the point after each of four half periods of `count` steps, (4, 2), m."""
    system, impulses = sliding_mass(), name == "moreau-jean"
    law = ContactLaw(Spring(PLANE), friction=CoulombFriction(MU, slip_velocity), stores_energy=not impulses)
    place = np.array([START, START, 0.0 if impulses else -WEIGHT / PLANE])
    still = imaged(system.operators, np.zeros(3))
    state = State(0.0, imaged(system.operators, place), still, system.contact.depth(place), np.array([WEIGHT]))
    steps = steps_of(system, law, PLANE_SCHEMES[name], state, HALF / count, 4 * count)
    return np.array([step.new.u[VALUE, :2] for step in steps[count - 1 :: count]])


def test_the_known_figures_are_those_of_the_closed_form() -> None:
    """The four digits that code_aster prints."""
    assert pytest.approx(EXACT, abs=5e-8) == KNOWN


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", PLANE_SCHEMES)
def test_a_mass_slides_on_the_diagonal(name: str) -> None:
    """Four half periods within 1e-4 of the amplitude; midpoint schemes within 1e-7. It stays on the diagonal."""
    places = ends_of_halves(name, 1.0e-6, 200 if name in MIDPOINT else 400)
    assert places[:, 1] == pytest.approx(places[:, 0], abs=1e-12 * START)
    assert places[:, 0] == pytest.approx(EXACT, abs=(1e-7 if name in MIDPOINT else 1e-4) * START)
    assert np.abs(places[:, 0] - KNOWN).max() < 1e-4 * START


def test_errors_of_the_step_and_of_the_slip_velocity() -> None:
    """Steps: fourth order at the ends of half periods, which are turning points. A larger v0 errs more, evenly."""
    coarse, fine = (np.abs(ends_of_halves("discrete-gradient", 1.0e-6, n)[:, 0] - EXACT).max() for n in (50, 100))
    assert fine < 1e-6 * START
    assert coarse / fine == pytest.approx(16.0, rel=0.1)
    loose, tight = (np.abs(ends_of_halves("discrete-gradient", v0, 200)[:, 0] - EXACT).max() for v0 in (1e-4, 1e-5))
    assert 1e-5 * START < loose < 1e-4 * START
    assert tight < 1e-6 * START


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("kind", [{"type": "full"}, {"type": "reduced", "contact": "all"}], ids=["full", "reduced"])
def test_a_solid_slides_on_the_diagonal(kind: dict[str, str]) -> None:
    """A plate of 1 kg on a stop along its whole length, with an elastic joint: the same figures to 1e-5.

    Friction below the springs tilts it by 3 % of what would lift an edge; the sum of its pressures stays as it is.
    """
    length, thickness, width, count = 0.2, 0.01, 0.1, 100
    springs = {"axial": SPRING, "lateral": SPRING}
    case = {
        "beam": {"length": length, "thickness": thickness, "width": width},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": MASS / (length * thickness * width)},
        "support": [{"name": "floor", "from": 0.0, "to": length, "region": "stop", "clearance": 0.0}],
        "joint": [{"name": "springs", "type": "elastic", "point": length / 2.0, "stiffness": springs}],
        "restraint": {"axial": 1.0e-3, "lateral": 1.0e-3},
        "model": kind,
        "mesh": {
            "dimension": 3, "degree": 1, "size": 0.1, "support_size": 0.1, "edge_size": 0.1,
            "cells_through_thickness": 2, "cells_across_width": 2,
        },
        "contact": {
            "stiffness": PLANE / (length * width), "quadrature_degree": 2,
            "friction": {"coefficient": MU, "slip_velocity": 1.0e-6},
        },
        "load": [{"type": "gravity", "acceleration": WEIGHT / MASS}],
        "probe": [{"name": "middle", "point": length / 2.0}],
        "time": {"end": 4.0 * HALF, "step": HALF / count, "scheme": "discrete-gradient"},
    }  # fmt: skip
    simulation = Simulation(build_model(gapbeam.read_case(case), MPI.COMM_SELF))
    model, seat = simulation.model, simulation.seat().state
    nodes = np.zeros((len(model.space.tabulate_dof_coordinates()), 3))
    nodes[:, :2] = START
    expansion = getattr(model.body, "expansion", None)
    aside = nodes.reshape(-1) if expansion is None else np.linalg.lstsq(np.asarray(expansion), nodes.reshape(-1))[0]
    operators, middle = model.system.operators, model.probes["middle"]
    start = State(0.0, imaged(operators, seat.u[VALUE] + aside), seat.v, seat.depth, seat.pressure)
    steps = list(simulation.march(start))
    assert len(steps) == 4 * count
    places = np.array([middle.evaluate(step.new.u[VALUE], operators)[:2] for step in steps[count - 1 :: count]])
    assert places == pytest.approx(np.tile(EXACT[:, None], 2), abs=1e-5 * START)
