"""Fluid around parts of a beam: wet frequencies by transfer matrices, decay, buoyancy and shaken frames by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.linalg import eigvals, expm
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.seat.contact_modes import held_modes
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array

LENGTH, THICKNESS, WIDTH = 0.6, 0.012, 0.02
YOUNG, POISSON, DENSITY, GRAVITY = 2.1e11, 0.3, 7919.0, 9.81
AREA, SECOND = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
BENDING = YOUNG * SECOND
SHEAR = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON) * YOUNG / (2.0 * (1.0 + POISSON)) * AREA  # Cowper (1966)
LINE = DENSITY * AREA  # kg/m
FINE: dict[str, Any] = {"type": "beam", "elements": 200}


def fluid(start: float = 0.0, end: float = LENGTH, **figures: float) -> dict[str, Any]:
    """Return a fluid."""
    return {"name": "water", "from": start, "to": end, **figures}


def tables(*fluids: dict[str, Any], model: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Return a steel cantilever in a slot that it does not touch."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.30, "to": 0.32, "clearance": 9.0e-3}],
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "fluid": list(fluids),
        "mesh": {"size": 0.012, "cells_through_thickness": 2},
        "model": model or FINE,
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 0.1, "step": 1.0e-4},
        **more,
    }


def model_with(*fluids: dict[str, Any], **more: Any) -> Model:
    """Return the model of a cantilever in fluid."""
    return build_model(gapbeam.read_case(tables(*fluids, **more)), MPI.COMM_SELF)


def frequencies(model: Model) -> Array:
    """Return the frequencies of a small model, ascending, Hz."""
    assert isinstance(model.system.operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(model.system.operators.modes[0], 0.0)) / (2.0 * np.pi))


def of_theory(parts: list[tuple[float, float]], most: float = 400.0) -> Array:
    """Return the frequencies of a Timoshenko cantilever whose parts carry added mass, by transfer matrices, Hz.

        w' = theta + Q / (kappa G A),  theta' = M / (E I),  M' = -Q - rho I s theta,  Q' = -(rho A + m_a) s w

    Args:
        parts: Length, m, and added mass, kg/m, of each part from the clamped end.
        most: Frequency at which the search stops, Hz.
    """

    def missed(frequency: float) -> float:
        s = (2.0 * np.pi * frequency) ** 2
        state = np.identity(4)[:, 2:]
        for length, added in parts:
            field = np.array(
                [
                    [0.0, 1.0, 0.0, 1.0 / SHEAR],
                    [0.0, 0.0, 1.0 / BENDING, 0.0],
                    [0.0, -DENSITY * SECOND * s, 0.0, -1.0],
                    [-(LINE + added) * s, 0.0, 0.0, 0.0],
                ]
            )
            state = expm(field * length) @ state
        return float(np.linalg.det(state[2:]))

    places = np.linspace(2.0, most, 800)
    values = [missed(place) for place in places]
    return np.array([
        brentq(missed, one, other, xtol=1e-10, rtol=1e-13)
        for one, other, before, after in zip(places, places[1:], values, values[1:], strict=False)
        if before * after < 0.0
    ])  # fmt: skip


@pytest.mark.parametrize(
    ("fluids", "parts"),
    [
        ([fluid(added_mass=LINE)], [(LENGTH, LINE)]),
        ([fluid(0.25, LENGTH, added_mass=3.0)], [(0.25, 0.0), (LENGTH - 0.25, 3.0)]),
        (
            [fluid(0.0, 0.2, added_mass=5.0), fluid(0.4, 0.55, added_mass=1.0) | {"name": "oil"}],
            [(0.2, 5.0), (0.2, 0.0), (0.15, 1.0), (0.05, 0.0)],
        ),
    ],
    ids=["all along", "from a level", "two baths"],
)
def test_wet_frequencies(fluids: list[dict[str, Any]], parts: list[tuple[float, float]]) -> None:
    """Frequencies of a cantilever by beam elements; those of a reduced mesh within its own error when dry."""
    theory = of_theory(parts)
    assert len(theory) >= 2
    errors = np.abs(frequencies(model_with(*fluids))[: len(theory)] / theory - 1.0)
    assert np.all(errors < [1e-6, 5e-6, 3e-5][: len(theory)]), errors
    dry = frequencies(model_with(model={"type": "reduced"}))[0] / of_theory([(LENGTH, 0.0)])[0]
    wet = frequencies(model_with(*fluids, model={"type": "reduced"}))[: len(theory)] / theory
    np.testing.assert_allclose(wet, dry, rtol=2e-4)


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("dimension", [2, 3])
def test_full_model_in_fluid(dimension: int) -> None:
    """The full model has the modes of its reduction: springs, added masses and mesh are the same."""
    water = fluid(0.25, LENGTH, added_mass=3.0)
    mesh = {"dimension": dimension, "size": 0.05, "cells_through_thickness": 1}
    full = model_with(water, model={"type": "full"}, mesh=mesh)
    bending = held_modes(full, 2)[0].bending()[0][:2]
    reduced = frequencies(model_with(water, model={"type": "reduced"}, mesh=mesh))
    for one in bending:
        assert np.min(np.abs(reduced / one - 1.0)) < 2e-5


def test_decay_is_that_of_the_damping_over_the_moving_mass() -> None:
    """Uniform fluid: every mode of a slender beam decays at c / (2 (m + m_a))."""
    model = model_with(fluid(added_mass=2.0, damping=7.0))
    system = model.system
    assert isinstance(system.operators, DenseOperators)
    assert system.dashpots is not None
    mass, stiffness = system.operators.mass, system.operators.stiffness
    rows = system.dashpots.patterns
    damping = rows.T @ (system.dashpots.coefficients[:, None] * rows)
    size = len(mass)
    matrix = np.block([
        [np.zeros((size, size)), np.eye(size)],
        [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
    ])  # fmt: skip
    found = eigvals(matrix)
    lowest = found[np.argsort(np.abs(found))][:4:2]
    np.testing.assert_allclose(-lowest.real, 7.0 / (2.0 * (LINE + 2.0)), rtol=2e-3)


@pytest.mark.parametrize("kind", ["beam", "reduced", "full"])
def test_buoyancy_takes_its_share_of_the_weight(kind: str) -> None:
    """A cantilever in a fluid of a third of its mass sags by two thirds; added mass has no weight."""
    model = FINE if kind == "beam" else {"type": kind}
    gravity = [{"type": "gravity", "acceleration": GRAVITY}]
    dry = tip_at_rest(model, gravity)
    wet = tip_at_rest(model, gravity, fluid(displaced_mass=LINE / 3.0, added_mass=4.0))
    assert wet == pytest.approx(2.0 / 3.0 * dry, rel=1e-6)
    if kind == "beam":
        bent = -LINE * GRAVITY * LENGTH**4 / (8.0 * BENDING) - LINE * GRAVITY * LENGTH**2 / (2.0 * SHEAR)
        assert dry == pytest.approx(bent, rel=1e-6)


def tip_at_rest(model: dict[str, Any], load: list[dict[str, Any]], *fluids: dict[str, Any]) -> float:
    """Return the displacement of the tip at the seat, m."""
    simulation = gapbeam.model(gapbeam.read_case(tables(*fluids, model=model, load=load)))
    state = simulation.seat().state
    return float(simulation.model.probes["tip"].evaluate(state.u[0], simulation.model.system.operators)[-1])


@pytest.mark.parametrize("displaced", [0.0, 0.4, 1.0])
def test_a_shaken_tank_drives_by_mass_minus_displaced_mass(displaced: float) -> None:
    """A body as dense as the fluid stays at rest in its tank, whatever the added mass; a lighter one lags behind."""
    shaker = {"type": "base_motion", "name": "shaker", "amplitude": 5.0, "frequency": 10.0}
    pushed = []
    for share in (displaced, 0.0):
        system = model_with(fluid(displaced_mass=share * LINE, added_mass=LINE), load=[shaker]).system
        assert isinstance(system.operators, DenseOperators)
        pushed.append(np.linalg.solve(system.operators.stiffness, system.loads[0].pattern)[:3])
    np.testing.assert_allclose(pushed[0], (1.0 - displaced) * pushed[1], atol=1e-6 * np.max(np.abs(pushed[1])))
