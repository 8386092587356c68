"""`gapbeam check`: what a run will be, and what it will cost."""

from __future__ import annotations

import time
from math import pi, sqrt

import numpy as np
from mpi4py import MPI
from rich.console import Group
from rich.table import Table
from rich.text import Text

from gapbeam.large_prediction import LARGEST, predict_large
from gapbeam.prediction import Prediction, predict
from solver.analyses.resolution import RESOLVING_SHARE
from solver.body import MeshedBeam, mesh_beam, mesh_dofs
from solver.case import Case, Ramped
from solver.case_file.warnings import warnings
from solver.case_tables.analysis import Periodic
from solver.case_tables.recorded import Recorded
from solver.defaults import Default, overhang_frequency, stiffness_unit
from solver.energy_creators import accepted_energy_creators, refuse_energy_creators
from solver.loads.recorded import MOST_POWER, RecordedSignal, signal_of
from solver.memory_limit import lack_of_memory, refuse_too_large_before_meshing
from solver.model import Model, build_model
from solver.verdict import remarks_on_model

SOFT_ENOUGH = 1.0 / 3.0
GIGABYTE = 1.0e9


def describe(case: Case, comm: MPI.Comm) -> Group:
    """Mesh, assemble and seat a case, march some steps and describe its run; of a large one, on coarser meshes.

    Raises:
        UserError: The run would be refused: scheme and contact are known to create energy, a point lies outside, or
            there is no memory for what is tried out.
        CaseError: The computed time step does not go with the rest of the case.
        MeshError: A user's mesh does not fit the case.
        NotConverged: The beam finds no seat.

    Collective.
    """
    refuse_too_large_before_meshing(case, comm, mesh_alone=True)
    meshed = mesh_beam(case, comm)
    if mesh_dofs(meshed) > LARGEST:
        return Group(
            _table("Model", _mesh_rows(case, meshed)),
            _table("Run", _cost_rows(predict_large(case, mesh_dofs(meshed), comm))),
            *(Text(f"warning: {text}") for text in [*warnings(case), *_memory_warnings(case, meshed, comm)]),
        )
    started = time.perf_counter()
    model = build_model(case, comm)
    # the first meshing is what a run pays for, also gmsh's start
    spent = time.perf_counter() - started + meshed.seconds - model.seconds["mesh"]
    refuse_energy_creators(model)
    prediction = predict(model, spent, comm)
    case, step = model.case, model.step
    return Group(
        _table("Model", _model_rows(model)),
        _table("Computed defaults", [row for default in model.defaults for row in _default_rows(default)]),
        _table("Dynamics", _dynamics_rows(model)),
        _table(
            "Run",
            [
                ("scheme", case.time.scheme.type, ""),
                *_analysis_rows(case),
                *_adaptive_rows(model),
                ("steps", f"{prediction.steps}", f"of {step:.6g} s up to {case.time.end:g} s"),
                *_cost_rows(prediction),
            ],
        ),
        *(Text(f"warning: {text}") for text in _warnings(model)),
    )


def _cost_rows(cost: Prediction) -> list[tuple[str, str, str]]:
    certainty = "a scaled estimate" if cost.scaled else "predicted within a factor of 2"
    rows = [("set-up", _duration(sum(cost.setup.values())), ", ".join(_part(*part) for part in cost.setup.items()))]
    if cost.back_substitution > 0.0:
        rows.append(("back-substitution", f"{1e3 * cost.back_substitution:.3g} ms", "of one step"))
    return [
        *rows,
        ("step", f"{1e3 * cost.per_step:.3g} ms", "with its records; " + cost.basis),
        ("field", f"{1e3 * cost.per_field:.3g} ms", f"{cost.fields} of them"),
        ("march", _duration(cost.march), "predicted from these"),
        ("wall time", _duration(cost.total), f"{certainty}; without pictures"),
        ("memory", f"{cost.memory / GIGABYTE:.2f} GB", "peak of all ranks together"),
    ]


def _part(name: str, seconds: float) -> str:
    return f"{name} {_duration(seconds)}"


def _default_rows(default: Default) -> list[tuple[str, str, str]]:
    rows = [(default.key, f"{default.value:.4g} {default.unit}", default.reason)]
    return rows + ([("", "", default.consequence)] if default.consequence else [])


def _mesh_rows(case: Case, meshed: MeshedBeam) -> list[tuple[str, str, str]]:
    topology = meshed.space.mesh.topology
    cells = topology.index_map(topology.dim).size_global
    return [
        ("mesh", f"{cells} cells", f"{topology.cell_name()}, degree {case.mesh.degree}"),
        ("degrees of freedom", f"{mesh_dofs(meshed)}", ""),
    ]


def _model_rows(model: Model) -> list[tuple[str, str, str]]:
    contact = model.system.contact
    areas = np.bincount(contact.faces, weights=contact.weights)
    faces = ", ".join(f"{name} {1e6 * area:.5g} mm^2" for name, area in zip(contact.face_names, areas, strict=True))
    return [
        *_mesh_rows(model.case, model.body.meshed),
        *(
            []
            if model.dofs == model.mesh_dofs
            else [("marched", f"{model.dofs} DOFs", f"model {model.case.model.type}")]
        ),
        ("contact points", f"{contact.size}", f"on {contact.interface.size} interface DOFs; {faces}"),
    ]


def _dynamics_rows(model: Model) -> list[tuple[str, str, str]]:
    case, duration = model.case, model.contact_duration
    rows = [
        (
            "overhang, clamped",
            f"{overhang_frequency(case):.4g} Hz",
            "first bending frequency, Euler-Bernoulli",
        ),
        ("axial restraint", f"{restraint_frequency(case, case.restraint.axial):.3g} Hz", "rigid beam on it"),
    ]
    if case.mesh.dimension == 3:
        frequency = restraint_frequency(case, case.restraint.lateral)
        rows.append(("lateral restraint", f"{frequency:.3g} Hz", "rigid beam on it"))
    rows.append(
        (
            "contact duration",
            f"{1e6 * duration:.3g} us",
            f"at least: half a period of the supported part on {model.law_stiffness:.3g} {stiffness_unit(case)}; "
            f"{duration / model.step:.2g} steps. After a run, contact_episodes in summary.json "
            "tells how much of the impulse passes in contacts of fewer than 10 steps",
        )
    )
    for load in case.load:
        if isinstance(load, Ramped):
            steps = 1.0 / (load.frequency * model.step)
            rows.append((load.name, f"{load.frequency:g} Hz", f"{steps:.4g} steps per period"))
        elif isinstance(load, Recorded):
            rows.append((load.name, *record_words(signal_of(load), model.step)))
    return rows


def record_words(signal: RecordedSignal, step: float) -> tuple[str, str]:
    """Return how fast a record is, and what it holds."""
    curve, frequency = signal.curve, signal.content.below(MOST_POWER)
    words = (
        f"below which {MOST_POWER:.0%} of its power lie, {1.0 / (frequency * step):.4g} steps per period; "
        if frequency > 0.0
        else ""
    )
    words += f"{len(curve.knots)} rows over {curve.span:.6g} s, every {curve.interval:.4g} s; peak {signal.peak:.4g}"
    return f"{frequency:.4g} Hz", words


def restraint_frequency(case: Case, stiffness: float) -> float:
    """Return the frequency of the rigid beam on a restraint, Hz."""
    beam = case.beam
    return sqrt(stiffness / (case.material.density * beam.length * beam.width * beam.thickness)) / (2.0 * pi)


def _analysis_rows(case: Case) -> list[tuple[str, str, str]]:
    if not isinstance(case.analysis, Periodic):
        return []
    return [("analysis", "periodic", "predicted is a march to time.end; the search from there is not")]


def _adaptive_rows(model: Model) -> list[tuple[str, str, str]]:
    if not model.case.time.adaptive:
        return []
    shortest = model.step / 2**model.case.time.max_halvings
    wanted = RESOLVING_SHARE * model.contact_duration
    words = f"an impact asks for {wanted:.2g} s" + (", which is out of reach" if shortest > wanted else "")
    return [
        ("adaptive steps", f"down to {shortest:.2g} s", f"time.max_halvings = {model.case.time.max_halvings}; {words}")
    ]


def _warnings(model: Model) -> list[str]:
    accepted = accepted_energy_creators(model)
    return [
        *warnings(model.case),
        *accepted,
        *remarks_on_model(model),
        *_restraint_warnings(model),
    ]


def _memory_warnings(case: Case, meshed: MeshedBeam, comm: MPI.Comm) -> list[str]:
    fault = lack_of_memory(case, mesh_dofs(meshed), comm)
    return [] if fault is None else [f"{fault}: gapbeam run refuses it but for gates.accept_lack_of_memory = true"]


def _restraint_warnings(model: Model) -> list[str]:
    case = model.case
    wanted = [load.frequency for load in case.load if isinstance(load, Ramped)]
    lowest = min([overhang_frequency(case), *wanted])
    names = ("axial", "lateral")[: case.mesh.dimension - 1]
    return [
        f"restraint.{name} gives {frequency:.3g} Hz, not soft against the lowest frequency of interest, "
        f"{lowest:.3g} Hz; make it at least {(frequency / (SOFT_ENOUGH * lowest)) ** 2:.2g} times softer"
        for name in names
        if (frequency := restraint_frequency(case, getattr(case.restraint, name))) > SOFT_ENOUGH * lowest
    ]


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _table(title: str, rows: list[tuple[str, str, str]]) -> Table:
    table = Table(title=title, title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table
