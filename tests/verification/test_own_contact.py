"""Supports with a stiffness, damping and friction of their own: a rigid bar on two springs, by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import gapbeam
from gapbeam.solver.models.body import body_key
from gapbeam.solver.run.output.run_summary import describe_seat
from tests.shared.command import DEMO

LENGTH, THICKNESS, WIDTH, DENSITY, GRAVITY = 0.5, 0.01, 0.02, 7850.0, 9.81
MASS = DENSITY * LENGTH * THICKNESS * WIDTH
INERTIA = MASS * (LENGTH**2 + THICKNESS**2) / 12.0
WIDE = 1.0e-3  # m: the length of a support that stands for a point
PLACES = np.array([0.1, 0.4])
SPRINGS = np.array([4.0e4, 1.0e4])  # N/m
DAMPERS = np.array([3.0, 0.5])  # N s/m
AREA = WIDE * WIDTH


def stops(**own: Any) -> list[dict[str, Any]]:
    """Return two narrow stops below the bar, with figures of their own, one of each per stop."""
    return [
        {
            "name": name,
            "from": x - 0.5 * WIDE,
            "to": x + 0.5 * WIDE,
            "clearance": 0.0,
            "region": "stop",
            **{key: values[number] for key, values in own.items()},
        }
        for number, (name, x) in enumerate(zip(("left", "right"), PLACES, strict=True))
    ]


def tables(support: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Return a rigid steel bar under its weight."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": DENSITY},
        "support": support,
        "mesh": {"size": 0.02, "support_size": 0.5e-3, "cells_through_thickness": 1},
        "model": {"type": "rigid"},
        "probe": [{"name": "start", "point": 0.0}, {"name": "tip", "point": LENGTH}],
        "load": [{"type": "gravity", "acceleration": GRAVITY}],
        "time": {"end": 0.05, "step": 2.0e-5},
        "output": {"fields_interval": 0.05},
        **more,
    }


SOFT = {"stiffness": SPRINGS / AREA, "damping": DAMPERS / AREA}


def weights() -> np.ndarray:
    """Return the reactions of the two stops, N."""
    right = MASS * GRAVITY * (0.5 * LENGTH - PLACES[0]) / (PLACES[1] - PLACES[0])
    return np.array([MASS * GRAVITY - right, right])


def test_each_support_sinks_by_its_own_stiffness() -> None:
    """The bar sinks by R / K at each stop, and its ends by the lever."""
    simulation = gapbeam.model(gapbeam.read_case(tables(stops(stiffness=SPRINGS / AREA))))
    found = describe_seat(simulation.seat(), simulation.model)
    sunk = -weights() / SPRINGS
    slope = (sunk[1] - sunk[0]) / (PLACES[1] - PLACES[0])
    ends = sunk[0] + slope * (np.array([0.0, LENGTH]) - PLACES[0])
    assert [found["left_below_force"], found["right_below_force"]] == pytest.approx(weights(), rel=1e-4)
    assert [found["probes"]["start"][-1], found["probes"]["tip"][-1]] == pytest.approx(ends, rel=1e-4, abs=1e-8)


@pytest.mark.parametrize("scheme", ["discrete-gradient", "newmark", "generalized-alpha"])
def test_bar_on_two_springs_and_dampers(scheme: str, tmp_path: Path) -> None:
    """Two DOFs, different springs and dampers: M a + C v + K x = 0 about the seat, by the exponential of its matrix."""
    motion = {"velocity": 0.002, "spin": 0.005, "point": 0.0}
    case = tables(
        stops(**SOFT), analysis={"type": "transient", "motion": motion},
        time={"end": 0.05, "step": 2.0e-5, "scheme": scheme},
    )  # fmt: skip
    done = gapbeam.run(case, output=tmp_path / "run")
    assert done.exit_status == 0, done.message
    tip = gapbeam.open_results(tmp_path / "run").history["displacement"].sel(probe="tip", component="y")
    arms = PLACES - 0.5 * LENGTH
    rows = np.stack([np.ones(2), arms], axis=1)
    inertia = np.diag([MASS, INERTIA])
    stiffness, damping = (rows.T @ np.diag(values) @ rows for values in (SPRINGS, DAMPERS))
    matrix = np.block([
        [np.zeros((2, 2)), np.eye(2)],
        [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, damping)],
    ])  # fmt: skip
    start = np.array([0.0, 0.0, motion["velocity"] + 0.5 * LENGTH * motion["spin"], motion["spin"]])
    times = tip["time"].values[:: len(tip) // 50]
    expected = np.array([np.array([1.0, 0.5 * LENGTH, 0.0, 0.0]) @ expm(matrix * t) @ start for t in times])
    found = tip.sel(time=times).values - float(tip[0])
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.max(np.abs(expected)))


def test_supports_without_own_figures_have_those_of_contact() -> None:
    """One support brings its stiffness and damping; the law of the other, and what is said of both."""
    support = stops(**SOFT)
    for key in SOFT:
        del support[1][key]
    model = gapbeam.model(gapbeam.read_case(tables(support, contact={"stiffness": 1.0e12, "damping": 7.0}))).model
    faces = model.system.contact.faces
    table = model.law.table(len(faces))
    np.testing.assert_array_equal(table.stiffness, np.where(faces == 0, SPRINGS[0] / AREA, 1.0e12))
    np.testing.assert_array_equal(table.coefficient, np.where(faces == 0, DAMPERS[0] / AREA, 7.0))
    keys = {default.key: default.value for default in model.defaults}
    assert keys["support.left.stiffness"] == SPRINGS[0] / AREA
    assert keys["contact.stiffness"] == 1.0e12
    assert "support.right.stiffness" not in keys


def test_a_restitution_asks_for_damping_by_the_stiffness_of_each_support() -> None:
    """From c = 2 zeta sqrt(K m), a support that is a hundred times softer has a tenth of the damping."""
    law = {"type": "kelvin-voigt", "restitution": 0.6}
    case = tables(stops(stiffness=[1.0e12, 1.0e10]), contact={"law": law})
    model = gapbeam.model(gapbeam.read_case(case)).model
    keys = {default.key: default.value for default in model.defaults}
    assert keys["support.left.damping"] == pytest.approx(10.0 * keys["support.right.damping"], rel=1e-12)
    assert "contact.stiffness" not in keys


def test_each_support_rubs_with_its_own_friction() -> None:
    """A bar that is pulled along its supports: the traction is mu of each support times its pressure."""
    coefficients = {"left": 0.05, "right": 0.4}
    pull = {"amplitude": 50.0, "frequency": 50.0, "point": LENGTH}
    case = tables(
        stops(stiffness=SPRINGS / AREA, friction=list(coefficients.values())),
        model={"type": "full"},
        contact={"friction": {"coefficient": 0.2, "slip_velocity": 1.0e-7}},
        load=[
            {"type": "gravity", "acceleration": GRAVITY},
            {"type": "harmonic_force", "direction": [1.0, 0.0], **pull},
        ],
        time={"end": 2.0e-3, "step": 1.0e-4},
    )
    simulation = gapbeam.model(gapbeam.read_case(case))
    *_, last = simulation.march(simulation.start(simulation.seat()))
    contact, stage = simulation.model.system.contact, last.stage
    assert stage.traction is not None
    for face, name in enumerate(("left", "right")):
        pressed = (contact.faces == face) & (stage.pressure > 0.0)
        ratio = np.linalg.norm(stage.traction[pressed], axis=1) / stage.pressure[pressed]
        np.testing.assert_allclose(ratio, coefficients[name], rtol=1e-3)


def test_own_figures_are_cheap_to_change() -> None:
    """Cases that differ in them alone share their body, as for the keys of [contact]."""
    one, other = (gapbeam.read_case(tables(support)) for support in (stops(), stops(**SOFT)))
    assert body_key(one) == body_key(other)
    assert one != other


def test_a_soft_stop_is_no_deep_penetration(tmp_path: Path) -> None:
    """A support that gives way by design is not warned of as penetration; the penalty of others is."""
    support = stops(stiffness=SPRINGS / AREA)
    for one in support:
        one["clearance"] = 1.0e-5
    done = gapbeam.run(tables(support, time={"end": 1.0e-3, "step": 2.0e-5}), output=tmp_path / "own")
    assert not [line for line in done.summary["warnings"] if "penetration" in line]
    assert done.summary["model"]["supports"][0]["stiffness"] == SPRINGS[0] / AREA
    shared = tables(stops(), time={"end": 1.0e-3, "step": 2.0e-5}, contact={"stiffness": SPRINGS[0] / AREA})
    for one in shared["support"]:
        one["clearance"] = 1.0e-5
    done = gapbeam.run(shared, output=tmp_path / "shared")
    assert [line for line in done.summary["warnings"] if "penetration" in line]


def test_the_summary_has_the_friction_of_each_face(tmp_path: Path) -> None:
    """One coefficient by face, where supports bring their own."""
    first = '{name = "a", from = 0.0, to = 0.02, clearance = 1e-4, friction = 0.0}'
    last = '{name = "b", from = 0.45, to = 0.48, clearance = 1e-4}'
    keys = (f"support=[{first}, {last}]", "contact.friction={coefficient = 0.3}", "time.end=2e-3", "output.errors=none")
    outcome = gapbeam.run(DEMO, keys, tmp_path / "run")
    assert outcome.exit_status == 0
    found = gapbeam.open_results(tmp_path / "run").summary["friction"]["coefficient"]
    assert found == {"a_below": 0.0, "a_above": 0.0, "b_below": 0.3, "b_above": 0.3}
