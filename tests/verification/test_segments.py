"""Beams with segments: frequencies, deflections, weights and seats by theory and by hand, and solids beside beams."""

from __future__ import annotations

from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.linalg import expm
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.case.analysis_table import NAMES
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.assumptions.pose_rows import gauges_of
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from tests.shared.models import face_forces, seat_of

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0
KAPPA = 13.0 / 15.3  # of a rectangle for nu = 0.3
LENGTH, WIDTH, THIN, THICK = 1.0, 0.02, 0.012, 0.02
THICKER = {"name": "hub", "from": 0.3, "to": 0.55, "thickness": THICK}
ALUMINUM = {"name": "end", "from": 0.7, "to": 1.0, "young_modulus": 7.0e10, "poisson_ratio": 0.33, "density": 2700.0}
GRAVITY = {"type": "gravity", "name": "weight"}


def held(
    joints: tuple[dict[str, Any], ...],
    segments: tuple[dict[str, Any], ...],
    model: dict[str, Any],
    force: float = LENGTH,
    **tables: Any,
) -> Model:
    """Return a beam in joints, in a slot that it does not touch, with a force at a place."""
    case = {
        "beam": {"length": LENGTH, "thickness": THIN, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "segment": list(segments),
        "support": [{"name": "far", "from": 0.6, "to": 0.65, "clearance": 9.0e-3}],
        "joint": list(joints),
        "restraint": {"axial": 1e-6, "lateral": 1e-6},
        "mesh": {"size": 0.02, "support_size": 0.02, "cells_through_thickness": 2},
        "model": model,
        "load": [{"type": "harmonic_force", "name": "f", "point": force, "amplitude": 1.0, "frequency": 5.0}],
        "probe": [{"name": "tip", "point": force}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return build_model(gapbeam.read_case(case | tables), MPI.COMM_SELF)


CLAMPED = ({"name": "root", "type": "clamped", "point": 0.0},)
PINNED = tuple({"name": f"pin{number}", "type": "pinned", "point": x} for number, x in enumerate((0.0, 0.5, 1.0)))
ELEMENTS = {"type": "beam", "elements": 80}


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, ascending, Hz."""
    assert isinstance(model.system.operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(model.system.operators.modes[0], 0.0)) / (2.0 * pi))


def tip_flexibility(model: Model) -> float:
    """Return the static motion of the loaded place under a unit force there, m/N."""
    squares, shapes = model.system.operators.modes
    return float(np.sum((model.body.patterns[0] @ shapes) ** 2 / squares))


# A piece by hand: length, thickness, E, nu, density.
Piece = tuple[float, float, float, float, float]
STEPPED: tuple[Piece, ...] = (
    (0.3, THIN, YOUNG, POISSON, DENSITY),
    (0.25, THICK, YOUNG, POISSON, DENSITY),
    (0.15, THIN, YOUNG, POISSON, DENSITY),
    (0.3, THIN, 7.0e10, 0.33, 2700.0),
)


def transfer(piece: Piece, omega: float, length: float) -> Array:
    """Return what w, theta, moment and shear force become along a part of a Timoshenko beam that vibrates.

    w' = theta + Q / (kappa G A), theta' = M / (E I), M' = -Q - rho I om^2 theta, Q' = -rho A om^2 w.
    """
    _, thickness, young, poisson, density = piece
    area, second = WIDTH * thickness, WIDTH * thickness**3 / 12.0
    kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson)
    shear = kappa * young / (2.0 * (1.0 + poisson)) * area
    rates = np.zeros((4, 4))
    rates[0, 1], rates[0, 3] = 1.0, 1.0 / shear
    rates[1, 2] = 1.0 / (young * second)
    rates[2, 1], rates[2, 3] = -density * second * omega**2, -1.0
    rates[3, 0] = -density * area * omega**2
    scales = np.array([1.0, 1.0, 1.0e3, 1.0e3])  # moments and forces beside deflections
    return np.asarray(scales[:, None] * expm(length * rates * scales / scales[:, None]) / scales)


def along(omega: float, start: float, end: float) -> Array:
    """Return the transfer matrix of the stepped beam from one place to another."""
    whole, place = np.identity(4), 0.0
    for piece in STEPPED:
        first, last = max(place, start), min(place + piece[0], end)
        if last > first:
            whole = transfer(piece, omega, last - first) @ whole
        place += piece[0]
    return whole


def clamped_free(frequency: float) -> float:
    """Return the determinant that is zero at frequencies of the cantilever: no moment and no force at the tip."""
    return float(np.linalg.det(along(2.0 * pi * frequency, 0.0, LENGTH)[2:, 2:]))


def over_two_spans(frequency: float) -> float:
    """Return that of pins at both ends and in the middle, where the shear force jumps by an unknown reaction."""
    first, second = (along(2.0 * pi * frequency, *ends) for ends in ((0.0, 0.5), (0.5, 1.0)))
    # unknown: rotation and shear force at x = 0, reaction in the middle; no deflection there and at the end, no moment
    at_pin = first[:, [1, 3]]
    at_end = np.hstack([second @ at_pin, second[:, [3]]])
    return float(np.linalg.det(np.vstack([[*at_pin[0], 0.0], at_end[0], at_end[2]])))


def roots(condition: Any, count: int, highest: float) -> list[float]:
    """Return the lowest roots of a function, by a scan and Brent's method."""
    grid = np.linspace(1.0, highest, 4000)
    values = [condition(f) for f in grid]
    signs = [(a, b) for (a, fa), (b, fb) in pairwise(zip(grid, values, strict=True)) if fa * fb < 0.0]
    return [float(brentq(condition, a, b, xtol=1e-10)) for a, b in signs[:count]]


@pytest.mark.parametrize(
    ("joints", "condition", "highest"), [(CLAMPED, clamped_free, 250.0), (PINNED, over_two_spans, 900.0)]
)
def test_stepped_beams_of_two_materials_vibrate_as_transfer_matrices_say(
    joints: Any, condition: Any, highest: float
) -> None:
    """A cantilever, and a beam over two spans with different steps in each: the exact roots of Timoshenko's beam."""
    found = frequencies(held(joints, (THICKER, ALUMINUM), ELEMENTS))
    assert found[:3] == pytest.approx(roots(condition, 3, highest), rel=1e-5)


def test_a_slender_stepped_cantilever_vibrates_as_euler_and_bernoulli_say() -> None:
    """Two halves, the second half as thick: the determinant of w, w', EI w'', EI w''' in cosh, sinh, cos and sin."""
    thin, thick = 0.002, 0.004
    model = held(
        CLAMPED,
        ({"name": "tail", "from": 0.5, "to": 1.0, "thickness": thin},),
        ELEMENTS,
        beam={"length": LENGTH, "thickness": thick, "width": WIDTH},
        support=[{"name": "far", "from": 0.6, "to": 0.65, "clearance": 2.0e-3}],
    )

    def basis(k: float, x: float) -> Array:
        ch, sh, c, s = np.cosh(k * x), np.sinh(k * x), np.cos(k * x), np.sin(k * x)
        return np.array(
            [[ch, sh, c, s], [k * sh, k * ch, -k * s, k * c], [k**2 * ch, k**2 * sh, -(k**2) * c, -(k**2) * s],
             [k**3 * sh, k**3 * ch, k**3 * s, -(k**3) * c]]
        )  # fmt: skip

    def condition(frequency: float) -> float:
        omega = 2.0 * pi * frequency
        k, m = ((omega**2 * DENSITY * 12.0 / (YOUNG * h**2)) ** 0.25 for h in (thick, thin))
        bending = np.diag([1.0, 1.0, thick**3, thick**3]), np.diag([1.0, 1.0, thin**3, thin**3])
        matrix = np.zeros((8, 8))
        matrix[:2, :4] = basis(k, 0.0)[:2]
        matrix[2:6, :4], matrix[2:6, 4:] = bending[0] @ basis(k, 0.5), -bending[1] @ basis(m, 0.0)
        matrix[6:, 4:] = basis(m, 0.5)[2:]
        matrix /= np.abs(matrix).max(axis=1, keepdims=True)
        return float(np.linalg.det(matrix))

    assert frequencies(model)[:3] == pytest.approx(roots(condition, 3, 60.0), rel=2e-4)


def bent_by_hand(force: float) -> float:
    """Return the deflection under a unit force by statics, int (P - x)^2 / EI + 1 / kappa G A dx, m/N."""
    total, start = 0.0, 0.0
    for length, thickness, young, poisson, _ in STEPPED:
        end = min(start + length, force)
        if end > start:
            second, area = WIDTH * thickness**3 / 12.0, WIDTH * thickness
            kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson)
            total += ((force - start) ** 3 - (force - end) ** 3) / (3.0 * young * second)
            total += (end - start) / (kappa * young / (2.0 * (1.0 + poisson)) * area)
        start += length
    return total


@pytest.mark.parametrize("force", [1.0, 0.8])
def test_a_stepped_cantilever_of_two_materials_bends_as_by_hand(force: float) -> None:
    """The beam elements to round-off; the slice, which knows the shoulders of steps, to a percent."""
    beam = tip_flexibility(held(CLAMPED, (THICKER, ALUMINUM), {"type": "beam", "elements": 30}, force))
    assert beam == pytest.approx(bent_by_hand(force), rel=1e-8)
    solid = tip_flexibility(held(CLAMPED, (THICKER, ALUMINUM), {"type": "reduced", "modes": 6}, force))
    assert beam < solid < 1.01 * beam, "the shoulders of steps carry nothing at their corners"


def test_slices_vibrate_as_beam_elements_do() -> None:
    solid = frequencies(held(CLAMPED, (THICKER, ALUMINUM), {"type": "reduced", "modes": 8}))
    beam = frequencies(held(CLAMPED, (THICKER, ALUMINUM), ELEMENTS))
    assert solid[:3] == pytest.approx(beam[:3], rel=5e-3)


@pytest.mark.slow(minutes=0.1)
def test_solid_shafts_vibrate_and_bend_as_beam_elements_do() -> None:
    """A bar with a thicker hub that ends as an aluminum tube, clamped: two frequencies of bending, and the tip."""
    round_bar = {
        "beam": {"length": LENGTH, "thickness": 0.03, "width": 0.03, "section": "round"},
        "mesh": {"dimension": 3, "size": 0.1, "support_size": 0.04, "edge_size": 0.04, "cells_through_thickness": 2,
                 "cells_across_width": 2},
    }  # fmt: skip
    hub, end = {**THICKER, "thickness": 0.045}, {**ALUMINUM, "section": {"type": "tube", "wall": 0.006}}
    solid, beam = (
        held(CLAMPED, (hub, end), model, **round_bar) for model in ({"type": "reduced", "modes": 6}, ELEMENTS)
    )
    assert frequencies(solid)[:2] == pytest.approx(frequencies(beam)[:2], rel=0.01)
    assert tip_flexibility(beam) < tip_flexibility(solid) < 1.015 * tip_flexibility(beam)


SHAFT = {
    "beam": {"length": 0.5, "thickness": 0.03, "width": 0.03, "section": "round"},
    "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
    "segment": [
        {"name": "journal", "from": 0.0, "to": 0.1, "thickness": 0.02},
        {"name": "hollow", "from": 0.35, "to": 0.5, "section": {"type": "tube", "wall": 0.006}, "density": 4000.0},
    ],
    "support": [
        {"name": "left", "from": 0.02, "to": 0.06, "clearance": 2.0e-4},
        {"name": "right", "from": 0.4, "to": 0.44, "clearance": 2.0e-4},
    ],
    "mesh": {
        "dimension": 3,
        "size": 0.2,
        "support_size": 0.035,
        "edge_size": 0.035,
        "cells_through_thickness": 2,
        "cells_across_width": 2,
    },
    "load": [GRAVITY],
    "probe": [{"name": "left", "point": 0.04}, {"name": "right", "point": 0.42}],
    "time": {"end": 0.1, "step": 1.0e-4},
}
# mass and middle of the pieces of that shaft by hand
PIECES = (
    (DENSITY * 0.1 * pi / 4.0 * 0.02**2, 0.05),
    (DENSITY * 0.25 * pi / 4.0 * 0.03**2, 0.225),
    (4000.0 * 0.15 * pi / 4.0 * (0.03**2 - 0.018**2), 0.425),
)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("kind", ["beam", "reduced"])
def test_a_stepped_shaft_rests_in_two_supports_under_different_diameters(kind: str) -> None:
    """Reactions by the lever rule; both ends sink by half the clearance, since gaps begin at the surface there."""
    model = build_model(gapbeam.read_case(SHAFT | {"model": {"type": kind}}), MPI.COMM_SELF)
    seat = seat_of(model)
    forces = face_forces(model.system.contact, seat.state.pressure)
    weight = 9.81 * sum(mass for mass, _ in PIECES)
    moment = 9.81 * sum(mass * (middle - 0.04) for mass, middle in PIECES)
    # a support carries at its edges; the rigid shaft turns about none of them, so that levers are known to its length
    right = forces["right_below"] - forces.get("right_above", 0.0)
    left = forces["left_below"] - forces.get("left_above", 0.0)
    assert left + right == pytest.approx(weight, rel=3e-3)
    assert right == pytest.approx(moment / 0.38, rel=0.06)
    sunk = {name: probe.evaluate(seat.state.u[0], model.system.operators)[-1] for name, probe in model.probes.items()}
    assert sunk["left"] == pytest.approx(-1.0e-4, rel=0.05)
    assert sunk["right"] == pytest.approx(-1.0e-4, rel=0.05)


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("kind", ["full", "beam"])
def test_models_weigh_what_their_pieces_do(kind: str) -> None:
    """Mass and first moment of a shaft with a journal and a light hollow end, by hand; 8 cells around lack 8e-4."""
    model = build_model(gapbeam.read_case(SHAFT | {"model": {"type": kind}}), MPI.COMM_SELF)
    mass, moment = sum(one for one, _ in PIECES), sum(one * middle for one, middle in PIECES)
    heave, pitch = (model.body.rigid[NAMES.index(name)] @ raised(model) for name in ("vertical", "rotation"))
    assert heave == pytest.approx(mass, rel=1e-3 if kind == "full" else 1e-12)
    assert pitch == pytest.approx(moment, rel=1e-3 if kind == "full" else 1e-12)
    assert model.case.profile.mass == pytest.approx(mass, rel=1e-12)
    assert model.case.profile.middle == pytest.approx(moment / mass, rel=1e-12)


def raised(model: Model) -> Array:
    """Return the motion of the whole body upward by 1, on its DOFs."""
    if isinstance(model.system.operators, DenseOperators):
        return np.tile([1.0, 0.0], model.system.operators.size // 2)
    return np.tile([0.0, 0.0, 1.0], model.dofs // 3)


@pytest.mark.parametrize("kind", ["beam", "reduced"])
def test_stress_is_that_of_the_segment(kind: str) -> None:
    """Under a force F at the tip, sigma = F (L - x) (h / 2) / I in the thick steel and in the thin aluminum."""
    model = held(
        CLAMPED,
        (THICKER, ALUMINUM),
        {"type": kind},
        probe=[
            {"name": "hub", "point": [0.42, 0.5 * THICK], "stress": True},
            {"name": "end", "point": [0.8, 0.5 * THIN], "stress": True},
        ],
    )
    squares, shapes = model.system.operators.modes
    gauges = gauges_of(model.case, model)
    assert gauges is not None
    axial, mises = gauges.stresses((shapes @ ((model.body.patterns[0] @ shapes) / squares))[None])
    wanted = [-0.58 * 6.0 / (WIDTH * THICK**2), -0.2 * 6.0 / (WIDTH * THIN**2)]
    assert axial[0] == pytest.approx(wanted, rel=0.02)
    assert mises[0] == pytest.approx(np.abs(wanted), rel=0.02)


def test_a_segment_as_the_rest_changes_no_bit() -> None:
    """A beam of one piece is one piece, however it is written."""
    plain = held(CLAMPED, (), {"type": "reduced", "modes": 4})
    same = held(
        CLAMPED, ({"name": "same", "from": 0.2, "to": 0.4, "density": DENSITY},), {"type": "reduced", "modes": 4}
    )
    assert same.case.profile.prismatic
    assert np.array_equal(plain.system.operators.stiffness, same.system.operators.stiffness)
    assert np.array_equal(plain.body.contact.initial_gap, same.body.contact.initial_gap)


def test_profile_has_pieces_between_segments_too() -> None:
    case: Case = held(CLAMPED, (ALUMINUM, THICKER), ELEMENTS).case
    assert [(piece.start, piece.end) for piece in case.profile.pieces] == [
        (0.0, 0.3),
        (0.3, 0.55),
        (0.55, 0.7),
        (0.7, 1.0),
    ]
    assert [case.profile.at(x).beam.thickness for x in (0.0, 0.3, 0.55, 1.0)] == [THIN, THICK, THIN, THIN]
    assert case.profile.at(0.9).material.density == 2700.0
