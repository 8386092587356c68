"""Forces of joints: statics by hand, the balance of momentum in every step of an impact, models against each other."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from mpi4py import MPI

import gapbeam
import gapbeam.solver.march.simulation
from gapbeam.solver.assembly.assembled_system import model_motions
from gapbeam.solver.case.analysis_table import NAMES, unit_motions
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import VALUE
from tests.verification.test_joints_and_masses import AREA, DENSITY, HEAD, LENGTH, ROOT, SHEAR, TIP, joint, tables
from tests.verification.test_joints_and_masses import BENDING as STIFFNESS

GRAVITY = 9.81  # m/s^2
WEIGHT = DENSITY * AREA * GRAVITY  # N/m
SOLID = {"dimension": 3, "size": 0.03, "support_size": 0.02, "cells_through_thickness": 2, "cells_across_width": 2}
MODELS: dict[str, dict[str, Any]] = {
    "full slice": {"model": {"type": "full"}},
    "reduced slice": {"model": {"type": "reduced"}},
    "beam": {"model": {"type": "beam", "elements": 20}},
    "reduced solid": {"model": {"type": "reduced"}, "mesh": SOLID},
}
RUN: dict[str, Any] = {"time": {"end": 2.0e-4, "step": 1.0e-4}, "output": {"errors": "none"}}


def history(folder: Path, *joints: dict[str, Any], **more: Any) -> xr.Dataset:
    """Return the history of a beam with joints under its weight."""
    case = gapbeam.read_case(tables(joint=list(joints), **({"load": [{"type": "gravity"}]} | RUN | more)))
    outcome = gapbeam.run(case, {"restraint.axial": 1e-4}, folder)
    assert outcome.exit_status == 0, outcome.message
    return gapbeam.open_results(folder).history


@pytest.mark.parametrize("name", MODELS)
def test_cantilever_under_weight(name: str, tmp_path: Path) -> None:
    """The root carries the weight w L and the moment w L^2 / 2, at rest and a little later."""
    found = history(tmp_path / "run", joint(ROOT, "clamped"), **MODELS[name])
    assert found["joint_force"].dims == ("time", "joint", "translation")
    force, moment = found["joint_force"].sel(joint="root"), found["joint_moment"].sel(joint="root", turn="rotation")
    assert force.sel(translation="vertical").values == pytest.approx(WEIGHT * LENGTH, rel=1e-6)
    assert moment.values == pytest.approx(0.5 * WEIGHT * LENGTH**2, rel=1e-4)
    if name != "beam":
        assert np.abs(force.sel(translation="axial")).max() < 1e-6 * WEIGHT * LENGTH


@pytest.mark.parametrize("name", MODELS)
def test_propped_cantilever_under_weight(name: str, tmp_path: Path) -> None:
    """The prop takes 3/8 of the weight and what shear adds; what it leaves, and the moment of both, is at the root."""
    found = history(tmp_path / "run", joint(ROOT, "clamped"), joint(TIP, "pinned"), **MODELS[name])
    sag = WEIGHT * LENGTH**4 / (8.0 * STIFFNESS) + WEIGHT * LENGTH**2 / (2.0 * SHEAR)
    prop = sag / (LENGTH**3 / (3.0 * STIFFNESS) + LENGTH / SHEAR)
    assert prop == pytest.approx(0.375 * WEIGHT * LENGTH, rel=1e-3)
    vertical = found["joint_force"].sel(translation="vertical").values[0]
    assert vertical == pytest.approx([WEIGHT * LENGTH - prop, prop], rel=2e-4)
    moment = 0.5 * WEIGHT * LENGTH**2 - prop * LENGTH
    assert found["joint_moment"].sel(turn="rotation").values[0] == pytest.approx([moment, 0.0], rel=1e-3, abs=1e-12)


@pytest.mark.parametrize("kind", ["pinned", "elastic"])
def test_a_rigid_beam_stands_on_its_joints(kind: str, tmp_path: Path) -> None:
    """Two joints share the weight of beam and head by their levers, on springs as on pins."""
    more = {"stiffness": {"axial": 1e6, "vertical": 2e5}} if kind == "elastic" else {}
    head = {"name": "head", "point": 0.45, "mass": HEAD}
    ends = joint(ROOT, kind, **more), joint(TIP, "elastic", stiffness={"vertical": 1e5})
    found = history(tmp_path / "run", *ends, mass=[head], model={"type": "rigid"})
    right = 0.5 * WEIGHT * LENGTH + HEAD * GRAVITY * 0.45 / LENGTH
    left = WEIGHT * LENGTH + HEAD * GRAVITY - right
    assert found["joint_force"].sel(translation="vertical").values[0] == pytest.approx([left, right], rel=1e-7)


MOVING: dict[str, Any] = {
    "support": [{"name": "stop", "from": 0.30, "to": 0.32, "clearance": 1.0e-4, "region": "stop"}],
    "mass": [{"name": "head", "point": TIP, "mass": HEAD, "rotary_inertia": 1e-4}],
    "damping": {"mass": 3.0, "stiffness": 2e-6},
    "restraint": {"axial": 1e-6},  # N/m, the springs on the face of the stop: nothing beside the joints
    "load": [{"type": "gravity"}, {"type": "base_motion", "name": "shaker", "amplitude": 60.0, "frequency": 80.0}],
    "probe": [{"name": "tip", "point": LENGTH}],
    "time": {"end": 0.02, "step": 5.0e-5, "scheme": {"type": "implicit-midpoint"}},
    "gates": {"accept_energy_growth": True},
}


@pytest.mark.parametrize("name", ["full slice", "reduced slice", "modal damping", "beam", "rigid"])
def test_forces_balance_the_momentum_in_every_step(name: str) -> None:
    """What joints, stop, weight and frame do in a step is the change of momentum and its moment, to round-off."""
    more = dict(MODELS.get(name, {"model": {"type": "rigid" if name == "rigid" else "reduced"}}))
    damping = {"damping": MOVING["damping"] | {"ratio": 0.02}} if name == "modal damping" else {}
    joints = [
        joint(ROOT, "pinned" if name == "rigid" else "clamped"),
        joint(TIP, "elastic", stiffness={"vertical": 3e3}),
    ]
    joints[1]["damping"] = {"vertical": 5.0}
    case = gapbeam.read_case(tables(joint=joints, **(MOVING | more | damping)))
    model = build_model(case, MPI.COMM_SELF)
    simulation, system, operators = Simulation(model), model.system, model.system.operators
    reactions, contact = system.reactions, system.contact
    assert reactions is not None
    vertical = next(
        row for one, row in _attached(model) if one.attachment.mass == HEAD and one.motion.name == "vertical"
    )
    turning = next(
        row for one, row in _attached(model) if one.attachment.mass == 1e-4 and one.motion.name == "rotation"
    )
    rigid = model.body.rigid[[NAMES.index("vertical"), NAMES.index("rotation")]]
    momenta = rigid + np.array([HEAD * vertical, HEAD * TIP * vertical + 1e-4 * turning])
    beam = DENSITY * AREA * LENGTH
    masses = [beam + HEAD, 0.5 * beam * LENGTH + HEAD * TIP]
    motions = ("axial", "vertical", "rotation") if name != "beam" else ("vertical", "rotation")
    pressed = largest = 0.0
    worst = [0.0, 0.0]
    for step in islice(simulation.march(simulation.seat().state), 400):
        u, v = (0.5 * (getattr(step.old, name)[VALUE] + getattr(step.new, name)[VALUE]) for name in ("u", "v"))
        forces = contact.weights * step.stage.pressure
        of_joints = reactions.total(
            u[None], v[None], step.stage.load_factors[None], reactions.of_contact(forces, None)[None], operators
        ).reshape(2, len(motions))
        lift, turn = of_joints[:, motions.index("vertical")], of_joints[:, motions.index("rotation")]
        push = GRAVITY + step.stage.load_factors[1]
        changes = operators.sum(momenta @ (step.new.v - step.old.v)[VALUE]) / step.size
        lost = 3.0 * operators.sum(rigid @ v)  # Rayleigh damping by the mass
        if name == "modal damping":
            squares, shapes = operators.modes
            lost += momenta @ (shapes @ (2.0 * 0.02 * np.sqrt(squares) * (shapes.T @ operators.apply_mass(v))))
        done = [
            np.sum(lift) + np.sum(forces) - masses[0] * push,
            np.sum(turn) + lift @ [ROOT, TIP] + forces @ contact.positions[:, 0] - masses[1] * push,
        ]
        worst = [max(one, abs(two)) for one, two in zip(worst, np.array(done) - lost - changes, strict=True)]
        pressed, largest = max(pressed, float(np.sum(forces))), max(largest, float(np.abs(of_joints).max()))
    assert pressed > 20.0
    assert largest > 10.0
    assert worst == pytest.approx([0.0, 0.0], abs=1e-7 * (pressed + largest))


def _attached(model: Any) -> list[Any]:
    from gapbeam.solver.assembly.assembled_system import attached_rows

    return attached_rows(model.case, model.body.patterns)


CONTACT_ALL = {"type": "reduced", "contact": "all", "modes": 40}


def moving(folder: Path, **more: Any) -> xr.Dataset:
    """Return the history of the moving beam, whose far end is on a spring."""
    ends = joint(ROOT, "clamped"), joint(TIP, "elastic", stiffness={"vertical": 3e3}, damping={"vertical": 5.0})
    return history(folder, *ends, **(MOVING | {"time": {"end": 0.008, "step": 5.0e-5}, "output": RUN["output"]} | more))


@pytest.mark.slow(minutes=0.1)
def test_friction_is_in_the_forces_of_joints(tmp_path: Path) -> None:
    """A rubbing stop pulls a clamp along: the residual of a reduced model is the stiff spring of a full one."""
    rubbing = {"contact": {"friction": {"coefficient": 0.4}}, "support": MOVING["support"]}
    full, reduced = (
        moving(tmp_path / str(number), model=model, **rubbing)
        for number, model in enumerate(({"type": "full"}, CONTACT_ALL))
    )
    for name in ("joint_force", "joint_moment"):
        found, wanted = reduced[name].values, full[name].values
        size = np.abs(wanted).max(axis=0)
        assert np.all(np.sqrt(np.mean((found - wanted) ** 2, axis=0)) <= 0.02 * size + 1e-9)
    along = full["joint_force"].sel(joint="root", translation="axial")
    assert float(np.abs(along).max()) > 1.0


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("scheme", ["discrete-gradient", "generalized-alpha", "implicit-midpoint"])
def test_the_compiled_march_records_the_same_forces(
    scheme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Step by step and compiled, in the same records; those of the start too. The last is a tube that rubs."""
    tube = {"model": ROUND} | {key: value for key, value in TUBE.items() if key != "time"}
    more = {"model": {"type": "reduced"}} if scheme != "implicit-midpoint" else tube
    more = more | {"time": {"end": 0.004, "step": 5.0e-5, "scheme": {"type": scheme}}}
    compiled = moving(tmp_path / "compiled", **more)
    monkeypatch.setattr(gapbeam.solver.march.simulation, "why_not_compiled", lambda _plan: "asked for by a test")
    steps = moving(tmp_path / "steps", **more)
    assert float(compiled["contact_force"].max()) > 5.0
    for name in ("joint_force", "joint_moment"):
        size = float(np.abs(steps[name]).max())
        np.testing.assert_allclose(compiled[name].values, steps[name].values, rtol=0.0, atol=1e-6 * size)


TUBE: dict[str, Any] = {
    "beam": {"length": LENGTH, "section": "round", "thickness": 0.012},
    "mesh": {"dimension": 3, "size": 0.02, "cells_through_thickness": 2},
    "support": [
        {"name": "hole", "from": 0.50, "to": 0.54, "clearance": 1.0e-4, "region": {"type": "hole", "contact": "circle"}}
    ],
    "contact": {"stiffness": 1.0e11, "friction": {"coefficient": 0.3}},
    "restraint": {"axial": 1e-6},
    "load": [
        {"type": "gravity"},
        {"type": "base_motion", "name": "up", "amplitude": 60.0, "frequency": 80.0},
        {"type": "base_motion", "name": "aside", "amplitude": 40.0, "frequency": 95.0, "direction": [0.3, 1.0, 0.0]},
    ],
    "time": {"end": 0.02, "step": 2.0e-5, "scheme": {"type": "implicit-midpoint"}},
    "gates": {"accept_energy_growth": True},
}
AREA_OF_TUBE = 0.25 * np.pi * 0.012**2
FRAME = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), np.array([0.3, 1.0, 0.0]) / np.hypot(0.3, 1.0)
ROUND = {"type": "beam", "elements": 10, "motions": ["axial", "bending", "lateral", "torsion"]}


@pytest.mark.parametrize("kind", ["pinned", "clamped", "guided"])
def test_forces_balance_the_momenta_of_a_tube_that_rubs_in_a_hole(kind: str) -> None:
    """Joints, hole, friction and base motion make the change of all six momenta in every step, to round-off."""
    ends = joint(ROOT, kind), joint(TIP, "elastic", stiffness={"lateral": 2e3, "twist": 10.0})
    case = gapbeam.read_case(tables(joint=list(ends), **(TUBE | {"model": ROUND})))
    model = build_model(case, MPI.COMM_SELF)
    simulation, system, operators = Simulation(model), model.system, model.system.operators
    reactions, contact, names = system.reactions, system.contact, model_motions(case)
    assert reactions is not None
    circles, rigid, units = contact.circles, model.body.rigid, unit_motions()
    mass, x = DENSITY * AREA_OF_TUBE * LENGTH, contact.positions[circles.points, 0]
    sections = np.array([[one.section(point)[name] for point in (ROOT, TIP) for name in names] for one in units])
    worst, rubbed, largest = np.zeros(6), 0.0, 0.0
    for step in islice(simulation.march(simulation.seat().state), 400):
        u, v = (0.5 * (getattr(step.old, name)[VALUE] + getattr(step.new, name)[VALUE]) for name in ("u", "v"))
        forces, friction = contact.weights * step.stage.pressure, contact.weights[:, None] * step.stage.traction
        opening = step.stage.opening
        across = opening / np.hypot(*opening.T)[:, None]
        turned = circles.forces(opening, forces, None) + circles.forces(across, np.zeros(len(x)), friction)
        of_joints = reactions.total(
            u[None], v[None], step.stage.load_factors[None],
            reactions.of_contact(forces, friction, turned.reshape(-1))[None], operators,
        )[0].reshape(-1)  # fmt: skip
        sideways = np.column_stack([-across[:, 1], across[:, 0]])
        at = np.column_stack([x, -circles.radii[:, None] * across])
        push = np.column_stack([friction[:, 0], friction[:, 1:] * sideways])
        lines = np.column_stack([0.0 * x, forces[:, None] * opening])
        axis = np.column_stack([x, np.zeros((len(x), 2))])
        frame = sum(factor * np.array(way) for factor, way in zip(step.stage.load_factors, FRAME, strict=True))
        done = sections @ of_joints + [
            np.sum(push * one.at(at)) + np.sum(lines * one.at(axis)) - mass * frame @ one.at([[LENGTH / 2, 0, 0]])[0]
            for one in units
        ]
        changes = rigid @ (step.new.v - step.old.v)[VALUE] / step.size
        kept = [NAMES.index(name) for name in names]
        worst[kept] = np.maximum(worst, np.abs(done - changes))[kept]
        rubbed, largest = max(rubbed, np.abs(friction).max(axis=0).min()), max(largest, np.abs(of_joints).max())
    assert rubbed > 1.0
    assert worst == pytest.approx(np.zeros(6), abs=1e-7 * largest)
