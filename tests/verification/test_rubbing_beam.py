"""Friction on beam models: rolling and sliding by hand, momentum, and the same motion as the solid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.beam_body import BeamOfParts
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, Step, imaged

pytestmark = pytest.mark.versions
RADIUS, LENGTH, MU, GRAVITY = 0.02, 0.1, 0.3, 9.81
MASS = 7850.0 * pi * RADIUS**2 * LENGTH
SPEED, STEP = 0.005, 1.0e-5  # m/s, s
FLOOR = {"type": "polygon", "walls": [0.0]}
WEIGHT = {"type": "gravity"}


def roll(**more: Any) -> Model:
    """Return the model of a short steel cylinder on a floor under its middle."""
    tables = {
        "beam": {"length": LENGTH, "thickness": 2.0 * RADIUS, "width": 2.0 * RADIUS, "section": "round"},
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "floor", "from": 0.04, "to": 0.06, "clearance": 1.0e-4, "region": FLOOR}],
        "restraint": {"axial": 10.0, "lateral": 10.0},
        "contact": {
            "stiffness": 5.0e8,
            "quadrature_degree": 2,
            "friction": {"coefficient": MU, "slip_velocity": 1.0e-6},
        },
        "mesh": {"dimension": 3, "size": 0.02, "support_size": 0.01},
        "model": {"type": "beam", "elements": 10},
        "load": [WEIGHT],
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 0.002, "step": STEP, "scheme": "implicit-midpoint"},
    }
    return build_model(gapbeam.read_case(tables | more), MPI.COMM_SELF)


class Whole:
    """Mean velocity sideways and along, and mean rate of turning, of a beam as a whole."""

    def __init__(self, model: Model) -> None:
        beam = BeamOfParts.of_case(model.case, 10)
        twist = np.zeros(beam.size)
        twist[-beam.parts[-1].size :] = 1.0
        self.motions = [beam.uniform(np.array([0.0, 1.0, 0.0])), beam.uniform(np.array([1.0, 0.0, 0.0])), twist]
        self._images = [model.body.operators.apply_mass(motion) for motion in self.motions]
        self.inertias = [float(a @ b) for a, b in zip(self.motions, self._images, strict=True)]

    def of(self, v: Array) -> tuple[float, float, float]:
        """Return both velocities, m/s, and the rate, rad/s, of velocities v, (n,)."""
        sideways, along, turning = (float(a @ v) / b for a, b in zip(self._images, self.inertias, strict=True))
        return sideways, along, turning


def started(model: Model, velocity: Array) -> Iterator[Step]:
    """March from the seat with a velocity."""
    simulation = Simulation(model)
    seat = simulation.seat().state
    yield from simulation.march(replace(seat, v=imaged(model.system.operators, velocity)))


def friction(model: Model, step: Step) -> Array:
    """Return the friction force on the beam, along it and around it, (2,), N."""
    assert step.stage.traction is not None
    return np.asarray((model.system.contact.weights[:, None] * step.stage.traction).sum(axis=0))


def test_a_cylinder_that_slides_ends_rolling() -> None:
    """At 2/3 of its speed (Coriolis): friction mu N takes momentum and spins it up, m v R + I w is kept, to 1 %."""
    model = roll()
    assert why_not_compiled(Simulation(model).plan) is None
    whole = Whole(model)
    assert whole.inertias[0] == pytest.approx(MASS)
    assert whole.inertias[2] == pytest.approx(0.5 * MASS * RADIUS**2)
    speeds, rates = [], []
    for number, step in enumerate(started(model, SPEED * whole.motions[0])):
        sideways, _, turning = whole.of(step.new.v[VALUE])
        speeds.append(sideways / SPEED)
        rates.append(-turning * RADIUS / SPEED)
        if number < 40:  # sliding, until v0 / (3 mu g)
            normal = float(model.system.contact.weights @ step.stage.pressure)
            assert abs(friction(model, step)[1]) == pytest.approx(MU * normal, rel=1e-4)
            assert rates[-1] == pytest.approx(2.0 * (1.0 - speeds[-1]), rel=0.01)
    slid = 1.0 - MU * GRAVITY * STEP * np.arange(1, 41) / SPEED
    assert speeds[:40] == pytest.approx(slid, abs=0.005)
    rolling = slice(120, None)
    assert np.mean(speeds[rolling]) == pytest.approx(2.0 / 3.0, rel=0.01)
    assert np.mean(rates[rolling]) == pytest.approx(2.0 / 3.0, rel=0.01)


@pytest.mark.parametrize("share", [0.6, 2.0], ids=["rolls", "slips"])
def test_a_cylinder_that_is_pushed(share: float) -> None:
    """A force F through the axis: a = 2 F / 3 m as long as F / 3 < mu m g, then a = F / m - mu g, R w' = 2 mu g."""
    limit, turn = 3.0 * MU * MASS * GRAVITY, 2.0 * pi * 100.0
    push = {"type": "harmonic_force", "name": "push", "point": 0.05, "amplitude": share * limit,
            "frequency": 100.0, "direction": [0.0, 1.0, 0.0]}  # fmt: skip
    model = roll(load=[WEIGHT, push])
    whole = Whole(model)
    *_, last = Simulation(model).march()
    sideways, _, turning = whole.of(last.new.v[VALUE])
    rolling = np.arcsin(min(1.0, 1.0 / share)) / turn if share > 1.0 else last.new.time
    slipping = last.new.time - rolling
    pushed = share * limit / (MASS * turn)
    rolled = 2.0 / 3.0 * pushed * (1.0 - np.cos(turn * rolling))
    slid = pushed * (np.cos(turn * rolling) - np.cos(turn * last.new.time)) - MU * GRAVITY * slipping
    assert sideways == pytest.approx(rolled + slid, rel=0.02)
    assert -turning * RADIUS == pytest.approx(rolled + 2.0 * MU * GRAVITY * slipping, rel=0.02)


def test_a_cylinder_that_slides_along_is_slowed_by_friction() -> None:
    """Along its axis it loses mu g in velocity, and the impulse of friction is what its momentum loses, to 1e-6."""
    model = roll(restraint={"axial": 1.0, "lateral": 10.0})
    whole, lost = Whole(model), 0.0
    steps = list(started(model, SPEED * whole.motions[1]))[:100]
    for step in steps:
        lost -= friction(model, step)[0] * STEP
    _, along, turning = whole.of(steps[-1].new.v[VALUE])
    assert along == pytest.approx(SPEED - MU * GRAVITY * 100 * STEP, abs=0.01 * SPEED)
    assert MASS * (SPEED - along) == pytest.approx(lost, rel=1e-5)
    assert abs(turning) * RADIUS < 1e-3 * SPEED


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("region", ["hole", "slot"])
def test_the_surface_moves_as_that_of_the_solid(region: str) -> None:
    """Gaps and slip of beam and mesh agree at every contact point: moved along, sideways, up, pitched and twisted."""
    round_beam = {"length": LENGTH, "thickness": 2.0 * RADIUS, "width": 2.0 * RADIUS, "section": "round"}
    beam = round_beam if region == "hole" else round_beam | {"section": "rectangle"}
    support = [{"name": "floor", "from": 0.04, "to": 0.06, "clearance": 1.0e-4, "region": region}]
    push = {"type": "harmonic_force", "name": "push", "point": LENGTH, "amplitude": 1.0, "frequency": 9.0,
            "direction": [0.0, 1.0, 0.0]}  # fmt: skip
    small, full = (
        roll(beam=beam, support=support, load=[push], model=kind, contact={"friction": {"coefficient": MU}})
        for kind in ({"type": "beam", "elements": 10}, {"type": "full"})
    )
    at_all = small.case.model_copy(update={"model": BeamModel(type="beam", elements=10)})
    small = build_model(at_all, MPI.COMM_SELF)  # with the points of the mesh, and not at stations
    parts = BeamOfParts.of_case(small.case, 10)
    assert parts.motions == ("bending", "lateral", "axial", "torsion")
    whole = Whole(small)
    expansion = parts.displacement(full.space.tabulate_dof_coordinates())
    for motion in (*whole.motions, *parts.rigid_motions()):
        on_mesh = np.asarray(expansion @ motion)
        solid, rod = full.system.contact, small.system.contact
        traced = solid.interface.trace(on_mesh, full.system.operators)
        if region == "hole":
            assert rod.positions == pytest.approx(solid.positions, abs=1e-15)
            assert solid.slip(traced) == pytest.approx(rod.slip(motion), abs=1e-12 * np.abs(motion).max())
            assert solid.gap_matrix @ traced == pytest.approx(rod.gap_matrix @ motion, abs=1e-12 * np.abs(motion).max())
        else:  # a beam keeps few points across flat faces
            forces = solid.weights @ solid.slip(traced), rod.weights @ rod.slip(motion)
            assert forces[1] == pytest.approx(forces[0], abs=1e-12)


SLICE: dict[str, Any] = {
    "beam": {"length": 0.51, "thickness": 0.012, "width": 0.02},
    "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
    "support": {"length": 0.05, "clearance": 1.0e-4},
    "damping": {"frequencies": [40.0, 300.0], "ratios": [0.02, 0.02]},
    "contact": {"stiffness": 2.0e10, "friction": {"coefficient": 0.3, "slip_velocity": 1.0e-4}},
    "mesh": {"size": 0.012, "cells_through_thickness": 2},
    "load": [
        WEIGHT,
        {"type": "harmonic_force", "name": "pull", "point": 0.51, "amplitude": 15.0, "frequency": 40.0,
         "direction": [1.0, 0.3]},
    ],
    "probe": [{"name": "tip", "point": 0.51}],
    "time": {"end": 0.05, "step": 1.0e-4},
}  # fmt: skip


@pytest.mark.slow(minutes=0.1)
def test_a_slice_that_sticks_and_slips_moves_as_its_solid() -> None:
    """A beam between base and gland is pulled to and fro, and slips: its tip moves as in the mesh, to 3 %."""
    found = {}
    for kind in ({"type": "beam"}, {"type": "reduced", "contact": "all"}):
        model = build_model(gapbeam.read_case(SLICE | {"model": kind}), MPI.COMM_SELF)
        tip = model.probes["tip"]
        states: list[State] = [step.new for step in Simulation(model).march()]
        found[kind["type"]] = np.array([tip.evaluate(state.u[VALUE], model.system.operators) for state in states])
    for axis in range(2):
        beam, solid = found["beam"][:, axis], found["reduced"][:, axis]
        assert np.ptp(solid) > 1e-6
        assert np.sqrt(np.mean((beam - solid) ** 2)) < 0.03 * np.ptp(solid), axis
