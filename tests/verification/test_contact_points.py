"""Resultant springs at points of the contact faces, as a rigid-body code has them.

Sources: statics of the overhanging beam (38.986 N at the gland, x = 0, and 48.494 N at the base, x = 50 mm) with the
levers of the patches; Flamant's half-plane, whose compliance grows by 2 ln 2 / (pi E b) when a patch is halved
(Johnson, Contact Mechanics, 1985, section 2.3); momentum; Table 2 of Li et al. (2013).
"""

from __future__ import annotations

from itertools import pairwise
from math import log, pi
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.case import Contact, case_to_toml
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.contact.laws.contact_law import make_law
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.system.semi_discrete import MASS, VALUE, Snapshots, Step
from tests.shared.case_texts import assert_says, faults_of, spoiled, written
from tests.shared.command import DEMO, RATTLE, alone, called, on_ranks_in_turn, settings
from tests.shared.models import SOLID, beam_model, face_forces, seat_of, thrown
from tests.shared.toys import ledger_of

LENGTH, THICKNESS, WIDTH, SUPPORT = 0.51, 0.012, 0.02, 0.05  # m
E = 2.1e11  # Pa
WEIGHT = 7919.0 * LENGTH * THICKNESS * WIDTH * 9.81  # N
ENDS = [0.0, SUPPORT]
CORNERS = [[0.0, -0.0075], [0.0, 0.0075], [SUPPORT, -0.0075], [SUPPORT, 0.0075]]
ALIGNED = {"support_size": 1.25e-3, "edge_size": 1.25e-3}  # cells end where the hats of a patch of 5 mm have kinks
WIDE = {**SOLID, "support_size": 5.0e-3, "edge_size": 2.5e-3, "cells_across_width": 4}

# Table 2: stiffness 1e5, exponent 2.2, damping 10, penetration 1e-3, in N, mm and s.
TABLE_2: dict[str, Any] = {
    "stiffness": 1.0e5 * 1.0e3**2.2,  # N/m^2.2
    "law": {"type": "adams-impact", "exponent": 2.2, "damping": 10.0 * 1.0e3, "full_depth": 1.0e-6},
}


def held(points: list[Any], mesh: dict[str, Any] | None = None, **contact: Any) -> Model:
    """The beam of the paper, held at points."""
    return beam_model({"contact": {"points": points, **contact}, "mesh": mesh or ALIGNED}, probes={"tip": LENGTH})


def reactions(gland: float, base: float) -> tuple[float, float]:
    """Forces of gland and base that act at these x: moments about either of a beam of uniform weight."""
    force = WEIGHT * (0.5 * LENGTH - base) / (base - gland)
    return force, WEIGHT + force


def test_seat_is_that_of_a_rigid_body() -> None:
    """Reactions by statics within 1e-4, with the exact levers of half hats at the ends, a sixth of a patch inside.

    Half a hat of length p/2 has its mean at p/6. What is left is the moment of the weak axial restraint.
    """
    assert reactions(0.0, SUPPORT) == pytest.approx((38.986, 48.494), abs=1e-3)
    for patch in (5.0e-3, 10.0e-3):
        model = held(ENDS, patch=patch)
        contact = model.system.contact
        inside = patch / 6.0
        assert contact.positions[:, 0] == pytest.approx(2 * [inside, SUPPORT - inside], rel=1e-12)
        assert contact.weights == pytest.approx(4 * [0.25 * patch * WIDTH], rel=1e-12)
        found = face_forces(contact, seat_of(model).state.pressure)
        gland, base = reactions(inside, SUPPORT - inside)
        assert found["gland"] == pytest.approx(gland, rel=1e-4)
        assert found["base"] == pytest.approx(base, rel=1e-4)
        assert found["base"] - found["gland"] == pytest.approx(WEIGHT, rel=1e-8)


@pytest.mark.parametrize("points", [[0.0125, 0.0375], [0.0, 0.025, 0.05], [0.0, 0.0025, 0.005, 0.05]])
def test_inner_points_act_at_their_places(points: list[float]) -> None:
    """A whole hat acts at its place and has the area of half its patch; the seat balances the weight's moment, 1e-4."""
    model = held(points)
    contact, width = model.system.contact, 0.5 * 5.0e-3
    inner = [number for number, x in enumerate(points) if width <= x <= SUPPORT - width]
    assert contact.positions[inner, 0] == pytest.approx([points[number] for number in inner], abs=1e-12)
    assert contact.weights[inner] == pytest.approx(width * WIDTH, rel=1e-12)
    forces = contact.weights * seat_of(model).state.pressure
    up = np.where(contact.faces == contact.face_names.index("base"), 1.0, -1.0)
    assert float(up @ forces) == pytest.approx(WEIGHT, rel=1e-8)
    moment = float(up @ (forces * contact.positions[:, 0]))
    assert moment == pytest.approx(0.5 * LENGTH * WEIGHT, rel=1e-4)


def compliance(patch: float, cell: float, layers: int = 12) -> float:
    """Mean sinking of the patch at x = 12.5 mm under a unit resultant there, times E b; soft springs hold the beam."""
    mesh = {"support_size": cell, "edge_size": cell, "cells_through_thickness": layers}
    system = held([0.0125, 0.0375], mesh, patch=patch).system
    condensed = CondensedOperator(system, 0.0, 1.0, springs=system.contact.springs(1.0e11))
    return float(condensed.delassus[0, 0]) * E * WIDTH


def test_sinking_converges_under_refinement() -> None:
    """A patch of 5 mm converges as cells shrink, by a factor above 4 a halving.

    A patch of two cells, as springs at nodes are, sinks in by 2 ln 2 / pi = 0.441 more at every halving, within 6 %.
    """
    fixed = [compliance(5.0e-3, cell) for cell in (5.0e-3, 2.5e-3, 1.25e-3, 0.625e-3)]
    changes = [abs(later - earlier) for earlier, later in pairwise(fixed)]
    assert all(later < 0.25 * earlier for earlier, later in pairwise(changes))
    assert changes[-1] < 1e-3
    shrinking = [compliance(2.0 * cell, cell) for cell in (2.5e-3, 1.25e-3, 0.625e-3)]
    assert np.diff(shrinking) == pytest.approx(2.0 * log(2.0) / pi, rel=0.06)


@pytest.mark.slow(minutes=0.4)
def test_smaller_patches_sink_as_flamant_says() -> None:
    """On a fine mesh halving a patch adds 2 ln 2 / (pi E b) to its compliance: 1.5 % with patches of 4, 2 and 1 mm."""
    found = [compliance(patch, 0.125e-3, 24) for patch in (4.0e-3, 2.0e-3, 1.0e-3)]
    assert np.diff(found) == pytest.approx(2.0 * log(2.0) / pi, rel=0.015)


def test_deflection_converges_under_refinement() -> None:
    """The tip of the seated beam moves by less than 1e-4 of its sag between cells of 2.5 and 1.25 mm, then by less."""

    def sag(cell: float) -> float:
        model = held(ENDS, {"support_size": cell, "edge_size": cell}, stiffness=1.0e8)
        return float(model.probes["tip"].evaluate(seat_of(model).state.u[VALUE], model.system.operators)[1])

    sags = [sag(cell) for cell in (2.5e-3, 1.25e-3, 0.625e-3)]
    changes = [abs(later - earlier) / abs(sags[-1]) for earlier, later in pairwise(sags)]
    assert changes[0] < 1e-4
    assert changes[1] < 0.5 * changes[0]


def test_resultants_follow_the_law_in_force() -> None:
    """At rest F = K d^2.2 at each point, K = 1e5 N/mm^2.2; in motion with the damping of ADAMS's step besides."""
    model = held(ENDS, **TABLE_2)
    contact, state = model.system.contact, seat_of(model).state
    millimetres = 1.0e3 * np.maximum(state.depth, 0.0)
    assert contact.weights * state.pressure == pytest.approx(1.0e5 * millimetres**2.2, rel=1e-9)
    depth, speed = np.full(4, 0.4e-6), 0.01  # m, m/s
    moving = contact.weights * model.law.endpoint(depth, np.full(4, speed), 0.0).pressure
    share = 0.4**2 * (3.0 - 2.0 * 0.4)
    assert moving == pytest.approx(np.full(4, 1.0e5 * 0.4e-3**2.2 + share * 10.0 * 1.0e3 * speed), rel=1e-9)


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ({"type": "kelvin-voigt"}, 5.0e7 * 2.0e-6 + 300.0 * 0.1),
        (
            {"type": "hunt-crossley", "restitution": 0.5, "exponent": 1.5},
            5.0e7 * 2.0e-6**1.5 * (1.0 + 1.43275 * 0.1 / 0.4),
        ),
        ({"type": "lankarani-nikravesh", "restitution": 0.5}, 5.0e7 * 2.0e-6**1.5 * (1.0 + 0.75 * 0.75 * 0.1 / 0.4)),
    ],
    ids=["kelvin-voigt", "hunt-crossley", "lankarani-nikravesh"],
)
def test_every_law_is_a_force_at_points(law: dict[str, Any], expected: float) -> None:
    """K in N/m^n and c in N s/m of each point, over areas that differ: 2 um deep, 0.1 m/s, touched at 0.4 m/s."""
    areas = np.array([25.0e-6, 50.0e-6, 3.0e-6])
    contact = Contact.model_validate({"law": law, "stiffness": 5.0e7, "points": ENDS})
    made = make_law(contact.law, 5.0e7, 1e-9, 300.0, areas, slowest_touch=1e-4).touched_at(np.full(3, 0.4))
    pressure = made.endpoint(np.full(3, 2.0e-6), np.full(3, 0.1), 0.0).pressure
    assert areas * pressure == pytest.approx(np.full(3, expected), rel=1e-5)


def test_corners_hold_the_beam_against_rolling() -> None:
    """Rigid rise, tilt and roll change the gaps of four corners in three ways, and those of two lines in two."""
    for points, ways in ((CORNERS, 3), (ENDS, 2)):
        contact = held(points, WIDE).system.contact
        x, y, _ = contact.positions[contact.faces == 0].T
        assert np.linalg.matrix_rank(np.stack([np.ones_like(x), x, y]), tol=1e-6) == ways


def test_solid_seat_on_corners() -> None:
    """Four corners carry in pairs what statics say, 1e-4; each of a pair half of it, 1e-6."""
    model = held(CORNERS, WIDE)
    contact = model.system.contact
    forces = (contact.weights * seat_of(model).state.pressure).reshape(2, 2, 2)  # face, x, y
    inside = contact.positions[0, 0]
    gland, base = reactions(inside, SUPPORT - inside)
    by_face = dict(zip(contact.face_names, forces, strict=True))
    assert by_face["gland"][0] == pytest.approx(0.5 * gland, rel=1e-4)
    assert by_face["base"][1] == pytest.approx(0.5 * base, rel=1e-4)
    assert by_face["gland"][1] == pytest.approx(0.0)
    assert by_face["base"][0] == pytest.approx(0.0)
    assert forces[:, :, 0] == pytest.approx(forces[:, :, 1], rel=1e-6)


def motion(model: Model, count: int, scheme: TimeScheme) -> list[Step]:
    """Steps of a beam thrown at its support."""
    plan = March(model.system, model.law, scheme, EffectiveOperators(model.system, scheme), 2.0e-5, count)
    return list(march(plan, thrown(model)))


@pytest.mark.parametrize("points", [ENDS, CORNERS], ids=["2D", "3D"])
def test_momentum_and_energy_balance_in_motion(points: list[Any]) -> None:
    """With Table 2's law and the default scheme both faces are struck, and momentum balances to 1e-7.

    The upward momentum changes by the impulses of base, gland and weight alone: the restraint acts along and across.
    Energy balances, and the scheme makes and loses none, below what u K u resolves, itself less than 1e-7 of it.
    """
    model = held(points, ALIGNED if points is ENDS else WIDE, **TABLE_2)
    system, contact = model.system, model.system.contact
    steps = motion(model, 300, model.case.time.scheme)
    assert model.case.time.scheme.has_period_map
    up = np.where(contact.faces == contact.face_names.index("base"), 1.0, -1.0)
    forces = np.array([contact.weights * step.stage.pressure for step in steps])
    assert (forces.max(axis=0).reshape(2, -1).max(axis=1) > 0.0).all()
    impulse = sum(step.size * (float(up @ force) - WEIGHT) for step, force in zip(steps, forces, strict=True))
    vertical = np.zeros(system.operators.size)
    vertical[model.case.mesh.dimension - 1 :: model.case.mesh.dimension] = 1.0
    before, after = (float(vertical @ state.v[MASS]) for state in (steps[0].old, steps[-1].new))
    assert after - before == pytest.approx(impulse, rel=1e-7)
    ledger = ledger_of(system, model.law, steps[0].old, steps)
    assert ledger.contact_loss > 0.01 * ledger.exchanged
    assert ledger.round_off < 1e-7 * ledger.exchanged
    assert abs(ledger.residual) < ledger.round_off
    assert abs(ledger.algorithmic) < ledger.round_off


@pytest.mark.parametrize("scheme", ["implicit-midpoint", "newmark", "generalized-alpha"])
def test_other_schemes_march_to_the_same_place(scheme: str) -> None:
    """After 1 ms with several touches the tip is where the default scheme brings it, to 1 % of its way."""
    tips = []
    for name in ("discrete-gradient", scheme):
        model = held(ENDS, **TABLE_2)
        integrator = scheme_of(name)
        last = motion(model, 50, integrator)[-1].new
        tips.append(float(model.probes["tip"].evaluate(last.u[VALUE], model.system.operators)[1]))
    assert tips[1] == pytest.approx(tips[0], rel=0.01)


def test_recorded_area_is_that_of_the_patches() -> None:
    """A history of the seat: contact area of the one closed patch at each face, and the moment of its resultant."""
    model = held(ENDS)
    state = seat_of(model).state
    row = {
        name: rows[0]
        for name, rows in Recorder(model.case, model)
        .row(state, Accounts.opened(model.system, model.law, state, model.step))
        .items()
    }
    assert row["contact_area"] == pytest.approx([0.25 * 5.0e-3 * WIDTH] * 2, rel=1e-12)
    assert row["active_points"] == pytest.approx([1.0, 1.0])
    force = dict(zip(model.system.contact.face_names, np.asarray(row["contact_force"]), strict=True))
    moment = dict(zip(model.system.contact.face_names, np.asarray(row["contact_moment"]), strict=True))
    assert moment["base"] == pytest.approx(force["base"] * (SUPPORT - 5.0e-3 / 6.0), rel=1e-9)
    assert moment["gland"] == pytest.approx(force["gland"] * 5.0e-3 / 6.0, rel=1e-9)


def test_fields_show_the_resultant_spread_over_its_patch(tmp_path: Path) -> None:
    """The nodal pressure integrates to the resultants, vanishes off the patches and has the peak of a hat, all to 1e-9.

    A hat presses with F N / A; a nodal value is its mean under the hat of the node.
    """
    model = held([0.0125, 0.0375])
    contact, state = model.system.contact, seat_of(model).state
    writer = FieldWriter(tmp_path, model.case, model)
    writer.write(Snapshots.of_states([state]), model)
    writer.close()
    with h5py.File(tmp_path / "fields.h5") as file:
        points, pressure = file["points"][:], file["contact_pressure/0"][:]
    cell, reach = 1.25e-3, 2.5e-3
    forces = face_forces(contact, state.pressure)
    for name, height, place in (("base", -0.5 * THICKNESS, 0.0375), ("gland", 0.5 * THICKNESS, 0.0125)):
        on_face = (np.abs(points[:, 1] - height) < 1e-9) & (points[:, 0] < SUPPORT + 1e-9)
        x, found = points[on_face, 0], pressure[on_face]
        at_end = (x < 1e-9) | (x > SUPPORT - 1e-9)
        areas = np.where(at_end, 0.5, 1.0) * cell * WIDTH
        assert float(areas @ found) == pytest.approx(forces[name], rel=1e-9)
        assert np.all(found[np.abs(x - place) > reach + 0.99 * cell] == 0.0)
        # the mean of 1 - |t| / r under a hat of half width h is 1 - h / (3 r)
        peak = forces[name] / (reach * WIDTH) * (1.0 - cell / (3.0 * reach))
        assert found.max() == pytest.approx(peak, rel=1e-9)


def test_shares_are_means() -> None:
    """Rows of P add up to 1, and spreading keeps each force; G of a uniform rise is 1 at the base, -1 at the gland."""
    contact = held(ENDS).system.contact
    assert isinstance(contact, ResultantOperator)
    assert np.asarray(contact.shares.sum(axis=1)).ravel() == pytest.approx(np.ones(4), abs=1e-12)
    forces = np.array([1.0, 2.0, 3.0, 4.0])
    assert contact.spread(forces).sum() == pytest.approx(10.0, rel=1e-12)
    assert contact.initial_gap == pytest.approx([0.0, 0.0, 0.107e-3, 0.107e-3], abs=1e-15)
    assert contact.area == pytest.approx(2.0 * SUPPORT * WIDTH, rel=1e-12)


def test_computed_stiffness_is_the_share_of_the_face() -> None:
    """Of each of two points half of what the whole face has, in N/m; the patch is a tenth of the support."""
    spread_out, gathered = beam_model({"mesh": ALIGNED}).defaults[0], held(ENDS).defaults
    stiffness, patch = gathered
    assert (stiffness.key, stiffness.unit) == ("contact.stiffness", "N/m")
    assert stiffness.value == pytest.approx(0.5 * spread_out.value * SUPPORT * WIDTH, rel=1e-12)
    assert "over 2 points" in stiffness.reason
    assert (patch.key, patch.value, patch.unit) == ("contact.patch", pytest.approx(5.0e-3), "m")
    assert "1.1e-10 m/N" in patch.consequence
    assert "twice as much" in held(CORNERS, WIDE).defaults[1].consequence


def test_a_patch_between_quadrature_points_is_refused() -> None:
    """Cells far larger than a patch: where, how large, and what to refine."""
    with pytest.raises(UserError) as caught:
        held([0.02, 0.0125, 0.04], {"support_size": 12.5e-3, "edge_size": 12.5e-3}, patch=1.0e-5)
    words = str(caught.value)
    for word in ("0.0125 at the base", "0.0125 at the gland", "patches of 1e-05 m", "mesh.support_size = 5e-06"):
        assert word in words


@alone
def test_the_command_refuses_it_with_status_2() -> None:
    """A fault that shows only on the mesh is still one of the input."""
    done = called("check", DEMO, *settings("contact.points=[0.0125, 0.0375]", "contact.patch=1e-6"))
    assert done.returncode == 2
    assert "no quadrature point lies in the patch around 0.0125 at the base" in done.stderr


BAD = {
    "formulation": (
        'points = [0.0, 0.05]\nformulation = "unilateral"',
        ["[contact] points", "points with the formulation unilateral", "penalty", "or leave points out"],
    ),
    "patch alone": (
        "patch = 0.004",
        ["[contact] patch", "0.004 m without points", "no patches", "points = [0.0, 0.05]"],
    ),
    "outside the support": (
        "points = [0.0, 0.051]",
        ["[contact] points", "x = 0.051 m, outside the support", "x from 0 to 0.05 m", "from the supported end"],
    ),
    "before the support": ("points = [-0.001, 0.05]", ["[contact] points", "x = -0.001 m, outside"]),
    "in mm": ("points = [0.0, 50]", ["[contact] points", "x = 50 m, outside", "is it in mm? In m it is 0.05"]),
    "y in 2D": (
        "points = [0.0, [0.05, 0.001]]",
        ["[contact] points", "[0.05, 0.001] with dimension = 2", "x alone in 2D", "mesh.dimension = 3"],
    ),
    "one line": (
        "points = [0.05]",
        ["[contact] points", "points at x = 0.05 m only", "at least two points with different x", "tilting"],
    ),
    "none": ("points = []", ["[contact] points", "no point", "at least two points"]),
    "twice": (
        "points = [0.0, 0.05, 0.0]",
        ["[contact] points", "points number 1 and 3 lie at the same place", "half a patch", "leave one of them out"],
    ),
    "too close": (
        "points = [0.0, 0.002, 0.05]",
        ["[contact] points", "points number 1 and 2 are 0.002 m apart, with patches of 0.005 m", "0.0025 m", "0.004"],
    ),
    "large patch": (
        "points = [0.0, 0.05]\npatch = 0.12",
        ["[contact] points", "points number 1 and 2 are 0.05 m apart", "patches of 0.12 m", "patch = 0.1"],
    ),
    "no list": (
        "points = 0.05",
        ["[contact] points", "a list of at most 1000 items, each a number or a list of 2 numbers"],
    ),
    "three numbers": ("points = [0.0, [0.05, 0.0, 0.0]]", ["[contact] points", "a list of 2 numbers"]),
    "text": ('points = ["0.0", "0.05"]', ["[contact] points", "numbers without quotes"]),
    "exponent": (
        'points = [0.0, 0.05]\nlaw = { type = "hunt-crossley", restitution = 0.8, exponent = 1.5 }',
        ["[contact] stiffness", "a number in N/m^1.5", "stiffness = 1e12"],
    ),
    "damping of another law": (
        'points = [0.0, 0.05]\ndamping = 5.0\nlaw = { type = "hunt-crossley", restitution = 0.8 }',
        ["[contact] damping", "5 N s/m", "brings its own damping"],
    ),
}


@pytest.mark.parametrize(("new", "words"), BAD.values(), ids=BAD)
def test_bad_points_are_explained(tmp_path: Path, new: str, words: list[str]) -> None:
    """One mistake, one fault: where, what was found, what was expected, what to try."""
    (fault,) = faults_of(written(tmp_path, spoiled('stiffness = "auto"', new)))
    assert_says(fault, words)


def test_points_beside_a_solid_beam_are_explained(tmp_path: Path) -> None:
    """In 3D y lies within the width; all faults of the points are reported together."""
    text = spoiled('stiffness = "auto"', "points = [[0.0, 0.0], [0.05, 0.011], [0.06, 0.0]]")
    found = faults_of(written(tmp_path, text.replace("dimension = 2", "dimension = 3")))
    message = [fault.found for fault in found]
    assert message == ["y = 0.011 m, outside the beam", "x = 0.06 m, outside the support"]
    assert found[0].expected == "y from -0.01 to 0.01 m"


@pytest.mark.parametrize("points", ["[0.0, 0.0025, 0.005, 0.05]", "[[0.0, -0.0075], [0.0, 0.0075], 0.05]"])
def test_hats_that_add_up_to_one_are_fine(tmp_path: Path, points: str) -> None:
    """Centers half a patch apart, or side by side across the width; the case reads back as it was written."""
    text = spoiled('stiffness = "auto"', f"points = {points}").replace("degree = 2", "degree = 2\nsupport_size = 2e-3")
    case = read_case(
        written(tmp_path, text.replace("dimension = 2", "dimension = 3" if "[[" in points else "dimension = 2"))
    )
    assert warnings(case) == []
    assert read_case(written(tmp_path, case_to_toml(case))) == case


WARNED = {
    "coarse cells": ("points = [0.0, 0.05]\npatch = 0.003", "patches of 0.003 m are smaller than the cells of 0.004 m"),
    "soft": (
        'points = [0.0, 0.05]\nstiffness = 4e11\nlaw = { type = "hunt-crossley", restitution = 0.8, exponent = 2.2 }',
        "the weight presses the beam 1.1e-05 m into it",
    ),
}


@pytest.mark.parametrize("points", ["[0.0, 0.025, 0.05]", "[[0.0, -0.0075], [0.05, 0.0075]]"])
def test_rolling_is_warned_of(tmp_path: Path, points: str) -> None:
    """In 3D resultants on one line leave rolling to the weak restraint; in 2D nothing rolls."""
    text = spoiled('stiffness = "auto"', f"points = {points}").replace("degree = 2", "degree = 2\nsupport_size = 2e-3")
    lines = warnings(read_case(written(tmp_path, text.replace("dimension = 2", "dimension = 3"))))
    assert len(lines) == 1
    assert "holds the beam against rolling" in lines[0]


@pytest.mark.parametrize(("new", "words"), WARNED.values(), ids=WARNED)
def test_points_are_warned_of(tmp_path: Path, new: str, words: str) -> None:
    """Patches that cells cannot resolve, and a depth under the weight, (m g / 2 / K)^(1/n), that is not small."""
    lines = warnings(read_case(written(tmp_path, spoiled('stiffness = "auto"', new))))
    assert any(words in line for line in lines), lines


FEW = (*RATTLE, "time.end=0.02", "output.fields_interval=1e-2", "contact.stiffness=3.981071705534969e11")
LAW = 'contact.law={type = "adams-impact", exponent = 2.2, damping = 1e4, full_depth = 1e-6}'
FLAT = (*FEW, LAW, "contact.points=[0.0, 0.05]", "mesh.support_size=2.5e-3")
BLOCK = (
    *FEW,
    LAW,
    "contact.points=[[0.0, -0.0075], [0.0, 0.0075], [0.05, -0.0075], [0.05, 0.0075]]",
    "mesh.dimension=3",
    "mesh.cell=hexahedron",
    "mesh.degree=1",
    "mesh.cells_across_width=4",
    "restraint.lateral=1e6",
)


@pytest.mark.slow(minutes=0.3)
@alone
def test_ranks_agree(tmp_path: Path) -> None:
    """Table 2's law on one and two ranks, in 2D and 3D."""
    kinds = {4: FLAT, 8: BLOCK}
    calls = [("run", DEMO, "--output", tmp_path / f"{points} on 2", *settings(*kind)) for points, kind in kinds.items()]
    for done in on_ranks_in_turn(2, *calls):
        assert done.returncode == 0, done.stderr
    for points, kind in kinds.items():
        assert gapbeam.run(DEMO, kind, tmp_path / str(points)).exit_status == 0
        _assert_ranks_agree(tmp_path / str(points), tmp_path / f"{points} on 2", points)


def _assert_ranks_agree(first: Path, second: Path, points: int) -> None:
    """Every history to 5e-8 of its size (1.4e-8 was seen: accelerations), both faces struck, energy closed."""
    one, two = gapbeam.open_results(first), gapbeam.open_results(second)
    assert two.summary["model"]["ranks"] == 2
    assert one.summary["model"]["contact_points"] == points
    energy = one.summary["energy"]
    assert abs(energy["residual"]) < max(1e-8 * energy["exchanged"], energy["round_off"])
    assert (np.ptp(one.history["active_points"].values, axis=0) > 0.0).all()
    size = float(np.abs(one.history["load_work"]).max())
    for name in one.history.variables:
        if one.history[name].dtype == object:
            continue
        own = size if "residual" in str(name) or "dissipation" in str(name) else float(np.abs(one.history[name]).max())
        apart = float(np.abs(one.history[name].values - two.history[name].values).max())
        assert apart <= 5e-8 * own, name


@pytest.mark.parametrize("dimension", [2, 3])
def test_resultants_rub(dimension: int) -> None:
    """Friction at points: T of a patch moves a rigid beam along its axis by the same everywhere, without any gap."""
    changes = {"mesh": {"dimension": dimension, "support_size": 4.0e-3}, "contact": {"points": [0.0, 0.05]}}
    changes["contact"]["friction"] = {"coefficient": 0.3}
    contact = beam_model(changes).system.contact
    directions = dimension - 1
    assert contact.tangents is not None
    assert contact.tangents.shape == (4 * directions, contact.interface.size)
    totals = np.asarray(contact.tangents.sum(axis=1)).reshape(4, directions)
    np.testing.assert_allclose(totals, 1.0, rtol=1e-12)  # a translation by (1, 1): all components are 1
