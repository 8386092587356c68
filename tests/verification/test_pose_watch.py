"""Rotation, strain, stress and travel of a pose: exact fields on every model, and the sag of a cantilever by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.diagnostics.assumption import (
    LOOKS,
    ROTATION,
    STRAIN,
    STRESS,
    TRAVEL,
    PoseWatch,
)
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.pose_rows import watch_of
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.models import BEAM, COARSE, SOLID, beam_model, seat_of

CURVATURE = 0.03  # 1/m
YOUNG, NU = BEAM["material"]["young_modulus"], BEAM["material"]["poisson_ratio"]
LENGTH, THICKNESS = BEAM["beam"]["length"], BEAM["beam"]["thickness"]
MODELS: dict[str, Mapping[str, Any]] = {
    "full": {"type": "full"},
    "reduced": {"type": "reduced", "modes": 8, "shapes": 3},
    "beam": {"type": "beam", "elements": 20},
}


def watched(model: Model, u: Array) -> PoseWatch:
    """Return a watch that has looked at one pose."""
    watch = watch_of(model.case, model)
    watch.see(np.zeros(1), u[None], np.zeros(1))
    return watch


def field_of(model: Model, bent: bool) -> Array:
    """Return the DOFs of pure bending (exact in elasticity), or of a rotation and a motion along x, of a full model."""
    places = model.space.tabulate_dof_coordinates()[: model.space.dofmap.index_map.size_local]
    dimension = model.space.mesh.geometry.dim
    x, y, z = places[:, 0], places[:, 1] if dimension == 3 else 0.0 * places[:, 0], places[:, dimension - 1]
    if bent:
        up = 0.5 * CURVATURE * (x**2 + NU * z**2 - NU * y**2)
        motion = [-CURVATURE * x * z, CURVATURE * NU * y * z, up]
    else:
        motion = [-CURVATURE * z + 0.02, 0.0 * x, CURVATURE * x]
    chosen = motion if dimension == 3 else [motion[0], motion[2]]
    return np.stack(chosen, axis=1).reshape(-1)


@pytest.mark.parametrize("mesh", [COARSE, SOLID], ids=["plane", "solid"])
def test_exact_fields(mesh: Mapping[str, Any]) -> None:
    """Pure bending: rotation k x, strain k t/2 (with its cross strains), stress E k t/2; a rotation strains nothing."""
    model = beam_model({"mesh": mesh})
    closest = watched(model, field_of(model, bent=True)).closest
    across = (1.0 + 2.0 * NU**2) ** 0.5 if mesh is SOLID else (1.0 + NU**2) ** 0.5
    strain = 0.5 * CURVATURE * THICKNESS
    farthest = closest[ROTATION, 2]
    assert farthest > LENGTH - 0.07
    # anticlastic bending turns the sides as well, by nu k y at most
    assert closest[ROTATION, 0] == pytest.approx(CURVATURE * farthest, rel=1e-3)
    if mesh is not SOLID:
        strain_with_plane = (across**2 + NU**2) ** 0.5
        assert closest[STRAIN, 0] == pytest.approx(strain * strain_with_plane, rel=1e-6)
    else:
        assert closest[STRAIN, 0] == pytest.approx(strain * across, rel=1e-6)
    assert closest[STRESS, 0] == pytest.approx(YOUNG * strain, rel=1e-6)
    turned = watched(model, field_of(model, bent=False)).closest
    assert turned[ROTATION, 0] == pytest.approx(CURVATURE, rel=1e-9)
    assert turned[STRAIN, 0] < 1e-12
    assert turned[TRAVEL, 0] == pytest.approx(0.02 / BEAM["support"]["length"], rel=1e-9)


@pytest.mark.parametrize("kind", MODELS)
def test_sag_of_a_cantilever(kind: str) -> None:
    """Under 50 g the overhang bends as Bernoulli has it: stress at the edge of the support, turn of the free end."""
    gravity = {"type": "gravity", "acceleration": 490.5}
    model = beam_model({"model": MODELS[kind]}, (gravity,))
    found = watched(model, seat_of(model).state.u[VALUE]).closest
    unit = BEAM["material"]["density"] * 490.5 / YOUNG
    place = found[STRESS, 2]
    assert place == pytest.approx(0.05, abs=0.01)
    # sigma = E k t/2, E I k = rho A g s^2 / 2 at a distance s from the free end
    assert found[STRESS, 0] == pytest.approx(3.0 * YOUNG * unit * (LENGTH - place) ** 2 / THICKNESS, rel=0.06)
    overhang, faces = LENGTH - 0.05, watch_of(model.case, model).rows
    (displacement,), (gradient,) = faces.poses(seat_of(model).state.u[VALUE][None])
    end, edge = np.argmax(faces.places[:, 0]), np.argmin(np.abs(faces.places[:, 0] - 0.05))
    turn = [abs(gradient[k, 1, 0] - gradient[k, 0, 1]) / 2.0 for k in (end, edge)]
    assert turn[0] - turn[1] == pytest.approx(2.0 * unit * overhang**3 / THICKNESS**2, rel=0.06)
    assert found[ROTATION, 0] == pytest.approx(max(turn), rel=1e-6)
    assert len(displacement) == len(faces.places)


def test_rigid_model_turns_without_strain() -> None:
    """A rigid body turns and travels, and strains nothing."""
    model = beam_model({"model": {"type": "rigid"}, "mesh": COARSE})
    u = np.linalg.lstsq(model.expand(np.identity(model.dofs)), field_of(model, bent=False), rcond=None)[0]
    found = watched(model, u).closest
    assert found[ROTATION, 0] == pytest.approx(CURVATURE, rel=1e-6)
    assert found[STRAIN, 0] < 1e-10


def test_when_a_record_is_looked_at() -> None:
    """Looks are due over the span of the run, and where the strain energy is a tenth above all before."""
    model = beam_model({"mesh": COARSE, "model": MODELS["beam"]})
    times, u = np.linspace(0.0, 1.0e-2, 5001), np.zeros((5001, model.dofs))
    energy = np.zeros(5001)
    u[777, 1::2], energy[777] = 0.2, 1.0
    whole, parts = watch_of(model.case, model), watch_of(model.case, model)
    whole.see(times, u, energy)
    for first in range(0, 5001, 613):
        parts.see(times[first : first + 613], u[first : first + 613], energy[first : first + 613])
    assert LOOKS <= whole.looks <= LOOKS + 3
    assert whole.closest[ROTATION, 1] == times[777]
    assert np.array_equal(whole.closest, parts.closest)
    assert whole.looks == parts.looks
