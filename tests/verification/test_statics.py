"""The seat under gravity against statics and beam theory, and the pressure of an interference fit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gapbeam.solver.seat.static_seat import find_seat
from tests.shared.models import beam_model, face_forces, seat_of, stiffness_of

LENGTH, THICKNESS, WIDTH, SUPPORT = 0.51, 0.012, 0.02, 0.05  # m
OVERHANG = LENGTH - SUPPORT
E, NU, DENSITY = 2.1e11, 0.3, 7919.0
WEIGHT = DENSITY * LENGTH * THICKNESS * WIDTH * 9.81  # N
GLAND = WEIGHT * (0.5 * LENGTH - SUPPORT) / SUPPORT  # N, by moments about the edge of the base
BENDING = E * WIDTH * THICKNESS**3 / 12.0  # E I, N m^2
SHEAR = 5.0 / 6.0 * E / (2.0 * (1.0 + NU)) * THICKNESS * WIDTH  # kappa G A, N

PLAYS = (0.008e-3, 0.040e-3, 0.107e-3, 0.143e-3, 0.184e-3, 0.243e-3)  # m, the clearances of Li et al. (2013)
FINE = {"support_size": 4.0e-3, "edge_size": 5.0e-5}  # m: contact narrows to the two edges


def seated_beam(clearance, stiffness="auto", mesh=None, springs=None):
    model = beam_model(
        {"support": {"clearance": clearance}, "contact": {"stiffness": stiffness}, "mesh": mesh or {}},
        probes={"tip": LENGTH},
    )
    return model, find_seat(model.system, model.law, springs or model.seat_springs)


def tip_of(model, seat):
    return float(model.probes["tip"].evaluate(seat.state.u[0], model.system.operators)[1])


def hand_sag(clearance):
    """Sag of the tip, m: rocking in the clearance, bending of overhang and support span, shear (unit load method)."""
    q, a, c = WEIGHT / LENGTH, SUPPORT, OVERHANG
    rocking = clearance * c / a
    bending = q * c * (3.0 * c**3 + 4.0 * c**2 * a - a**3) / (24.0 * BENDING)
    shear = (0.5 * q * c**2 + c / a * (GLAND * a + 0.5 * q * a**2)) / SHEAR
    return rocking + bending + shear


@pytest.mark.parametrize("clearance", [-0.006e-3, 0.0, *PLAYS, 10.0e-3])
def test_reactions_balance_the_weight(clearance: float) -> None:
    """A seat is found for every clearance, and its forces and moments are those of a rigid body in equilibrium.

    F_base - F_gland = m g, and the moments about x = 0 of contact, weight and weak restraint cancel: to 1e-8 of the
    weight and the round-off in K u, whose terms K_ij u_j are large for a beam that has rotated in its clearance and
    cancel only to eps sum |K_ij u_j|. An interference fit, where 100 kN balance, to 5e-9 of the contact force.
    """
    model, seat = seated_beam(clearance)
    operators, contact = model.system.operators, model.system.contact
    u, pressure = seat.state.u[0], seat.state.pressure
    reactions = face_forces(contact, pressure)
    terms = stiffness_of(model).multiply(u).tocsr().data
    round_off = np.finfo(float).eps * float(np.sum(np.abs(terms)))
    tolerance = 1e-8 * WEIGHT + round_off + (5e-9 * reactions["base"] if clearance < 0.0 else 0.0)
    assert round_off < 4e-5 * WEIGHT
    assert reactions["base"] - reactions["gland"] == pytest.approx(WEIGHT, abs=tolerance)
    up = np.where(contact.faces == contact.face_names.index("base"), 1.0, -1.0)
    x, y, _ = model.space.tabulate_dof_coordinates().T
    rotation = np.column_stack([-y, x]).reshape(-1)
    held = float(rotation @ operators.apply_restraint(u))
    moment = float(np.sum(up * contact.weights * pressure * contact.positions[:, 0]))
    assert moment - held == pytest.approx(0.5 * LENGTH * WEIGHT, abs=LENGTH * tolerance)
    assert abs(held) < 5e-3 * moment


@pytest.mark.parametrize("clearance", PLAYS)
def test_stiff_contact_is_the_hand_calculation(clearance: float) -> None:
    """The beam rests on two edges, 38.99 N at the gland (x = 0) and 48.49 N at the base (50 mm), and sags as beams do.

    Stiff contact on cells of 0.05 mm at the edges: reactions within 0.1 %, sag within 0.3 %, of which the elastic part
    alone within 1 %. Source: statics; Euler-Bernoulli bending and Timoshenko shear by the unit load method.
    """
    model, seat = seated_beam(clearance, 1.0e16, FINE)
    reactions = face_forces(model.system.contact, seat.state.pressure)
    assert pytest.approx(38.986, abs=1e-3) == GLAND
    assert reactions["gland"] == pytest.approx(GLAND, rel=1e-3)
    assert reactions["base"] == pytest.approx(48.494, rel=1e-3)
    sag, rocking = -tip_of(model, seat), clearance * OVERHANG / SUPPORT
    assert sag == pytest.approx(hand_sag(clearance), rel=3e-3)
    assert sag - rocking == pytest.approx(hand_sag(0.0), rel=1e-2)


def test_reactions_approach_the_edges_with_stiffer_contact() -> None:
    """The gland force exceeds 38.986 N as its pressure has a width; less so for every tenfold stiffness."""
    excess = []
    for stiffness in (1.0e13, 1.0e14, 1.0e15, 1.0e16):
        model, seat = seated_beam(0.107e-3, stiffness, FINE)
        excess.append(face_forces(model.system.contact, seat.state.pressure)["gland"] / GLAND - 1.0)
    assert all(later < 0.7 * earlier for earlier, later in pairwise(excess))
    assert 0.0 < excess[-1] < 3e-4


@pytest.mark.parametrize("clearance", PLAYS)
def test_default_contact_is_near_the_hand_calculation(clearance: float) -> None:
    """The demo's mesh and computed stiffness: gland within 4 %, sag within 5 %; its support is 12.5 cells long."""
    model, seat = seated_beam(clearance)
    assert face_forces(model.system.contact, seat.state.pressure)["gland"] == pytest.approx(GLAND, rel=4e-2)
    assert -tip_of(model, seat) == pytest.approx(hand_sag(clearance), rel=5e-2)


def test_seat_does_not_depend_on_the_springs_of_its_search() -> None:
    """The proximal springs leave no trace: reactions and sag agree to 1e-6 for springs a hundred times apart."""
    answers = []
    for springs in (2.0e7, 2.0e8, 2.0e9):
        model, seat = seated_beam(0.04e-3, 2.0e12, springs=springs)
        answers.append([face_forces(model.system.contact, seat.state.pressure)["gland"], tip_of(model, seat)])
    assert answers[1] == pytest.approx(answers[0], rel=1e-6)
    assert answers[2] == pytest.approx(answers[0], rel=1e-6)


def test_interference_clamps_the_beam() -> None:
    """Pressed by 0.006 mm it sags like a cantilever: one of 460 mm is too stiff, one longer by the thickness too soft.

    The axis in the support lies half the interference lower. Source: q c^4 / (8 E I) + q c^2 / (2 kappa G A).
    """
    model, seat = seated_beam(-0.006e-3)
    sag = -tip_of(model, seat) - 0.003e-3
    q = WEIGHT / LENGTH
    shortest, longest = (q * c**4 / (8.0 * BENDING) + 0.5 * q * c**2 / SHEAR for c in (OVERHANG, OVERHANG + THICKNESS))
    assert shortest < sag < longest


PRESSED = {
    "plane stress": ({}, E),
    "triangles": ({"cell": "triangle"}, E),
    "plane strain": ({"plane": "strain"}, E / (1.0 - NU**2)),
    "solid": ({"dimension": 3, "cells_through_thickness": 1, "cells_across_width": 1}, E),
}


@pytest.mark.parametrize("name", PRESSED)
def test_pressure_of_an_interference_fit(name: str) -> None:
    """A block squeezed along its whole length: p = |c| / (2 / eps + h / E'), the same at all points, to 1e-7.

    Two contact compliances in series with the body, E' = E where it may expand sideways and E / (1 - nu^2) in plane
    strain; the weak restraint against the expansion is the rest.
    """
    mesh, modulus = PRESSED[name]
    model = beam_model(
        {"beam": {"length": 0.05}, "support": {"length": 0.05, "clearance": -6.0e-6}, "mesh": mesh}, loads=()
    )
    pressure = seat_of(model).state.pressure
    assert pressure == pytest.approx(6.0e-6 / (2.0 / model.law.stiffness + THICKNESS / modulus), rel=1e-7)


def test_pressure_in_the_middle_of_an_interference_fit() -> None:
    """Three thicknesses away from the ends the overhang is forgotten: the same pressure within 0.1 %."""
    model = beam_model({"support": {"length": 0.12, "clearance": -6.0e-6}}, loads=())
    pressure = seat_of(model).state.pressure
    middle = np.abs(model.system.contact.positions[:, 0] - 0.06) < 0.02
    expected = 6.0e-6 / (2.0 / model.law.stiffness + THICKNESS / E)
    assert pressure[middle] == pytest.approx(expected, rel=1e-3)
    assert pressure.max() > 1.05 * expected
