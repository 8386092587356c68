"""Mesh that a result needs: beams and meshes from some hundred DOFs up against a solid mesh of 190 000.

The beam of cases/li2013.toml with a contact soft enough for a periodic response, in bases that keep many more shapes
than by default, so that what differs is the mesh. Every row is marched to its steady state from the seat; figures are
those of `gapbeam compare`, and the axial stress on the underside just outside the edge of the base, a quarter of a
period into the forcing.

    environment/run python3 -m benchmarks.fidelity
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI

from benchmarks.table import Cell, Table, machine_words, options
from benchmarks.textbook import stress
from gapbeam.meshes.versions.mesh_geometry import coordinate_dofs, coordinate_element
from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE, SMOOTHED_ACCELERATION
from gapbeam.postprocess.signals.steady_figures import Steady, steady
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.body import Body
from gapbeam.solver.models.model import Model, build_body, model_of
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE
from gapbeam.studies.trials.response import respond

CASES = Path(__file__).parents[1] / "cases"
SOLID, PLANE = CASES / "li2013.toml", CASES / "li2013-2d.toml"
PERIODIC = ("contact.stiffness=1e12", "contact.damping=5e7", "damping.ratios=[0.05, 0.05]")
FORCES = {"fidelity_light": "load.shaker.amplitude=20.0", "fidelity_heavy": "load.shaker.amplitude=80.0"}
RICH = ("model.type=reduced", "model.modes=40", "model.shapes=25", "model.points_across=2")
PERIODS = 48
OUTSIDE = 1.0e-3  # m, from the edge of the base to where the stress is taken


Level = tuple[Path, tuple[str, ...]]


def _solid(size: float, support: float, cells: int, degree: int = 2) -> Level:
    across = (f"mesh.cells_through_thickness={cells}", f"mesh.cells_across_width={cells}", f"mesh.degree={degree}")
    return SOLID, (*RICH, f"mesh.size={size}", f"mesh.support_size={support}", *across)


def _plane(size: float, support: float, cells: int, *others: str) -> Level:
    sizes = (f"mesh.size={size}", f"mesh.support_size={support}", f"mesh.cells_through_thickness={cells}")
    return PLANE, (*(others or RICH), *sizes)


LEVELS: dict[str, Level] = {
    "solid, reference": _solid(0.00575, 2.3e-3, 8),
    "solid": _solid(0.0115, 4.2e-3, 4),
    "solid, coarse": _solid(0.02, 8.0e-3, 2),
    "solid, coarsest": _solid(0.06, 12.5e-3, 1),
    "solid, linear": _solid(0.0115, 4.2e-3, 4, 1),
    "plane stress, fine": _plane(0.00575, 2.3e-3, 8),
    "plane stress": _plane(0.0115, 4.2e-3, 4),
    "plane stress, coarse": _plane(0.03, 8.0e-3, 2),
    "beam elements": _plane(0.0115, 4.2e-3, 4, "model.type=beam"),
}
REFERENCE = next(iter(LEVELS))


@dataclass(frozen=True)
class Answer:
    """Results of a fidelity level: steady response, stress, largest contact pressure, and costs."""

    dofs: int
    mesh_dofs: int
    found: Steady
    stress: float
    pressure: float
    set_up: float
    per_step: float


def answer(case: Case, body: Body, set_up: float, periods: int) -> Answer:
    """Return the steady response of a case a quarter of a period after the last whole one."""
    model = model_of(case, body)
    seat = Simulation(model).seat()
    frequency = 20.0
    steps = round(periods / (frequency * model.step))
    response = respond(model, seat.state, steps, case.output.history_interval)
    if response.verdict != "passed" or response.end is None:
        raise SystemExit(f"{case.title}: {response.verdict}: {response.message}")
    quarter = respond(model, response.end, round(0.25 / (frequency * model.step)))
    assert quarter.end is not None
    return Answer(
        model.dofs,
        model.mesh_dofs,
        steady(as_history(response.history, response.labels), frequency),
        surface_stress(case, model, model.expand(quarter.end.u[VALUE])),
        float(quarter.end.pressure.max()),
        set_up,
        response.seconds / response.steps,
    )


def surface_stress(case: Case, model: Model, u: Array) -> float:
    """Return the axial stress on the underside just outside the edge of the base, on the axis, Pa."""
    mesh, dimension = model.space.mesh, model.dimension
    place = np.zeros(3)
    place[0], place[dimension - 1] = case.layout.end + OUTSIDE, -0.5 * case.beam.thickness
    if case.model.type == "beam":  # the fields of a beam have no strain across: its stress is E z w''
        return case.material.young_modulus * _slope(model, u, place)
    tree = geometry.bb_tree(mesh, dimension)
    near = geometry.compute_collisions_points(tree, place.reshape(1, 3))
    cell = int(geometry.compute_colliding_cells(mesh, near, place.reshape(1, 3)).links(0)[0])
    corners = mesh.geometry.x[coordinate_dofs(mesh)[cell]][:, :dimension]
    reference = coordinate_element(mesh).pull_back(place[:dimension].reshape(1, -1), corners)
    field = fem.Function(model.space)
    field.x.array[: len(u)] = u
    plane = dimension == 2 and case.mesh.plane == "stress"
    axial = fem.Expression(stress(field, case.material, plane)[0, 0], reference)
    return float(np.ravel(axial.eval(mesh, np.array([cell], dtype=np.int32)))[0])


def _slope(model: Model, u: Array, place: Array) -> float:
    """Return du_x/dx on the underside from the motions of the nodes there."""
    nodes = model.space.tabulate_dof_coordinates()[:, :2]
    low = np.flatnonzero(np.isclose(nodes[:, 1], place[1]))
    low = low[np.argsort(nodes[low, 0])]
    slope = np.gradient(u.reshape(-1, 2)[low, 0], nodes[low, 0])
    return float(np.interp(place[0], nodes[low, 0], slope))


def errors(one: Answer, reference: Answer) -> dict[str, float]:
    """Return the differences from the reference, relative to it; of harmonics relative to the largest one."""
    wanted, given = reference.found.quantities, one.found.quantities
    found = {
        name: given[name].mean / wanted[name].mean - 1.0
        for name in (f"test {SMOOTHED_ACCELERATION}", f"base {LARGEST_FORCE}", "base impulse")
    }
    first = np.abs(reference.found.harmonics["test"].mean(axis=0))
    second = np.abs(one.found.harmonics["test"].mean(axis=0))
    found["harmonics"] = float(np.max(np.abs(second - first)) / first.max())
    found["edge stress"] = one.stress / reference.stress - 1.0
    found["pressure"] = one.pressure / reference.pressure - 1.0
    return found


def answers_of(levels: dict[str, Level], forces: dict[str, str], periods: int) -> dict[str, dict[str, Answer]]:
    """Return the answers by forcing and fidelity level; a fidelity level is set up once."""
    found: dict[str, dict[str, Answer]] = {name: {} for name in forces}
    for level, (path, overrides) in levels.items():
        clock = time.perf_counter()
        body = build_body(read_case(path, [*PERIODIC, *overrides]), MPI.COMM_SELF)
        set_up = time.perf_counter() - clock
        for name, force in forces.items():
            case = read_case(path, [*PERIODIC, force, *overrides])
            found[name][level] = answer(case, body, set_up, periods)
            print(f"{level}, {force}: {found[name][level].found.word}", flush=True)
    return found


def table(name: str, force: str, answers: dict[str, Answer]) -> Table:
    """Return the table of one forcing."""
    reference = answers[REFERENCE]
    rows: list[tuple[Cell, ...]] = []
    for level, one in answers.items():
        missed: dict[str, Any] = errors(one, reference)
        words = [f"{100.0 * value:+.2g} %" if level != REFERENCE else "0" for value in missed.values()]
        rows.append((level, one.mesh_dofs, one.dofs, one.found.word, *words, one.set_up, 1e6 * one.per_step))
    amplitude = force.partition("=")[2]
    figures = {what: quantity.mean for what, quantity in reference.found.quantities.items()}
    reported_figures = ", ".join(f"{what} {value:.4g}" for what, value in figures.items())
    return Table(
        name,
        f"Fidelity: {amplitude} N at 20 Hz, clearance 0.107 mm, errors against {REFERENCE}",
        (
            "mesh",
            "DOFs of the mesh",
            "DOFs marched",
            "response",
            "peak to peak, 2.5 ms mean",
            "peak force at the base",
            "impulse per period",
            "harmonics 1 to 5",
            "axial stress 1 mm outside the edge",
            "largest contact pressure",
            "set-up (s)",
            "step (us)",
        ),
        tuple(rows),
        (
            f"reference: stress {reference.stress:.4g} Pa, pressure {reference.pressure:.4g} Pa, {reported_figures}",
            machine_words(),
        ),
        {**figures, "stress": reference.stress},
    )


def main() -> None:
    """Measure both forcings and write the tables."""
    chosen = options(__doc__)
    found = answers_of(LEVELS, FORCES, PERIODS)
    for name, force in FORCES.items():
        table(name, force, found[name]).write(chosen.output)


if __name__ == "__main__":
    main()
